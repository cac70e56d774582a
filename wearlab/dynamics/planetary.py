"""Builder of the planetary model with translations and rotations, 3(N + 3) degrees of freedom (W23)."""

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple, TypedDict

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.rigid import MESHES, RigidSet, require_held
from wearlab.dynamics.spur import Meshing
from wearlab.dynamics.supports import FREE, MemberSupport, Support, damping_of, grounded, stiffness_of
from wearlab.dynamics.system import System

CENTRAL = ("sun", "ring", "carrier")
X, Y, U = 0, 1, 2
MEMBERS = (*CENTRAL, "planet")
NO_MESHING: Mapping[str, Meshing] = MappingProxyType({})
NEVER = 1.0
"""A backlash that no motion reaches, where the meshes of the other kind alone have a back flank [m]."""
ALIKE = 1e-9
"""Distance of the planets' centre of mass from the axis, over their path, that is none."""


class MemberTorques(NamedTuple):
    """What turns the members.

    Parameters
    ----------
    given : on ``sun``, ``ring``, ``carrier``, positive as their angles [N m]; see `balanced_torques`
    balanced : the member whose torque is solved for, so that a set free to turn keeps its speed; None: the
        torques given must be in balance
    """

    given: Mapping[str, float] = MappingProxyType({})
    balanced: str | None = None


NO_TORQUES = MemberTorques()


def assemble(
    rigid: RigidSet,
    held: Mapping[str, MemberSupport],
    meshing: Mapping[str, Meshing] = NO_MESHING,
    torques: MemberTorques = NO_TORQUES,
    *,
    carrier_speed: float = 0.0,
    friction: bool = False,
) -> System:
    """Build W23's model in the carrier frame, Eqs. 7–14 with the misprints mended.

    ``M q̈ + (C + ω_c G) q̇ + (K − ω_c² K_ω) q + Σ d_i W_i = F`` with q = (x, y, u) of sun, ring, carrier
    and planets 1…N, u = r_b θ (carrier: r_c θ), inertias I/r². Meshes are ordered sun–planet 1…N,
    planet–ring 1…N. The sun's positive torque loads the drive flanks.

    Parameters
    ----------
    rigid : members, pressure angles, planet angles
    held : what holds each member; a planet's radial stiffness is its bearing on the pin; missing: nothing
    meshing : damping and backlash of ``sun_planet`` and ``planet_ring``; missing: none
    torques : on the members
    carrier_speed : ω_c, of the gyroscopic and centripetal terms [rad/s]
    friction : the meshes get friction vectors (the tables then carry ``sliding`` and ``moment``)

    Returns
    -------
    System

    Raises
    ------
    ValueError
        When something floats in a plane or would accelerate, or a key is unknown.

    Notes
    -----
    q counts from the steady rotation, in which every planet runs on the circle r_c that its meshes are made
    for: its pin, pulled at by m_p ω_c² r_c, sits on the smaller radius ``r_c (1 − σ)``, ``σ = m_p ω_c²/k_p``.
    As the carrier turns by u_c, its pins move by (1 − σ) u_c, and their pull turns with them, which adds
    ``m_p ω_c² (1 − σ)`` a planet to the stiffness of u_c (a negative entry of K_ω). The rotation of the whole
    set is then neutral at any speed, in the ratio of its gears, so that power is neither made nor lost in
    it. W23 and Lin & Parker leave these terms out: without them ``K − ω_c² K_ω`` of an ungrounded carrier is
    indefinite, and a tangential deflection of the pins drives the set; beside a grounded carrier at
    moderate speed they are nothing. Planets unequally spaced pull the carrier to one side: it counts
    from where its bearing then holds it, which turns with it.

    References
    ----------
    W23 Eqs. 1–14; J. Lin, R. G. Parker, J. Vib. Acoust. 121 (1999) 316, Eqs. 1–9.
    """
    for given in (rigid.bodies, held, torques.given):
        _known(given, MEMBERS)
    bodies, angles = rigid.bodies, rigid.angles
    planet, planets, names = bodies["planet"], len(angles), coordinates(len(angles))
    vectors = mesh_vectors(rigid)
    on_pin = held.get("planet", FREE)
    members = (*CENTRAL, *["planet"] * planets)
    inertial = [(body.mass, body.mass, body.equivalent) for body in (bodies[m] for m in members)]
    inner = 1.0 - _pull(planet.mass, on_pin.radial_stiffness, carrier_speed)
    spin, swing = _rotation([bodies[m].mass for m in members], planets * planet.mass * inner)
    swing += _unbalance(angles, planet.mass, len(names))
    pull = planet.mass * carrier_speed**2 * bodies["carrier"].radius
    supports = _against_unbalance((*_grounded(names, held), *_on_pins(angles, inner, on_pin, pull)))
    load = np.zeros(len(names))
    for member, value in torques.given.items():
        load[names.index(f"{member}.u")] += value / bodies[member].radius
    turning, solved = carrier_speed != 0.0, torques.balanced
    system = System(
        coordinates=names,
        mass=np.diag(np.array(inertial, float).ravel()),
        damping=damping_of(supports, len(names)),
        stiffness=stiffness_of(supports, len(names)),
        direction=vectors.direction,
        load=load,
        **meshes_of(rigid, meshing),
        gyroscopic=spin if turning else None,
        centripetal=swing if turning else None,
        rotation=float(carrier_speed),
        meshes=vectors.names,
        friction_constant=vectors.friction_constant if friction else None,
        friction_slope=vectors.friction_slope if friction else None,
        balance=None if solved is None else np.array([float(name == f"{solved}.u") for name in names]),
        supports=supports,
    )
    require_held(system)
    return system


