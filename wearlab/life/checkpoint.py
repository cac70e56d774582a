"""Checkpoints: a life is saved after any accepted state and restored to the bit.

What is kept is all that the next step depends on: the accepted states and curves, the
memory of the stepper, and that of the rate (its last orbits). A life that was taken up
again makes the same steps, counts the same work and ends with the same numbers.

A checkpoint is one line of JSON and the bytes of its arrays. Reading it calls nothing
that it names: records of `wearlab.life`, `wearlab.mesh` and `wearlab.dynamics` are
filled field by field, and anything else that it asks for is refused. What cannot be
read is as good as no checkpoint.
"""

import hashlib
import importlib
import json
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import fields, is_dataclass
from typing import Any, NamedTuple

import numpy as np

MODULE = re.compile(r"wearlab\.(life|mesh|dynamics)(\.[a-z_][a-z0-9_]*)*")
"""Modules whose records a checkpoint may hold: numbers, and nothing that reads or
writes."""
NUMBER = re.compile(r"[<>|=](b1|[iu][1248]|f[248]|c8|c16|U[0-9]{1,4})")
PLAIN = (type(None), bool, int, float, str)


class Reached(NamedTuple):
    """How far a life is, for those who wait.

    Parameters
    ----------
    cycle : reached [1]
    depth : largest depth reached [m]
    """

    cycle: float
    depth: float


Report = Callable[[Reached, Callable[[], bytes]], None]
"""Called with every accepted state and what makes its checkpoint, which costs nothing
until it is called."""


class CheckpointError(Exception):
    """No wearlab wrote this checkpoint."""


def encoded(value: Any, shared: Sequence[Any] = ()) -> bytes:
    """Return a value as a line of JSON and the bytes of its arrays.

    Objects are listed each once, after all that it holds.

    Parameters
    ----------
    value : numbers, texts, lists, tuples, tables, arrays and records of wearlab, in any
        depth; an object that occurs twice is written once
    shared : objects of this process of which only the number is written

    Raises
    ------
    CheckpointError : it holds anything else
    """
    encoder = _Encoder(shared)
    root = encoder.reference(value)

    document = {"values": encoder.values, "root": root}
    head = json.dumps(document, separators=(",", ":")).encode()
    return head + b"\n" + encoder.arrays


class _Encoder:
    """The objects of a checkpoint, listed each once, after all that it holds.

    Parameters
    ----------
    shared : objects of this process of which only the number is written
    """

    def __init__(self, shared: Sequence[Any]) -> None:
        self.values = list[list[Any]]()
        self.arrays = bytearray()
        self._shared = {id(value): number for number, value in enumerate(shared)}
        # with the object: an id names it only as long as it lives
        self._numbers = dict[int, tuple[int, Any]]()

    def reference(self, value: Any) -> Any:
        """Return a plain value itself, of any other object its number in the list."""
        if type(value) in PLAIN:
            return value
        if id(value) not in self._numbers:
            stored = self._stored(value)
            self._numbers[id(value)] = len(self.values), value
            self.values.append(stored)
        return [self._numbers[id(value)][0]]

    def _stored(self, value: Any) -> list[Any]:
        """Return an object as its kind and what it holds."""
        if id(value) in self._shared:
            return ["shared", self._shared[id(value)]]
        match value:
            case np.ndarray() | np.generic():
                return self._stored_array(value)
            case slice():
                return ["slice", value.start, value.stop, value.step]
            case dict():
                return ["table", self._stored_items(value)]
        if type(value) in (tuple, list):
            return [type(value).__name__, [self.reference(item) for item in value]]
        return self._stored_record(value)

    def _stored_array(self, value: Any) -> list[Any]:
        """Append the bytes of an array, or of one number of numpy; return its kind."""
        if not NUMBER.fullmatch(value.dtype.str):
            raise CheckpointError(
                f"arrays of {value.dtype} do not belong in a checkpoint"
            )
        only_fortran = value.flags.f_contiguous and not value.flags.c_contiguous
        order: Any = "F" if only_fortran else "C"
        kind = "array" if isinstance(value, np.ndarray) else "number"
        offset = len(self.arrays)
        self.arrays.extend(value.tobytes(order))
        return [kind, value.dtype.str, list(value.shape), order, offset]

    def _stored_items(self, table: dict[Any, Any]) -> list[list[Any]]:
        """Return the keys and values of a table as references."""
        return [
            [self.reference(_key(key)), self.reference(value)]
            for key, value in table.items()
        ]

    def _stored_record(self, value: Any) -> list[Any]:
        """Return a record of wearlab as its name and its fields."""
        record = type(value)
        qualified = f"{record.__module__}:{record.__qualname__}"
        if _record(qualified) is not record:
            raise CheckpointError(f"{qualified} does not belong in a checkpoint")

        names = _fields(record)
        if names is None:
            names = list(vars(value))
        values = {name: self.reference(getattr(value, name)) for name in names}
        return ["record", qualified, values]


