"""Builders of the planetary models: 3(N + 3) degrees of freedom (W23), or rotations alone (B23)."""

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
MEMBERS = (*CENTRAL, "planet")
Meshes = Mapping[str, Meshing]
NONE: Meshes = MappingProxyType({})
NEVER = 1.0
"""A backlash that no motion reaches, where the meshes of the other kind alone have a
back flank [m]."""
ALIKE = 1e-9
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
    for named in (rigid.bodies, held, torques.given):
        if unknown := sorted(set(named) - set(MEMBERS)):
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
    on_pin = held.get("planet", supports.FREE)
    members = (*CENTRAL, *["planet"] * planets)
    inertial = [
        (body.mass, body.mass, body.equivalent) for body in (bodies[m] for m in members)
    ]
    inner = 1.0 - _pull(planet.mass, on_pin.radial_stiffness, speed)
    pins = tuple(
        _on_pins(
            angles, inner, on_pin, planet.mass * speed**2 * bodies["carrier"].radius
        )
    )
    unbalance = {
        f"carrier.{axis}": sum(pin.preload for pin in pins if pin.axis == axis)
        for axis in "xy"
    }
    springs = (
        *supports.to_ground(names, _against_ground(held, planets), unbalance),
        *pins,
    )
    load = np.zeros(len(names))
    for member, value in torques.given.items():
        load[names.index(f"{member}.u")] += value / bodies[member].radius
    given: dict[str, Any] = {"load": load}
    if speed != 0.0:
        masses = [bodies[member].mass for member in members]
        given["gyroscopic"], given["centripetal"] = _rotation(masses, angles, inner)
        given["rotation"] = float(speed)
    if torques.balanced is not None:
        given["balance"] = np.array(
            [float(name == f"{torques.balanced}.u") for name in names]
        )
    return _meshed(
        rigid, meshing, friction, springs, names, np.ravel(inertial), **given
    )


def _meshed(
    rigid: RigidSet,
    meshing: Meshes,
    friction: bool,
    *on: Any,
    turn: Array | None = None,
    **given: Any,
) -> System:
    """Return the system of a set whose meshes act on it; refuse one that floats.

    Where the meshes of one kind alone have a back flank, the others get one that no
    motion reaches.

    Parameters
    ----------
    rigid, meshing, friction : as in `assemble`
    on, given : of `System.on`: supports, coordinates and masses, and what else there is
    turn : (3(N + 3), n) the coordinates of the model with translations by those of the
        system, None: the same
    """
    names, *vectors = mesh_vectors(rigid)
    direction, constant, slope = (
        each if turn is None else each @ turn for each in vectors
    )
    damping = rigid.per_mesh({mesh: each.damping for mesh, each in meshing.items()})
    always = any(each.damps_always for each in meshing.values())
    backlash = {mesh: each.backlash for mesh, each in meshing.items()}
    if not set(backlash.values()) <= {None}:
        known = {
            mesh: NEVER if value is None else value for mesh, value in backlash.items()
        }
        given["backlash"] = rigid.per_mesh(known)
    if friction:
        given["friction_constant"], given["friction_slope"] = constant, slope
    given |= {"direction": direction, "mesh_damping": damping, "damping_always": always}
    system = System.on(*on, meshes=names, **given)
    require_held(system)
    return system


def _against_ground(held: Held, planets: int) -> dict[str, MemberSupport]:
    """Return what holds each member against ground: of a planet its rotation alone."""
    pin = held.get("planet", supports.FREE)
    turning = MemberSupport(
        None, pin.tangential_stiffness, None, pin.tangential_damping
    )
    return {**held, **{f"planet-{n + 1}": turning for n in range(planets)}}


