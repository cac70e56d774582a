"""Builder of the planetary model with translations and rotations, 3(N + 3) degrees of freedom (W23)."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.planetary_mesh import CENTRAL, U, bearing_vectors, coordinates, mesh_vectors
from wearlab.dynamics.rigid import require_held
from wearlab.dynamics.supports import Support, damping_of, grounded, stiffness_of
from wearlab.dynamics.system import System

MEMBERS = (*CENTRAL, "planet")
MESHES = ("sun_planet", "planet_ring")
ALIKE = 1e-9
"""Distance of the planets' centre of mass from the axis, over their path, that is none."""


def assemble(
    *,
    mass: Mapping[str, float],
    inertia: Mapping[str, float],
    base_radius: Mapping[str, float],
    pin_circle_radius: float,
    pressure_angle: Mapping[str, float],
    planet_angles: Sequence[float] | Array,
    radial_stiffness: Mapping[str, float],
    tangential_stiffness: Mapping[str, float],
    carrier_speed: float = 0.0,
    torque: Mapping[str, float] | None = None,
    radial_damping: Mapping[str, float] | None = None,
    tangential_damping: Mapping[str, float] | None = None,
    mesh_damping: Mapping[str, float] | None = None,
    damping_always: bool = False,
    backlash: Mapping[str, float] | None = None,
    friction: bool = False,
    balanced: str | None = None,
) -> System:
    """Build W23's model in the carrier frame, Eqs. 7–14 with the misprints mended.

    ``M q̈ + (C + ω_c G) q̇ + (K − ω_c² K_ω) q + Σ d_i W_i = F`` with q = (x, y, u) of sun, ring, carrier
    and planets 1…N, u = r_b θ (carrier: r_c θ), inertias I/r². Meshes are ordered sun–planet 1…N,
    planet–ring 1…N. The sun's positive torque loads the drive flanks.

    Parameters
    ----------
    mass, inertia : of ``sun``, ``ring``, ``carrier``, ``planet`` [kg], [kg m²]
    base_radius : of ``sun``, ``ring``, ``planet`` [m]
    pin_circle_radius : r_c, the carrier's radius to the planets' centres [m]
    pressure_angle : operating, of ``sun_planet`` and ``planet_ring`` [rad]
    planet_angles : (N,) ψ_n [rad]
    radial_stiffness : supports k_x = k_y of every member; the planet's is its bearing on the pin; missing: 0
        [N/m]
    tangential_stiffness : torsional supports k_u at the base radius, the carrier's at the pin circle;
        missing: 0 [N/m]
    carrier_speed : ω_c, of the gyroscopic and centripetal terms [rad/s]
    torque : on ``sun``, ``ring``, ``carrier``, positive as their angles [N m]; see `balanced_torques`
    radial_damping, tangential_damping : of the same supports [N s/m]; see `support_damping`
    mesh_damping : c of ``sun_planet`` and ``planet_ring`` [N s/m]; see `effective_masses`
    damping_always : the mesh damping acts in separation too
    backlash : j_bn of ``sun_planet`` and ``planet_ring`` [m]; None: no back flanks
    friction : the meshes get friction vectors (the tables then carry ``sliding`` and ``moment``)
    balanced : the member whose torque is solved for, so that a set free to turn keeps its speed; None: the
        torques given must be in balance

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
    for given in (mass, inertia, base_radius, radial_stiffness, tangential_stiffness):
        _known(given, MEMBERS)
    for optional in (torque, radial_damping, tangential_damping):
        _known(optional or {}, MEMBERS)
    angles = np.asarray(planet_angles, float)
    alpha = {mesh: float(pressure_angle[mesh]) for mesh in MESHES}
    planets, names = len(angles), coordinates(len(angles))
    vectors = mesh_vectors(angles, alpha["sun_planet"], alpha["planet_ring"], dict(base_radius))
    radius = _radii(base_radius, pin_circle_radius)

    def per_mesh(given: Mapping[str, float]) -> Array:
        return np.repeat([float(given.get(mesh, 0.0)) for mesh in MESHES], planets)

    members = (*CENTRAL, *["planet"] * planets)
    inertial = [(mass[m], mass[m], inertia[m] / radius[m] ** 2) for m in members]
    inner = 1.0 - _pull(mass["planet"], radial_stiffness, carrier_speed)
    spin, swing = _rotation(mass, members, planets * mass["planet"] * inner)
    swing += _unbalance(angles, mass["planet"], len(names))
    stiffness = (radial_stiffness, tangential_stiffness)
    damping = (radial_damping or {}, tangential_damping or {})
    held = (
        *_grounded(names, stiffness, damping),
        *_on_pins(
            angles, inner, stiffness[0], damping[0], mass["planet"] * carrier_speed**2 * radius["carrier"]
        ),
    )
    supports = _against_unbalance(held)
    load = np.zeros(len(names))
    for member, value in (torque or {}).items():
        load[names.index(f"{member}.u")] += value / radius[member]
    turning = carrier_speed != 0.0
    system = System(
        coordinates=names,
        mass=np.diag(np.array(inertial, float).ravel()),
        damping=damping_of(supports, len(names)),
        stiffness=stiffness_of(supports, len(names)),
        direction=vectors.direction,
        load=load,
        mesh_damping=per_mesh(mesh_damping or {}),
        damping_always=damping_always,
        mesh_mass=per_mesh(effective_masses(inertia, base_radius)),
        backlash=None if backlash is None else per_mesh(backlash),
        gyroscopic=spin if turning else None,
        centripetal=swing if turning else None,
        rotation=float(carrier_speed),
        meshes=vectors.names,
        friction_constant=vectors.friction_constant if friction else None,
        friction_slope=vectors.friction_slope if friction else None,
        balance=None if balanced is None else np.array([float(name == f"{balanced}.u") for name in names]),
        supports=supports,
    )
    require_held(system)
    return system


Given = tuple[Mapping[str, float], Mapping[str, float]]
"""Radial and tangential values of the members, 0 where missing."""


def _grounded(names: Sequence[str], stiffness: Given, damping: Given) -> Iterator[Support]:
    """Yield the supports between members and ground; a planet has one of its rotation alone."""
    for name in names:
        member, _, axis = name.rpartition(".")
        own, turns = "planet" if member.startswith("planet") else member, axis == "u"
        if own != "planet" or turns:
            k, c = (given[turns].get(own, 0.0) for given in (stiffness, damping))
            yield from grounded(names, name, k, c)


def _on_pins(
    angles: Array, inner: float, stiffness: Mapping[str, float], damping: Mapping[str, float], pull: float
) -> Iterator[Support]:
    """Yield the bearings of the planets on their pins, which the centrifugal force of a planet preloads.

    ``x_n − (x_c − (1 − σ) u_c sin ψ_n)`` and so on: pins turn on a radius smaller by σ, see `assemble`.

    Parameters
    ----------
    angles : (N,) ψ_n [rad]
    inner : 1 − σ [1]
    stiffness, damping : radial, of the members [N/m], [N s/m]
    pull : m_p ω_c² r_c [N]
    """
    k, c = stiffness.get("planet", 0.0), damping.get("planet", 0.0)
    rows = -bearing_vectors(angles)
    turning = np.where(np.arange(rows.shape[1]) == 3 * CENTRAL.index("carrier") + U, inner, 1.0)
    for planet, angle in enumerate(angles):
        for axis, outwards in (("x", np.cos(angle)), ("y", np.sin(angle))):
            row = rows[2 * planet + "xy".index(axis)]
            yield Support(f"planet-{planet + 1}", axis, row * turning, row, k, c, -pull * float(outwards))


def _against_unbalance(held: Sequence[Support]) -> tuple[Support, ...]:
    """Return the supports, those of the carrier preloaded by what its planets' bearings add up to."""
    pulled = {
        axis: sum(one.preload for one in held if one.member.startswith("planet") and one.axis == axis)
        for axis in "xy"
    }
    return tuple(
        one._replace(preload=pulled[one.axis]) if one.member == "carrier" and one.axis in pulled else one
        for one in held
    )