def decoded(image: bytes, shared: Sequence[Any] = ()) -> Any:
    """Return what `encoded` wrote, with this process's objects for those shared.

    Objects are made one after another: each refers to earlier ones only.

    Parameters
    ----------
    image : the line of JSON and the bytes of the arrays
    shared : objects of this process, in the order in which they were written

    Raises
    ------
    CheckpointError : no wearlab wrote it
    """
    head, _, arrays = image.partition(b"\n")
    decoder = _Decoder(arrays, shared)
    try:
        document = json.loads(head)
        for stored in document["values"]:
            decoder.restore(stored)
        return decoder.value(document["root"])
    except (
        ValueError,
        TypeError,
        KeyError,
        IndexError,
        RecursionError,
        OverflowError,
    ) as error:
        raise CheckpointError(f"no checkpoint of wearlab ({error})") from error


class _Decoder:
    """The objects that a checkpoint lists, made in the order of the list.

    Parameters
    ----------
    arrays : the bytes of all arrays
    shared : objects of this process, in the order in which they were written
    """

    def __init__(self, arrays: bytes, shared: Sequence[Any]) -> None:
        self._arrays = arrays
        self._shared = shared
        self._values = list[Any]()

    def restore(self, stored: Any) -> None:
        """Make the next object of the list."""
        self._values.append(self._restored(stored))

    def value(self, reference: Any) -> Any:
        """Return what a reference stands for: a plain value or an earlier object."""
        if type(reference) in PLAIN:
            return reference
        return self._values[_index(*reference)]

    def _restored(self, stored: Any) -> Any:
        """Return the object that a kind and what it holds describe."""
        match stored:
            case ["shared", number]:
                return self._shared[_index(number)]
            case ["array", str(dtype), list(shape), order, offset]:
                return self._restored_array(dtype, shape, order, offset)
            case ["number", str(dtype), list(shape), order, offset]:
                return self._restored_array(dtype, shape, order, offset)[()]
            case ["slice", start, stop, step]:
                return slice(start, stop, step)
            case ["table", list(items)]:
                return {_key(self.value(key)): self.value(item) for key, item in items}
            case ["tuple", list(items)]:
                return tuple(map(self.value, items))
            case ["list", list(items)]:
                return list(map(self.value, items))
            case ["record", str(name), dict(values)]:
                return _filled(
                    _record(name),
                    {field: self.value(value) for field, value in values.items()},
                )
        raise CheckpointError(f"{str(stored)[:60]!r} does not belong in a checkpoint")

    def _restored_array(
        self, dtype: str, shape: list[Any], order: Any, offset: Any
    ) -> Any:
        """Return a copy of the array at an offset in the bytes of all arrays."""
        if not NUMBER.fullmatch(dtype) or order not in ("C", "F"):
            raise CheckpointError(
                f"arrays of {dtype[:20]!r} do not belong in a checkpoint"
            )
        count = int(np.prod([_index(length) for length in shape], dtype=object))
        if count:
            flat = np.frombuffer(self._arrays, dtype, count, _index(offset))
        else:
            flat = np.empty(0, dtype)

        # the life may write to it, which it may not to bytes
        return flat.reshape(shape, order=order).copy(order)


def _key(key: Any) -> Any:
    """Return a key of a table: a plain value or a tuple of these."""
    if all(type(part) in PLAIN for part in (key if type(key) is tuple else (key,))):
        return key
    raise CheckpointError(f"{str(type(key))[:60]} is no key of a table")


def _index(number: Any) -> int:
    if type(number) is not int or number < 0:
        raise CheckpointError(f"{str(number)[:20]!r} is no number of an object")
    return number