def _on_pins(
    angles: Array, inner: float, bearing: MemberSupport, pull: float
) -> Iterator[supports.Support]:
    """Yield the bearings of the planets on their pins, which the centrifugal force of a planet preloads.

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
        for at, (axis, outwards, ahead) in enumerate(sides):
            slip = np.zeros(3 * (len(angles) + 3))
            slip[carrier + at] = -1.0
            slip[3 * (planet + 3) + at] = 1.0
            slip[carrier + U] = -ahead
            give = slip.copy()
            give[carrier + U] *= inner
            yield supports.Support(
                f"planet-{planet + 1}", axis, give, slip, k, c, -pull * float(outwards)
            )


def _pull(mass: float, radial_stiffness: float | None, carrier_speed: float) -> float:
    """Return σ, how far the centrifugal force pulls a planet off its pin, over the pin circle radius [1]."""
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
    """Return G and K_ω: ``m (ẍ − 2 ω ẏ − ω² x)``, ``m (ÿ + 2 ω ẋ − ω² y)``, and the pins' pull on u_c.

    The pull of unequally spaced planets turns with u_c, too.
    """
    gyroscopic, centripetal = np.zeros((2, 3 * len(mass), 3 * len(mass)))
    for x, own in zip(range(0, 3 * len(mass), 3), mass, strict=True):
        gyroscopic[x, x + 1] = -2.0 * own
        gyroscopic[x + 1, x] = 2.0 * own
        centripetal[x, x] = centripetal[x + 1, x + 1] = own
    carrier = 3 * CENTRAL.index("carrier")
    planet = mass[-1]
    centripetal[carrier + U, carrier + U] = -len(angles) * planet * inner
    pull = planet * np.array([np.sin(angles).sum(), -np.cos(angles).sum()])
    if np.abs(pull).max() > ALIKE * planet:
        centripetal[carrier : carrier + 2, carrier + U] = pull
        centripetal[carrier + U, carrier : carrier + 2] = pull
    return gyroscopic, centripetal


def mesh_vectors(rigid: RigidSet) -> tuple[tuple[str, ...], Array, Array, Array]:
    """Return names of the 2N meshes, sun–planet first, and their vectors d, f0, f1, (2N, 3(N + 3)) each.

    With ``n = (−sin ψ, cos ψ)``, ψ_s = ψ_n − α_s and ψ_r = ψ_n + α_r, the force
    direction on the planet: ``δ_sn = n_s·(x_s − x_n) + u_s + u_n − e``, ``δ_rn =
    n_r·(x_r − x_n) + u_r − u_n − e`` (W23 Eqs. 3–6). Friction acts along e ⊥ n; the
    path position s grows towards recess while the sun drives, and the arms are ``ρ =
    r_b tan α ± s``.
    """
    alpha_sun, alpha_ring = (float(rigid.pressure_angle[mesh]) for mesh in MESHES)
    planets = len(rigid.angles)
    d, f0, f1 = np.zeros((3, 2 * planets, 3 * (planets + 3)))
    for kind, member, alpha, spin in (
        (0, "sun", -alpha_sun, 1.0),
        (1, "ring", alpha_ring, -1.0),
    ):
        for planet, angle in enumerate(rigid.angles):
            mesh = kind * planets + planet
            own = 3 * CENTRAL.index(member)
            other = 3 * (planet + 3)
            normal = np.array([-np.sin(angle + alpha), np.cos(angle + alpha)])
            across = np.array([normal[1], -normal[0]])
            arm = np.tan(abs(alpha))
            d[mesh, own : own + 2] = normal
            d[mesh, other : other + 2] = -normal
            d[mesh, own + U], d[mesh, other + U] = 1.0, spin
            # The sun pushes the planet, the planet the ring: friction turns with who
            # pushes.
            f0[mesh, own : own + 2] = -spin * across
            f0[mesh, other : other + 2] = spin * across
            f0[mesh, own + U] = arm
            f0[mesh, other + U] = spin * arm
            f1[mesh, own + U] = 1.0 / rigid.bodies[member].radius
            f1[mesh, other + U] = -1.0 / rigid.bodies["planet"].radius
    names = [
        f"{kind}-{n + 1}"
        for kind in ("sun-planet", "planet-ring")
        for n in range(planets)
    ]
    return tuple(names), d, f0, f1


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
    springs = tuple(supports.to_ground(names, _against_ground(held, planets), {}))
    free = not any(
        held.get(member, supports.FREE).tangential_stiffness
        for member in ("sun", "carrier")
    )
    mass = [bodies["sun"].equivalent, carrier, *[bodies["planet"].equivalent] * planets]
    unit = np.eye(planets + 2)
    turn = _turning(angles)
    load = unit[0] * mesh_load(sun_torque, bodies["sun"].radius)
    balance = unit[1] if free else None
    return _meshed(
        rigid,
        meshing,
        friction,
        springs,
        names,
        mass,
        turn=turn,
        load=load,
        balance=balance,
    )


def _turning(angles: Array) -> Array:
    """Return the coordinates of the model with translations as the set turns, (3(N + 3), N + 2)."""
    planets = len(angles)
    first = 3 * len(CENTRAL)
    turn = np.zeros((3 * (planets + 3), planets + 2))
    turn[3 * CENTRAL.index("sun") + U, 0] = turn[
        3 * CENTRAL.index("carrier") + U, 1
    ] = 1.0
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


def held(given: supports.OfMembers, rigid: RigidSet) -> dict[str, MemberSupport]:
    """Return what holds the members."""
    return {
        name: supports.support_of(support, rigid.bodies[name])
        for name, support in given.given.items()
    }


def torques(motion: models.InMotion, held: Held) -> MemberTorques:
    """Return the torques on the members that are not held, positive where they load drive flanks [N m].

    Where it is not said, a torque on the output balances the input unless a torsional
    spring ties it to ground. An output that nothing grounds gets the torque that keeps
    its speed.
    """
    given = motion.operation
    tied = bool(held.get(given.output, supports.FREE).tangential_stiffness)
    loaded = not tied if given.output_loaded is None else given.output_loaded
    idle = {given.fixed} if loaded else {given.fixed, given.output}
    every = balanced_torques(rigid_set(motion), motion.gears.torque)
    acting = {member: torque for member, torque in every.items() if member not in idle}
    return MemberTorques(acting, str(given.output) if loaded and not tied else None)


def meshing(motion: models.InMotion, rigid: RigidSet) -> dict[str, Meshing]:
    """Return damping, given or 2 ζ √(k̄ m), and backlash of both kinds of mesh."""
    mass = effective_masses(rigid)
    means = motion.stiffness[:: len(motion.stiffness) // 2]
    each = zip(
        (kind.section for kind in motion.gears.kinds), motion.meshes, means, strict=True
    )
    return {
        name: meshing_of(mesh, float(mean), mass[name]) for name, mesh, mean in each
    }
