"""What a figure that cannot be drawn says."""

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
