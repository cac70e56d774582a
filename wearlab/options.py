"""What every choice of a scene is made of: frozen parts, options with a meaning, and values with a unit.

A value comes from a campaign file, or from a scene that is already SI (``Stored``): the
second kind needs no unit, since it was read once.
"""

import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, get_args

import pydantic
from annotated_types import Ge, Gt
from pydantic import BeforeValidator, Field, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema

from wearlab.units import HOUR, KINDS, is_number, quantity

Text = str | None
Alternatives = tuple[tuple[tuple[str, ...], ...], ...]
TEXT_UNDER_FIELD = re.compile(
    r"(?P<description>.*?)(?: \[(?P<derived>[^][]*)\])?(?:\. Source: (?P<source>.*))?"
)
"""The text under a field: what it means [what its absence means]. Source: where it
comes from."""
LIMIT_SIGNS = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}


class Stored(float):
    """A number that a scene has already read: SI, or a plain number."""


class OptionTable(pydantic.BaseModel):
    """A table of a campaign file.

    The text under a field tells its meaning, as `TEXT_UNDER_FIELD` reads it.
    """

    model_config = pydantic.ConfigDict(use_attribute_docstrings=True)

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Add the texts under fields, and "none" where nothing says what an absent key means."""
        table = handler(core)
        properties = handler.resolve_ref_schema(table).get("properties", {})
        texts = cls.texts()
        for key in properties.keys() & cls.model_fields.keys():
            properties[key].pop("description", None)
            properties[key] |= texts.get(key, {})
            if key in texts and cls.model_fields[key].default is None:
                properties[key].setdefault("derived", "none")
        return table

    @classmethod
    def texts(cls) -> dict[str, dict[str, str]]:
        """Return description, derived and source of options, as far as somebody says them.

        A field that a class declares anew keeps the text of its base where it has none.
        """
        tables = [base for base in cls.__mro__ if issubclass(base, OptionTable)]
        texts: dict[str, dict[str, str]] = {}
        for key in cls.model_fields:
            described = (
                base.model_fields[key].description
                for base in tables
                if key in base.model_fields
            )
            text = next((text for text in described if text), None)
            if text is not None:
                texts[key] = _parts_of_text(text)
        return texts


def _parts_of_text(text: str) -> dict[str, str]:
    """Return description, derived and source of the text under a field."""
    match = TEXT_UNDER_FIELD.fullmatch(" ".join(text.split()))
    if match is None:
        return {}
    return {name: part for name, part in match.groupdict().items() if part}


class Part(OptionTable):
    """A frozen table of options; unknown keys are refused.

    ``alternatives`` lists sets of keys that replace each other: keys of two of the sets
    are never given together, and a file that gives one drops the other from what it
    extends. ``chooser`` is the key that chooses among the parts of a union, and a table
    that leaves it out means the default's unless it has one of another's
    ``implied_by``; ``keeps_table`` says that another choice merges with the table it
    finds: the choices share options; ``per_member`` says that members may override it,
    table by table.
    """

    model_config = pydantic.ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)
    alternatives: ClassVar[Alternatives] = ()
    chooser: ClassVar[str] = "model"
    implied_by: ClassVar[frozenset[str]] = frozenset()
    keeps_table: ClassVar[bool] = False
    per_member: ClassVar[bool] = False

    def identifying(self) -> dict[str, Any]:
        """Return the options that tell this part from others, by name."""
        fields = type(self).model_fields
        return {
            name: getattr(self, name)
            for name, field in fields.items()
            if not field.exclude
        }

    def written(self, table: dict[str, Any]) -> Any:
        """Return a table of this part's options as it is written."""
        return table

    @pydantic.model_validator(mode="before")
    @classmethod
    def _completed(cls, value: Any, info: ValidationInfo) -> Any:
        """Complete a table; anything else is for pydantic to refuse."""
        return cls._complete(value, info) if isinstance(value, dict) else value

    @classmethod
    def _complete(cls, table: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        """Return a table as it is written with what goes without saying."""
        return table

    @pydantic.model_validator(mode="after")
    def _checked(self) -> "Part":
        """Refuse options that exclude each other, and those that do not go together."""
        self._one_alternative()
        self._check()
        return self

    def _check(self) -> None:
        """Refuse options that do not go together, by a `ValueError`.

        Fill in those that others tell.
        """

    def _one_alternative(self) -> None:
        """Refuse keys of two sets of `alternatives` that are given together."""
        for groups in self.alternatives:
            present = [
                group
                for group in groups
                if any(key in self.model_fields_set for key in group)
                and any(getattr(self, key) is not None for key in group)
            ]
            if len(present) > 1:
                keys = [
                    next(key for key in group if key in self.model_fields_set)
                    for group in present
                ]
                raise ValueError(
                    f"give one of {' and '.join(map(repr, keys))}, not both"
                )


class ClosedTable(OptionTable):
    """A table of a campaign file that is no section of a scene; unknown keys are refused."""

    model_config = pydantic.ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def option(
    default: Any,
    meaning: Text = None,
    *,
    derived: Text = None,
    source: Text = None,
    identity: bool = True,
) -> Any:
    """Declare an option of which more is to say than its default and the text under it.

    Parameters
    ----------
    default : the value when the key is absent; ``...`` when it is required
    meaning : one sentence for ``wearlab schema`` [the text under the field]
    derived : what an absent key means, when ``default`` is None [none]
    source : the paper, equation or standard behind it
    identity : whether the value is part of the scene's identity
    """
    texts: Any = {
        key: text
        for key, text in {"derived": derived, "source": source}.items()
        if text is not None
    }
    return Field(
        default,
        description=meaning,
        json_schema_extra=texts,
        exclude=None if identity else True,
    )


@dataclass(frozen=True)
class Unit:
    """Marks a value that is written with a unit; tells the JSON Schema which."""

    kind: str

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Describe the value as users write it: a text with a unit."""
        kind = KINDS[self.kind]
        limits = [
            f"{LIMIT_SIGNS[key]} {limit:g}"
            for key, limit in handler(core).items()
            if key in LIMIT_SIGNS
        ]
        schema = {
            "type": "string",
            "kind": kind.name,
            "unit": kind.unit,
            "examples": [kind.example],
        }
        return {**schema, "limits": " and ".join(limits)} if limits else schema


def unit_within(annotation: Any, metadata: Iterable[Any] = ()) -> Unit | None:
    """Return the mark of a value with a unit, None where there is none.

    Parameters
    ----------
    annotation : type of a field; the types that it holds are looked at, too
    metadata : marks of the field, which are looked at first
    """
    for mark in (*metadata, *getattr(annotation, "__metadata__", ())):
        if isinstance(mark, Unit):
            return mark
    for inner in get_args(annotation):
        unit = unit_within(inner)
        if unit is not None:
            return unit
    return None


def _reader(kind: str) -> Callable[[object], float]:
    """Return what reads a value of a kind of quantity into SI."""

    def read(value: object) -> float:
        return float(value) if isinstance(value, Stored) else quantity(value, kind)

    return read


def _number(value: object) -> float:
    """Read a plain, finite number."""
    if not is_number(value):
        raise ValueError(
            f"{value!r} is not a plain number: write it without quotes or unit"
        )
    if not math.isfinite(value):
        raise ValueError(f"{value!r} is not a finite number")
    return float(value)


def _count(value: object) -> int:
    """Read a whole number."""
    number = _number(value)
    if number != int(number):
        raise ValueError(f"{value!r} is not a whole number")
    return value if type(value) is int else int(number)


def _hours(value: object) -> float:
    """Read hours: a plain number, or a time with its unit."""
    return _reader("time")(value) / HOUR if isinstance(value, str) else _number(value)


def measured(kind: str) -> Any:
    """Return the type of a value with a unit.

    Parameters
    ----------
    kind : name of its kind of quantity, a key of `wearlab.units.KINDS`
    """
    return Annotated[float, BeforeValidator(_reader(kind)), Unit(kind)]


POSITIVE = Gt(0)
NOT_NEGATIVE = Ge(0)

Number = Annotated[float, BeforeValidator(_number)]
Hours = Annotated[
    float,
    BeforeValidator(_hours),
    pydantic.WithJsonSchema(
        {"anyOf": [{"type": "number"}, {"type": "string", "kind": "time", "unit": "s"}]}
    ),
]
Count = Annotated[int, BeforeValidator(_count)]
Switch = pydantic.StrictBool

Length = measured("length")
Depth = measured("depth")
Angle = measured("angle")
Speed = measured("speed")
Torque = measured("torque")
Frequency = measured("frequency")
Power = measured("power")
Force = measured("force")
Mass = measured("mass")
Inertia = measured("inertia")
SpringRate = measured("stiffness")
TorsionalSpringRate = measured("torsional stiffness")
DampingRate = measured("damping")
TorsionalDampingRate = measured("torsional damping")
LossPerSpeed = measured("loss per speed")
Pressure = measured("pressure")
Density = measured("density")
Viscosity = measured("viscosity")
PressureViscosity = measured("pressure-viscosity coefficient")
WearCoefficient = measured("wear coefficient")
Time = measured("time")
Hardness = measured("hardness")
KinematicViscosity = measured("kinematic viscosity")
Temperature = measured("temperature")
