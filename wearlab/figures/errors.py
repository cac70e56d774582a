"""What a figure that cannot be drawn says."""

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path


class FigureError(ValueError):
    """A figure that cannot be drawn: which, what was asked, what would be valid.

    Parameters
    ----------
    message : one line per figure
    drawn : the figures that were drawn all the same
    """

    def __init__(self, message: str, drawn: tuple[Path, ...] = ()) -> None:
        super().__init__(message)
        self.drawn = drawn


def choices(value: object, valid: Iterable[object]) -> str:
    """Return the end of a message: the nearest valid choice first, then all of them."""
    known = [str(choice) for choice in valid]
    near = get_close_matches(str(value), known, 1, 0.6)
    meant = f"did you mean {near[0]!r}? " if near else ""
    return f"{meant}valid: {', '.join(known) or 'none'}"
