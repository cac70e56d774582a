"""The sections of a scene, and what of them stands at a path of the file.

``[numerics]``: one tolerance, and what may override what follows from it.

``[rating]``: what ISO 6336 says of the pair, beside what is computed.
"""

from collections.abc import Iterator
from functools import cache
from itertools import accumulate
from operator import mul
from typing import Annotated, Any, ClassVar, get_args

from annotated_types import Ge, Le, Lt
from pydantic.fields import FieldInfo

from wearlab import options, slots
from wearlab.scene.errors import ErrorsSection
from wearlab.scene.gears import ALL_TOOTHED, LEAD_KEYS, Gears
from wearlab.scene.materials import Lubricant
from wearlab.scene.mesh import MeshSection, OneMesh
from wearlab.scene.operation import BACK, Dynamics, Operation
from wearlab.scene.start import Start
from wearlab.scene.stored_variables import StoreSection
from wearlab.scene.wear import WearSection
from wearlab.thermal.models import ThermalModel

STIFFNESS, PITTING = "ISO 6336-1", "ISO 6336-2"


class Rating(options.Part):
    """Rating of the pair: stiffness and K_Hβ by ISO 6336-1, S_H by ISO 6336-2.

    Nothing else asks for it.
    """

    of_pitting: ClassVar[tuple[str, ...]] = (
        "allowable_contact_stress",
        "viscosity_40",
        "hours",
    )
    """What S_H takes, besides roughnesses and a misalignment."""

    body_factor: Annotated[options.Number, options.POSITIVE, Le(1.0)] = 1.0
    """C_R, 1 for solid bodies. Source: ISO 6336-1"""
    equivalent_misalignment: Annotated[options.Depth, options.NOT_NEGATIVE] | None = (
        None
    )
    """F_βx before running-in, which the face load factor is for [mesh.misalignment,
    else no face load factor]. Source: ISO 6336-1"""
    running_in: Annotated[options.Number, options.NOT_NEGATIVE, Le(1.0)] = 0.15
    """share of it that runs in, y_β/F_βx; 0.15 of case-hardened gears. Source: ISO
    6336-1"""
    application_factor: Annotated[options.Number, options.POSITIVE] = 1.0
    """K_A K_v on the load of the face load factor. Source: ISO 6336-1"""
    allowable_contact_stress: Annotated[options.Pressure, options.POSITIVE] | None = (
        None
    )
    """σ_Hlim of both gears, such as '1500 MPa', for the safety against pitting [no
    safety against pitting]. Source: ISO 6336-2"""
    viscosity_40: Annotated[options.KinematicViscosity, options.POSITIVE] | None = None
    """kinematic viscosity of the oil at 40 °C, for it. Source: ISO 6336-2"""
    hours: Annotated[options.Hours, options.POSITIVE] | None = None
    """life wanted of it. Source: ISO 6336-2"""
    transverse_load_factor: Annotated[options.Number, options.POSITIVE] = 1.0
    """K_Hα on the contact stress. Source: ISO 6336-2"""
    load_cycles: Annotated[options.Number, options.POSITIVE] | None = None
    """turns of the pinion for mean wear and root strength of plastics, with [thermal]
    [those of wear.until]. Source: VDI 2736-2"""
    root_form_factors: (
        tuple[
            Annotated[options.Number, options.POSITIVE],
            Annotated[options.Number, options.POSITIVE],
        ]
        | None
    ) = None
    """Y_Fa Y_Sa of pinion and gear, for the stress of plastic roots, with [thermal] [no
    root stress]. Source: VDI 2736-2"""


MOST = 1_000_000  # points; a state of the wear would take gigabytes


FINEST = 1e-10
"""Smallest tolerance: round-off of a life of a thousand steps, each of a thousand
nodes."""
Tolerance = Annotated[options.Number, Ge(FINEST), Lt(1.0)]


class Numerics(options.Part):
    """How accurate a run is."""

    tolerance: Tolerance = 1e-3
    """relative error in wear depth and life. Source: wearlab"""
    steps_per_period: Annotated[options.Count, Ge(4), Le(MOST)] | None = None
    """integration steps in a mesh period [from the tolerance]"""
    phase_points: Annotated[options.Count, Ge(8), Le(MOST)] | None = None
    """stored phases of a mesh period [from the tolerance]"""
    profile_points: Annotated[options.Count, Ge(9), Le(MOST)] | None = None
    """nodes on the path of contact [from the tolerance]"""
    cycle_tolerance: Tolerance | None = None
    """relative error of the steps over cycles [from the tolerance]"""
    most_right_hand_sides: Annotated[options.Number, Ge(1.0)] | None = None
    """right-hand sides after which a life ends where it is, to be gone on from; more
    than derived allow a longer search for other attractors, too [from the tolerance and
    the coordinates: minutes of work]"""


