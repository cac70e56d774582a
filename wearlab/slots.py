"""Slots: places of a scene where one of several variants stands.

A file in its package adds another.

A variant is a frozen `Part` whose chooser (``model``, ``method`` …) is a `Literal` of
one name. It says its options and, in ``build``, makes the physics they stand for;
whatever is slow to import is imported there. The slot finds its variants by itself:
every module of its package, and what plug-ins add.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from importlib import import_module
from pkgutil import iter_modules
from typing import Any, ClassVar, NamedTuple, Self, get_args

import pydantic
from pydantic_core import CoreSchema, core_schema

from wearlab.nearest import meant
from wearlab.options import Part, unit_within
from wearlab.units import UnitError, quantity


class Origin(NamedTuple):
    """Where a variant that is not part of the package comes from.

    Parameters
    ----------
    file : name of the file, or of the entry point
    sha256 : hash of its source, which is part of the identity of every run that uses it
    runs : whether its code was run; else only its options are known
    """

    file: str
    sha256: str
    runs: bool = True


ORIGIN: ContextVar[Origin | None] = ContextVar("origin", default=None)
"""Where variants come from that are defined now, None where they are wearlab's."""


class SlotError(ValueError):
    """Two variants of a slot have one name."""


PLUGIN = "plugin"
"""The key under which a stored scene says which plug-in a variant comes from."""


class VariantError(ValueError):
    """A variant's own physics gives what cannot be."""


class Slot:
    """A place of a scene where one of several variants stands.

    Parameters
    ----------
    key : dotted key of the place in a campaign file
    package : the package whose modules are its variants
    chooser : the key that says which one
    default : the one that a table means which names none, "" where it must name one
    by_name : whether a variant with nothing but its name is written as that name alone
    """

    all: ClassVar[dict[str, "Slot"]] = {}

    def __init__(
        self,
        key: str,
        package: str,
        chooser: str = "model",
        *,
        default: str = "",
        by_name: bool = False,
    ) -> None:
        self.key, self.package, self.chooser, self.default = (
            key,
            package,
            chooser,
            default,
        )
        self.by_name = by_name
        self.base: type[Variant] | None = None
        self.known: dict[str, type[Variant]] = {}
        self._searched = False
        self.all[key] = self

    def __repr__(self) -> str:
        return f"Slot({self.key!r})"

    @property
    def variants(self) -> "dict[str, type[Variant]]":
        """The variants by name, those of the package first."""
        if not self._searched:
            self._searched = True
            for module in iter_modules(import_module(self.package).__path__):
                import_module(f"{self.package}.{module.name}")
            self.known = dict(sorted(self.known.items()))
        return self.known

    def read(self, value: object) -> object:
        """Return a choice as a table: a text is its name.

        Own options imply it, else it is the default.
        """
        if isinstance(value, dict) and self.chooser not in value:
            implied = (
                name
                for name, part in self.variants.items()
                if part.implied_by.intersection(value)
            )
            chosen = next(implied, self.default)
            return {self.chooser: chosen, **value} if chosen else value
        return {self.chooser: value} if isinstance(value, str) else value

    def add(self, variant: "type[Variant]", name: str) -> None:
        """Take up a variant.

        One of a plug-in may be replaced by its later self, no other.

        Raises
        ------
        SlotError
            When another variant has the name.
        """
        before = self.known.get(name)
        if before is not None and issubclass(variant, before):
            return
        if before is not None and (
            before.origin is None or before.source() != variant.source()
        ):
            raise SlotError(
                f"{self.key}: {self.chooser} {name!r} is there already, from "
                f"{before.source()}: "
                "give yours another name"
            )
        self.known[name] = variant


