"""Options of a scene: frozen tables of values with a unit, a meaning and a source.

A value comes from a campaign file, or from a scene that is already SI (``Stored``): the
second kind needs no unit, since it was read before.
"""

import math
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, get_args

import pydantic
from annotated_types import Ge, Gt
from pydantic import (
    AliasChoices,
    BeforeValidator,
    Field,
    GetJsonSchemaHandler,
    ValidationInfo,
)
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
        """Add the texts under fields to the JSON Schema.

        A key that may be absent means "none" where no text says what it means.
        """
        schema = handler(core)
        properties = handler.resolve_ref_schema(schema).get("properties", {})
        texts = cls.texts()

        for key in properties.keys() & cls.model_fields.keys():
            properties[key].pop("description", None)
            properties[key] |= texts.get(key, {})
            if key in texts and cls.model_fields[key].default is None:
                properties[key].setdefault("derived", "none")
        return schema

    @classmethod
    def texts(cls) -> dict[str, dict[str, str]]:
        """Return description, derived and source of the options that have a text.

        A field that a class declares anew keeps the text of its base where it has none.
        """
        tables = [base for base in cls.__mro__ if issubclass(base, OptionTable)]
        texts: dict[str, dict[str, str]] = {}
        for table in reversed(tables):
            for key, field in table.model_fields.items():
                if field.description and key in cls.model_fields:
                    texts[key] = _parts_of_text(field.description)
        return {key: texts[key] for key in cls.model_fields if key in texts}

    @classmethod
    def field_of(cls, key: str) -> str:
        """Return the name of the field that a key of the file fills.

        Parameters
        ----------
        key : as the file writes it: `from` is no name in Python
        """
        for name, field in cls.model_fields.items():
            alias = field.validation_alias
            if isinstance(alias, AliasChoices) and key in alias.choices:
                return name
        return key


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
        """Return the options that belong to the identity of a scene, by name."""
        fields = type(self).model_fields
        return {name: value for name, value in self if not fields[name].exclude}

    def written(self, table: dict[str, Any]) -> Any:
        """Return a table of this part's options as a campaign file writes it.

        Parameters
        ----------
        table : option → value, as JSON can hold it
        """
        return table

    @pydantic.model_validator(mode="before")
    @classmethod
    def _completed(cls, value: Any, info: ValidationInfo) -> Any:
        """Complete a table; anything else is for pydantic to refuse."""
        return cls._complete(value, info) if isinstance(value, dict) else value

    @classmethod
    def _complete(cls, table: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        """Return a table of a file with the keys that it need not write."""
        return table

    @pydantic.model_validator(mode="after")
    def _checked(self) -> "Part":
        """Refuse options that exclude each other, and those that do not go together."""
        self._one_alternative()
        self._check()
        return self

    def _check(self) -> None:
        """Refuse options that do not go together, by a `ValueError`.

        Derive options from others.
        """

    def _one_alternative(self) -> None:
        """Refuse keys of two sets of `alternatives` that are given together."""
        for groups in self.alternatives:
            keys = [
                written[0]
                for group in groups
                if (written := [key for key in group if key in self.model_fields_set])
                and any(getattr(self, key) is not None for key in group)
            ]
            if len(keys) > 1:
                names = " and ".join(map(repr, keys))
                raise ValueError(f"give one of {names}, not both")


class ClosedTable(OptionTable):
    """A table of a campaign file outside of scenes; unknown keys are refused."""

    model_config = pydantic.ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def option(
    default: Any,
    meaning: Text = None,
    *,
    derived: Text = None,
    source: Text = None,
    identity: bool = True,
) -> Any:
    """Declare an option that needs more than a default and the text under it.

    Parameters
    ----------
    default : the value when the key is absent; ``...`` when it is required
    meaning : one sentence for ``wearlab schema`` [the text under the field]
    derived : what an absent key means, when ``default`` is None [none]
    source : the paper, equation or standard behind it
    identity : whether the value is part of the scene's identity
    """
    texts: Any = {}
    if derived is not None:
        texts["derived"] = derived
    if source is not None:
        texts["source"] = source
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
        constraints = handler(core)
        limits = [
            f"{LIMIT_SIGNS[key]} {constraints[key]:g}"
            for key in constraints
            if key in LIMIT_SIGNS
        ]
        schema: dict[str, Any] = {
            "type": "string",
            "kind": kind.name,
            "unit": kind.unit,
            "examples": [kind.example],
        }
        if limits:
            schema["limits"] = " and ".join(limits)
        return schema


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
    """Return the function that reads a value of a kind of quantity into SI."""

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
    if isinstance(value, str):
        return _reader("time")(value) / HOUR
    hours = _number(value)
    if hours > 0 and not isinstance(value, Stored):
        quantity(f"{hours!r} h", "time")  # refuses what no time is
    return hours


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
Volume = measured("volume")
Density = measured("density")
Viscosity = measured("viscosity")
PressureViscosity = measured("pressure-viscosity coefficient")
WearCoefficient = measured("wear coefficient")
Time = measured("time")
Hardness = measured("hardness")
KinematicViscosity = measured("kinematic viscosity")
Temperature = measured("temperature")
TemperatureDifference = measured("temperature difference")
Velocity = measured("velocity")
ThermalExpansion = measured("thermal expansion")
Area = measured("area")
ThermalInsulance = measured("thermal insulance")
