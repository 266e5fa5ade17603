"""How well found cracks agree with masks drawn by people."""

from schemas.contract import Contract


class Scores(Contract):
    precision: float
    recall: float
    f1: float


class Evaluation(Contract):
    """One method on one set of images, at one tolerance."""

    method: str
    tolerance_px: int  # a pixel counts as right within this distance
    images: int
    aggregate: Scores  # over the pixels of all images
    mean: Scores  # over images, each counting the same
