from hypothesis import given
from hypothesis import strategies as st

from tasks.detection.windows import Window, windows

SIDE = st.integers(1, 3000)


@given(SIDE, SIDE, st.integers(0, 60), st.integers(1, 40))
def test_windows_cover_every_pixel_once_and_none_sees_too_much(
    height: int, width: int, halo_px: int, room: int
) -> None:
    image = Window(0, height, 0, width)
    most_px = room * (64 + 2 * halo_px) ** 2
    parts = list(windows(image, halo_px, most_px, 64))
    assert sum(part.area_px for part in parts) == image.area_px
    assert parts == sorted(set(parts)) and all(part.top % 64 == part.left % 64 == 0 for part in parts)
    assert all(image.grown(0, part) == part for part in parts)  # none lies outside
    assert all(part.grown(halo_px, image).area_px <= most_px for part in parts)


def test_windows_see_as_little_twice_as_can_be() -> None:
    """An image of twice what can be seen is cut across its longer side, once."""
    image = Window(0, 1000, 0, 1800)
    assert list(windows(image, 20, 1_000_000, 64)) == [
        Window(0, 1000, 0, 896),
        Window(0, 1000, 896, 1800),
    ]
    assert list(windows(image, 20, 1_800_000, 64)) == [image]


def test_windows_with_their_halos_are_as_large_as_each_other() -> None:
    """A photo of 12 MP: those at its ends, which have a halo on one side only, are longer for it."""
    image = Window(0, 3000, 0, 4000)
    parts = list(windows(image, 224, 6_000_000, 32))
    assert [part.grown(224, image).area_px for part in parts] == 3 * [3000 * 1632]


def test_without_a_halo_windows_are_as_few_as_can_be() -> None:
    """All cuts see each pixel once then."""
    assert len(list(windows(Window(0, 3000, 0, 4000), 0, 3 << 20, 64))) == 4
    assert list(windows(Window(0, 384, 0, 544), 0, 3 << 20, 64)) == [Window(0, 384, 0, 544)]
