"""``[mesh]``: contact, excitation and damping.

``[errors]``: prescribed errors of gears and mesh.
"""

import math
import re
from itertools import pairwise
from typing import Annotated, Any, Literal

import numpy as np
import pydantic
from annotated_types import Ge, Le, MinLen

from wearlab import options
from wearlab.gears.sets import PLANETARY, UNSAID
from wearlab.mesh import (
    contacts,
    damping_laws,
    excitations,
    face_couplings,
    slow_errors,
    stiffnesses,
)
from wearlab.scene import gears, identity

Several = Annotated[tuple[options.Depth, ...], MinLen(1)]


class Misalignment(options.Part):
    """How far unloaded flanks of a mesh open from one end of the face to the other."""

    alternatives = ((("value",), ("in_plane", "out_of_plane")),)

    value: Several | None = None
    """F_βy over the face, in the plane of action; with torque one for each [from the
    axes]. Source: ISO 6336-1"""
    in_plane: Several | None = None
    """deviation of the axes f_Σδ over the face, in their common plane. Source: ISO/TR
    10064-3"""
    out_of_plane: Several | None = None
    """deviation of the axes f_Σβ over the face, across that plane. Source: ISO/TR
    10064-3"""
    torque: tuple[Annotated[options.Torque, options.NOT_NEGATIVE], ...] | None = None
    """torques of the input at which it is given, straight between: shafts bend; held
    beyond [the same under all]. Source: wearlab"""

    @classmethod
    def _complete(
        cls, table: dict[str, Any], info: pydantic.ValidationInfo
    ) -> dict[str, Any]:
        single = {
            key: value
            for key, value in table.items()
            if not isinstance(value, list | tuple)
        }
        return {
            **table,
            **{key: [value] for key, value in single.items() if value is not None},
        }

    def _check(self) -> None:
        keys = [
            key
            for key in ("value", "in_plane", "out_of_plane")
            if getattr(self, key) is not None
        ]
        if not keys:
            raise ValueError(
                "give a length such as '20 um', value, or in_plane and out_of_plane"
            )
        if any(low >= high for low, high in pairwise(self.torque or ())):
            raise ValueError("torque must ascend")
        expected = len(self.torque or (0.0,))
        for key in keys:
            count = len(getattr(self, key))
            if count != expected:
                raise ValueError(
                    f"{key} has {count} values and needs {expected}: one for each "
                    "torque, or one"
                )

    def over_face(self, working_pressure_angle: float, torque: float) -> float:
        """Return F_βy = ``f_Σβ cos α_wt + f_Σδ sin α_wt`` at a torque [m].

        Parameters
        ----------
        working_pressure_angle : α_wt [rad]
        torque : of the input [N·m]
        """
        across = np.array(self.out_of_plane or (0.0,))
        along = np.array(self.in_plane or (0.0,))
        of_axes = across * math.cos(working_pressure_angle) + along * math.sin(
            working_pressure_angle
        )
        return float(np.interp(torque, self.torque or (0.0,), self.value or of_axes))


