"""Builders of the planetary models.

They have 3(N + 3) degrees of freedom (W23), or rotations alone (B23).
"""

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics import models, supports
from wearlab.dynamics.rigid import (
    MESHES,
    RigidSet,
    balanced_torques,
    effective_masses,
    require_held,
)
from wearlab.dynamics.spur import Meshing, meshing_of
from wearlab.dynamics.supports import Held, MemberSupport
from wearlab.dynamics.system import System
from wearlab.mesh.gear_set import mesh_load

CENTRAL = ("sun", "ring", "carrier")
U = 2
"""Place of the rotation among the coordinates (x, y, u) of a member."""
MEMBERS = (*CENTRAL, "planet")
Meshes = Mapping[str, Meshing]
NONE: Meshes = MappingProxyType({})
UNREACHED = 1.0
"""A backlash that no motion reaches, where the meshes of the other kind alone have a
back flank [m]."""
CENTRED = 1e-9
"""Distance of the planets' centre of mass from the axis, over their path, that is
none."""


class MemberTorques(NamedTuple):
    """What turns the members.

    Parameters
    ----------
    given : on ``sun``, ``ring``, ``carrier``, positive as their angles [N m]; see
        `balanced_torques`
    balanced : the member whose torque is solved for, so that a set free to turn keeps
        its speed; None: the torques given must be in balance
    carrier_speed : ω_c, of the gyroscopic and centripetal terms [rad/s]
    """

    given: Mapping[str, float] = MappingProxyType({})
    balanced: str | None = None
    carrier_speed: float = 0.0


IDLE = MemberTorques()


def assemble(
    rigid: RigidSet,
    held: Held,
    meshing: Meshes = NONE,
    torques: MemberTorques = IDLE,
    friction: bool = False,
) -> System:
    """Build W23's model in the carrier frame, Eqs. 7–14 with the misprints mended.

    ``M q̈ + (C + ω_c G) q̇ + (K − ω_c² K_ω) q + Σ d_i W_i = F`` with q = (x, y, u) of
    sun, ring, carrier and planets 1…N, u = r_b θ (carrier: r_c θ), inertias I/r².
    Meshes are ordered sun–planet 1…N, planet–ring 1…N. The sun's positive torque loads
    the drive flanks.

    Parameters
    ----------
    rigid : members, pressure angles, planet angles
    held : what holds each member; a planet's radial stiffness is its bearing on the
        pin; missing: nothing
    meshing : damping and backlash of ``sun_planet`` and ``planet_ring``; missing: none
    torques : on the members, and ω_c
    friction : the meshes get friction vectors (the tables then carry ``sliding`` and
        ``moment``)

    Returns
    -------
    System

    Raises
    ------
    ValueError
        When something floats in a plane or would accelerate, or a key is unknown.

    Notes
    -----
    q counts from the steady rotation, in which every planet runs on the circle r_c that
    its meshes are made for: its pin, pulled at by m_p ω_c² r_c, sits on the smaller
    radius ``r_c (1 − σ)``, ``σ = m_p ω_c²/k_p``. As the carrier turns by u_c, its pins
    move by (1 − σ) u_c, and their pull turns with them, which adds ``m_p ω_c² (1 − σ)``
    a planet to the stiffness of u_c (a negative entry of K_ω). The rotation of the
    whole set is then neutral at any speed, in the ratio of its gears, so that power is
    neither made nor lost in it. W23 and Lin & Parker leave these terms out: without
    them ``K − ω_c² K_ω`` of an ungrounded carrier is indefinite, and a tangential
    deflection of the pins drives the set; beside a grounded carrier at moderate speed
    they are nothing. Planets unequally spaced pull the carrier to one side: it counts
    from where its bearing then holds it, which turns with it.

    References
    ----------
    W23 Eqs. 1–14; J. Lin, R. G. Parker, J. Vib. Acoust. 121 (1999) 316, Eqs. 1–9.
    """
    for names_of_members in (rigid.bodies, held, torques.given):
        unknown = sorted(set(names_of_members) - set(MEMBERS))
        if unknown:
            raise ValueError(
                f"unknown member {unknown[0]!r}; members are {', '.join(MEMBERS)}"
            )
    bodies = rigid.bodies
    angles = rigid.angles
    planet = bodies["planet"]
    planets = len(angles)
    speed = torques.carrier_speed
    movers = (*CENTRAL, *(f"planet-{n + 1}" for n in range(planets)))
    names = tuple(f"{mover}.{axis}" for mover in movers for axis in "xyu")
    members = (*CENTRAL, *["planet"] * planets)
    inertia: list[float] = []
    for member in members:
        body = bodies[member]
        inertia += [body.mass, body.mass, body.equivalent]

    bearing = held.get("planet", supports.FREE)
    inner = 1.0 - _pull(planet.mass, bearing.radial_stiffness, speed)
    centrifugal = planet.mass * speed**2 * bodies["carrier"].radius
    pins = tuple(_on_pins(angles, inner, bearing, centrifugal))
    unbalance = {"carrier.x": 0.0, "carrier.y": 0.0}
    for pin in pins:
        unbalance[f"carrier.{pin.axis}"] += pin.preload
    grounded = supports.to_ground(names, _against_ground(held, planets), unbalance)

    options: dict[str, Any] = {"load": _load(rigid, torques, names)}
    if speed != 0.0:
        masses = [bodies[member].mass for member in members]
        gyroscopic, centripetal = _rotation(masses, angles, inner)
        options["gyroscopic"] = gyroscopic
        options["centripetal"] = centripetal
        options["rotation"] = float(speed)
    if torques.balanced is not None:
        options["balance"] = _unit(names, f"{torques.balanced}.u")
    return _meshed(
        rigid,
        meshing,
        friction,
        springs=(*grounded, *pins),
        coordinates=names,
        inertia=inertia,
        **options,
    )


