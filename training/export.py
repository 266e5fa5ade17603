"""Write trained weights as ONNX: `python -m training.export WEIGHTS.pt MODEL.onnx [SLOPE OFFSET]`.

The logits are scaled and shifted as training.calibrate asks for, so that they are calibrated; those of each
2×2 pixels stay four channels, which tasks.detection.network unfolds faster than OpenCV would."""

import hashlib
import sys
import warnings
from pathlib import Path

import torch

from training.network import Network


def main(weights: Path, model: Path, slope: float = 1.0, offset: float = 0.0) -> None:
    net = Network()
    net.load_state_dict(torch.load(weights, weights_only=True))
    net.unfold = net.unfold[:1]
    with torch.no_grad():
        net.unfold[0].weight *= slope
        net.unfold[0].bias.mul_(slope).add_(offset)
    sides = {"rgb": {2: "height", 3: "width"}, "logit": {2: "half height", 3: "half width"}}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # PyTorch announces another exporter, which needs two more packages
        torch.onnx.export(
            net.eval(),
            (torch.zeros(1, 3, 64, 64),),
            str(model),
            input_names=["rgb"],
            output_names=["logit"],
            dynamic_axes=sides,
            opset_version=13,
            dynamo=False,
        )
    content = model.read_bytes()
    print(f"{model}: {len(content)} bytes, SHA-256 {hashlib.sha256(content).hexdigest()}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), *(float(t) for t in sys.argv[3:]))