class OneMesh(options.Part):
    """A mesh of two gears."""

    alternatives = ((("damping",), ("damping_ratio",)),)

    stiffness: stiffnesses.StiffnessModel = stiffnesses.StiffnessModel.named()
    """stiffness of a tooth pair"""
    contact: contacts.ContactModel = contacts.ContactModel.named()
    """how worn flanks touch"""
    extended_contact: options.Switch = options.option(None)
    """let tip corners touch beyond A and E, so that pairs engage and leave gradually
    under load; without, a pair takes up its share at A at once [true, but for Algorithm
    1 and a stiffness of the whole mesh, which know no tip corners]. Source: Munro,
    Morrish & Palmer 1999; finite elements: docs/model_error.md"""
    excitation: excitations.ExcitationModel = excitations.ExcitationModel.named()
    """how the mesh force reaches the dynamics"""
    normal_backlash: Annotated[options.Depth, options.NOT_NEGATIVE] | None = None
    """backlash j_bn normal to the flanks, of helical gears j_bn/cos β_b along the line
    of action: back contact begins where drive contact ends at 0 [what shifts, centre
    distance and tooth_thickness_allowance leave, where they leave any; else the back
    flank is not modelled, separation still is]. Source: L16 Eq. 6, recentred; ISO
    21771:2007, 5.5"""
    damping_ratio: Annotated[options.Number, options.NOT_NEGATIVE] | None = None
    """damping ratio on mean stiffness and effective mass of the mesh; this or damping
    with dynamics [damping]"""
    damping: Annotated[options.DampingRate, options.NOT_NEGATIVE] | None = None
    """mesh damping c_m; this or damping_ratio with dynamics [damping_ratio]. Source:
    L16 Table 1"""
    damping_in: Literal["contact", "always"] = "contact"
    """when the damping acts: while flanks touch, or always as in the papers. Source:
    wearlab"""
    damping_law: damping_laws.DampingLaw = damping_laws.DampingLaw.named()
    """how the mesh loses energy, in contact and out of it. Source: wearlab"""

    face_load_factor: Annotated[options.Number, Ge(1)] = 1.0
    """load per width where the face carries most, over its mean, K_Hβ; of flanks
    without a width. Source: ISO 6336-1"""
    misalignment: Annotated[
        Misalignment | None, gears.alone(Misalignment, options.Depth, "value")
    ] = None
    """by how much the flanks open from the end of negative face_position to that of
    positive one [aligned]. Source: ISO 6336-1"""
    face_coupling: face_couplings.FaceCouplingModel | None = None
    """how the slices of a tooth hold each other along the face [elements with
    finite-element stiffness; none where it is prescribed; else pasternak]. Source: Ajmi
    & Velex 2005"""
    face_points: Annotated[options.Count, Ge(3), Le(401)] | None = None
    """slices across the face; of helical gears about as many, on the lattice of the
    nodes [41, by the tolerance]. Source: wearlab"""

    def _check(self) -> None:
        """Let contact reach beyond A and E wherever pairs and corners are known."""
        if self.extended_contact is None:
            object.__setattr__(self, "extended_contact", self._corners_known)

    @property
    def damps_always(self) -> bool:
        """Whether the mesh damps in separation too."""
        return self.damping_in == "always"

    @property
    def coupling(self) -> face_couplings.FaceCouplingModel:
        """How the slices of a face hold each other: as stated, or by their stiffness.

        As solid teeth with finite elements, apart where the stiffness is prescribed,
        else in shear.
        """
        if self.face_coupling is not None:
            return self.face_coupling
        return face_couplings.FaceCouplingModel.named(self.stiffness.usual_coupling)

    @property
    def by_sections(self) -> bool:
        """Whether slices yield by their sections, not as solid teeth nor as given."""
        return not (self.coupling.of_elements or self.stiffness.prescribed)

    @property
    def _corners_known(self) -> bool:
        return not self.stiffness.of_mesh and self.contact.tip_corners

    def identifying(self) -> dict[str, Any]:
        """Return the options of the identity; a derived contact onset is none."""
        by_itself = self.extended_contact == self._corners_known
        return super().identifying() | ({"extended_contact": None} if by_itself else {})


OWN_MESHES = PLANETARY.sections


class MeshSection(OneMesh):
    """The meshes of a gear set: options of all, and tables of one kind of mesh."""

    sun_planet: OneMesh | None = None
    """what holds for sun and planets alone [as above]"""
    planet_ring: OneMesh | None = None
    """what holds for planets and ring alone [as above]"""

    def of(self, section: str) -> OneMesh:
        """Return what holds for one kind of mesh.

        ``section`` names its own table, "" for a pair.
        """
        table: OneMesh | None = getattr(self, section) if section else None
        return self if table is None else table

    def _each(self) -> dict[str, OneMesh]:
        """Return what holds for each kind of mesh, wherever it was written.

        {}: nothing of its own.
        """
        if self.sun_planet is None and self.planet_ring is None:
            return {}
        general = OneMesh.model_construct(
            **{name: getattr(self, name) for name in OneMesh.model_fields}
        )
        return {key: getattr(self, key) or general for key in OWN_MESHES}

    def identifying(self) -> dict[str, Any]:
        """Return the options of each kind of mesh, once where both have the same."""
        kinds: dict[str, Any] = self._each()
        if len({identity.canonical(mesh.model_dump()) for mesh in kinds.values()}) == 1:
            return kinds[OWN_MESHES[0]].identifying()
        return kinds or super().identifying()

    @pydantic.model_serializer(mode="wrap")
    def _what_holds(
        self, dump: pydantic.SerializerFunctionWrapHandler
    ) -> dict[str, Any]:
        """Dump the options of each kind of mesh, once where both have the same."""
        if not (
            kinds := {key: mesh.model_dump() for key, mesh in self._each().items()}
        ):
            written: dict[str, Any] = dump(self)
            return written
        first = kinds[OWN_MESHES[0]]
        text = [
            {key: identity.canonical({"": mesh}) for key, mesh in kind.items()}
            for kind in kinds.values()
        ]
        shared = dict(text[0].items() & text[1].items())
        if len(shared) == len(first):
            return first
        return {
            **OneMesh().model_dump(),
            **{key: first[key] for key in shared},
            **kinds,
        }


def _listed(value: object) -> object:
    return [value] if isinstance(value, str) else value


Grade = Annotated[options.Count, options.NOT_NEGATIVE, Le(12)]
Tolerances = Annotated[
    tuple[Annotated[options.Depth, options.NOT_NEGATIVE], ...],
    pydantic.BeforeValidator(_listed),
]
"""One tolerance or several, each in a direction of its own [m]."""


