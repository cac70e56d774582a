"""What every choice of a scene is made of: frozen parts, options with a meaning, and values with a unit.

A value comes from a campaign file, or from a scene that is already SI (``Stored``): the
second kind needs no unit, since it was read once.
"""

import ast
import inspect
import math
import re
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Annotated, Any, ClassVar, get_args

import pydantic
from annotated_types import Ge, Gt
from pydantic import BeforeValidator, Field, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import CoreSchema

from wearlab.units import HOUR, KINDS, is_number, quantity

Text = str | None
Alternatives = tuple[tuple[tuple[str, ...], ...], ...]


class Stored(float):
    """A number that a scene has already read: SI, or a plain number."""


UNDER = re.compile(
    r"(?P<description>.*?)(?: \[(?P<derived>[^][]*)\])?(?:\. Source: (?P<source>.*))?"
)
"""The text under a field: what it means [what its absence means]. Source: where it
comes from."""


class OptionTable(pydantic.BaseModel):
    """A table of a campaign file.

    The text under a field tells its meaning, as `UNDER` reads it.
    """

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Add the texts under fields, and "none" where nothing says what an absent key means."""
        table = handler(core)
        properties = handler.resolve_ref_schema(table).get("properties", {})
        for key, words in cls.texts().items():
            if key in properties:
                properties[key] |= words
                if cls.model_fields[key].default is None:
                    properties[key].setdefault("derived", "none")
        return table

    @classmethod
    def texts(cls) -> dict[str, dict[str, str]]:
        """Return description, derived and source of options: of the text under a field, or of `option`."""
        words: dict[str, dict[str, str]] = {}
        for base in reversed(cls.__mro__):
            words |= _texts_under_fields(base) if issubclass(base, OptionTable) else {}
        told = {key: field.description for key, field in cls.model_fields.items()}
        return words | {
            key: {"description": meaning} for key, meaning in told.items() if meaning
        }


def _texts_under_fields(part: type) -> dict[str, dict[str, str]]:
    try:
        module = sys.modules[part.__module__]
        classes = _classes_of(
            getattr(module, "__source__", None) or inspect.getsource(module)
        )
    except (KeyError, TypeError, OSError):  # its source was never a file, or is gone
        return {}
    texts: dict[str, dict[str, str]] = {}
    for field, text in pairwise(
        classes[part.__name__].body if part.__name__ in classes else ()
    ):
        match field, text:
            case ast.AnnAssign(target=ast.Name(id=key)), ast.Expr(
                value=ast.Constant(value=str(words))
            ):
                read = UNDER.fullmatch(" ".join(words.split()))
                texts[key] = (
                    {name: said for name, said in read.groupdict().items() if said}
                    if read
                    else {}
                )
    return texts


@cache
def _classes_of(source: str) -> dict[str, ast.ClassDef]:
    return {
        node.name: node
        for node in ast.parse(source).body
        if isinstance(node, ast.ClassDef)
    }


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
    def _completed(cls, given: Any, info: ValidationInfo) -> Any:
        return cls._complete(given, info) if isinstance(given, dict) else given

    @classmethod
    def _complete(cls, given: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        """Return a table as it is written with what goes without saying."""
        return given

    @pydantic.model_validator(mode="after")
    def _checked(self) -> "Part":
        self._one_alternative()
        self._check()
        return self

    def _check(self) -> None:
        """Refuse options that do not go together, by a `ValueError`.

        Fill in those that others tell.
        """

    def _one_alternative(self) -> None:
        for groups in self.alternatives:
            given = [
                g for g in groups if any(key in self.model_fields_set for key in g)
            ]
            given = [
                g for g in given if any(getattr(self, key) is not None for key in g)
            ]
            if len(given) > 1:
                keys = [next(k for k in g if k in self.model_fields_set) for g in given]
                raise ValueError(
                    f"give one of {' and '.join(map(repr, keys))}, not both"
                )


class ClosedTable(OptionTable):
    """A table of a campaign file that is no section of a scene: fixed, without unknown keys."""

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
    given: Any = {
        key: text
        for key, text in {"derived": derived, "source": source}.items()
        if text is not None
    }
    return Field(
        default,
        description=meaning,
        json_schema_extra=given,
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
        signs = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
        limits = [
            f"{signs[key]} {limit:g}"
            for key, limit in handler(core).items()
            if key in signs
        ]
        described = {
            "type": "string",
            "kind": kind.name,
            "unit": kind.unit,
            "examples": [kind.example],
        }
        return {**described, "limits": " and ".join(limits)} if limits else described


def unit_within(annotation: Any, metadata: Iterable[Any] = ()) -> Unit | None:
    """Return the mark of a value with a unit: of metadata, of an annotation, or of what that holds."""
    marks = (*metadata, *getattr(annotation, "__metadata__", ()))
    own = next((mark for mark in marks if isinstance(mark, Unit)), None)
    return own or next(
        (unit for inner in get_args(annotation) if (unit := unit_within(inner))), None
    )


def _reader(kind: str) -> Callable[[object], float]:
    return lambda value: (
        float(value) if isinstance(value, Stored) else quantity(value, kind)
    )


def _number(value: object) -> float:
    if not is_number(value):
        raise ValueError(
            f"{value!r} is not a plain number: write it without quotes or unit"
        )
    if not math.isfinite(value):
        raise ValueError(f"{value!r} is not a finite number")
    return float(value)


def _count(value: object) -> int:
    number = _number(value)
    if number != int(number):
        raise ValueError(f"{value!r} is not a whole number")
    return value if type(value) is int else int(number)


def _hours(value: object) -> float:
    return _reader("time")(value) / HOUR if isinstance(value, str) else _number(value)


def measured(kind: str) -> Any:
    """Return the type of a value with a unit, by the name of its kind of quantity."""
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