class _Meshes(TypedDict):
    mesh_damping: Array
    damping_always: bool
    backlash: Array | None


def meshes_of(rigid: RigidSet, meshing: Mapping[str, Meshing]) -> _Meshes:
    """Return what a system is told of its meshes beside their directions.

    Where the meshes of one kind alone have a back flank, the others get one that no motion reaches.
    """
    backlash = {mesh: meshing_of.backlash for mesh, meshing_of in meshing.items()}
    given = {mesh: NEVER if value is None else value for mesh, value in backlash.items()}
    return {
        "mesh_damping": rigid.per_mesh({mesh: meshing_of.damping for mesh, meshing_of in meshing.items()}),
        "damping_always": any(meshing_of.damps_always for meshing_of in meshing.values()),
        "backlash": None if set(backlash.values()) <= {None} else rigid.per_mesh(given),
    }


def _grounded(names: Sequence[str], held: Mapping[str, MemberSupport]) -> Iterator[Support]:
    """Yield the supports between members and ground; a planet has one of its rotation alone."""
    for at, name in enumerate(names):
        member, turns = name.rpartition(".")[0], at % 3 == U
        if at < 3 * len(CENTRAL):
            own = held.get(member, FREE)
        elif turns:
            own = held.get("planet", FREE)
        else:
            continue
        k, c = (
            (own.tangential_stiffness, own.tangential_damping)
            if turns
            else (own.radial_stiffness, own.radial_damping)
        )
        yield from grounded(names, name, k, c)


def _on_pins(angles: Array, inner: float, bearing: MemberSupport, pull: float) -> Iterator[Support]:
    """Yield the bearings of the planets on their pins, which the centrifugal force of a planet preloads.

    ``x_n − (x_c − (1 − σ) u_c sin ψ_n)`` and so on: pins turn on a radius smaller by σ, see `assemble`.

    Parameters
    ----------
    angles : (N,) ψ_n [rad]
    inner : 1 − σ [1]
    bearing : of a planet
    pull : m_p ω_c² r_c [N]
    """
    k, c = bearing.radial_stiffness, bearing.radial_damping
    rows = -bearing_vectors(angles)
    turning = np.where(np.arange(rows.shape[1]) == 3 * CENTRAL.index("carrier") + U, inner, 1.0)
    for planet, angle in enumerate(angles):
        for axis, outwards in (("x", np.cos(angle)), ("y", np.sin(angle))):
            row = rows[2 * planet + "xy".index(axis)]
            yield Support(f"planet-{planet + 1}", axis, row * turning, row, k, c, -pull * float(outwards))


def _against_unbalance(held: Sequence[Support]) -> tuple[Support, ...]:
    """Return the supports, those of the carrier preloaded by what its planets' bearings add up to."""
    pulled = {
        axis: sum(
            support.preload
            for support in held
            if support.member.startswith("planet") and support.axis == axis
        )
        for axis in "xy"
    }
    return tuple(
        support._replace(preload=pulled[support.axis])
        if support.member == "carrier" and support.axis in pulled
        else support
        for support in held
    )


def _pull(mass: float, radial_stiffness: float, carrier_speed: float) -> float:
    """Return σ, how far the centrifugal force pulls a planet off its pin, over the pin circle radius [1]."""
    share = mass * carrier_speed**2 / (radial_stiffness or np.inf)
    if share >= 1.0:
        raise ValueError(
            f"K − ω_c² K_ω is indefinite: at {carrier_speed:.4g} rad/s a planet's centrifugal force grows "
            f"faster with its path than the bearing's, {radial_stiffness:.3g} N/m"
        )
    return share


def _rotation(mass: Sequence[float], preloaded: float) -> tuple[Array, Array]:
    """Return G and K_ω: ``m (ẍ − 2 ω ẏ − ω² x)``, ``m (ÿ + 2 ω ẋ − ω² y)``, and the pins' pull on u_c."""
    size = 3 * len(mass)
    gyroscopic, centripetal = np.zeros((size, size)), np.zeros((size, size))
    for index, own in enumerate(mass):
        x, y = 3 * index, 3 * index + 1
        gyroscopic[x, y], gyroscopic[y, x] = -2.0 * own, 2.0 * own
        centripetal[x, x] = centripetal[y, y] = own
    carrier = 3 * CENTRAL.index("carrier") + U
    centripetal[carrier, carrier] = -preloaded
    return gyroscopic, centripetal


