"""Checkpoints: a march over cycles can be put down after any accepted state, and taken up bit for bit.

What is kept is all that the next step depends on: the accepted states and curves, the memory of the stepper,
and that of the rate (its last orbits). A life that was taken up again makes the same steps, counts the same
work and ends with the same numbers.
"""

import hashlib
import io
import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any, NamedTuple

MAKES_ARRAYS = ("_reconstruct", "ndarray", "dtype", "scalar", "_frombuffer")
"""Names in numpy by which pickled arrays are made."""


class _Writer(pickle.Pickler):
    """Writes which of the shared objects stands where, not the objects."""

    def __init__(self, file: io.BytesIO, shared: tuple[Any, ...]) -> None:
        super().__init__(file)
        self.shared = shared

    def persistent_id(self, obj: Any) -> int | None:
        """Return the number of a shared object."""
        return next((i for i, shared in enumerate(self.shared) if shared is obj), None)


class _Reader(pickle.Unpickler):
    """Puts this process's own objects back; makes nothing but plain values, arrays and our types."""

    def __init__(self, image: bytes, shared: tuple[Any, ...] = ()) -> None:
        super().__init__(io.BytesIO(image))
        self.shared = shared

    def persistent_load(self, pid: Any) -> Any:
        """Return a shared object by its number."""
        return self.shared[pid]

    def find_class(self, module: str, name: str) -> Any:
        """Return a type of ours or what makes arrays; anything else in a checkpoint was not written by us."""
        room = module.split(".")[0]
        named = super().find_class(module, name) if room in ("wearlab", "numpy") else None
        ours = room == "wearlab" and isinstance(named, type)
        if not ours and (room != "numpy" or name not in MAKES_ARRAYS):
            raise pickle.UnpicklingError(f"{module}.{name} does not belong in a checkpoint")
        return named


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
"""Called with every accepted state and what makes its checkpoint, which costs nothing until it is called."""


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
    shared : objects that this process has of its own and that are told apart by identity
    """

    keeper: Keeper
    key: str
    shared: tuple[Any, ...] = ()

    @property
    def kept(self) -> Any:
        """What an earlier process kept of this march, None: nothing."""
        image = self.keeper.kept.get(self.key)
        return None if image is None else _Reader(image, self.shared).load()

    def keep(self, told: Told, state: Callable[[], Any]) -> None:
        """Tell an accepted state, which can be kept."""

        def image() -> bytes:
            self.settle(state)
            return self.keeper.image()

        self.keeper.tell(told, image)

    def settle(self, state: Callable[[], Any]) -> None:
        """Keep a state of the march, its end too: a later march's checkpoint holds it."""
        written = io.BytesIO()
        _Writer(written, self.shared).dump(state())
        self.keeper.kept[self.key] = written.getvalue()


_KEEPER: ContextVar[Keeper | None] = ContextVar("keeper", default=None)


@contextmanager
def kept_by(tell: Tell, image: bytes | None = None) -> Iterator[None]:
    """Let every march in this context be told of, and go on from what ``image`` holds.

    Parameters
    ----------
    tell : called with every accepted state
    image : what a checkpoint of the same run held, None: a run from its beginning
    """
    token = _KEEPER.set(Keeper(tell, {} if image is None else _Reader(image).load()))
    try:
        yield
    finally:
        _KEEPER.reset(token)


def place(begins: tuple[Any, ...], shared: tuple[Any, ...]) -> Place | None:
    """Return the place of the march that begins so, None where nobody keeps."""
    keeper = _KEEPER.get()
    return None if keeper is None else Place(keeper, hashlib.sha256(pickle.dumps(begins)).hexdigest(), shared)
