"""Builders of spur-pair models: plain SI numbers in, a `System` out."""

from typing import Any, NamedTuple, TypedDict

import numpy as np

from wearlab.dynamics.models import InMotion
from wearlab.dynamics.supports import damping_by_ratio, damping_of, damping_or_ratio, grounded, stiffness_of
from wearlab.dynamics.system import System
from wearlab.gears.gear import Gear, GearPair
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

    def radial_damping_on(self, mass: float) -> float:
        """Return c_y [N s/m] for a gear of ``mass`` [kg]."""
        return damping_or_ratio(self.damping, self.damping_ratio, self.radial_stiffness, mass)

    def axial_damping_on(self, mass: float) -> float:
        """Return c_z [N s/m] for a gear of ``mass`` [kg]."""
        return damping_or_ratio(self.axial_damping, self.damping_ratio, self.axial_stiffness, mass)

    def torsional_damping_on(self, mass: float) -> float:
        """Return the torsional damping at the base radius [N s/m] for an inertia I/r_b² of ``mass`` [kg]."""
        return damping_or_ratio(self.torsional_damping, self.damping_ratio, self.tangential_stiffness, mass)


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

    @property
    def turns_freely(self) -> bool:
        """Whether nothing holds its rotation."""
        return self.support.tangential_stiffness is None and self.support.torsional_damping is None


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


mesh_damping_of = damping_by_ratio
"""The name by which plug-ins know it."""


def effective_mass(inertia: tuple[float, float], base_radius: tuple[float, float]) -> float:
    """Return the torsional effective mass of a mesh, ``1/m_c = r1²/I1 + r2²/I2`` [kg] (L16 Eq. 3).

    Parameters
    ----------
    inertia : I of the driving and the driven gear [kg m²]
    base_radius : their base radii [m]
    """
    return 1.0 / sum(r**2 / i for r, i in zip(base_radius, inertia, strict=True))


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
    return _system(gears, [], mesh, (torque, fluctuation), friction)


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
        _Coordinate(
            f"{gear.name}.y", gear.mass, gear.support.radial_damping_on(gear.mass),
            gear.support.radial_stiffness or 0.0, sign, -sign * gear.support.preload,
        )
        for gear, sign in zip(gears, (1.0, -1.0), strict=True)
    ]  # fmt: skip
    return _system(gears, translations, mesh, (torque, fluctuation), friction)


def _rubbing(system: System, friction: PairFriction, gears: tuple[PairedGear, PairedGear]) -> System:
    """Return the system with friction on its last two coordinates, u1 and u2."""
    arm = np.tan(friction.pressure_angle)
    constant, slope = np.zeros_like(system.direction), np.zeros_like(system.direction)
    constant[0, -2:] = arm, -arm
    driving, driven = friction.arm_slope
    slope[0, -2:] = driving / gears[0].base_radius, -driven / gears[1].base_radius
    free = not system.stiffness[-2:, -2:].any()
    return system._replace(
        friction_constant=constant,
        friction_slope=slope,
        balance=np.eye(len(system.load))[-1] if free else None,
    )


class _Coordinate(NamedTuple):
    """An uncoupled coordinate: its name, its entries of M, C, K, d and F, and its fluctuating load."""

    name: str
    mass: float
    damping: float
    stiffness: float
    direction: float
    load: float = 0.0
    fluctuation: float = 0.0


def _axial(gears: tuple[PairedGear, PairedGear], slope: float) -> list[_Coordinate]:
    """Return the translations along their axes of the gears whose bearings give way there."""
    return [
        _Coordinate(
            f"{gear.name}.z", gear.mass, gear.support.axial_damping_on(gear.mass), stiffness, sign * slope
        )
        for gear, sign in zip(gears, (1.0, -1.0), strict=True)
        if (stiffness := gear.support.axial_stiffness) is not None
    ]


