"""ONNX files of one layer, written by hand: a guest network that darkness alone convinces."""

import struct


def _varint(value: int) -> bytes:
    out = b""
    while value > 127:
        out, value = out + bytes([value & 127 | 128]), value >> 7
    return out + bytes([value])


def _field(number: int, value: bytes | str | int) -> bytes:
    if isinstance(value, int):
        return _varint(number << 3) + _varint(value)
    content = value.encode() if isinstance(value, str) else value
    return _varint(number << 3 | 2) + _varint(len(content)) + content


def _tensor(name: str, shape: tuple[int, ...], values: list[float]) -> bytes:
    sides = b"".join(_field(1, n) for n in shape)
    raw = struct.pack(f"<{len(values)}f", *values)
    return sides + _field(2, 1) + _field(8, name) + _field(9, raw)


def _value(name: str, shape: tuple[int | str, ...]) -> bytes:
    sides = b"".join(_field(1, _field(1, n) if isinstance(n, int) else _field(2, n)) for n in shape)
    return _field(1, name) + _field(2, _field(1, _field(1, 1) + _field(2, sides)))


def darkness(channels_out: int = 1, weight: float = -20.0, bias: float = 12.0) -> bytes:
    """logit = weight · (R + G + B) + bias: crack where the mean grey is below −bias / (3 · weight)."""
    node = _field(1, "rgb") + _field(1, "w") + _field(1, "b") + _field(2, "logit") + _field(4, "Conv")
    weights = _tensor("w", (channels_out, 3, 1, 1), [weight] * 3 * channels_out)
    graph = _field(1, node) + _field(2, "tiny") + _field(5, weights)
    graph += _field(5, _tensor("b", (channels_out,), [bias] * channels_out))
    graph += _field(11, _value("rgb", (1, 3, "height", "width")))
    graph += _field(12, _value("logit", (1, channels_out, "height", "width")))
    return _field(1, 7) + _field(8, _field(1, "") + _field(2, 13)) + _field(7, graph)