def _load(rigid: RigidSet, torques: MemberTorques, names: tuple[str, ...]) -> Array:
    """Return the load of every coordinate by the torques on the members [N]."""
    load = np.zeros(len(names))
    for member, value in torques.given.items():
        radius = rigid.bodies[member].radius
        load[names.index(f"{member}.u")] += value / radius
    return load


def _unit(names: tuple[str, ...], coordinate: str) -> Array:
    """Return a load of one on a coordinate."""
    return np.array([float(name == coordinate) for name in names])


def _meshed(
    rigid: RigidSet,
    meshing: Meshes,
    friction: bool,
    *,
    springs: tuple[supports.Support, ...],
    coordinates: tuple[str, ...],
    inertia: Any,
    turn: Array | None = None,
    **options: Any,
) -> System:
    """Return the system of a set whose meshes act on it; refuse one that floats.

    Where the meshes of one kind alone have a back flank, the others get one that no
    motion reaches.

    Parameters
    ----------
    rigid, meshing, friction : as in `assemble`
    springs, coordinates, inertia, options : of `System.on`
    turn : (3(N + 3), n) the coordinates of the model with translations by those of the
        system, None: the same
    """
    vectors = mesh_vectors(rigid)
    if turn is not None:
        vectors = vectors.seen_by(turn)
    damping = {kind: mesh.damping for kind, mesh in meshing.items()}
    backlash = {kind: mesh.backlash for kind, mesh in meshing.items()}
    if not set(backlash.values()) <= {None}:
        gaps = {
            kind: UNREACHED if value is None else value
            for kind, value in backlash.items()
        }
        options["backlash"] = rigid.per_mesh(gaps)
    if friction:
        options["friction_constant"] = vectors.friction_constant
        options["friction_slope"] = vectors.friction_slope
    system = System.on(
        springs,
        coordinates,
        inertia,
        meshes=vectors.names,
        direction=vectors.direction,
        mesh_damping=rigid.per_mesh(damping),
        damping_always=any(mesh.damps_always for mesh in meshing.values()),
        **options,
    )
    require_held(system)
    return system


def _against_ground(held: Held, planets: int) -> dict[str, MemberSupport]:
    """Return what holds each member against ground: of a planet its rotation alone."""
    pin = held.get("planet", supports.FREE)
    turning = MemberSupport(
        None, pin.tangential_stiffness, None, pin.tangential_damping
    )
    of_planets = {f"planet-{n + 1}": turning for n in range(planets)}
    return {**held, **of_planets}


