"""Builders of spur-pair models: plain SI numbers in, a `System` out."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from wearlab.dynamics import supports
from wearlab.dynamics.models import InMotion
from wearlab.dynamics.system import System
from wearlab.mesh.gear_set import Body, mesh_load


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
    """Where tooth friction acts on a pair: arms ``ρ_i = r_i tan α_w + slope_i s`` about the gears' axes.

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
    torque : on the driving gear [N m]; the driven gear's balances it
    fluctuation : amplitude of the fluctuating input torque [N m] (L16 Eq. 9), None:
        none
    friction : lever arms of tooth friction, None: none
    """

    gears: Mapping[str, Body]
    held: Mapping[str, supports.MemberSupport]
    mesh: Meshing
    torque: float
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


SENSES = 1.0, -1.0
"""In which a mesh pushes the driving and the driven gear."""


def _system(pair: Paired, moving: list[tuple[str, str]]) -> System:
    """Return a pair that moves by these translations, along its axes where bearings give way, and turns."""
    gears = pair.gears
    mesh = pair.mesh
    friction = pair.friction
    held = {gear: pair.held.get(gear, supports.FREE) for gear in gears}
    (first, second) = gears
    sense = dict(zip((*gears, "mesh"), (*SENSES, 1.0), strict=True))
    radius = gears[first].radius
    force, variation = (
        mesh_load(each, radius) for each in (pair.torque, pair.fluctuation or 0.0)
    )
    turning = {
        (each.tangential_stiffness, each.tangential_damping) for each in held.values()
    }
    apart = friction is not None or turning != {(None, None)}
    rotations = [(first, "u"), (second, "u")] if apart else [("mesh", "x")]
    axial = [(gear, "z") for gear in gears if held[gear].axial_stiffness is not None]
    moving = [*moving, *axial, *rotations]
    # x = u1 − u2: ẍ = (T1/r1 − W)/m1 + (T2/r2 − W)/m2, and both loads equal T/r1; a
    # fluctuation of the input torque alone enters through the driving gear's share
    # m_c/m1 (L16 Eq. 5).
    m_c = supports.effective_mass(*(body.equivalent for body in gears.values()))
    mass = {("mesh", "x"): m_c}
    load = {("mesh", "x"): force, (first, "u"): force, (second, "u"): -force}
    changes = {
        ("mesh", "x"): variation * m_c / gears[first].equivalent,
        (first, "u"): variation,
    }
    for gear, body in gears.items():
        mass |= {
            (gear, "y"): body.mass,
            (gear, "z"): body.mass,
            (gear, "u"): body.equivalent,
        }
        load[gear, "y"] = -sense[gear] * held[gear].preload
    names = tuple(f"{gear}.{axis}" for gear, axis in moving)
    masses = np.array([mass.get(each, 0.0) for each in moving])
    loads = np.array([load.get(each, 0.0) for each in moving])
    varied = np.array([changes.get(each, 0.0) for each in moving])
    direction = np.array(
        [[sense[gear] * (mesh.slope if axis == "z" else 1.0) for gear, axis in moving]]
    )
    given: dict[str, Any] = {
        "mesh_damping": np.array([mesh.damping]),
        "damping_always": mesh.damps_always,
    }
    if mesh.backlash is not None:
        given["backlash"] = np.array([mesh.backlash])
    if pair.fluctuation is not None:
        given["fluctuation_direction"] = varied
    springs = tuple(supports.to_ground(names, held, {}))
    system = System.on(springs, names, masses, direction=direction, load=loads, **given)
    if friction is None:
        return system
    # on the last two coordinates, u1 and u2
    constant, slope = np.zeros((2, 1, len(names)))
    constant[0, -2:] = np.tan(friction.pressure_angle) * np.array(SENSES)
    slope[0, -2:] = (
        np.array(SENSES)
        * friction.arm_slope
        / np.array([body.radius for body in gears.values()])
    )
    balance = None if system.stiffness[-2:, -2:].any() else np.eye(len(names))[-1]
    return system._replace(
        friction_constant=constant, friction_slope=slope, balance=balance
    )


def paired(model: Any, motion: InMotion) -> Paired:
    """Return what meshes in a gear set of two.

    Friction has arms that grow as curvatures do.
    """
    pair = motion.gears.kinds[0].pair
    waves = motion.operation.fluctuation
    friction = None
    bodies = {gear.name: motion.gears.bodies[gear.name] for gear in pair.gears}
    given = model.supports.given
    held = {
        name: supports.support_of(given[name], body)
        for name, body in bodies.items()
        if name in given
    }
    mass = supports.effective_mass(*(body.equivalent for body in bodies.values()))
    mesh = meshing_of(motion.meshes[0], float(motion.stiffness[0]), mass, motion.slope)
    if model.friction is not None:
        first_slope, second_slope = (
            np.diff(pair.curvature(np.array([0.0, 1.0])), axis=1).ravel().tolist()
        )
        friction = PairFriction(
            pair.working_pressure_angle, (first_slope, second_slope)
        )
    variation = waves[0].amplitude if waves else None
    return Paired(bodies, held, mesh, motion.operation.torque, variation, friction)
