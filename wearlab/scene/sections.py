"""The sections of a scene, and what of them stands at a path of the file."""

from functools import cache
from typing import Annotated, Any, get_args

from pydantic import BeforeValidator, ValidationInfo
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from wearlab import options, slots
from wearlab.dynamics.models import DynamicModel
from wearlab.options import named
from wearlab.scene.gears import ALL_TOOTHED, Gears, set_in
from wearlab.scene.materials import Lubricant
from wearlab.scene.mesh import ErrorsSection, MeshSection
from wearlab.scene.numerics import Numerics, StoreSection
from wearlab.scene.operation import Operation
from wearlab.scene.rating import Rating
from wearlab.scene.wear import Start, WearSection


def _of_the_set(value: Any, info: ValidationInfo) -> Any:
    """Refuse a model of another kind of gear set before what that model requires is missed."""
    kind = set_in(info.context).kind
    model = value.get("model") if isinstance(value, dict) else value
    variants = DynamicModel.slot.variants
    chosen = variants.get(model) if isinstance(model, str) else None
    if chosen is not None and kind and kind not in _kinds(chosen):
        own = [name for name, variant in variants.items() if kind in _kinds(variant)]
        raise PydanticCustomError(
            "not_of_the_set", "{model} does not belong to gears of kind {kind}; give {own}",
            {"model": repr(model), "kind": repr(kind), "own": " or ".join(map(repr, own))},
        )  # fmt: skip
    return value


def _kinds(model: Any) -> tuple[str, ...]:
    kinds: tuple[str, ...] = model.kinds
    return kinds


Dynamics = Annotated[DynamicModel, *named(), BeforeValidator(_of_the_set)]


class Sections(options.Part):
    """The sections of a scene; an absent one is ``None``."""

    gears: Gears = options.option(..., "shape of the gears")
    operation: Operation = options.option(..., "how they are driven")
    mesh: MeshSection = options.option(MeshSection(), "contact, stiffness, excitation and damping")
    errors: ErrorsSection | None = options.option(None, "prescribed errors", derived="none")
    dynamics: Dynamics | None = options.option(None, "moving coordinates", derived="quasi-static")
    lubricant: Lubricant | None = options.option(None, "the oil", derived="dry: no film")
    wear: WearSection | None = options.option(None, "the wear law and the life", derived="one unworn state")
    numerics: Numerics = options.option(Numerics(), "accuracy")
    start: Start | None = options.option(
        None, "the run whose wear this one goes on from", derived="its own wear"
    )
    rating: Rating | None = options.option(
        None, "what ISO 6336 says of a pair, beside what is computed", derived="nothing is rated"
    )
    store: StoreSection = options.option(StoreSection(), "what is kept")


Path = tuple[str, ...]
MEMBERS = ALL_TOOTHED


def parts_in(annotation: Any) -> tuple[type[options.Part], ...]:
    """Return every kind of part that an annotation allows, however deeply it is nested."""
    if isinstance(annotation, type) and issubclass(annotation, slots.Variant) and annotation.is_slot():
        return tuple(annotation.slot.variants.values())
    if isinstance(annotation, type) and issubclass(annotation, options.Part):
        return (annotation,)
    return tuple(part for argument in get_args(annotation) for part in parts_in(argument))


@cache
def parts_at(path: Path) -> tuple[type[options.Part], ...]:
    """Return the parts that may stand at a path; none where a plain value or nothing stands."""
    if not path:
        return (Sections,)
    parts: list[type[options.Part]] = []
    for part in parts_at(path[:-1]):
        if path[-1] in part.model_fields:
            parts += parts_in(part.model_fields[path[-1]].annotation)
        elif part.per_member and path[-1] in MEMBERS:
            parts.append(part)
    return tuple(dict.fromkeys(parts))


@cache
def field_at(path: Path) -> FieldInfo | None:
    """Return the first field declared for a path, None when no part has such a key."""
    return next((p.model_fields[path[-1]] for p in parts_at(path[:-1]) if path[-1] in p.model_fields), None)


@cache
def chooser_at(path: Path) -> str | None:
    """Return the key that chooses among the parts at a path, None where there is no choice."""
    return next((part.chooser for part in parts_at(path) if part.chooser in part.model_fields), None)


@cache
def default_choice(path: Path) -> str | None:
    """Return what a choice without its chooser means, None where it must be written."""
    field, chooser = field_at(path), chooser_at(path)
    if field is None or chooser is None or not isinstance(field.default, options.Part):
        return None
    return str(getattr(field.default, chooser))


def choice_of(path: Path, table: dict[str, Any]) -> str | None:
    """Return what a table at a path chooses: as written, as its options imply, or by default."""
    chooser = chooser_at(path)
    if chooser is None or chooser in table:
        return None if chooser is None else table[chooser]
    for part in parts_at(path):
        if part.implied_by.intersection(table) and chooser in part.model_fields:
            return str(get_args(part.model_fields[chooser].annotation)[0])
    return default_choice(path)


@cache
def keys_at(path: Path) -> tuple[str, ...]:
    """Return every key that some part at a path understands."""
    parts = parts_at(path)
    members = MEMBERS if any(part.per_member for part in parts) else ()
    return tuple(dict.fromkeys([key for part in parts for key in part.model_fields] + list(members)))


@cache
def nearest_place(key: str) -> Path | None:
    """Return the path nearest to the root of a scene at which a key stands, None if it stands nowhere."""
    level: list[Path] = [()]
    while level:
        below = [(*path, name) for path in level for part in parts_at(path) for name in part.model_fields]
        nearest = next((path for path in below if path[-1] == key), None)
        if nearest is not None:
            return nearest
        level = list(dict.fromkeys(path for path in below if parts_at(path)))
    return None


def forget() -> None:
    """Forget which parts there are: plug-ins have brought others."""
    for known in (parts_at, field_at, chooser_at, default_choice, keys_at, nearest_place):
        known.cache_clear()
