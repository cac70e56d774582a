"""The sections of a scene, and what of them stands at a path of the file."""

from functools import cache
from typing import Any, get_args

from pydantic.fields import FieldInfo

from wearlab.options import Part, option
from wearlab.scene.dynamics import Dynamics
from wearlab.scene.gears import ALL_TOOTHED, Gears
from wearlab.scene.materials import Lubricant
from wearlab.scene.mesh import ErrorsSection, MeshSection
from wearlab.scene.numerics import Numerics, StoreSection
from wearlab.scene.operation import Operation
from wearlab.scene.wear import Start, WearSection
from wearlab.slots import Variant


class Sections(Part):
    """The sections of a scene; an absent one is ``None``."""

    gears: Gears = option(..., "shape of the gears")
    operation: Operation = option(..., "how they are driven")
    mesh: MeshSection = option(MeshSection(), "contact, stiffness, excitation and damping")
    errors: ErrorsSection | None = option(None, "prescribed errors", derived="none")
    dynamics: Dynamics | None = option(None, "moving coordinates", derived="quasi-static")
    lubricant: Lubricant | None = option(None, "the oil", derived="dry: no film")
    wear: WearSection | None = option(None, "the wear law and the life", derived="one unworn state")
    numerics: Numerics = option(Numerics(), "accuracy")
    start: Start | None = option(None, "the run whose wear this one goes on from", derived="its own wear")
    store: StoreSection = option(StoreSection(), "what is kept")


Path = tuple[str, ...]
MEMBERS = ALL_TOOTHED


def parts_in(annotation: Any) -> tuple[type[Part], ...]:
    """Return every kind of part that an annotation allows, however deeply it is nested."""
    if isinstance(annotation, type) and issubclass(annotation, Variant) and annotation.is_slot():
        return tuple(annotation.slot.variants.values())
    if isinstance(annotation, type) and issubclass(annotation, Part):
        return (annotation,)
    return tuple(part for argument in get_args(annotation) for part in parts_in(argument))


@cache
def parts_at(path: Path) -> tuple[type[Part], ...]:
    """Return the parts that may stand at a path; none where a plain value or nothing stands."""
    if not path:
        return (Sections,)
    parts: list[type[Part]] = []
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
    if field is None or chooser is None or not isinstance(field.default, Part):
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