def _fields(kind: type) -> Sequence[str] | None:
    """Return the names of the values that make an object; None: it may hold any."""
    if issubclass(kind, tuple):
        return getattr(kind, "_fields", ())
    return [each.name for each in fields(kind)] if is_dataclass(kind) else None


def _record(named: str) -> type:
    """Return a class of our own by its module and name."""
    module, _, name = named.partition(":")
    if not MODULE.fullmatch(module) or not name.isidentifier():
        raise CheckpointError(f"{named[:60]!r} does not belong in a checkpoint")
    try:
        kind = vars(importlib.import_module(module)).get(name)
    except ImportError as error:
        raise CheckpointError(f"{named[:60]!r} is not there") from error
    if not isinstance(kind, type) or kind.__module__ != module:
        raise CheckpointError(f"{named[:60]!r} does not belong in a checkpoint")
    return kind


def _filled(kind: type, values: dict[str, Any]) -> Any:
    """Return an object with these values; none of its own code runs."""
    names = _fields(kind)
    if names is not None and set(names) != set(values):
        raise CheckpointError(f"{kind.__name__} with other fields")
    if issubclass(kind, tuple):
        return tuple.__new__(kind, [values[name] for name in names or ()])
    made = object.__new__(kind)
    for name, value in values.items():
        object.__setattr__(made, name, value)
    return made


def _parts(image: bytes) -> dict[str, bytes]:
    """Return what `Checkpoint.keep` joined; nothing where no wearlab wrote it."""
    head, _, rest = image.partition(b"\n")
    kept: dict[str, bytes] = {}
    try:
        for key, length in json.loads(head).items():
            kept[key] = rest[: _index(length)]
            rest = rest[_index(length) :]
    except (ValueError, AttributeError, RecursionError):
        return {}
    return kept


class Checkpoint(NamedTuple):
    """The place of one life among those of a run.

    Parameters
    ----------
    report : called with every accepted state
    lives : what is kept of every life of the run, by what it began with
    key : hash of what this one began with: a run has several, and may find some of them
        done elsewhere
    shared : objects that this process has of its own and that are told apart by
        identity
    """

    report: Report
    lives: dict[str, bytes]
    key: str = ""
    shared: tuple[Any, ...] = ()

    @property
    def kept(self) -> Any:
        """What an earlier process kept of this life, None: nothing that can be read."""
        with suppress(CheckpointError, KeyError):
            return decoded(self.lives[self.key], self.shared)
        return None

    def keep(self, reached: Reached, state: Callable[[], Any]) -> None:
        """Report an accepted state, which can be kept."""

        def image() -> bytes:
            """Return everything kept: a line of JSON with lengths, then the images."""
            self.settle(state)
            head = json.dumps({key: len(image) for key, image in self.lives.items()})
            return head.encode() + b"\n" + b"".join(self.lives.values())

        self.report(reached, image)

    def settle(self, state: Callable[[], Any]) -> None:
        """Keep a state of the life, its end too: a later life's checkpoint holds it.

        A life whose memory is of a plug-in's own types is not kept; it begins anew.
        """
        try:
            self.lives[self.key] = encoded(state(), self.shared)
        except CheckpointError:
            self.lives.pop(self.key, None)


_RUN: ContextVar[Checkpoint | None] = ContextVar("run", default=None)


@contextmanager
def checkpoints(report: Report, image: bytes | None = None) -> Iterator[None]:
    """Let every life in this context be reported, and go on from what ``image`` holds.

    Parameters
    ----------
    report : called with every accepted state
    image : what a checkpoint of the same run held, None: a run from its beginning
    """
    token = _RUN.set(Checkpoint(report, {} if image is None else _parts(image)))
    try:
        yield
    finally:
        _RUN.reset(token)


def checkpoint(begins: tuple[Any, ...], shared: tuple[Any, ...]) -> Checkpoint | None:
    """Return the place of the life that begins so, None where nobody keeps any.

    Parameters
    ----------
    begins : what the life is made of: first state, limits, method, tolerances
    shared : objects that its rate tells apart by identity
    """
    run = _RUN.get()
    hashed = hashlib.sha256()
    if run is None:
        return None
    for each in begins:
        try:
            hashed.update(encoded(each))
        except CheckpointError:  # a step of a plug-in
            hashed.update(repr(each).encode())
    return run._replace(key=hashed.hexdigest(), shared=shared)
