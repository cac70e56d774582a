"""``[mesh]``: contact, excitation and damping of the mesh."""

from typing import Annotated, Any, ClassVar, Literal

from annotated_types import Ge
from pydantic import SerializerFunctionWrapHandler, model_serializer, model_validator

from wearlab.gears.sets import PLANETARY, SETS
from wearlab.mesh.contacts import ContactModel, DisplacementContact
from wearlab.mesh.excitations import ExcitationModel
from wearlab.mesh.excitations.pairs import PairsExcitation
from wearlab.mesh.stiffnesses import FiniteElementStiffness, StiffnessModel
from wearlab.options import (
    NOT_NEGATIVE,
    Alternatives,
    DampingRate,
    Depth,
    Number,
    Part,
    Switch,
    named,
    option,
)
from wearlab.scene.identity import canonical
from wearlab.slots import implied

Stiffness = Annotated[StiffnessModel, *named("finite-element"), implied(StiffnessModel)]
Contact = Annotated[ContactModel, *named("displacement")]
Excitation = Annotated[ExcitationModel, *named("pairs")]


class OneMesh(Part):
    """A mesh of two gears."""

    alternatives: ClassVar[Alternatives] = ((("damping",), ("damping_ratio",)),)

    stiffness: Stiffness = option(FiniteElementStiffness(), "stiffness of a tooth pair")
    contact: Contact = option(DisplacementContact(), "how worn flanks touch")
    extended_contact: Switch = option(
        None,
        "let tip corners touch beyond A and E, so that pairs engage and leave gradually under load; without, "
        "a pair takes up its share at A at once",
        derived="true, but for Algorithm 1 and a stiffness of the whole mesh, which know no tip corners",
        source="Munro, Morrish & Palmer 1999; finite elements: docs/model_error.md",
    )
    excitation: Excitation = option(PairsExcitation(), "how the mesh force reaches the dynamics")
    normal_backlash: Annotated[Depth, NOT_NEGATIVE] | None = option(
        None,
        "backlash j_bn along the line of action: back contact begins where drive contact ends at 0",
        derived="the back flank is not modelled, separation still is",
        source="L16 Eq. 6, recentred",
    )
    damping_ratio: Annotated[Number, NOT_NEGATIVE] | None = option(
        None,
        "damping ratio on mean stiffness and effective mass of the mesh; this or damping with dynamics",
        derived="damping",
    )
    damping: Annotated[DampingRate, NOT_NEGATIVE] | None = option(
        None,
        "mesh damping c_m; this or damping_ratio with dynamics",
        derived="damping_ratio",
        source="L16 Table 1",
    )
    damping_in: Literal["contact", "always"] = option(
        "contact",
        "when the damping acts: while flanks touch, or always as in the papers",
        source="wearlab",
    )

    face_load_factor: Annotated[Number, Ge(1)] = option(
        1.0, "load per width where the face carries most, over its mean, K_Hβ", source="ISO 6336-1"
    )

    @model_validator(mode="after")
    def _contact_onset(self) -> "OneMesh":
        """Let contact reach beyond A and E wherever pairs and corners are known."""
        if self.extended_contact is None:
            object.__setattr__(self, "extended_contact", self._corners_known)
        return self

    @property
    def damps_always(self) -> bool:
        """Whether the mesh damps in separation too."""
        return self.damping_in == "always"

    @property
    def _corners_known(self) -> bool:
        return not self.stiffness.of_mesh and self.contact.tip_corners

    def identifying(self) -> dict[str, Any]:
        """Return the options that tell this part from others: not an onset of contact that goes by itself."""
        identity = super().identifying()
        return (
            identity | {"extended_contact": None}
            if self.extended_contact == self._corners_known
            else identity
        )


OWN_MESHES = PLANETARY.sections


class MeshSection(OneMesh):
    """The meshes of a gear set: what all have in common, and what one kind has of its own."""

    sun_planet: OneMesh | None = option(None, "what holds for sun and planets alone", derived="as above")
    planet_ring: OneMesh | None = option(None, "what holds for planets and ring alone", derived="as above")

    def of(self, section: str) -> OneMesh:
        """Return what holds for one kind of mesh; ``section`` names its own table, "" for a pair."""
        own: OneMesh | None = getattr(self, section) if section else None
        return self if own is None else own

    def each(self, kind: str) -> "tuple[OneMesh, ...]":
        """Return what holds for each kind of mesh of a kind of gear set, in their order."""
        return tuple(map(self.of, SETS[kind].sections))

    def identifying(self) -> dict[str, Any]:
        """Return what holds for each kind of mesh, wherever it was written: once if the same for both."""
        if self.sun_planet is None and self.planet_ring is None:
            return super().identifying()
        names = OneMesh.model_fields
        general = OneMesh.model_construct(**{name: getattr(self, name) for name in names})
        each = {key: getattr(self, key) or general for key in OWN_MESHES}
        if len({canonical(section.model_dump()) for section in each.values()}) == 1:
            return each[OWN_MESHES[0]].identifying()
        return dict(each)

    @model_serializer(mode="wrap")
    def _what_holds(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Dump what holds for each kind of mesh, wherever it was written: once if it is the same for both."""
        written: dict[str, Any] = dump(self)
        if self.sun_planet is None and self.planet_ring is None:
            return written
        general = {key: value for key, value in written.items() if key not in OWN_MESHES}
        each = {key: general if written[key] is None else written[key] for key in OWN_MESHES}
        if len({canonical(section) for section in each.values()}) == 1:
            return each[OWN_MESHES[0]]
        first, second = each.values()
        shared = {
            key: own for key, own in first.items() if canonical({"": own}) == canonical({"": second[key]})
        }
        return {**OneMesh().model_dump(), **shared, **each}