class MemberErrors(options.Part):
    """Manufacturing and installation errors of a gear, 1 and z times a revolution."""

    iso_1328_class: Grade | None = None
    """accuracy class whose allowed F_i′ and f_i′ stand where none are given; seed draws
    their angles [the set's]. Source: ISO 1328-1:1995"""
    total_composite: Annotated[options.Depth, options.NOT_NEGATIVE] = 0.0
    """tangential composite deviation F_i′. Source: ISO 1328-1, W23 Eq. 28"""
    tooth_composite: Annotated[options.Depth, options.NOT_NEGATIVE] = 0.0
    """tooth-to-tooth tangential composite deviation f_i′. Source: ISO 1328-1, W23 Eq.
    28"""
    composite: Literal["runout", "pitch"] = "runout"
    """what the once-per-revolution part of F_i′ comes from: a toothing whose axis runs
    out, or pitches that add up over the teeth; of a planet, runout comes to its two
    meshes α_s + α_r apart, pitch together. Source: ISO/TR 10064-1, eccentricity"""
    installation: Tolerances = ()
    """installation tolerances Δe_q, each in a random direction. Source: W23 Eq. 30"""


class PlanetErrors(MemberErrors):
    """Errors of every planet, each with angles of its own."""

    planet_position: Tolerances = ()
    """tolerances of the planets' pins, each in a fixed random direction of the carrier.
    Source: W23"""


class CarrierErrors(options.Part):
    """Errors of the carrier."""

    installation: Tolerances = ()
    """installation tolerances of the carrier, each in a random direction. Source: W23
    Eq. 30"""
    planet_position: Tolerances = ()
    """tolerances of the pins, each in a fixed random direction of the carrier. Source:
    W23 Eq. 30"""


class ErrorHarmonic(options.Part):
    """A prescribed error of a mesh, ``amplitude sin(2π order φ + phase)``."""

    mesh: str = options.option(None)
    """the mesh it acts in, such as 'sun-planet-2'; 'sun-planet' names all of its kind
    [the mesh of a pair]"""
    order: Annotated[options.Count, options.POSITIVE]
    """multiple of the mesh frequency"""
    amplitude: Annotated[options.Depth, options.NOT_NEGATIVE]
    """amplitude along the line of action. Source: L16 Eq. 8"""
    phase: options.Angle = 0.0
    """phase angle at mesh phase 0. Source: L16 Eq. 8"""

    @classmethod
    def _complete(
        cls, table: dict[str, Any], info: pydantic.ValidationInfo
    ) -> dict[str, Any]:
        """Fill in the mesh of a pair.

        A planetary set must say which, and hears so at that key.
        """
        meshes = gears.set_in(info.context).meshes
        return {"mesh": meshes[0] if len(meshes) == 1 else None, **table}

    @pydantic.field_validator("mesh", mode="before")
    @classmethod
    def _known_mesh(cls, mesh: Any, info: pydantic.ValidationInfo) -> Any:
        meshes = gears.set_in(info.context).meshes
        if isinstance(mesh, str) and any(
            re.fullmatch(rf"{name}(-[1-9][0-9]*)?", mesh) for name in meshes
        ):
            return mesh
        if mesh is None:
            raise ValueError(
                f"required: {' or '.join(map(repr, meshes))}, or one of them by its "
                "number"
            )
        raise ValueError(
            f"{mesh!r} is no mesh of this gear set; there are {', '.join(meshes)}"
        )


class ErrorsSection(options.Part):
    """Errors of the mesh besides wear."""

    seed: Annotated[options.Count, options.NOT_NEGATIVE] = 0
    """seed of the initial angles, drawn once. Source: wearlab"""
    slow: slow_errors.SlowErrorModel = slow_errors.SlowErrorModel.named()
    """once-per-revolution parts: quadrature over member angles, one drawn angle, or the
    full period. Source: wearlab"""
    iso_1328_class: Grade | None = None
    """accuracy class whose allowed F_i′ and f_i′ stand where none are given; seed draws
    their angles. Source: ISO 1328-1:1995"""
    pinion: MemberErrors | None = None
    """errors of the pinion"""
    gear: MemberErrors | None = None
    """errors of the gear"""
    sun: MemberErrors | None = None
    """errors of the sun"""
    planet: PlanetErrors | None = None
    """errors of every planet"""
    ring: MemberErrors | None = None
    """errors of the ring"""
    carrier: CarrierErrors | None = None
    """errors of the carrier"""
    harmonic: tuple[ErrorHarmonic, ...] = ()
    """prescribed errors of the mesh frequency"""

    @pydantic.field_validator(
        "pinion", "gear", "sun", "planet", "ring", "carrier", mode="before"
    )
    @classmethod
    def _of_the_set(cls, value: Any, info: pydantic.ValidationInfo) -> Any:
        gear_set = gears.set_in(info.context)
        members = (
            *gear_set.toothed,
            *(name for name in gear_set.members if name not in gear_set.toothed),
        )
        if value is None or info.field_name in members:
            return value
        raise ValueError(f"no member of this gear set; there are {', '.join(members)}")

    @property
    def members(self) -> dict[str, MemberErrors | CarrierErrors]:
        """Errors of the members that have any, by name."""
        errors_of = {name: getattr(self, name) for name in UNSAID.members}
        return {
            name: errors for name, errors in errors_of.items() if errors is not None
        }
