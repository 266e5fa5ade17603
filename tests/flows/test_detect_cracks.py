"""Which photos go on to their cracks."""

from flows.detect_cracks import _inspectable
from flows.given_photos import PhotoSource
from schemas.photo import Photo
from schemas.problem import BadInput
from tests.flows.test_photo_commands import photo


def source(of: Photo, stitch: bool) -> PhotoSource:
    return PhotoSource(file=of.file, name=of.name, surface=of.surface, stitch=stitch)


def test_photos_that_stand_for_themselves_are_judged_before_the_others_are_stitched() -> None:
    good, dark = photo("good.jpg", "EXIF"), photo("dark.jpg", "EXIF").model_copy(update={"black": 0.9})
    twin = good.model_copy(update={"name": "twin.jpg"})
    found = _inspectable([(source(one, stitch=False), one) for one in (good, dark, twin)])
    assert [one.what if isinstance(one, BadInput) else one.name for one in found] == [
        "good.jpg",
        "underexposed (90% of it is black)",
        "the same picture as good.jpg",
    ]
    assert _inspectable([(source(one, stitch=True), one) for one in (good, dark, twin)]) == [good, dark, twin]