KEYS_OF_A_FACE = ("misalignment", "face_coupling", "face_points")
"""Options of a mesh that give a scene a face."""


class Sections(options.Part):
    """The sections of a scene; an absent one is ``None``."""

    gears: Gears
    """shape of the gears"""
    operation: Operation
    """how they are driven"""
    mesh: MeshSection = MeshSection()
    """contact, stiffness, excitation and damping"""
    errors: ErrorsSection | None = None
    """prescribed errors"""
    dynamics: Dynamics | None = None
    """moving coordinates [quasi-static]"""
    lubricant: Lubricant | None = None
    """the oil [dry: no film]"""
    wear: WearSection | None = None
    """the wear law and the life [one unworn state]"""
    thermal: ThermalModel | None = None
    """how warm friction makes the teeth [all as warm as their constants hold]"""
    numerics: Numerics = Numerics()
    """accuracy"""
    start: Start | None = None
    """the run whose wear this one goes on from [its own wear]"""
    rating: Rating | None = None
    """what ISO 6336 says of a pair, beside what is computed [nothing is rated]"""
    store: StoreSection = StoreSection()
    """what is kept"""

    @property
    def meshes(self) -> dict[str, OneMesh]:
        """What holds for each kind of mesh, by the path of the table that says it."""
        return {
            f"mesh.{table}".rstrip("."): self.mesh.of(table)
            for table in self.gears.descriptor.sections
        }

    @property
    def coefficients(self) -> dict[str, Any]:
        """The wear coefficient of every member with teeth, none where nothing wears."""
        if self.wear is None or self.wear.coefficient is None:
            return {}
        return {
            member: self.wear.coefficient_of(member) for member in self.gears.toothed
        }

    @property
    def prescribed(self) -> ErrorsSection:
        """The prescribed errors; those of a scene without ``[errors]`` are zero."""
        return self.errors or ErrorsSection()

    def initial_of(self, flank: str) -> Any:
        """Return the wear that a flank starts with, None of a new one.

        Back flanks start as the front ones do where both sides were worn.
        """
        if flank.endswith(BACK):
            front = self.initial_of(flank.removesuffix(BACK))
            return front if front is not None and front.thins_teeth else None
        return None if self.wear is None else self.wear.initial_of(flank)

    @property
    def wears_beyond(self) -> bool:
        """Whether pairs beyond A and E wear flanks: as stated, or as it is usual."""
        if self.wear is None or self.wear.beyond_path is None:
            return self.usually_wears_beyond
        return self.wear.beyond_path

    @property
    def usually_wears_beyond(self) -> bool:
        """Whether pairs beyond A and E wear flanks where nobody says: warm ones do."""
        return (
            self.wear is not None
            and self.thermal is not None
            and self.wear.load.tells_pairs
            and all(mesh.pairs_corners for mesh in self.meshes.values())
        )

    @property
    def face_keys(self) -> tuple[str, ...]:
        """The keys by which the flanks have a width, () where they have none."""
        keys = [] if self.gears.helix_angle is None else ["gears.helix_angle"]
        places: list[Any] = [
            (f"gears.{name}", gear, LEAD_KEYS)
            for name, gear in self.gears.gears().items()
        ]
        places += [(path, mesh, KEYS_OF_A_FACE) for path, mesh in self.meshes.items()]
        keys += [
            f"{path}.{key}"
            for path, part, keys_of_face in places
            for key in keys_of_face
            if getattr(part, key) is not None
        ]
        return tuple(keys)

    def hands(self) -> dict[str, str]:
        """Return the hand of each helical gear: as stated, or as its mate requires.

        Where none is said the driving gear is right-handed, of a planetary set the sun.
        """
        gears = self.gears.gears()
        chain = list(gears)  # each meshes with the one before it
        turns = accumulate(
            (1 if name == "ring" else -1 for name in chain[1:]), mul, initial=1
        )
        turns_alike = dict(zip(chain, turns, strict=True))
        first = str(self.operation.input) if self.gears.descriptor.is_pair else chain[0]
        with_hand = [name for name in (first, *chain) if gears[name].hand is not None]
        stated, hand = (
            (with_hand[0], gears[with_hand[0]].hand) if with_hand else (first, "right")
        )
        opposite = {"left": "right", "right": "left"}[str(hand)]
        derived = {
            name: str(hand) if turns_alike[name] == turns_alike[stated] else opposite
            for name in chain
        }
        return {name: gears[name].hand or derived[name] for name in chain}

    def identifying(self) -> dict[str, Any]:
        """Return the sections of the identity, with the default coupling along a face.

        The coupling of solid teeth was another once: a run of then is none of now. Nor
        is one of helical teeth that are not solid, of the time when these did not bend
        as oblique ones. Wear beyond the path is none where it is as usual.
        """
        sections = super().identifying()
        if self.wear is not None and self.wear.beyond_path == self.usually_wears_beyond:
            sections["wear"] = self.wear.model_copy(update={"beyond_path": None})
        if not self.face_keys:
            return sections
        solid = {
            path: mesh
            for path, mesh in self.meshes.items()
            if mesh.coupling.of_elements
        }
        with_coupling = {
            path: mesh.model_copy(update={"face_coupling": mesh.coupling})
            for path, mesh in solid.items()
        }
        general = with_coupling.pop("mesh", self.mesh)
        of_kinds = {
            path.removeprefix("mesh."): mesh for path, mesh in with_coupling.items()
        }
        sections["mesh"] = general.model_copy(update=of_kinds)
        oblique = bool(self.gears.helix_angle) and any(
            mesh.by_sections for mesh in self.meshes.values()
        )
        return sections | ({"oblique": True} if oblique else {})


