"""What a photo that has just arrived is good for."""

from schemas.contract import Contract


class Arrival(Contract):
    """`faults` empty: the photo is good."""

    name: str
    faults: tuple[str, ...] = ()  # why it must be shot again, in words
    note: str = ""  # what else is worth a word
    point: str | None = None  # the plan's shooting point that it is the photo of
