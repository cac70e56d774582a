"""Slots: places of a scene where one of several variants stands, each in a file of its own.

A variant is a frozen `Part` whose chooser (``model``, ``method`` …) is a `Literal` of one name. It says its
options and, in ``build``, makes the physics they stand for; whatever is slow to import is imported there.
The slot finds its variants by itself: every module of its package, and what plug-ins add.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from difflib import get_close_matches
from importlib import import_module
from pkgutil import iter_modules
from typing import Any, ClassVar, NamedTuple, get_args

from pydantic import GetCoreSchemaHandler
from pydantic_core import CoreSchema, core_schema

from wearlab.options import Part


class Origin(NamedTuple):
    """Where a variant that is not part of the package comes from.

    Parameters
    ----------
    file : name of the file, or of the entry point
    sha256 : hash of its source, which is part of the identity of every run that uses it
    """

    file: str
    sha256: str


_ORIGIN: ContextVar[Origin | None] = ContextVar("origin", default=None)


class SlotError(ValueError):
    """Two variants of a slot have one name."""


class Slot:
    """A place of a scene where one of several variants stands.

    Parameters
    ----------
    key : dotted key of the place in a campaign file
    package : the package whose modules are its variants
    chooser : the key that says which one
    """

    def __init__(self, key: str, package: str, chooser: str = "model") -> None:
        self.key, self.package, self.chooser = key, package, chooser
        self._known: dict[str, type[Variant]] = {}
        self._searched = False

    def __repr__(self) -> str:
        return f"Slot({self.key!r})"

    @property
    def variants(self) -> "dict[str, type[Variant]]":
        """The variants by name, those of the package first."""
        if not self._searched:
            self._searched = True
            package = import_module(self.package)
            for module in iter_modules(package.__path__):
                import_module(f"{self.package}.{module.name}")
        return self._known

    def add(self, variant: "type[Variant]", name: str) -> None:
        """Take up a variant; one of a plug-in may be replaced by its later self, no other.

        Raises
        ------
        SlotError
            When another variant has the name.
        """
        before = self._known.get(name)
        if before is not None and issubclass(variant, before):
            return
        if before is not None and (before.origin and before.origin.file) != (
            variant.origin.file if variant.origin else before.__module__
        ):
            raise SlotError(
                f"{self.key}: {self.chooser} {name!r} is there already, from "
                f"{before.origin.file if before.origin else 'wearlab'}: give yours another name"
            )
        self._known[name] = variant

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Choose among the variants that are known now by the chooser."""
        choices = {name: handler.generate_schema(part) for name, part in self.variants.items()}
        return core_schema.tagged_union_schema(choices, self.chooser)

    def nearest(self, name: str) -> str | None:
        """Return the name of the variant spelled most like another name."""
        return next(iter(get_close_matches(name, self.variants, 1)), None)


class Variant(Part):
    """One of the variants of a slot; the class of its slot is the common base that names the slot."""

    slot: ClassVar[Slot | None] = None
    origin: ClassVar[Origin | None] = None

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        """Let the slot know of every class that names a variant."""
        super().__pydantic_init_subclass__(**kwargs)
        if cls.slot is None:
            return
        field = cls.model_fields.get(cls.slot.chooser)
        names = get_args(field.annotation) if field is not None else ()
        if len(names) == 1 and isinstance(names[0], str):
            cls.origin = _ORIGIN.get()
            cls.slot.add(cls, names[0])


@contextmanager
def coming_from(origin: Origin) -> Iterator[None]:
    """Mark all variants that are defined within as coming from a plug-in."""
    token = _ORIGIN.set(origin)
    try:
        yield
    finally:
        _ORIGIN.reset(token)