def _on_pins(
    angles: Array, inner: float, bearing: MemberSupport, pull: float
) -> Iterator[supports.Support]:
    """Yield the bearings of the planets on their pins.

    The centrifugal force of a planet preloads its bearing:
    ``x_n − (x_c − (1 − σ) u_c sin ψ_n)`` and so on: pins turn on a radius smaller by σ,
    see `assemble`.

    Parameters
    ----------
    angles : (N,) ψ_n [rad]
    inner : 1 − σ [1]
    bearing : of a planet
    pull : m_p ω_c² r_c [N]
    """
    k = bearing.radial_stiffness or 0.0
    c = bearing.radial_damping or 0.0
    carrier = 3 * CENTRAL.index("carrier")
    for planet, angle in enumerate(angles):
        sides = (
            ("x", np.cos(angle), -np.sin(angle)),
            ("y", np.sin(angle), np.cos(angle)),
        )
        for index, (axis, outwards, ahead) in enumerate(sides):
            slip = np.zeros(3 * (len(angles) + 3))
            slip[carrier + index] = -1.0
            slip[3 * (planet + 3) + index] = 1.0
            slip[carrier + U] = -ahead
            give = slip.copy()
            give[carrier + U] *= inner
            yield supports.Support(
                member=f"planet-{planet + 1}",
                axis=axis,
                give=give,
                slip=slip,
                stiffness=k,
                damping=c,
                preload=-pull * float(outwards),
            )


def _pull(mass: float, radial_stiffness: float | None, carrier_speed: float) -> float:
    """Return σ, how far a planet is pulled off its pin, over the pin circle radius [1].

    The centrifugal force pulls it.
    """
    share = mass * carrier_speed**2 / (radial_stiffness or np.inf)
    if share >= 1.0:
        grows = (
            "a planet's centrifugal force grows faster with its path than the bearing's"
        )
        at = f"at {carrier_speed:.4g} rad/s {grows}, {radial_stiffness:.3g} N/m"
        raise ValueError(f"K − ω_c² K_ω is indefinite: {at}")
    return share


def _rotation(
    mass: Sequence[float], angles: Array, inner: float
) -> tuple[Array, Array]:
    """Return G and K_ω of the motion in the frame of the carrier.

    ``m (ẍ − 2 ω ẏ − ω² x)``, ``m (ÿ + 2 ω ẋ − ω² y)``, and the pins' pull on u_c. The
    pull of unequally spaced planets turns with u_c, too.
    """
    count = 3 * len(mass)
    gyroscopic = np.zeros((count, count))
    centripetal = np.zeros((count, count))
    for x, member_mass in zip(range(0, count, 3), mass, strict=True):
        gyroscopic[x, x + 1] = -2.0 * member_mass
        gyroscopic[x + 1, x] = 2.0 * member_mass
        centripetal[x, x] = member_mass
        centripetal[x + 1, x + 1] = member_mass
    carrier = 3 * CENTRAL.index("carrier")
    planet = mass[-1]
    turn = carrier + U
    plane = slice(carrier, carrier + 2)
    centripetal[turn, turn] = -len(angles) * planet * inner
    pull = planet * np.array([np.sin(angles).sum(), -np.cos(angles).sum()])
    if np.abs(pull).max() > CENTRED * planet:
        centripetal[plane, turn] = pull
        centripetal[turn, plane] = pull
    return gyroscopic, centripetal


class MeshVectors(NamedTuple):
    """The 2N meshes of a set, sun–planet first.

    Parameters
    ----------
    names : of the meshes
    direction : (2N, n) d, by how much a coordinate deflects a mesh [1]
    friction_constant, friction_slope : (2N, n) f0 [1] and f1 [1/m], friction acts
        along ``f0 + s f1``
    """

    names: tuple[str, ...]
    direction: Array
    friction_constant: Array
    friction_slope: Array

    def seen_by(self, turn: Array) -> "MeshVectors":
        """Return the vectors of other coordinates.

        Parameters
        ----------
        turn : (3(N + 3), n) these coordinates by the others
        """
        return MeshVectors(
            self.names,
            self.direction @ turn,
            self.friction_constant @ turn,
            self.friction_slope @ turn,
        )


