"""The network: a U-Net of depthwise convolutions. Nothing runs at full resolution: the first layer folds
each 2×2 pixels into 16 channels, the last unfolds them, so that edges keep their place at a quarter of the
cost."""

from torch import Tensor, nn
from torch.nn import functional

WIDTHS = (16, 32, 80, 112, 128)  # channels at 1/2, 1/4, 1/8, 1/16, 1/32
DEPTHS = (2, 2, 4, 4, 5)  # layers there


class Mixed(nn.Sequential):
    """1×1 convolution, batch norm."""

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__(nn.Conv2d(inputs, outputs, 1, bias=False), nn.BatchNorm2d(outputs))


class Separable(nn.Module):
    """Depthwise 3×3, then 1×1, added to its input where the shapes agree, ReLU: in this order OpenCV runs the
    last three as one, a twelfth of the whole network's time."""

    def __init__(self, inputs: int, outputs: int, stride: int = 1) -> None:
        super().__init__()
        self.across = nn.Conv2d(inputs, inputs, 3, stride, 1, groups=inputs, bias=False)
        self.mix = Mixed(inputs, outputs)
        self.same = inputs == outputs and stride == 1

    def forward(self, x: Tensor) -> Tensor:
        y: Tensor = self.mix(self.across(x))
        return functional.relu(x + y if self.same else y)


class Up(nn.Module):
    """The deeper level's features, mixed to this level's width, enlarged, added and smoothed."""

    def __init__(self, deep: int, width: int) -> None:
        super().__init__()
        self.mix = Mixed(deep, width)
        self.enlarge = nn.Upsample(scale_factor=2, mode="nearest")
        self.join = Separable(width, width)

    def forward(self, deep: Tensor, here: Tensor) -> Tensor:
        out: Tensor = self.join(here + self.enlarge(functional.relu(self.mix(deep))))
        return out


class Network(nn.Module):
    """(N, 3, H, W) RGB in 0..1 to (N, 1, H, W) logits; H and W multiples of 32."""

    def __init__(self) -> None:
        super().__init__()
        a = WIDTHS[0]
        self.fold = nn.Sequential(
            nn.Conv2d(3, a, 4, 2, 1, bias=False), nn.BatchNorm2d(a), nn.ReLU(inplace=True)
        )
        self.down = nn.ModuleList()
        for before, here, depth in zip((a, *WIDTHS[:-1]), WIDTHS, DEPTHS, strict=True):
            first = Separable(before, here, 1 if len(self.down) == 0 else 2)
            self.down.append(nn.Sequential(first, *(Separable(here, here) for _ in range(depth - 1))))
        self.up = nn.ModuleList(
            Up(deep, here) for deep, here in zip(WIDTHS[:0:-1], WIDTHS[-2::-1], strict=True)
        )
        self.last = Separable(a, a)
        shape = nn.Conv2d(a, 4, 1)
        nn.init.constant_(shape.bias, -3.0)  # type: ignore[arg-type]  # cracks are rare
        self.unfold = nn.Sequential(shape, nn.PixelShuffle(2))

    def forward(self, rgb: Tensor) -> Tensor:
        return self.of_folded(self.fold(2.0 * rgb - 1.0))

    def of_folded(self, y: Tensor) -> Tensor:
        """What comes after the first layer."""
        levels = []
        for down in self.down:
            y = down(y)
            levels.append(y)
        for up, here in zip(self.up, levels[-2::-1], strict=True):
            y = up(y, here)
        out: Tensor = self.unfold(self.last(y))
        return out
