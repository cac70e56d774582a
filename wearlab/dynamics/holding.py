"""``[dynamics.supports]``: what holds each member, as campaign files say it."""

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar

from wearlab.options import (
    NOT_NEGATIVE,
    POSITIVE,
    Alternatives,
    DampingRate,
    Force,
    Number,
    Part,
    SpringRate,
    TorsionalDampingRate,
    TorsionalSpringRate,
    option,
)


class Turning(Part):
    """A torsional spring and damper between a gear and ground."""

    alternatives: ClassVar[Alternatives] = (
        (("torsional_stiffness",), ("tangential_stiffness",)),
        (("damping_ratio",), ("damping", "torsional_damping")),
    )

    torsional_stiffness: Annotated[TorsionalSpringRate, POSITIVE] | None = option(
        None, "torsional spring to ground", derived="free to turn"
    )
    tangential_stiffness: Annotated[SpringRate, POSITIVE] | None = option(
        None, "the same, as a spring at the base radius", derived="torsional_stiffness"
    )
    torsional_damping: Annotated[TorsionalDampingRate, NOT_NEGATIVE] | None = option(
        None, "torsional damper to ground", derived="from damping_ratio, else none"
    )
    damping_ratio: Annotated[Number, NOT_NEGATIVE] | None = option(
        None, "damping ratio ζ of every spring here, c = 2 ζ √(k m) of that member", derived="damping"
    )

    @property
    def holds(self) -> bool:
        """Whether a torsional spring ties the member to ground."""
        return self.torsional_stiffness is not None or self.tangential_stiffness is not None


class TorsionalSupport(Turning):
    """What holds a gear that only turns."""

    radial_stiffness: ClassVar[None] = None
    damping: ClassVar[None] = None
    preload: ClassVar[float] = 0.0


class BearingSupport(Turning):
    """The bearings of one gear."""

    radial_stiffness: Annotated[SpringRate, POSITIVE] = option(
        ..., "bearing stiffness along the line of action, k_y", source="L16 Eq. 1"
    )
    damping: Annotated[DampingRate, NOT_NEGATIVE] | None = option(
        None, "bearing damping c_y", derived="from damping_ratio; one of them is required", source="L16 Eq. 1"
    )
    preload: Force = option(0.0, "constant radial force away from the mating gear", source="L16 Eq. 1")


class PlanetarySupport(Turning):
    """What holds a central member of a planetary set, or a planet on its pin."""

    radial_stiffness: Annotated[SpringRate, POSITIVE] | None = option(
        None, "bearing stiffness in every direction; a planet's is that on its pin", derived="free to move",
        source="W23 Table 1",
    )  # fmt: skip
    damping: Annotated[DampingRate, NOT_NEGATIVE] | None = option(
        None, "bearing damping", derived="from damping_ratio, else none"
    )


class OfMembers(Part):
    """What holds the members, each by its name."""

    def get(self, member: str) -> Any:
        """Return the support of a member, None when it has none."""
        return getattr(self, member, None)

    @property
    def given(self) -> dict[str, Any]:
        """Supports by member, those that are given."""
        each = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: support for name, support in each.items() if support is not None}


class TorsionalSupports(OfMembers):
    """What holds the rotation of each gear."""

    pinion: TorsionalSupport | None = option(None, "support of the pinion", derived="none")
    gear: TorsionalSupport | None = option(None, "support of the gear", derived="none")
    ring: TorsionalSupport | None = option(None, "support of the ring", derived="none")


class Supports(OfMembers):
    """The bearings of both gears of a pair."""

    pinion: BearingSupport = option(..., "bearings of the pinion")
    gear: BearingSupport | None = option(None, "bearings of the gear", derived="required with a gear")
    ring: BearingSupport | None = option(None, "bearings of the ring", derived="required with a ring")


class PlanetarySupports(OfMembers):
    """What holds the members of a planetary set."""

    sun: PlanetarySupport | None = option(None, "what holds the sun", derived="it floats")
    ring: PlanetarySupport | None = option(None, "what holds the ring", derived="it floats")
    carrier: PlanetarySupport | None = option(None, "what holds the carrier", derived="it floats")
    planet: PlanetarySupport | None = option(None, "bearing of every planet on its pin", derived="none")


class PlanetaryTorsionalSupports(OfMembers):
    """What holds the rotations of a planetary set."""

    sun: TorsionalSupport | None = option(None, "what holds the sun", derived="none")
    ring: TorsionalSupport | None = option(None, "what holds the ring", derived="fixed when it is")
    carrier: TorsionalSupport | None = option(None, "what holds the carrier", derived="none")


def problems_of_pair(model: Any, members: tuple[str, ...], *, bearings: bool) -> Iterator[tuple[str, str]]:
    """Yield what is wrong with the supports of a pair, as key and reason.

    Parameters
    ----------
    model : the dynamic model
    members : of the pair
    bearings : whether both gears need bearings
    """
    supports = {member: model.supports.get(member) for member in members}
    for stranger in model.supports.given:
        if stranger not in supports:
            yield (
                f"dynamics.supports.{stranger}",
                f"no member of this gear set; there are {', '.join(supports)}",
            )
    if bearings:
        for member, support in supports.items():
            if support is None:
                yield (
                    f"dynamics.supports.{member}",
                    "required: bearings, such as radial_stiffness = '1150 N/um' with 'damping'",
                )
    held = [member for member, support in supports.items() if support is not None and support.holds]
    if len(held) == len(supports):
        yield (
            "dynamics.supports",
            "torsional springs hold both gears: nothing turns, and the torque does not set the mesh force; "
            "hold the output alone",
        )
    for member, support in supports.items():
        path = f"dynamics.supports.{member}"
        if support is None or support.damping_ratio is not None:
            continue
        if bearings and support.damping is None:
            yield path, "give 'damping' such as '5360 N*s/m', or 'damping_ratio'"
        if support.holds and support.torsional_damping is None:
            yield (
                path,
                "a torsional spring needs 'torsional_damping' such as '2 N*m*s/rad', or 'damping_ratio'",
            )