def effective_masses(inertia: Mapping[str, float], base_radius: Mapping[str, float]) -> dict[str, float]:
    """Return the torsional effective mass of one mesh of each kind, ``1/m = r_1²/I_1 + r_2²/I_2`` [kg].

    A mesh damping ratio refers to it and to the mean mesh stiffness, ``c = 2 ζ √(k̄ m)``.

    References
    ----------
    L16 Eq. 3, for either kind of mesh.
    """
    equivalent = {m: inertia[m] / base_radius[m] ** 2 for m in ("sun", "planet", "ring")}
    return {
        mesh: 1.0 / sum(1.0 / equivalent[member] for member in mesh.split("_"))
        for mesh in MESHES
    }  # fmt: skip


def support_damping(ratio: float, stiffness: float, mass: float) -> float:
    """Return ``c = 2 ζ √(k m)`` of a support on the mass (or I/r²) of its own member [N s/m].

    References
    ----------
    W23 Table 1 gives the ratios ζ.
    """
    return 2.0 * ratio * float(np.sqrt(stiffness * mass))


def balanced_torques(
    sun_torque: float,
    base_radius: Mapping[str, float],
    pin_circle_radius: float,
    pressure_angle: Mapping[str, float],
) -> dict[str, float]:
    """Return the torques on sun, ring and carrier in equilibrium without friction [N m].

    ``F_r = F_s``, ``F_c = −(cos α_s + cos α_r) F_s`` with F = T/r: no work on any rigid rotation.

    References
    ----------
    W23 Eqs. 7–14, at rest.
    """
    force = sun_torque / base_radius["sun"]
    reduction = sum(np.cos(pressure_angle[mesh]) for mesh in MESHES)
    return {
        "sun": sun_torque,
        "ring": force * base_radius["ring"],
        "carrier": -float(reduction) * force * pin_circle_radius,
    }


