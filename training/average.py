"""The mean of weights that one training passed through: `python -m training.average OUT.pt WEIGHTS.pt...`.

It does better on photos of others than any of them (Izmailov et al. 2018)."""

import sys
from pathlib import Path

import torch


def main(out: Path, parts: list[Path]) -> None:
    states = [torch.load(part, weights_only=True) for part in parts]
    mean = {}
    for name, first in states[0].items():
        total = torch.stack([state[name].double() for state in states]).mean(dim=0)
        mean[name] = total.to(first.dtype)
    torch.save(mean, out)


if __name__ == "__main__":
    main(Path(sys.argv[1]), [Path(part) for part in sys.argv[2:]])
