"""Write trained weights as ONNX: `python -m training.export WEIGHTS.pt MODEL.onnx [SLOPE OFFSET]`.

The logits are scaled and shifted as training.calibrate asks for, so that they are calibrated. The pixels
come folded and the logits of each 2×2 pixels stay four channels: tasks.detection.network folds and unfolds
them faster than OpenCV would, whose first layer took a fifth of the time for three channels out of eight."""

import hashlib
import sys
import warnings
from pathlib import Path

import torch
from torch import Tensor, nn

from training.network import Network


class Folded(nn.Module):
    """(1, 12, H / 2 + 1, W / 2 + 1), −1..1, to (1, 4, H / 2, W / 2) logits: a photo with a pixel of 0 around
    it, each 2×2 of its pixels as channels, in the order of PyTorch's PixelUnshuffle."""

    def __init__(self, net: Network) -> None:
        super().__init__()
        first = net.fold[0]
        assert isinstance(first, nn.Conv2d)
        outputs, colours, height, width = first.weight.shape
        folded = nn.Conv2d(4 * colours, outputs, (height // 2, width // 2), bias=False)
        weight = first.weight.detach().reshape(outputs, colours, height // 2, 2, width // 2, 2)
        folded.weight = nn.Parameter(weight.permute(0, 1, 3, 5, 2, 4).reshape(folded.weight.shape))
        self.fold = nn.Sequential(folded, *net.fold[1:])
        self.net = net

    def forward(self, pixels: Tensor) -> Tensor:
        return self.net.of_folded(self.fold(pixels))


def main(weights: Path, model: Path, slope: float = 1.0, offset: float = 0.0) -> None:
    net = Network()
    net.load_state_dict(torch.load(weights, weights_only=True))
    net.unfold = net.unfold[:1]
    with torch.no_grad():
        net.unfold[0].weight *= slope
        net.unfold[0].bias.mul_(slope).add_(offset)
    sides = {
        "pixels": {2: "half height + 1", 3: "half width + 1"},
        "logit": {2: "half height", 3: "half width"},
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # PyTorch announces another exporter, which needs two more packages
        torch.onnx.export(
            Folded(net).eval(),
            (torch.zeros(1, 12, 33, 33),),
            str(model),
            input_names=["pixels"],
            output_names=["logit"],
            dynamic_axes=sides,
            opset_version=13,
            dynamo=False,
        )
    content = model.read_bytes()
    print(f"{model}: {len(content)} bytes, SHA-256 {hashlib.sha256(content).hexdigest()}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), *(float(t) for t in sys.argv[3:]))
