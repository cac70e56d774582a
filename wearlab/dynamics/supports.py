"""Springs and dampers that hold the members, and the forces they exert."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple

import numpy as np

from wearlab import options
from wearlab.arrays import Array

if TYPE_CHECKING:
    from wearlab.mesh.gear_set import Body

AXES = "xyz"
"""Of translations, which bearings are against; z along the axes of the gears."""


class Support(NamedTuple):
    """One spring and damper between a member and ground or another member.

    The force on the member along its axis is ``preload − k d·q − c r·q̇``: a planet's
    bearing gives way by ``x_planet − x_pin``, so that d and r have entries of both.

    Parameters
    ----------
    member : name of the member it acts on
    axis : "x", "y" or "z" of a translation, "u" of a rotation seen at the member's
        radius
    give : (n,) d, by how much it gives way with the coordinates [1]
    slip : (n,) r, by how much its rate follows the coordinates' rates [1]
    stiffness : k [N/m]
    damping : c [N s/m]
    preload : force on the member at q = 0, in balance with loads that the equation of
        motion leaves out [N]
    """

    member: str
    axis: str
    give: Array
    slip: Array
    stiffness: float
    damping: float
    preload: float = 0.0


class MemberSupport(NamedTuple):
    """What holds a member; None: nothing does.

    Parameters
    ----------
    radial_stiffness : k_y of a gear of a pair; of a planetary member k_x = k_y, a
        planet's bearing on the pin [N/m]
    tangential_stiffness : torsional support k_u at the base radius, the carrier's at
        the pin circle [N/m]
    radial_damping, tangential_damping : of the same [N s/m]
    axial_stiffness, axial_damping : of a bearing that gives way along the axis [N/m],
        [N s/m]
    preload : constant force away from the mating gear, as L16's −F_p on y_p and +F_g on
        y_g [N]
    """

    radial_stiffness: float | None = None
    tangential_stiffness: float | None = None
    radial_damping: float | None = None
    tangential_damping: float | None = None
    axial_stiffness: float | None = None
    axial_damping: float | None = None
    preload: float = 0.0


FREE = MemberSupport()
Held = Mapping[str, MemberSupport]
"""What holds the members, by name."""
Known = float | None
HELD_BY = {"x": "radial", "y": "radial", "z": "axial", "u": "tangential"}
"""What of a support acts along each axis."""


def damping_by_ratio(ratio: float, stiffness: float, mass: float) -> float:
    """Return ``c = 2 ζ √(k m)`` of a spring and the mass it holds [N s/m].

    Parameters
    ----------
    ratio : ζ [1]
    stiffness : k [N/m]
    mass : m, or I/r², or an effective mass [kg]

    References
    ----------
    Kahraman & Singh 1990 for a mesh; W23 Table 1 gives the ratios ζ of supports.
    """
    return 2.0 * ratio * float(np.sqrt(stiffness * mass))


def effective_mass(*equivalent: float) -> float:
    """Return the torsional effective mass of a mesh, ``1/m = Σ r²/I`` [kg].

    Parameters
    ----------
    equivalent : masses I/r² of the bodies it lies between [kg]

    References
    ----------
    L16 Eq. 3.
    """
    return 1.0 / sum(1.0 / mass for mass in equivalent)


def damping_or_ratio(
    damping: Known, ratio: Known, stiffness: Known, mass: float
) -> float:
    """Return a damping that is given, or what follows from its ratio [N s/m].

    Parameters
    ----------
    damping : c, None: not given [N s/m]
    ratio : ζ, None: 0 [1]
    stiffness, mass : see `damping_by_ratio`
    """
    if damping is not None:
        return float(damping)
    return damping_by_ratio(ratio or 0.0, stiffness or 0.0, mass)


def support_of(options: Any, body: "Body") -> MemberSupport:
    """Return what holds a member, from its options.

    Torsional springs and dampers count at the body's radius; a damping that is not
    given follows from the damping ratio, the spring and the mass that it holds.

    Parameters
    ----------
    options : of the support, which may leave out any of them
    body : the member
    """

    def option(name: str) -> float | None:
        value: float | None = getattr(options, name, None)
        return value

    def at_radius(torsional: float | None) -> float | None:
        return None if torsional is None else torsional / body.radius**2

    def damping_of_spring(
        damping: float | None, stiffness: float | None, mass: float
    ) -> float | None:
        if stiffness is None and damping is None:
            return None
        return damping_or_ratio(damping, options.damping_ratio, stiffness, mass)

    radial = option("radial_stiffness")
    axial = option("axial_stiffness")
    tangential = at_radius(option("torsional_stiffness"))
    tangential = tangential or options.tangential_stiffness
    torsional_damping = at_radius(option("torsional_damping"))
    return MemberSupport(
        radial_stiffness=radial,
        radial_damping=damping_of_spring(option("damping"), radial, body.mass),
        tangential_stiffness=tangential,
        tangential_damping=damping_of_spring(
            torsional_damping, tangential, body.equivalent
        ),
        axial_stiffness=axial,
        axial_damping=damping_of_spring(option("axial_damping"), axial, body.mass),
        preload=getattr(options, "preload", 0.0),
    )


def to_ground(
    coordinates: Sequence[str],
    held: Held,
    preload: Mapping[str, float],
) -> Iterator[Support]:
    """Yield the supports of coordinates against ground, of those that something holds.

    Parameters
    ----------
    coordinates : names, such as ``"ring.x"``
    held : what holds each member
    preload : force at rest by coordinate [N]
    """
    for name in coordinates:
        member, _, axis = name.rpartition(".")
        support = held.get(member, FREE)
        k = getattr(support, f"{HELD_BY[axis]}_stiffness") or 0.0
        c = getattr(support, f"{HELD_BY[axis]}_damping") or 0.0
        if k or c:
            give = np.array([float(coordinate == name) for coordinate in coordinates])
            yield Support(member, axis, give, give, k, c, preload.get(name, 0.0))


def stiffness_of(supports: Sequence[Support], count: int) -> Array:
    """Return ``K = Σ k d dᵀ`` of supports, (count, count) [N/m]."""
    stiffness = np.zeros((count, count))
    for support in supports:
        stiffness = stiffness + support.stiffness * np.outer(support.give, support.give)
    return stiffness


def damping_of(supports: Sequence[Support], count: int) -> Array:
    """Return ``C = Σ c r rᵀ`` of supports, (count, count) [N s/m]."""
    damping = np.zeros((count, count))
    for support in supports:
        damping = damping + support.damping * np.outer(support.slip, support.slip)
    return damping


def bearing_forces(
    supports: Sequence[Support],
    members: Sequence[str],
    q: Array,
    rate: Array,
) -> Array:
    """Return the force of the bearings on each member along `AXES` [N].

    Every bearing exerts ``preload − k d·q − c r·q̇``, see `Support`.

    Parameters
    ----------
    supports : of the system; those against rotation exert no force
    members : names of the members wanted, 0 for those that none of the supports holds
    q, rate : (n_kept, n, n_instants) coordinates q [m] and q̇ [m/s]

    Returns
    -------
    (n_members, 3, n_kept, n_instants)
    """
    force = np.zeros((len(members), len(AXES), len(q), q.shape[-1]))
    for support in supports:
        if support.axis in AXES and support.member in members:
            elastic = support.stiffness * np.einsum("i,kij->kj", support.give, q)
            damped = support.damping * np.einsum("i,kij->kj", support.slip, rate)
            member = members.index(support.member)
            axis = AXES.index(support.axis)
            force[member, axis] += support.preload - elastic - damped
    return force


SPRINGS = ("torsional_stiffness",), ("tangential_stiffness",)
RATIO = ("damping_ratio",)
DAMPINGS = ("damping", "torsional_damping")


class TorsionalSpring(options.Part):
    """A torsional spring and damper between a gear and ground."""

    alternatives: ClassVar[options.Alternatives] = (SPRINGS, (RATIO, DAMPINGS))

    torsional_stiffness: (
        Annotated[options.TorsionalSpringRate, options.POSITIVE] | None
    ) = None
    """torsional spring to ground [free to turn]"""
    tangential_stiffness: Annotated[options.SpringRate, options.POSITIVE] | None = None
    """the same, as a spring at the base radius [torsional_stiffness]"""
    torsional_damping: (
        Annotated[options.TorsionalDampingRate, options.NOT_NEGATIVE] | None
    ) = None
    """torsional damper to ground [from damping_ratio, else none]"""
    damping_ratio: Annotated[options.Number, options.NOT_NEGATIVE] | None = None
    """damping ratio ζ of every spring here, c = 2 ζ √(k m) of that member [damping]"""

    @property
    def holds(self) -> bool:
        """Whether a torsional spring ties the member to ground."""
        return (
            self.torsional_stiffness is not None
            or self.tangential_stiffness is not None
        )


class TorsionalSupport(TorsionalSpring):
    """What holds a gear that only turns."""

    radial_stiffness: ClassVar[None] = None
    damping: ClassVar[None] = None
    preload: ClassVar[float] = 0.0


class AxialBearing(TorsionalSpring):
    """A bearing along the axis of one helical gear."""

    alternatives: ClassVar[options.Alternatives] = (
        SPRINGS,
        (RATIO, (*DAMPINGS, "axial_damping")),
    )

    axial_stiffness: Annotated[options.SpringRate, options.POSITIVE] | None = None
    """bearing stiffness along the axis of a helical gear, k_z [rigid]"""
    axial_damping: Annotated[options.DampingRate, options.NOT_NEGATIVE] | None = None
    """bearing damping along the axis, c_z [from damping_ratio]"""


class PairTorsionalSupport(TorsionalSupport, AxialBearing):
    """What holds a gear of a pair that turns and, helical, may move along its axis."""


class BearingSupport(AxialBearing):
    """The bearings of one gear."""

    radial_stiffness: Annotated[options.SpringRate, options.POSITIVE]
    """bearing stiffness along the line of action, k_y. Source: L16 Eq. 1"""
    damping: Annotated[options.DampingRate, options.NOT_NEGATIVE] | None = None
    """bearing damping c_y [from damping_ratio; one of them is required]. Source: L16
    Eq. 1"""
    preload: options.Force = 0.0
    """constant radial force away from the mating gear. Source: L16 Eq. 1"""


class PlanetarySupport(TorsionalSpring):
    """What holds a central member of a planetary set, or a planet on its pin."""

    radial_stiffness: Annotated[options.SpringRate, options.POSITIVE] | None = None
    """bearing stiffness in every direction; a planet's is that on its pin [free to
    move]. Source: W23 Table 1"""
    damping: Annotated[options.DampingRate, options.NOT_NEGATIVE] | None = None
    """bearing damping [from damping_ratio, else none]"""


class OfMembers(options.Part):
    """What holds the members, each by its name."""

    def get(self, member: str) -> Any:
        """Return the support of a member, None when it has none."""
        return getattr(self, member, None)

    @property
    def given(self) -> dict[str, Any]:
        """Supports by member, those that are given."""
        return {name: support for name, support in self if support is not None}


class TorsionalSupports(OfMembers):
    """What holds each gear of a pair that turns."""

    pinion: PairTorsionalSupport | None = None
    """support of the pinion"""
    gear: PairTorsionalSupport | None = None
    """support of the gear"""
    ring: PairTorsionalSupport | None = None
    """support of the ring"""


class Supports(OfMembers):
    """The bearings of both gears of a pair."""

    pinion: BearingSupport
    """bearings of the pinion"""
    gear: BearingSupport | None = None
    """bearings of the gear [required with a gear]"""
    ring: BearingSupport | None = None
    """bearings of the ring [required with a ring]"""


class PlanetarySupports(OfMembers):
    """What holds the members of a planetary set."""

    sun: PlanetarySupport | None = None
    """what holds the sun [it floats]"""
    ring: PlanetarySupport | None = None
    """what holds the ring [it floats]"""
    carrier: PlanetarySupport | None = None
    """what holds the carrier [it floats]"""
    planet: PlanetarySupport | None = None
    """bearing of every planet on its pin"""


class PlanetaryTorsionalSupports(OfMembers):
    """What holds the rotations of a planetary set."""

    sun: TorsionalSupport | None = None
    """what holds the sun"""
    ring: TorsionalSupport | None = None
    """what holds the ring [fixed when it is]"""
    carrier: TorsionalSupport | None = None
    """what holds the carrier"""


def problems_of_pair(
    model: Any, scene: Any, *, bearings: bool
) -> Iterator[tuple[str, str]]:
    """Yield what is wrong with the supports of a pair, as key and reason.

    Parameters
    ----------
    model : the dynamic model
    scene : the sections of the scene
    bearings : whether both gears need bearings
    """
    members = list(scene.gears.toothed)
    supports = model.supports.given
    for name in supports:
        if name not in members:
            reason = f"no member of this gear set; there are {', '.join(members)}"
            yield f"dynamics.supports.{name}", reason
    if bearings:
        reason = (
            "required: bearings, such as radial_stiffness = '1150 N/um' with 'damping'"
        )
        for member in members:
            if member not in supports:
                yield f"dynamics.supports.{member}", reason
    if all(member in supports and supports[member].holds for member in members):
        reason = (
            "torsional springs hold both gears: nothing turns, and the torque does not "
            "set the mesh force; hold the output alone"
        )
        yield "dynamics.supports", reason
    helical = scene.gears.helix_angle is not None
    for member in members:
        if member not in supports:
            continue
        checks = _checks(supports[member], bearings=bearings, helical=helical)
        for key, is_wrong, reason in checks:
            if is_wrong:
                yield f"dynamics.supports.{member}{key}", reason


SPUR = (
    "is of helical gears: spur gears push nothing along their axes; give "
    "gears.helix_angle, or leave it out"
)


def _checks(
    support: Any, *, bearings: bool, helical: bool
) -> list[tuple[str, bool, str]]:
    """Return what may be wrong with the support of a gear.

    That is a key, whether it is wrong, and the reason.
    """
    gives_way = support.axial_stiffness is not None
    damped = support.axial_damping is not None
    no_ratio = support.damping_ratio is None
    undamped = no_ratio and getattr(support, "damping", None) is None
    untwisted = no_ratio and support.torsional_damping is None
    bearing = "is of a bearing that gives way: give 'axial_stiffness', too"
    axial = (
        "an axial bearing needs 'axial_damping' such as '2000 N*s/m', or "
        "'damping_ratio'"
    )
    spring = (
        "a torsional spring needs 'torsional_damping' such as '2 N*m*s/rad', or "
        "'damping_ratio'"
    )
    return [
        (".axial_stiffness", gives_way and not helical, SPUR),
        (".axial_damping", damped and not helical, SPUR),
        (".axial_damping", damped and not gives_way, bearing),
        ("", gives_way and not damped and no_ratio, axial),
        (
            "",
            bearings and undamped,
            "give 'damping' such as '5360 N*s/m', or 'damping_ratio'",
        ),
        ("", support.holds and untwisted, spring),
    ]
