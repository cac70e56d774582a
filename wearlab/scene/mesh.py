"""``[mesh]``: contact, excitation and damping."""

import math
from itertools import pairwise
from typing import Annotated, Any, Literal

import numpy as np
import pydantic
from annotated_types import Ge, Le, MinLen

from wearlab import options
from wearlab.gears.sets import PLANETARY
from wearlab.mesh import (
    contacts,
    damping_laws,
    excitations,
    face_couplings,
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
            raise ValueError("torque must ascend: sort it, and the values with it")
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
    def pairs_corners(self) -> bool:
        """Whether contact tells which points of both flanks meet beyond A and E."""
        return bool(self.extended_contact) and self.contact.pairs_corners

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