def _pull(mass: float, radial_stiffness: Mapping[str, float], carrier_speed: float) -> float:
    """Return σ, how far the centrifugal force pulls a planet off its pin, over the pin circle radius [1]."""
    share = mass * carrier_speed**2 / (radial_stiffness.get("planet", 0.0) or np.inf)
    if share >= 1.0:
        raise ValueError(
            f"K − ω_c² K_ω is indefinite: at {carrier_speed:.4g} rad/s a planet's centrifugal force grows "
            f"faster with its path than the bearing's, {radial_stiffness['planet']:.3g} N/m"
        )
    return share


def _rotation(mass: Mapping[str, float], members: Sequence[str], preloaded: float) -> tuple[Array, Array]:
    """Return G and K_ω: ``m (ẍ − 2 ω ẏ − ω² x)``, ``m (ÿ + 2 ω ẋ − ω² y)``, and the pins' pull on u_c."""
    size = 3 * len(members)
    gyroscopic, centripetal = np.zeros((size, size)), np.zeros((size, size))
    for index, member in enumerate(members):
        x, y = 3 * index, 3 * index + 1
        gyroscopic[x, y], gyroscopic[y, x] = -2.0 * mass[member], 2.0 * mass[member]
        centripetal[x, x] = centripetal[y, y] = mass[member]
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


def _radii(base_radius: Mapping[str, float], pin_circle_radius: float) -> dict[str, float]:
    return {**{m: float(base_radius[m]) for m in ("sun", "ring", "planet")}, "carrier": pin_circle_radius}


def _known(given: Mapping[str, float], allowed: Sequence[str]) -> None:
    unknown = sorted(set(given) - set(allowed))
    if unknown:
        raise ValueError(f"unknown member {unknown[0]!r}; members are {', '.join(allowed)}")
