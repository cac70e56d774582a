"""Builders of spur-pair models: plain SI numbers in, a `System` out."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics import supports
from wearlab.dynamics.models import InMotion
from wearlab.dynamics.system import System
from wearlab.mesh.gear_set import Body, mesh_load

SENSES = (1.0, -1.0)
"""Directions in which a mesh pushes the driving and the driven gear."""
Coordinate = tuple[str, str]
"""Gear and axis; the deflection of the mesh itself is `MESH`."""
MESH = ("mesh", "x")


class Meshing(NamedTuple):
    """What a mesh does beside its springs.

    Parameters
    ----------
    damping : c [N s/m]
    damps_always : the damping acts in separation too
    backlash : normal backlash j_bn [m], None: no back flank
    slope : signed tan β_b of helical teeth: the mesh pushes its driving gear along −z
        by W tan β_b [1]
    """

    damping: float = 0.0
    damps_always: bool = False
    backlash: float | None = None
    slope: float = 0.0


class PairFriction(NamedTuple):
    """Where tooth friction acts on a pair.

    Its arms about the gears' axes are ``ρ_i = r_i tan α_w + slope_i s``.

    Parameters
    ----------
    pressure_angle : operating α_w [rad]
    arm_slope : dρ/ds of the driving and the driven gear: (1, −1) external, (1, 1)
        pinion drives ring, (−1, −1) ring drives pinion [1]
    """

    pressure_angle: float
    arm_slope: tuple[float, float] = (1.0, -1.0)


mesh_damping_of = supports.damping_by_ratio
"""The name by which plug-ins know it."""


def meshing_of(
    options: Any, stiffness: float, mass: float, slope: float = 0.0
) -> Meshing:
    """Return what a mesh does beside its springs, from its options.

    Damping is given, or 2 ζ √(k̄ m).

    Parameters
    ----------
    options : ``[mesh]``
    stiffness, mass : mean stiffness k̄ [N/m], effective mass m [kg]
    slope : see `Meshing`

    References
    ----------
    Kahraman & Singh 1990.
    """
    damping = supports.damping_or_ratio(
        options.damping, options.damping_ratio, stiffness, mass
    )
    return Meshing(damping, options.damps_always, options.normal_backlash, slope)


class Paired(NamedTuple):
    """Two gears that mesh.

    Parameters
    ----------
    gears : driving and driven by name, each counted at its base radius
    held : what holds them; missing: nothing
    mesh : damping and backlash
    load : static normal force of the mesh [N], by the torque on the driving gear, which
        that on the driven gear balances
    fluctuation : amplitude of the fluctuating input torque [N m] (L16 Eq. 9), None:
        none
    friction : lever arms of tooth friction, None: none
    """

    gears: Mapping[str, Body]
    held: Mapping[str, supports.MemberSupport]
    mesh: Meshing
    load: float
    fluctuation: float | None = None
    friction: PairFriction | None = None


def torsional(pair: Paired) -> System:
    """Build the torsional model, ``m_c ẍ + W = T/r1`` with ``x = r1 θ1 − r2 θ2``.

    With a torsional support on either gear, or with friction, x alone no longer
    describes the motion, and the coordinates become ``u_i = r_i θ_i``, x = u1 − u2.
    With friction and no torsional support the load torque is found: zero mean
    acceleration. A helical gear whose bearing gives way along its axis moves so, ``m_i
    z̈_i + c_z ż_i + k_z z_i ± W tan β_b = 0``.
    """
    return _system(pair, [])


def spur_3dof(pair: Paired) -> System:
    """Build L16's model with translations along the line of action, Eq. 1–6.

    ``m_p ÿ_p + c_p ẏ_p + k_p y_p + W = F_p``, ``m_g ÿ_g + c_g ẏ_g + k_g y_g − W =
    F_g``, ``m_c ẍ + W = T/r_p``; written with x = r_p θ_p − r_g θ_g so that M is
    diagonal: q = (y_p, y_g, x), d = (1, −1, 1). Axial bearings of helical gears add z
    as in `torsional`; friction acts through its moment only.
    """
    return _system(pair, [(gear, "y") for gear in pair.gears])


def _system(pair: Paired, translations: list[Coordinate]) -> System:
    """Return a pair that moves by translations, and turns.

    Gears also move along their axes where their bearings give way.
    """
    gears = pair.gears
    mesh = pair.mesh
    held = {gear: pair.held.get(gear, supports.FREE) for gear in gears}
    coordinates = _coordinates(pair, held, translations)
    names = tuple(f"{gear}.{axis}" for gear, axis in coordinates)
    masses = _masses(gears)
    loads = _loads(pair, held)

    options: dict[str, Any] = {
        "mesh_damping": np.array([mesh.damping]),
        "damping_always": mesh.damps_always,
    }
    if mesh.backlash is not None:
        options["backlash"] = np.array([mesh.backlash])
    if pair.fluctuation is not None:
        changes = _fluctuating_loads(pair, masses[MESH])
        options["fluctuation_direction"] = _values(changes, coordinates)
    system = System.on(
        tuple(supports.to_ground(names, held, {})),
        names,
        _values(masses, coordinates),
        direction=_direction(pair, coordinates),
        load=_values(loads, coordinates),
        **options,
    )
    if pair.friction is None:
        return system
    return _with_friction(system, pair.friction, gears)


def _coordinates(
    pair: Paired,
    held: supports.Held,
    translations: list[Coordinate],
) -> list[Coordinate]:
    """Return the coordinates: translations, those along the axes, and rotations.

    Both gears have a rotation where something but the mesh acts on one of them alone.
    """
    first, second = pair.gears
    turning = {
        (support.tangential_stiffness, support.tangential_damping)
        for support in held.values()
    }
    axial = [
        (gear, "z") for gear in pair.gears if held[gear].axial_stiffness is not None
    ]
    if pair.friction is None and turning == {(None, None)}:
        return [*translations, *axial, MESH]
    return [*translations, *axial, (first, "u"), (second, "u")]


def _values(values: Mapping[Coordinate, float], coordinates: list[Coordinate]) -> Array:
    """Return values in the order of the coordinates, 0 where there is none."""
    return np.array([values.get(coordinate, 0.0) for coordinate in coordinates])


def _masses(gears: Mapping[str, Body]) -> dict[Coordinate, float]:
    """Return the mass of every coordinate a pair may have [kg]."""
    equivalent = [body.equivalent for body in gears.values()]
    masses = {MESH: supports.effective_mass(*equivalent)}
    for gear, body in gears.items():
        masses[gear, "y"] = body.mass
        masses[gear, "z"] = body.mass
        masses[gear, "u"] = body.equivalent
    return masses


def _loads(pair: Paired, held: supports.Held) -> dict[Coordinate, float]:
    """Return the load of every coordinate a pair may have [N].

    ``x = u1 − u2: ẍ = (T1/r1 − W)/m1 + (T2/r2 − W)/m2``, and both loads equal T/r1.
    """
    first, second = pair.gears
    loads = {MESH: pair.load, (first, "u"): pair.load, (second, "u"): -pair.load}
    for gear, sense in zip(pair.gears, SENSES, strict=True):
        loads[gear, "y"] = -sense * held[gear].preload
    return loads


def _fluctuating_loads(pair: Paired, mesh_mass: float) -> dict[Coordinate, float]:
    """Return the amplitude of the fluctuating load of every coordinate [N].

    The input torque alone fluctuates, which enters x through the driving gear's share
    m_c/m1 (L16 Eq. 5).
    """
    first, _ = pair.gears
    driving = pair.gears[first]
    force = mesh_load(pair.fluctuation or 0.0, driving.radius)
    return {MESH: force * mesh_mass / driving.equivalent, (first, "u"): force}


def _direction(pair: Paired, coordinates: list[Coordinate]) -> Array:
    """Return by how much each coordinate deflects the mesh, (1, n) [1]."""
    sense = dict(zip(pair.gears, SENSES, strict=True))
    row = [
        sense.get(gear, 1.0) * (pair.mesh.slope if axis == "z" else 1.0)
        for gear, axis in coordinates
    ]
    return np.array([row])


def _with_friction(
    system: System, friction: PairFriction, gears: Mapping[str, Body]
) -> System:
    """Return a system whose teeth rub; friction acts on its last two coordinates.

    These are u1 and u2. The load torque is found where nothing grounds them.
    """
    count = len(system.coordinates)
    constant = np.zeros((1, count))
    slope = np.zeros((1, count))
    radii = np.array([body.radius for body in gears.values()])
    constant[0, -2:] = np.tan(friction.pressure_angle) * np.array(SENSES)
    slope[0, -2:] = np.array(SENSES) * friction.arm_slope / radii
    grounded = system.stiffness[-2:, -2:].any()
    return system._replace(
        friction_constant=constant,
        friction_slope=slope,
        balance=None if grounded else np.eye(count)[-1],
    )


def paired(model: Any, motion: InMotion) -> Paired:
    """Return what meshes in a gear set of two.

    Friction has arms that grow as curvatures do.

    Parameters
    ----------
    model : options of the dynamic model
    motion : the gear set in operation
    """
    pair = motion.gears.kinds[0].pair
    bodies = {gear.name: motion.gears.bodies[gear.name] for gear in pair.gears}
    options = model.supports.given
    held = {
        name: supports.support_of(options[name], body)
        for name, body in bodies.items()
        if name in options
    }
    mass = supports.effective_mass(*(body.equivalent for body in bodies.values()))
    stiffness = float(motion.stiffness[0])

    friction = None
    if model.friction is not None:
        curvature = pair.curvature(np.array([0.0, 1.0]))
        first_slope, second_slope = np.diff(curvature, axis=1).ravel().tolist()
        friction = PairFriction(
            pair.working_pressure_angle, (first_slope, second_slope)
        )

    waves = motion.operation.fluctuation
    return Paired(
        gears=bodies,
        held=held,
        mesh=meshing_of(motion.meshes[0], stiffness, mass, motion.slope),
        load=motion.gears.kinds[0].load,
        fluctuation=waves[0].amplitude if waves else None,
        friction=friction,
    )