Path = tuple[str, ...]
MEMBERS = ALL_TOOTHED


def parts_in(annotation: Any) -> tuple[type[options.Part], ...]:
    """Return the classes of parts that an annotation allows, also nested ones."""
    if (
        isinstance(annotation, type)
        and issubclass(annotation, slots.Variant)
        and annotation.is_slot()
    ):
        return tuple(annotation.slot.variants.values())
    if isinstance(annotation, type) and issubclass(annotation, options.Part):
        return (annotation,)
    return tuple(
        part for argument in get_args(annotation) for part in parts_in(argument)
    )


def parts_within(value: Any) -> Iterator[slots.Variant]:
    """Yield every variant that stands anywhere in a part.

    Parameters
    ----------
    value : a part, a table of parts, or a plain value
    """
    if isinstance(value, slots.Variant):
        yield value
    if isinstance(value, options.Part):
        yield from (part for _, option in value for part in parts_within(option))
    elif isinstance(value, dict):
        yield from (part for inner in value.values() for part in parts_within(inner))


@cache
def parts_at(path: Path) -> tuple[type[options.Part], ...]:
    """Return the parts that may stand at a path.

    None where a plain value or nothing stands.
    """
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
    return next(
        (
            p.model_fields[path[-1]]
            for p in parts_at(path[:-1])
            if path[-1] in p.model_fields
        ),
        None,
    )


@cache
def chooser_at(path: Path) -> str | None:
    """Return the key that chooses among the parts at a path, None without a choice."""
    return next(
        (part.chooser for part in parts_at(path) if part.chooser in part.model_fields),
        None,
    )


def choice_of(path: Path, table: dict[str, Any]) -> str | None:
    """Return what a table chooses: as written, as its options imply, or by default.

    None where a choice must be written, and is not.
    """
    chooser = chooser_at(path)
    if chooser is None or chooser in table:
        return None if chooser is None else table[chooser]
    for part in parts_at(path):
        if part.implied_by.intersection(table) and chooser in part.model_fields:
            return str(get_args(part.model_fields[chooser].annotation)[0])
    default = getattr(field_at(path), "default", None)
    return str(getattr(default, chooser)) if isinstance(default, options.Part) else None


def nearest_place(key: str) -> Path | None:
    """Return the path of a key nearest to the root of a scene, None without one."""
    return next(iter(places_ending((key,))), None)


@cache
def places_ending(words: Path) -> tuple[Path, ...]:
    """Return the paths of a scene that end in some words, nearest to the root.

    Parameters
    ----------
    words : last ones of a path
    """
    level: list[Path] = [()]
    while level:
        below = [
            (*path, name)
            for path in level
            for part in parts_at(path)
            for name in part.model_fields
        ]
        found = [path for path in below if path[-len(words) :] == words]
        if found:
            return tuple(dict.fromkeys(found))
        level = list(dict.fromkeys(path for path in below if parts_at(path)))
    return ()


def forget() -> None:
    """Forget which parts there are: plug-ins have brought others."""
    for cached in (parts_at, field_at, chooser_at, places_ending):
        cached.cache_clear()
