"""Scan files damaged as transfers, disks and careless exports damage them."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from schemas.problem import BadInput
from tasks.registration.read_scan import scan_blocks, scan_count

LARGEST = 1_000_000  # bytes of a file worth damaging


def mutated_files(files: Sequence[Path], folder: Path, count: int) -> Iterator[Path]:
    """`count` damaged copies, each of another seed: cut short, bytes flipped, a stretch zeroed, doubled or
    taken out, lines swapped in, numbers of a header changed."""
    small = [path for path in files if path.stat().st_size <= LARGEST]
    for seed in range(1, count + 1):
        rng = np.random.default_rng([seed, 0x4D757461])
        source = small[int(rng.integers(len(small)))]
        data = bytearray(source.read_bytes())
        _damage(data, rng)
        path = folder / f"damaged-{seed:03}{source.suffix}"
        path.write_bytes(data)
        yield path


def outcome(path: Path) -> str:
    """`read`, `refused`, or what went wrong: a crash, or an empty cloud passed on as if it were one."""
    try:
        blocks = [block for k in range(scan_count(path)) for block in scan_blocks(path, k)]
    except BadInput as problem:
        return "refused" if problem.what and problem.remedy and problem.item == path.name else "unclear"
    except Exception as crash:
        return f"crash: {crash!r}"
    if not blocks or any(len(b.points_m) == 0 or not np.isfinite(b.points_m).all() for b in blocks):
        return "empty"
    return "read"


def _damage(data: bytearray, rng: np.random.Generator) -> None:
    size = len(data)
    start = int(rng.integers(size))
    stop = min(size, start + int(rng.integers(1, 200)))
    match int(rng.integers(7)):
        case 0:
            del data[start:]
        case 1:
            for at in rng.integers(0, size, 20):
                data[int(at)] ^= 1 << int(rng.integers(8))
        case 2:
            data[start:stop] = bytes(stop - start)
        case 3:
            data[start:start] = data[start:stop]
        case 4:
            del data[start:stop]
        case 5:
            for at in rng.integers(0, min(size, 400), 4):  # the header
                data[int(at)] = int(rng.integers(256))
        case _:
            digits = [k for k, byte in enumerate(data[:2000]) if chr(byte).isdigit()]
            for at in digits[:: max(1, len(digits) // 5)]:
                data[at] = ord(str(rng.integers(10)))
