"""Checkpoints: a march over cycles can be put down after any accepted state, and taken up bit for bit.

What is kept is all that the next step depends on: the accepted states and curves, the memory of the stepper,
and that of the rate (its last orbits). A life that was taken up again makes the same steps, counts the same
work and ends with the same numbers.
"""

import hashlib
import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any, NamedTuple


class Told(NamedTuple):
    """How far a life is, for those who wait.

    Parameters
    ----------
    cycle : reached [1]
    depth : largest depth reached [m]
    """

    cycle: float
    depth: float


Tell = Callable[[Told, Callable[[], bytes]], None]
"""Called with every accepted state and what makes its checkpoint, which costs nothing unless it is called."""


@dataclass
class Keeper:
    """Where the marches of one run put down what they need, and find what an earlier process put down.

    Parameters
    ----------
    tell : called with every accepted state
    kept : what was kept of every march, by what it began with
    """

    tell: Tell
    kept: dict[str, bytes] = field(default_factory=dict)

    def image(self) -> bytes:
        """Return everything kept."""
        return pickle.dumps(self.kept)


@dataclass(frozen=True)
class Place:
    """The place of one march with a keeper.

    Parameters
    ----------
    keeper : of the run
    key : hash of what the march began with: a run has several, and may find some of them done elsewhere
    """

    keeper: Keeper
    key: str

    @property
    def kept(self) -> Any:
        """What an earlier process kept of this march, None: nothing."""
        found = self.keeper.kept.get(self.key)
        return None if found is None else pickle.loads(found)

    def keep(self, told: Told, state: Callable[[], Any]) -> None:
        """Tell an accepted state, which can be kept."""

        def image() -> bytes:
            self.settle(state)
            return self.keeper.image()

        self.keeper.tell(told, image)

    def settle(self, state: Callable[[], Any]) -> None:
        """Keep a state of the march for as long as the run goes on: its end, for a later march's checkpoint."""
        self.keeper.kept[self.key] = pickle.dumps(state())


_KEEPER: ContextVar[Keeper | None] = ContextVar("keeper", default=None)


@contextmanager
def kept_by(tell: Tell, image: bytes | None = None) -> Iterator[None]:
    """Let every march in this context be told of, and go on from what ``image`` holds.

    Parameters
    ----------
    tell : called with every accepted state
    image : what a checkpoint of the same run held, None: a run from its beginning
    """
    token = _KEEPER.set(Keeper(tell, {} if image is None else pickle.loads(image)))
    try:
        yield
    finally:
        _KEEPER.reset(token)


def place(*begins: Any) -> Place | None:
    """Return the place of the march that begins so, None where nobody keeps."""
    keeper = _KEEPER.get()
    return None if keeper is None else Place(keeper, hashlib.sha256(pickle.dumps(begins)).hexdigest())
