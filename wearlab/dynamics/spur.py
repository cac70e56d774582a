"""Builders of spur-pair models: plain SI numbers in, a `System` out."""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.supports import damping_of, grounded, stiffness_of
from wearlab.dynamics.system import System


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
    """

    radial_stiffness: float | None = None
    damping: float | None = None
    tangential_stiffness: float | None = None
    torsional_damping: float | None = None
    damping_ratio: float | None = None
    preload: float = 0.0

    def radial_damping_on(self, mass: float) -> float:
        """Return c_y [N s/m] for a gear of ``mass`` [kg]."""
        return _damping(self.damping, self.damping_ratio, self.radial_stiffness, mass)

    def torsional_damping_on(self, mass: float) -> float:
        """Return the torsional damping at the base radius [N s/m] for an inertia I/r_b² of ``mass`` [kg]."""
        return _damping(self.torsional_damping, self.damping_ratio, self.tangential_stiffness, mass)


NO_SUPPORT = GearSupport()


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


def _damping(value: float | None, ratio: float | None, stiffness: float | None, mass: float) -> float:
    if value is not None:
        return value
    return 2.0 * (ratio or 0.0) * np.sqrt((stiffness or 0.0) * mass)


def effective_mass(inertia: tuple[float, float], base_radius: tuple[float, float]) -> float:
    """Return the torsional effective mass of a mesh, ``1/m_c = r1²/I1 + r2²/I2`` [kg] (L16 Eq. 3).

    Parameters
    ----------
    inertia : I of the driving and the driven gear [kg m²]
    base_radius : their base radii [m]
    """
    return 1.0 / sum(r**2 / i for r, i in zip(base_radius, inertia, strict=True))


def mesh_damping_of(ratio: float, mean_stiffness: float, mass: float) -> float:
    """Return mesh damping ``c = 2 ζ √(k̄ m_c)`` [N s/m].

    References
    ----------
    Kahraman & Singh 1990.
    """
    return 2.0 * ratio * float(np.sqrt(mean_stiffness * mass))


def torsional(
    *,
    inertia: tuple[float, float],
    base_radius: tuple[float, float],
    torque: float,
    mesh_damping: float,
    damping_always: bool = False,
    backlash: float | None = None,
    fluctuation: float | None = None,
    supports: tuple[GearSupport, GearSupport] = (NO_SUPPORT, NO_SUPPORT),
    names: tuple[str, str] = ("pinion", "gear"),
    friction: PairFriction | None = None,
) -> System:
    """Build the torsional model, ``m_c ẍ + W = T/r1`` with ``x = r1 θ1 − r2 θ2``.

    With a torsional support on either gear, or with friction, x alone no longer describes the motion, and
    the coordinates become ``u_i = r_i θ_i``, x = u1 − u2. With friction and no torsional support the load
    torque is found: zero mean acceleration.

    Parameters
    ----------
    inertia, base_radius : of the driving and driven gear [kg m²], [m]
    torque : on the driving gear [N m]; the driven gear's balances it
    mesh_damping : c [N s/m]
    damping_always : the damping acts in separation too
    backlash : normal backlash j_bn [m], None: no back flank
    fluctuation : amplitude of the fluctuating input torque [N m] (L16 Eq. 9), None: none
    supports : torsional supports of the driving and driven gear
    names : member names, driving first
    friction : lever arms of tooth friction, None: none
    """
    rotation = _rotation(inertia, base_radius, torque, fluctuation, supports, names, friction is not None)
    system = _system([rotation], mesh_damping, damping_always, backlash, effective_mass(inertia, base_radius))
    return system if friction is None else _rubbing(system, friction, base_radius)


def spur_3dof(
    *,
    mass: tuple[float, float],
    inertia: tuple[float, float],
    base_radius: tuple[float, float],
    torque: float,
    mesh_damping: float,
    supports: tuple[GearSupport, GearSupport],
    damping_always: bool = False,
    backlash: float | None = None,
    fluctuation: float | None = None,
    names: tuple[str, str] = ("pinion", "gear"),
    friction: PairFriction | None = None,
) -> System:
    """Build L16's model with translations along the line of action, Eq. 1–6.

    ``m_p ÿ_p + c_p ẏ_p + k_p y_p + W = F_p``, ``m_g ÿ_g + c_g ẏ_g + k_g y_g − W = F_g``,
    ``m_c ẍ + W = T/r_p``; written with x = r_p θ_p − r_g θ_g so that M is diagonal:
    q = (y_p, y_g, x), d = (1, −1, 1).

    Parameters
    ----------
    mass, inertia, base_radius : of the driving and driven gear [kg], [kg m²], [m]
    torque : on the driving gear [N m]; the driven gear's balances it
    mesh_damping : c [N s/m]
    supports : bearings of the driving and driven gear
    damping_always, backlash, fluctuation, names, friction : as in `torsional`; friction acts through its
        moment only
    """
    rotation = _rotation(inertia, base_radius, torque, fluctuation, supports, names, friction is not None)
    translations = [
        _Part(
            (f"{name}.y",),
            (m,),
            (support.radial_damping_on(m),),
            (support.radial_stiffness or 0.0,),
            (sign,),
            (-sign * support.preload,),
            (0.0,),
        )
        for name, m, support, sign in zip(names, mass, supports, (1.0, -1.0), strict=True)
    ]
    parts = [*translations, rotation]
    system = _system(parts, mesh_damping, damping_always, backlash, effective_mass(inertia, base_radius))
    return system if friction is None else _rubbing(system, friction, base_radius)


def _rubbing(system: System, friction: PairFriction, base_radius: tuple[float, float]) -> System:
    """Return the system with friction on its last two coordinates, u1 and u2."""
    arm = np.tan(friction.pressure_angle)
    constant, slope = np.zeros_like(system.direction), np.zeros_like(system.direction)
    constant[0, -2:] = arm, -arm
    one, two = friction.arm_slope
    slope[0, -2:] = one / base_radius[0], -two / base_radius[1]
    free = not system.stiffness[-2:, -2:].any()
    return system._replace(
        friction_constant=constant,
        friction_slope=slope,
        balance=np.eye(len(system.load))[-1] if free else None,
    )


class _Part(NamedTuple):
    """Uncoupled coordinates, one entry each: names, M, c, k, d, F and fluctuating load (None: absent)."""

    names: tuple[str, ...]
    mass: tuple[float, ...]
    damping: tuple[float, ...]
    stiffness: tuple[float, ...]
    direction: tuple[float, ...]
    load: tuple[float, ...]
    fluctuation: tuple[float, ...] | None


def _rotation(
    inertia: tuple[float, float],
    base_radius: tuple[float, float],
    torque: float,
    fluctuation: float | None,
    supports: tuple[GearSupport, GearSupport],
    names: tuple[str, str],
    both: bool = False,
) -> _Part:
    """Return x alone where nothing holds the rotations, else (or when asked) both rotations."""
    m1, m2 = (i / r**2 for i, r in zip(inertia, base_radius, strict=True))
    force = torque / base_radius[0]
    variation = None if fluctuation is None else fluctuation / base_radius[0]
    if not both and all(s.tangential_stiffness is None and s.torsional_damping is None for s in supports):
        # x = u1 − u2: ẍ = (T1/r1 − W)/m1 + (T2/r2 − W)/m2, and both loads equal T/r1; a fluctuation
        # of the input torque alone enters through the driving gear's share m_c/m1 (L16 Eq. 5).
        m_c = 1.0 / (1.0 / m1 + 1.0 / m2)
        share = None if variation is None else (variation * m_c / m1,)
        return _Part(("mesh.x",), (m_c,), (0.0,), (0.0,), (1.0,), (force,), share)
    return _Part(
        tuple(f"{name}.u" for name in names),
        (m1, m2),
        (supports[0].torsional_damping_on(m1), supports[1].torsional_damping_on(m2)),
        (supports[0].tangential_stiffness or 0.0, supports[1].tangential_stiffness or 0.0),
        (1.0, -1.0),
        (force, -force),
        None if variation is None else (variation, 0.0),
    )


def _system(
    parts: list[_Part], mesh_damping: float, damping_always: bool, backlash: float | None, mesh_mass: float
) -> System:
    def joined(field: str) -> Array:
        return np.array([value for part in parts for value in getattr(part, field)])

    names = tuple(name for part in parts for name in part.names)
    each = zip(names, joined("stiffness"), joined("damping"), strict=True)
    supports = tuple(
        support for name, stiffness, damping in each for support in grounded(names, name, stiffness, damping)
    )
    return System(
        coordinates=names,
        mass=np.diag(joined("mass")),
        damping=damping_of(supports, len(names)),
        stiffness=stiffness_of(supports, len(names)),
        direction=joined("direction")[None, :],
        load=joined("load"),
        mesh_damping=np.array([mesh_damping]),
        damping_always=damping_always,
        mesh_mass=np.array([mesh_mass]),
        backlash=None if backlash is None else np.array([backlash]),
        fluctuation_direction=None if parts[-1].fluctuation is None else joined("fluctuation"),
        supports=supports,
    )