def _unbalance(angles: Array, mass: float, size: int) -> Array:
    """Return the part of K_ω by which the pull of unequally spaced planets turns with u_c, (size, size)."""
    centripetal = np.zeros((size, size))
    carrier = 3 * CENTRAL.index("carrier")
    pull = mass * np.array([np.sin(angles).sum(), -np.cos(angles).sum()])
    if np.abs(pull).max() > ALIKE * mass:
        centripetal[carrier : carrier + 2, carrier + U] = centripetal[carrier + U, carrier : carrier + 2] = (
            pull
        )
    return centripetal


def _known(given: Mapping[str, Any], allowed: Sequence[str]) -> None:
    unknown = sorted(set(given) - set(allowed))
    if unknown:
        raise ValueError(f"unknown member {unknown[0]!r}; members are {', '.join(allowed)}")


class MeshVectors(NamedTuple):
    """Vectors of the 2N meshes, sun–planet first, (2N, 3(N + 3)).

    Parameters
    ----------
    names : of the meshes
    direction : d [1]
    friction_constant, friction_slope : f0 [1], f1 [1/m], see `wearlab.dynamics.system.System`
    """

    names: tuple[str, ...]
    direction: Array
    friction_constant: Array
    friction_slope: Array


def coordinates(planets: int) -> tuple[str, ...]:
    """Return the names of the 3(N + 3) coordinates: ``sun.x, sun.y, sun.u, ring.x, … planet-N.u``.

    References
    ----------
    W23 Eqs. 7–14.
    """
    members = (*CENTRAL, *(f"planet-{n + 1}" for n in range(planets)))
    return tuple(f"{member}.{axis}" for member in members for axis in "xyu")


def mesh_vectors(rigid: RigidSet) -> MeshVectors:
    """Return the vectors of all meshes.

    With ``n = (−sin ψ, cos ψ)``, ψ_s = ψ_n − α_s and ψ_r = ψ_n + α_r, the force direction on the planet:
    ``δ_sn = n_s·(x_s − x_n) + u_s + u_n − e``, ``δ_rn = n_r·(x_r − x_n) + u_r − u_n − e`` (W23 Eqs. 3–6).
    Friction acts along e ⊥ n; the path position s grows towards recess while the sun drives, and the arms
    are ``ρ = r_b tan α ± s``.
    """
    planet_angles, base_radius = rigid.angles, rigid.base_radius
    alpha_sun, alpha_ring = (float(rigid.pressure_angle[mesh]) for mesh in MESHES)
    planets = len(planet_angles)
    size = 3 * (planets + 3)
    d, f0, f1 = np.zeros((3, 2 * planets, size))
    for kind, member, alpha, spin in ((0, "sun", -alpha_sun, 1.0), (1, "ring", alpha_ring, -1.0)):
        for planet, angle in enumerate(planet_angles):
            mesh, own, other = kind * planets + planet, 3 * CENTRAL.index(member), 3 * (planet + 3)
            normal = np.array([-np.sin(angle + alpha), np.cos(angle + alpha)])
            across = np.array([normal[1], -normal[0]])
            arm = np.tan(abs(alpha))
            d[mesh, own : own + 2], d[mesh, other : other + 2] = normal, -normal
            d[mesh, own + U], d[mesh, other + U] = 1.0, spin
            # The sun pushes the planet, the planet the ring: friction turns with who pushes.
            f0[mesh, own : own + 2], f0[mesh, other : other + 2] = -spin * across, spin * across
            f0[mesh, own + U], f0[mesh, other + U] = arm, spin * arm
            f1[mesh, own + U], f1[mesh, other + U] = 1.0 / base_radius[member], -1.0 / base_radius["planet"]
    names = [f"{kind}-{n + 1}" for kind in ("sun-planet", "planet-ring") for n in range(planets)]
    return MeshVectors(tuple(names), d, f0, f1)


def bearing_vectors(planet_angles: Array) -> Array:
    """Return the rows of the pin deflections, ``δ_cnx`` and ``δ_cny`` of every planet, (2N, 3(N + 3)).

    ``δ_cnx = x_c − x_n − u_c sin ψ_n``, ``δ_cny = y_c − y_n + u_c cos ψ_n`` (W23 Eqs. 9–10).
    """
    planets, carrier = len(planet_angles), 3 * CENTRAL.index("carrier")
    rows = np.zeros((2 * planets, 3 * (planets + 3)))
    for planet, angle in enumerate(planet_angles):
        for axis, share in ((X, -np.sin(angle)), (Y, np.cos(angle))):
            row = rows[2 * planet + axis]
            row[carrier + axis], row[3 * (planet + 3) + axis], row[carrier + U] = 1.0, -1.0, share
    return rows
