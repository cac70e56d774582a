"""Something in a store that is not as it should be."""

from pathlib import Path
from typing import NamedTuple


class Problem(NamedTuple):
    """Something in a store that is not as it should be.

    Parameters
    ----------
    path : the file
    kind : missing | truncated | altered | foreign | unfinished | unknown | unreadable
    message : one sentence
    """

    path: Path
    kind: str
    message: str