def _rotation(
    gears: tuple[PairedGear, PairedGear], torque: float, fluctuation: float, both: bool
) -> list[_Coordinate]:
    """Return x alone where nothing holds the rotations, else (or when asked) both rotations."""
    m1, m2 = (gear.equivalent for gear in gears)
    force, variation = (mesh_load(each, gears[0].base_radius) for each in (torque, fluctuation))
    if not both and all(gear.turns_freely for gear in gears):
        # x = u1 − u2: ẍ = (T1/r1 − W)/m1 + (T2/r2 − W)/m2, and both loads equal T/r1; a fluctuation
        # of the input torque alone enters through the driving gear's share m_c/m1 (L16 Eq. 5).
        m_c = 1.0 / (1.0 / m1 + 1.0 / m2)
        return [_Coordinate("mesh.x", m_c, 0.0, 0.0, 1.0, force, variation * m_c / m1)]
    return [
        _Coordinate(
            f"{gear.name}.u", mass, gear.support.torsional_damping_on(mass),
            gear.support.tangential_stiffness or 0.0, sign, sign * force, changes,
        )
        for gear, mass, sign, changes in zip(gears, (m1, m2), (1.0, -1.0), (variation, 0.0), strict=True)
    ]  # fmt: skip


def _system(
    gears: tuple[PairedGear, PairedGear],
    translations: list[_Coordinate],
    mesh: Meshing,
    torques: tuple[float, float | None],
    friction: PairFriction | None,
) -> System:
    torque, fluctuation = torques
    rotations = _rotation(gears, torque, fluctuation or 0.0, friction is not None)
    names, mass, damping, stiffness, direction, load, changes = zip(
        *translations, *_axial(gears, mesh.slope), *rotations, strict=True
    )
    each = zip(names, stiffness, damping, strict=True)
    supports = tuple(support for name, k, c in each for support in grounded(names, name, k, c))
    system = System(
        coordinates=names,
        mass=np.diag(np.array(mass, float)),
        damping=damping_of(supports, len(names)),
        stiffness=stiffness_of(supports, len(names)),
        direction=np.array([direction], float),
        load=np.array(load, float),
        mesh_damping=np.array([mesh.damping]),
        damping_always=mesh.damps_always,
        backlash=None if mesh.backlash is None else np.array([mesh.backlash]),
        fluctuation_direction=None if fluctuation is None else np.array(changes, float),
        supports=supports,
    )
    return system if friction is None else _rubbing(system, friction, gears)


class PairArguments(TypedDict):
    """What a builder of :mod:`wearlab.dynamics.spur` is told."""

    gears: tuple[PairedGear, PairedGear]
    mesh: Meshing
    torque: float
    fluctuation: float | None
    friction: PairFriction | None


def common_arguments(model: Any, motion: InMotion) -> PairArguments:
    """Return what both builders of :mod:`wearlab.dynamics.spur` are told."""
    pair, mesh = motion.gears.kinds[0].pair, motion.meshes[0]
    first, second = (_gear(gear, model.supports.get(gear.name)) for gear in pair.gears)
    damping = mesh.damping
    if damping is None:
        mass = effective_mass((first.inertia, second.inertia), (first.base_radius, second.base_radius))
        damping = damping_by_ratio(mesh.damping_ratio, float(motion.stiffness[0]), mass)
    waves = motion.operation.fluctuation
    return {
        "gears": (first, second),
        "mesh": Meshing(damping, mesh.damps_always, mesh.normal_backlash, motion.slope),
        "torque": motion.operation.torque,
        "fluctuation": waves[0].amplitude if waves else None,
        "friction": None if model.friction is None else _friction(pair),
    }


def _gear(gear: Gear, support: Any) -> PairedGear:
    return PairedGear(
        gear.inertia, gear.base_radius, gear.mass, _support(support, gear.base_radius), gear.name
    )


def _support(given: Any, base_radius: float) -> GearSupport:
    if given is None:
        return NO_SUPPORT
    tangential = given.tangential_stiffness
    if given.torsional_stiffness is not None:
        tangential = given.torsional_stiffness / base_radius**2
    torsional_damping = given.torsional_damping
    return GearSupport(
        radial_stiffness=given.radial_stiffness,
        damping=given.damping,
        tangential_stiffness=tangential,
        torsional_damping=None if torsional_damping is None else torsional_damping / base_radius**2,
        damping_ratio=given.damping_ratio,
        preload=given.preload,
        axial_stiffness=given.axial_stiffness,
        axial_damping=given.axial_damping,
    )


def _friction(pair: GearPair) -> PairFriction:
    """Return where friction acts on a pair: arms that grow with s as the flanks' curvatures do."""
    first, second = (curvature[1] - curvature[0] for curvature in pair.curvature(np.array([0.0, 1.0])))
    return PairFriction(pair.working_pressure_angle, (float(first), float(second)))
