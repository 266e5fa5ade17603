"""How Hairline says that an input cannot be used: which item, what is wrong, what to do."""

from schemas.contract import Contract


class BadInput(Exception):
    """An input that cannot be used. Shown to the user as one message, never as a traceback.

    item:   the file, key, scan, photo, surface or vehicle concerned, as the user knows it.
    what:   what is wrong with it, in plain words.
    remedy: what the user can do about it.
    """

    def __init__(self, item: str, what: str, remedy: str) -> None:
        super().__init__(item, what, remedy)  # all three, so that the exception survives pickling
        self.item, self.what, self.remedy = item, what, remedy

    def __str__(self) -> str:
        return f"{self.item}: {self.what}. {self.remedy}"


class LeftOut(Contract):
    """One bad item among good ones: named, left out, listed in the report as not inspected."""

    item: str
    stage: str
    what: str
    remedy: str = ""

    @classmethod
    def because(cls, stage: str, problem: BadInput) -> "LeftOut":
        return cls(item=problem.item, stage=stage, what=problem.what, remedy=problem.remedy)