class Variant(Part):
    """One of the variants of a slot.

    The common base of a slot's variants stands for any of them.
    """

    slot: ClassVar[Slot]
    origin: ClassVar[Origin | None] = None
    may_need: ClassVar[tuple[str, ...]] = ()
    """What variants of this slot may name in ``needs``."""

    @classmethod
    def source(cls) -> str:
        """Return where the variant comes from, in a word."""
        return "wearlab" if cls.origin is None else cls.origin.file

    def identifying(self) -> dict[str, Any]:
        """Return the options that tell this variant from others, and whose it is if it is a user's."""
        own = super().identifying()
        return own if self.origin is None else {**own, PLUGIN: self.origin.sha256}

    def written(self, table: dict[str, Any]) -> Any:
        """Return a table of options as it is written: a word where the slot has words and it says no more."""
        return (
            self.chosen
            if self.slot.by_name and set(table) == {self.slot.chooser}
            else table
        )

    @pydantic.model_serializer(mode="wrap")
    def _with_plugin(self, dump: pydantic.SerializerFunctionWrapHandler) -> Any:
        written: dict[str, Any] = dump(self)
        if self.origin is None:
            return self.written(written)
        return {
            **written,
            PLUGIN: {"file": self.origin.file, "sha256": self.origin.sha256},
        }

    @classmethod
    def _complete(
        cls, given: dict[str, Any], info: pydantic.ValidationInfo
    ) -> dict[str, Any]:
        """Refuse what another source of the same name was chosen from."""
        if cls.origin is None or PLUGIN not in given:
            return given
        was = given[PLUGIN]
        if not isinstance(was, dict) or was.get("sha256") != cls.origin.sha256:
            raise ValueError(
                f"chosen from another {cls.origin.file} than the one that is loaded"
            )
        return {key: value for key, value in given.items() if key != PLUGIN}

    @classmethod
    def named(cls, name: str = "") -> Self:
        """Return a variant of this slot with its defaults.

        Parameters
        ----------
        name : of the variant; "": the slot's default
        """
        variant: Any = cls.slot.variants[name or cls.slot.default]
        return variant()

    @property
    def chosen(self) -> str:
        """The name by which a campaign file chooses this variant."""
        return str(getattr(self, self.slot.chooser))

    @classmethod
    def is_slot(cls) -> bool:
        """Whether this is the common base of a slot's variants, not one of them."""
        return "slot" in cls.__dict__

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        """Let the slot know of every class that names a variant."""
        super().__pydantic_init_subclass__(**kwargs)
        if cls.is_slot():
            cls.slot.base = cls
            return
        cls._check_needs()
        if ORIGIN.get() is not None:
            cls._read_defaults()
        field = cls.model_fields.get(cls.slot.chooser)
        names = get_args(field.annotation) if field is not None else ()
        if len(names) == 1 and isinstance(names[0], str):
            cls.origin = ORIGIN.get()
            cls.slot.add(cls, names[0])

    @classmethod
    def _read_defaults(cls) -> None:
        """Take a default with a unit for its value in SI.

        Refuse one that a campaign file could not say.
        """
        for name, field in cls.model_fields.items():
            unit = unit_within(None, field.metadata)
            if unit is None or not isinstance(field.default, str):
                continue
            try:
                field.default = quantity(field.default, unit.kind)
            except UnitError as error:
                raise SlotError(f"{cls.__name__}.{name}: default {error}") from None
        cls.model_rebuild(force=True)

    @classmethod
    def _check_needs(cls) -> None:
        """Refuse a class that needs what no scene can say."""
        given = cls.__dict__.get("needs", ())
        if not cls.may_need or isinstance(given, property):
            return
        needs = (given,) if isinstance(given, str) else given
        if unknown := [name for name in needs if name not in cls.may_need]:
            known = (
                f"{meant(unknown[0], cls.may_need, ';')} there are "
                f"{', '.join(map(repr, cls.may_need))}"
            )
            raise SlotError(f"{cls.__name__}.needs: {unknown[0]!r} is unknown{known}")
        if needs is not given:
            raise SlotError(
                f"{cls.__name__}.needs: {given!r} is no tuple: write {needs!r}"
            )

    @classmethod
    def __get_pydantic_core_schema__(
        cls, source: Any, handler: pydantic.GetCoreSchemaHandler
    ) -> CoreSchema:
        """Choose among the variants known now, by the chooser, where the slot stands for any of them."""
        if not cls.is_slot() or cls.slot.base is None:
            return handler(source)
        choices = {
            name: handler.generate_schema(part)
            for name, part in cls.slot.variants.items()
        }
        own = core_schema.plain_serializer_function_ser_schema(
            lambda part: part.model_dump()
        )
        union = core_schema.tagged_union_schema(
            choices, cls.slot.chooser, serialization=own
        )
        return core_schema.no_info_before_validator_function(cls.slot.read, union)

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core: CoreSchema, handler: pydantic.GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Offer the names of variants that require nothing else, where the slot stands for any of them."""
        table = super().__get_pydantic_json_schema__(core, handler)
        if not cls.is_slot():
            return table
        parts = [
            handler.resolve_ref_schema(part) for part in table.get("oneOf", [table])
        ]
        plain = [
            part
            for part in parts
            if not set(part.get("required", [])) - {cls.slot.chooser}
        ]
        names = [part["properties"][cls.slot.chooser]["const"] for part in plain]
        return {"anyOf": [{"enum": names}, table]} if names else table


@contextmanager
def within(variable: ContextVar[Any], value: Any) -> Iterator[None]:
    """Let a variable have a value within."""
    token = variable.set(value)
    try:
        yield
    finally:
        variable.reset(token)


WHEN_CHANGED: list[Callable[[], object]] = []
"""What renews what was made of the variants of slots, whenever one has got others."""


def changed() -> None:
    """Renew all that was made of the variants known before."""
    for renew in WHEN_CHANGED:
        renew()