def mesh_vectors(rigid: RigidSet) -> MeshVectors:
    """Return the vectors of the meshes in the model with translations.

    With ``n = (−sin ψ, cos ψ)``, ψ_s = ψ_n − α_s and ψ_r = ψ_n + α_r, the force
    direction on the planet: ``δ_sn = n_s·(x_s − x_n) + u_s + u_n − e``, ``δ_rn =
    n_r·(x_r − x_n) + u_r − u_n − e`` (W23 Eqs. 3–6). Friction acts along e ⊥ n; the
    path position s grows towards recess while the sun drives, and the arms are ``ρ =
    r_b tan α ± s``.

    Parameters
    ----------
    rigid : members, pressure angles, planet angles
    """
    alpha_sun, alpha_ring = (float(rigid.pressure_angle[mesh]) for mesh in MESHES)
    planets = len(rigid.angles)
    shape = (2 * planets, 3 * (planets + 3))
    kinds = ("sun-planet", "planet-ring")
    numbers = range(1, planets + 1)
    vectors = MeshVectors(
        names=tuple(f"{kind}-{n}" for kind in kinds for n in numbers),
        direction=np.zeros(shape),
        friction_constant=np.zeros(shape),
        friction_slope=np.zeros(shape),
    )
    for planet in range(planets):
        _write_mesh(vectors, planet, rigid, planet, "sun", -alpha_sun, 1.0)
        mesh = planets + planet
        _write_mesh(vectors, mesh, rigid, planet, "ring", alpha_ring, -1.0)
    return vectors


def _write_mesh(
    vectors: MeshVectors,
    mesh: int,
    rigid: RigidSet,
    planet: int,
    member: str,
    alpha: float,
    spin: float,
) -> None:
    """Write the vectors of the mesh of a planet with a central member.

    Parameters
    ----------
    vectors : written
    mesh : row
    rigid, planet, member : the set, the planet by its number, "sun" or "ring"
    alpha : signed pressure angle [rad]
    spin : 1 where the member pushes the planet, −1 where the planet pushes it
    """
    direction = vectors.direction[mesh]
    constant = vectors.friction_constant[mesh]
    slope = vectors.friction_slope[mesh]
    angle = rigid.angles[planet]
    at_member = 3 * CENTRAL.index(member)
    at_planet = 3 * (planet + 3)

    normal = np.array([-np.sin(angle + alpha), np.cos(angle + alpha)])
    direction[at_member : at_member + 2] = normal
    direction[at_planet : at_planet + 2] = -normal
    direction[at_member + U] = 1.0
    direction[at_planet + U] = spin

    # The sun pushes the planet, the planet the ring: friction turns with who pushes.
    across = np.array([normal[1], -normal[0]])
    arm = np.tan(abs(alpha))
    constant[at_member : at_member + 2] = -spin * across
    constant[at_planet : at_planet + 2] = spin * across
    constant[at_member + U] = arm
    constant[at_planet + U] = spin * arm
    slope[at_member + U] = 1.0 / rigid.bodies[member].radius
    slope[at_planet + U] = -1.0 / rigid.bodies["planet"].radius


