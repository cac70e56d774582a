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


PLUGIN = "plugin"
"""The key under which a stored scene says which plug-in a variant comes from."""


class SlotError(ValueError):
    """A variant cannot stand in its slot."""


class VariantError(ValueError):
    """The physics of a variant gives an impossible value."""


class Slot:
    """A place of a scene where one of several variants stands.

    Parameters
    ----------
    key : dotted key of the place in a campaign file
    package : the package whose modules are its variants
    chooser : the key that names the variant
    default : the variant of a table that names none, "" where a table must name one
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
        self.key = key
        self.package = package
        self.chooser = chooser
        self.default = default
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
        """Return a choice as a table that names the variant.

        A table without a name means the variant whose options it has, see
        `Part.implied_by`, else the default.

        Parameters
        ----------
        value : the name of a variant or a table, as a campaign file writes it
        """
        if isinstance(value, str):
            return {self.chooser: value}
        if not isinstance(value, dict) or self.chooser in value:
            return value

        implied = (
            name
            for name, part in self.variants.items()
            if part.implied_by.intersection(value)
        )
        name = next(implied, self.default)
        return {self.chooser: name, **value} if name else value

    def add(self, variant: "type[Variant]", name: str) -> None:
        """Add a variant; a variant of a plug-in replaces an earlier one of that file.

        Parameters
        ----------
        variant : a class of the slot's base
        name : what campaign files call it

        Raises
        ------
        SlotError
            When another variant has the name.
        """
        namesake = self.known.get(name)
        if namesake is not None:
            if issubclass(variant, namesake):
                return
            same_file = namesake.source() == variant.source()
            if namesake.origin is None or not same_file:
                raise SlotError(
                    f"{self.key}: {self.chooser} {name!r} is there already, from "
                    f"{namesake.source()}: give yours another name"
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
        """Return where the variant comes from: "wearlab", or the name of a plug-in."""
        return "wearlab" if cls.origin is None else cls.origin.file

    def identifying(self) -> dict[str, Any]:
        """Return the options of the identity, and the hash of the plug-in if any."""
        options = super().identifying()
        if self.origin is not None:
            options[PLUGIN] = self.origin.sha256
        return options

    def written(self, table: dict[str, Any]) -> Any:
        """Return a table of options as a campaign file writes it.

        Where the slot is `by_name`, a variant without other options is its name alone.

        Parameters
        ----------
        table : option → value, as JSON can hold it
        """
        has_only_name = set(table) == {self.slot.chooser}
        return self.chosen if self.slot.by_name and has_only_name else table

    @pydantic.model_serializer(mode="wrap")
    def _with_plugin(self, dump: pydantic.SerializerFunctionWrapHandler) -> Any:
        """Dump the options, and the plug-in that they belong to."""
        written: dict[str, Any] = dump(self)
        if self.origin is None:
            return self.written(written)
        return {
            **written,
            PLUGIN: {"file": self.origin.file, "sha256": self.origin.sha256},
        }

    @classmethod
    def _complete(
        cls, table: dict[str, Any], info: pydantic.ValidationInfo
    ) -> dict[str, Any]:
        """Refuse a table that was stored with another source of the plug-in."""
        if cls.origin is None or PLUGIN not in table:
            return table
        stored = table[PLUGIN]
        if not isinstance(stored, dict) or stored.get("sha256") != cls.origin.sha256:
            raise ValueError(
                f"chosen from another {cls.origin.file} than the one that is loaded"
            )
        return {key: value for key, value in table.items() if key != PLUGIN}

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
        """Whether this is the common base of a slot's variants."""
        return "slot" in cls.__dict__

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        """Add every class that names a variant to its slot."""
        super().__pydantic_init_subclass__(**kwargs)
        if cls.is_slot():
            cls.slot.base = cls
            return
        cls._check_needs()
        if ORIGIN.get() is not None:
            cls._check_attributes()
            cls._read_defaults()
        field = cls.model_fields.get(cls.slot.chooser)
        names = get_args(field.annotation) if field is not None else ()
        if len(names) == 1 and isinstance(names[0], str):
            cls.origin = ORIGIN.get()
            cls.slot.add(cls, names[0])

    @classmethod
    def _read_defaults(cls) -> None:
        """Convert defaults that are written with a unit to SI.

        Refuse a default that a campaign file could not say.
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
    def _check_attributes(cls) -> None:
        """Refuse an attribute of a plug-in's class that wearlab would never read.

        It is known where the class inherits one of the name, or where it is an option.
        """
        for name in vars(cls):
            is_inherited = hasattr(super(cls, cls), name)
            if name.startswith("_") or name in cls.model_fields or is_inherited:
                continue
            hooks = [
                hook
                for hook in dir(cls.slot.base)
                if not hook.startswith("_") and not hasattr(pydantic.BaseModel, hook)
            ]
            raise SlotError(
                f"{cls.__name__}.{name}: wearlab reads no attribute of this name"
                f"{meant(name, hooks, ';')} name what is for your own use _{name}"
            )

    @classmethod
    def _check_needs(cls) -> None:
        """Refuse a class that needs what no scene can say."""
        needs = cls.__dict__.get("needs", ())
        if not cls.may_need or isinstance(needs, property):
            return
        names = (needs,) if isinstance(needs, str) else needs

        unknown = next((name for name in names if name not in cls.may_need), None)
        if unknown is not None:
            raise SlotError(
                f"{cls.__name__}.needs: {unknown!r} is unknown"
                f"{meant(unknown, cls.may_need, ';')} there are "
                f"{', '.join(map(repr, cls.may_need))}"
            )
        if names is not needs:
            raise SlotError(
                f"{cls.__name__}.needs: {needs!r} is no tuple: write {names!r}"
            )

    @classmethod
    def __get_pydantic_core_schema__(
        cls, source: Any, handler: pydantic.GetCoreSchemaHandler
    ) -> CoreSchema:
        """Validate the base of a slot as any of the variants known now."""
        if not cls.is_slot() or cls.slot.base is None:
            return handler(source)
        variants = cls.slot.variants.items()
        choices = {name: handler.generate_schema(part) for name, part in variants}
        dump = core_schema.plain_serializer_function_ser_schema(
            lambda part: part.model_dump()
        )
        union = core_schema.tagged_union_schema(
            choices, cls.slot.chooser, serialization=dump
        )
        return core_schema.no_info_before_validator_function(cls.slot.read, union)

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core: CoreSchema, handler: pydantic.GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Offer the name alone of a variant that requires no other option."""
        schema = super().__get_pydantic_json_schema__(core, handler)
        if not cls.is_slot():
            return schema

        chooser = cls.slot.chooser
        names = []
        for reference in schema.get("oneOf", [schema]):
            variant = handler.resolve_ref_schema(reference)
            if set(variant.get("required", [])) <= {chooser}:
                names.append(variant["properties"][chooser]["const"])
        return {"anyOf": [{"enum": names}, schema]} if names else schema


@contextmanager
def within(variable: ContextVar[Any], value: Any) -> Iterator[None]:
    """Set a variable inside of ``with``.

    Parameters
    ----------
    variable : context variable
    value : that it has inside
    """
    token = variable.set(value)
    try:
        yield
    finally:
        variable.reset(token)


WHEN_CHANGED: list[Callable[[], object]] = []
"""Functions to call when a slot gets other variants, such as a rebuild of a schema."""


def changed() -> None:
    """Call `WHEN_CHANGED` after a slot has got other variants."""
    for renew in WHEN_CHANGED:
        renew()
