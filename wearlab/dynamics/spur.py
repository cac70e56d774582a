"""Builders of spur-pair models: plain SI numbers in, a `System` out."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from wearlab.dynamics import supports
from wearlab.dynamics.models import InMotion
from wearlab.dynamics.system import System
from wearlab.gears.gear import Gear
from wearlab.mesh.gear_set import mesh_load


class GearSupport(NamedTuple):
    """What holds one gear against ground, on the line of action.

    Parameters
    ----------
    radial_stiffness : bearing stiffness k_y [N/m]
    damping : bearing damping c_y [N s/m]; or give ``damping_ratio``
    tangential_stiffness : torsional spring to ground seen at the base radius, k_θ/r_b² [N/m]
    torsional_damping : torsional damper to ground seen at the base radius, c_θ/r_b² [N s/m]
    damping_ratio : ratio ζ; every missing damping becomes 2 ζ √(k m) of its own spring and mass
    preload : constant force away from the mating gear, as L16's −F_p on y_p and +F_g on y_g [N]
    axial_stiffness : bearing stiffness along the axis k_z, None: rigid [N/m]
    axial_damping : bearing damping along the axis c_z [N s/m]
    """

    radial_stiffness: float | None = None
    damping: float | None = None
    tangential_stiffness: float | None = None
    torsional_damping: float | None = None
    damping_ratio: float | None = None
    preload: float = 0.0
    axial_stiffness: float | None = None
    axial_damping: float | None = None


NO_SUPPORT = GearSupport()


class PairedGear(NamedTuple):
    """A gear of a pair, as a rigid body on its support.

    Parameters
    ----------
    inertia : I [kg m²]
    base_radius : r_b [m]
    mass : m, of a gear that moves along the line of action or its axis [kg]
    support : what holds it
    name : the member's name
    """

    inertia: float
    base_radius: float
    mass: float = 0.0
    support: GearSupport = NO_SUPPORT
    name: str = "gear"

    @property
    def equivalent(self) -> float:
        """I/r_b², the inertia seen at the base radius [kg]."""
        return self.inertia / self.base_radius**2


class Meshing(NamedTuple):
    """What a mesh does beside its springs.

    Parameters
    ----------
    damping : c [N s/m]
    damps_always : the damping acts in separation too
    backlash : normal backlash j_bn [m], None: no back flank
    slope : signed tan β_b of helical teeth: the mesh pushes its driving gear along −z by W tan β_b [1]
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
    arm_slope : dρ/ds of the driving and the driven gear: (1, −1) external, (1, 1) pinion drives ring,
        (−1, −1) ring drives pinion [1]
    """

    pressure_angle: float
    arm_slope: tuple[float, float] = (1.0, -1.0)


mesh_damping_of = supports.damping_by_ratio
"""The name by which plug-ins know it."""


def torsional(
    gears: tuple[PairedGear, PairedGear],
    mesh: Meshing,
    torque: float,
    fluctuation: float | None = None,
    friction: PairFriction | None = None,
) -> System:
    """Build the torsional model, ``m_c ẍ + W = T/r1`` with ``x = r1 θ1 − r2 θ2``.

    With a torsional support on either gear, or with friction, x alone no longer describes the motion, and
    the coordinates become ``u_i = r_i θ_i``, x = u1 − u2. With friction and no torsional support the load
    torque is found: zero mean acceleration. A helical gear whose bearing gives way along its axis moves so,
    ``m_i z̈_i + c_z ż_i + k_z z_i ± W tan β_b = 0``.

    Parameters
    ----------
    gears : driving and driven, with their torsional supports
    mesh : damping and backlash
    torque : on the driving gear [N m]; the driven gear's balances it
    fluctuation : amplitude of the fluctuating input torque [N m] (L16 Eq. 9), None: none
    friction : lever arms of tooth friction, None: none
    """
    return _system(gears, [], mesh, torque, fluctuation, friction)


def spur_3dof(
    gears: tuple[PairedGear, PairedGear],
    mesh: Meshing,
    torque: float,
    fluctuation: float | None = None,
    friction: PairFriction | None = None,
) -> System:
    """Build L16's model with translations along the line of action, Eq. 1–6.

    ``m_p ÿ_p + c_p ẏ_p + k_p y_p + W = F_p``, ``m_g ÿ_g + c_g ẏ_g + k_g y_g − W = F_g``,
    ``m_c ẍ + W = T/r_p``; written with x = r_p θ_p − r_g θ_g so that M is diagonal:
    q = (y_p, y_g, x), d = (1, −1, 1). Axial bearings of helical gears add z as in `torsional`.

    Parameters
    ----------
    gears : driving and driven, with masses and bearings
    mesh, torque, fluctuation, friction : as in `torsional`; friction acts through its moment only
    """
    translations = [
        _moving(gear, "y", sign, -sign * gear.support.preload)
        for gear, sign in zip(gears, SENSES, strict=True)
    ]
    return _system(gears, translations, mesh, torque, fluctuation, friction)


class _Coordinate(NamedTuple):
    """An uncoupled coordinate: its name, its entries of M, C, K, d and F, and its fluctuating load."""

    name: str
    mass: float
    damping: float
    stiffness: float
    direction: float
    load: float = 0.0
    fluctuation: float = 0.0


SENSES = 1.0, -1.0
"""In which a mesh pushes the driving and the driven gear."""
HELD_BY = {
    "y": ("radial_stiffness", "damping"),
    "z": ("axial_stiffness", "axial_damping"),
    "u": ("tangential_stiffness", "torsional_damping"),
}
"""What of a support acts along the line of action, along the axis and on the rotation."""


def _moving(
    gear: PairedGear, axis: str, direction: float, load: float = 0.0, fluctuation: float = 0.0
) -> _Coordinate:
    """Return a coordinate of a gear on its support."""
    mass = gear.equivalent if axis == "u" else gear.mass
    stiffness, given = (getattr(gear.support, key) for key in HELD_BY[axis])
    damping = supports.damping_or_ratio(given, gear.support.damping_ratio, stiffness, mass)
    return _Coordinate(f"{gear.name}.{axis}", mass, damping, stiffness or 0.0, direction, load, fluctuation)


def _system(
    gears: tuple[PairedGear, PairedGear],
    translations: Sequence[_Coordinate],
    mesh: Meshing,
    torque: float,
    fluctuation: float | None,
    friction: PairFriction | None,
) -> System:
    """Return a pair that moves by these translations, along its axes where bearings give way, and turns."""
    force, variation = (mesh_load(each, gears[0].base_radius) for each in (torque, fluctuation or 0.0))
    holds = [(gear.support.tangential_stiffness, gear.support.torsional_damping) for gear in gears]
    if friction is not None or any(hold != (None, None) for hold in holds):
        rotations = [
            _moving(gear, "u", sense, sense * force, changes)
            for gear, sense, changes in zip(gears, SENSES, (variation, 0.0), strict=True)
        ]
    else:
        # x = u1 − u2: ẍ = (T1/r1 − W)/m1 + (T2/r2 − W)/m2, and both loads equal T/r1; a fluctuation
        # of the input torque alone enters through the driving gear's share m_c/m1 (L16 Eq. 5).
        m1, m2 = (gear.equivalent for gear in gears)
        m_c = supports.effective_mass(m1, m2)
        rotations = [_Coordinate("mesh.x", m_c, 0.0, 0.0, 1.0, force, variation * m_c / m1)]
    axial = [
        _moving(gear, "z", sense * mesh.slope)
        for gear, sense in zip(gears, SENSES, strict=True)
        if gear.support.axial_stiffness is not None
    ]
    names, mass, damping, stiffness, direction, load, changes = zip(
        *translations, *axial, *rotations, strict=True
    )
    each = zip(names, stiffness, damping, strict=True)
    springs = tuple(support for name, k, c in each for support in supports.grounded(names, name, k, c))
    system = System(
        coordinates=names,
        mass=np.diag(np.array(mass, float)),
        damping=supports.damping_of(springs, len(names)),
        stiffness=supports.stiffness_of(springs, len(names)),
        direction=np.array([direction], float),
        load=np.array(load, float),
        mesh_damping=np.array([mesh.damping]),
        damping_always=mesh.damps_always,
        backlash=None if mesh.backlash is None else np.array([mesh.backlash]),
        fluctuation_direction=None if fluctuation is None else np.array(changes, float),
        supports=springs,
    )
    if friction is None:
        return system
    # on the last two coordinates, u1 and u2
    constant, slope = np.zeros((2, 1, len(names)))
    constant[0, -2:] = np.tan(friction.pressure_angle) * np.array(SENSES)
    radii = np.array([gear.base_radius for gear in gears])
    slope[0, -2:] = np.array(SENSES) * friction.arm_slope / radii
    balance = None if system.stiffness[-2:, -2:].any() else np.eye(len(names))[-1]
    return system._replace(friction_constant=constant, friction_slope=slope, balance=balance)


def arguments_of(model: Any, motion: InMotion) -> tuple[Any, ...]:
    """Return what `torsional` and `spur_3dof` are told; friction has arms that grow as curvatures do."""
    pair, mesh = motion.gears.kinds[0].pair, motion.meshes[0]
    first, second = (
        PairedGear(gear.inertia, gear.base_radius, gear.mass, _support(model, gear), gear.name)
        for gear in pair.gears
    )
    damping, waves, friction = mesh.damping, motion.operation.fluctuation, None
    if damping is None:
        mass = supports.effective_mass(first.equivalent, second.equivalent)
        damping = supports.damping_by_ratio(mesh.damping_ratio, float(motion.stiffness[0]), mass)
    if model.friction is not None:
        first_slope, second_slope = np.diff(pair.curvature(np.array([0.0, 1.0])), axis=1).ravel().tolist()
        friction = PairFriction(pair.working_pressure_angle, (first_slope, second_slope))
    return (
        (first, second),
        Meshing(damping, mesh.damps_always, mesh.normal_backlash, motion.slope),
        motion.operation.torque,
        waves[0].amplitude if waves else None,
        friction,
    )


def _support(model: Any, gear: Gear) -> GearSupport:
    """Return what holds a gear, torsional springs and dampers as seen at the base radius."""
    given, square = model.supports.get(gear.name), gear.base_radius**2
    if given is None:
        return NO_SUPPORT
    seen = {key: getattr(given, key) for key in GearSupport._fields}
    if given.torsional_stiffness is not None:
        seen["tangential_stiffness"] = given.torsional_stiffness / square
    if given.torsional_damping is not None:
        seen["torsional_damping"] = given.torsional_damping / square
    return GearSupport(**seen)