def planetary_torsional(
    rigid: RigidSet,
    held: Held,
    meshing: Meshes,
    sun_torque: float,
    friction: bool = True,
) -> System:
    """Build B23's model, rederived: sun, planets and carrier turn, the ring is fixed.

    With u = r_b θ (carrier r_c θ), all angles counted alike (B23 counts the planets'
    clockwise): ``(I_s/r_s²) ü_s + Σ W_sn + … = T_s/r_s``, ``(I_p/r_p²) ü_n + W_sn −
    W_rn + … = 0``, ``(I_c/r_c² + N m_p) ü_c − Σ (W_sn cos α_s + W_rn cos α_r) + … =
    −T_c/r_c``, dots standing for friction. It is the model with translations whose
    planets ride on the carrier, x_n = u_c (−sin ψ_n, cos ψ_n), so meshes and friction
    are those of `wearlab.dynamics.planetary`.

    The set is free to turn unless a tangential stiffness grounds it; the load torque
    T_c on the carrier is then found: zero mean acceleration.

    Parameters
    ----------
    rigid : members, pressure angles, planet angles; the ring's body stands still, a
        planet's mass rides on the carrier
    held : torsional supports of ``sun`` and ``carrier``; missing: free to turn
    meshing : damping and backlash of ``sun_planet`` and ``planet_ring``; missing: none
    sun_torque : T_s [N m]
    friction : the meshes get friction vectors

    References
    ----------
    B23 Eqs. 1–8.
    """
    bodies = rigid.bodies
    angles = rigid.angles
    planets = len(angles)
    names = ("sun.u", "carrier.u", *(f"planet-{n + 1}.u" for n in range(planets)))
    carrier = bodies["carrier"].equivalent + planets * bodies["planet"].mass
    grounded = _against_ground(held, planets)
    springs = tuple(supports.to_ground(names, grounded, {}))
    is_free = not any(
        held.get(member, supports.FREE).tangential_stiffness
        for member in ("sun", "carrier")
    )
    mass = [bodies["sun"].equivalent, carrier, *[bodies["planet"].equivalent] * planets]
    sun_load = mesh_load(sun_torque, bodies["sun"].radius)
    return _meshed(
        rigid,
        meshing,
        friction,
        springs=springs,
        coordinates=names,
        inertia=mass,
        turn=_turning(angles),
        load=_unit(names, "sun.u") * sun_load,
        balance=_unit(names, "carrier.u") if is_free else None,
    )


def _turning(angles: Array) -> Array:
    """Return the coordinates of the model with translations by its rotations.

    They are (3(N + 3), N + 2): the planets ride on the carrier.
    """
    planets = len(angles)
    first = 3 * len(CENTRAL)
    turn = np.zeros((3 * (planets + 3), planets + 2))
    turn[3 * CENTRAL.index("sun") + U, 0] = 1.0
    turn[3 * CENTRAL.index("carrier") + U, 1] = 1.0
    turn[first::3, 1] = -np.sin(angles)
    turn[first + 1 :: 3, 1] = np.cos(angles)
    turn[first + U :: 3, 2:] = np.eye(planets)
    return turn


def rigid_set(motion: models.InMotion) -> RigidSet:
    """Return the members of the set and where they touch."""
    angles = {
        kind.section: kind.pair.working_pressure_angle for kind in motion.gears.kinds
    }
    return RigidSet(motion.gears.bodies, angles, motion.gears.angles)


def held(options: supports.OfMembers, rigid: RigidSet) -> dict[str, MemberSupport]:
    """Return what holds the members.

    Parameters
    ----------
    options : supports of the members
    rigid : the members
    """
    return {
        name: supports.support_of(support, rigid.bodies[name])
        for name, support in options.given.items()
    }


def torques(motion: models.InMotion, held: Held) -> MemberTorques:
    """Return the torques on the members that are not held [N m].

    They are positive where they load drive flanks. Where it is not said, a torque on
    the output balances the input unless a torsional spring ties it to ground. An output
    that nothing grounds gets the torque that keeps its speed.

    Parameters
    ----------
    motion : the set in operation
    held : what holds the members
    """
    operation = motion.operation
    output = operation.output
    tied = bool(held.get(output, supports.FREE).tangential_stiffness)
    loaded = operation.output_loaded
    if loaded is None:
        loaded = not tied
    idle = {operation.fixed} if loaded else {operation.fixed, output}
    balanced = balanced_torques(rigid_set(motion), motion.gears.torque)
    acting = {
        member: torque for member, torque in balanced.items() if member not in idle
    }
    solved_for = str(output) if loaded and not tied else None
    return MemberTorques(acting, solved_for)


def meshing(motion: models.InMotion, rigid: RigidSet) -> dict[str, Meshing]:
    """Return damping, given or 2 ζ √(k̄ m), and backlash of both kinds of mesh.

    Parameters
    ----------
    motion : the set in operation
    rigid : its members
    """
    masses = effective_masses(rigid)
    result = {}
    for number, kind in enumerate(motion.gears.kinds):
        options = motion.meshes[number]
        stiffness = motion.stiffness[motion.gears.mesh_kinds.index(number)]
        mass = masses[kind.section]
        result[kind.section] = meshing_of(options, float(stiffness), mass)
    return result
