"""Energy over a period of a response: every term integrated on its own, none by subtraction.

Multiply the equation of motion by the whole velocity V + q̇, V the nominal rotation (d·V = 0), and integrate:
``∮ F·(V + q̇) − ∮ V·(C q̇ + (K − ω_c² K_ω) q) = friction + ∮ q̇ᵀ C q̇ + Σ_p ∮ D_p ẋ_p`` ``− Σ_p ∮ ½ k̇_p x_p²
+ Σ_p ∮ N_p (ġ_p + ė) + ΔE`` with ``D_p = N_p − F_p``; where pairs share a gear body, the elastic part of the
last two terms is that of their springs. Stiffness that changes under load does work (the parametric term,
each jump of k adding ``½ Δk x²``), and so do flanks whose gaps and errors move. The stored energy changes by
ΔE over the averaged periods of an aperiodic response, ``E = ½ q̇ᵀ M q̇ + V·(M q̇ + ω_c G q) + ½ qᵀ (K − ω_c²
K_ω) q + Σ_p ½ k_p x_p²``; over a period it does not.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.orbits.response import Response, dashpot_of
from wearlab.dynamics.system import System
from wearlab.mesh.force import Deflections, NormalForces, normal_forces
from wearlab.mesh.stages import Springs, parabola

NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)
NEARBY = 1e-3
"""Fraction of a step over which the rates of stiffness and gap are taken, to both sides [1]."""


class EnergyBalance(NamedTuple):
    """Mean powers over the period of a response [W].

    Parameters
    ----------
    input, output : work of the loads on the moving members, and what loads and turning supports take
    friction : lost between the teeth
    bearing_damping, mesh_damping : lost in the dampers of supports and of meshes
    parametric : −Σ ½ k̇ x² with the jumps of k: what changing stiffness takes from the motion
    moving_gaps : Σ N (ġ + ė): what moving gaps and errors take
    stored : what the motion gains, 0 on a periodic orbit
    """

    input: float
    output: float
    friction: float
    bearing_damping: float
    mesh_damping: float
    parametric: float
    moving_gaps: float
    stored: float

    @property
    def residual(self) -> float:
        """Power that the terms do not account for, over the input power, NaN without load [1]."""
        lost = self.friction + self.bearing_damping + self.mesh_damping
        taken = lost + self.parametric + self.moving_gaps + self.stored
        return (self.input - self.output - taken) / self.input if self.input else float("nan")

    @property
    def efficiency(self) -> float:
        """Output over input power, NaN without load [1]."""
        return self.output / self.input if self.input else float("nan")


def nominal_speeds(system: System, given: Mapping[str, float]) -> Array:
    """Return the nominal speeds V of all coordinates in a rotation that no mesh resists, (n,) [m/s].

    Parameters
    ----------
    system : the one form
    given : speeds of some coordinates, such as ``{"sun.u": r ω, "carrier.u": 0}``; translations rest [m/s]

    Raises
    ------
    ValueError
        When the speeds given do not determine a rotation, or contradict each other.
    """
    names = system.coordinates
    unknown = [at for at in np.flatnonzero(system.turns) if names[at] not in given]
    speed = np.array([given.get(name, 0.0) for name in names])
    turning, _, rank, _ = np.linalg.lstsq(system.direction[:, unknown], -system.direction @ speed, rcond=None)
    speed[unknown] = turning
    if rank < len(unknown) or np.abs(system.direction @ speed).max() > 1e-9 * np.abs(speed).max():
        raise ValueError(f"the speeds of {', '.join(given)} do not say how the whole set turns")
    return speed


def energy_balance(response: Response, nominal: Array) -> EnergyBalance:
    """Return the mean powers over the period, or over the kept periods, of a response.

    The motion within the steps is the response's `Path`; it and the mesh are integrated by Gauss's rule. A
    step in which contact changes is integrated with less accuracy.

    Parameters
    ----------
    response : a response; of an aperiodic one the kept periods, which follow each other
    nominal : (n,) nominal speeds, see `nominal_speeds` [m/s]
    """
    system, tables, period = response.system, response.tables, response.mesh_period
    x = 0.5 * (1.0 + NODES)
    weight = 0.5 * WEIGHTS[:, None] * (tables.width * period)
    q, v = _within_steps(response, x)
    mesh = _mesh_at(response, x)
    delta = q @ system.direction.T - mesh.error
    rate = v @ system.direction.T - mesh.error_rate

    def mean(power: Array) -> float:
        return float(np.einsum("xs,kxs->", weight, power)) / (len(response.state) * period)

    whole = v + nominal
    loads = (system.load * whole).reshape(*whole.shape)
    if system.fluctuation_direction is not None and tables.fluctuation is not None:
        loads = loads + (_parabolas(tables.fluctuation, x)[..., None] * system.fluctuation_direction) * whole
    work = np.array([mean(loads[..., row]) for row in range(loads.shape[-1])])
    held = v @ system.damping.T + q @ system.total_stiffness.T
    forces = normal_forces(mesh.springs, Deflections(delta, rate), dashpot_of(system))
    damped, parametric, moving = _flank_powers(system, mesh, Deflections(delta, rate), forces)
    rubbed = _friction_power(response, x, forces.pair_normal, whole)
    duration = len(response.state) * period
    return EnergyBalance(
        input=float(work[work > 0.0].sum()),
        output=float(-work[work < 0.0].sum()) + mean(held @ nominal),
        friction=0.0 if rubbed is None else mean(rubbed),
        bearing_damping=mean((v * (v @ system.damping.T)).sum(axis=-1)),
        mesh_damping=mean(damped),
        parametric=-mean(parametric) - _jumps(response) / duration,
        moving_gaps=mean(moving),
        stored=_gained(response, nominal) / duration if response.period == 0 else 0.0,
    )


class _Mesh(NamedTuple):
    """Meshes at nodes within the steps, (n_nodes, n_steps, n_mesh[, n_pairs]); rates by time."""

    springs: Springs
    stiffness_rate: Array
    gap_rate: Array
    error: Array
    error_rate: Array


def _mesh_at(response: Response, x: Array) -> _Mesh:
    tables, period, steps = response.tables, response.mesh_period, len(response.tables.width)
    step, fraction = np.tile(np.arange(steps), len(x)), np.repeat(x, steps)
    between = response.within

    def shaped(values: Array) -> Array:
        return values.reshape(len(x), steps, *values.shape[1:])

    before, here, after = (between.springs_at(step, fraction + moved) for moved in (-NEARBY, 0.0, NEARBY))
    duration = 2.0 * NEARBY * period * tables.width[:, None, None]
    rates = [
        (shaped(late) - shaped(early)) / duration for early, late in zip(before[:2], after[:2], strict=True)
    ]
    error, error_rate = (shaped(values) for values in between.errors_at(step, fraction))
    return _Mesh(
        here.per(period).each(shaped),
        rates[0],
        rates[1],
        error,
        error_rate / period,
    )


def _parabolas(table: Array, x: Array) -> Array:
    """Return stage values at fractions x of all steps, (n_fractions, n_steps, …)."""
    steps = len(table)
    values = parabola(table, np.tile(np.arange(steps), len(x)), np.repeat(x, steps))
    return values.reshape(len(x), *table.shape[:1], *table.shape[2:])


def _flank_powers(
    system: System, mesh: _Mesh, motion: Deflections, forces: NormalForces
) -> tuple[Array, Array, Array]:
    """Return what damping, changes of stiffness and moving gaps take, summed over all flanks (…) [W]."""
    springs, error_rate = mesh.springs, mesh.error_rate
    approach = np.maximum(motion.deflection[..., None] - springs.gap, 0.0) * (springs.stiffness > 0.0)
    elastic = springs.stiffness * approach
    parametric = (0.5 * mesh.stiffness_rate * approach**2).sum(axis=(-1, -2))
    moving = (elastic * (mesh.gap_rate + error_rate[..., None])).sum(axis=(-1, -2))
    if system.damping_always:
        dashpot = forces.normal - forces.elastic
        damped = (dashpot * (motion.rate - springs.lead_rate)).sum(axis=-1)
        moving = moving + (dashpot * (springs.lead_rate + error_rate)).sum(axis=-1)
    else:
        dashpot = forces.pair_normal - forces.pair
        damped = (dashpot * (motion.rate[..., None] - springs.pair_rate)).sum(axis=(-1, -2))
        moving = moving + (dashpot * (springs.pair_rate + error_rate[..., None])).sum(axis=(-1, -2))
    if system.backlash is not None:
        behind = np.maximum(-system.backlash - motion.deflection, 0.0)
        back = springs.stiffness.sum(axis=-1) * behind
        normal = forces.pair_normal.sum(axis=-1) - forces.normal if not system.damping_always else back
        parametric = parametric + (0.5 * mesh.stiffness_rate.sum(axis=-1) * behind**2).sum(axis=-1)
        damped = damped - ((normal - back) * motion.rate).sum(axis=-1)
        moving = moving - (normal * error_rate).sum(axis=-1)
    return damped, parametric, moving


def _friction_power(response: Response, x: Array, pair: Array, whole: Array) -> Array | None:
    """Return ``Σ Λμ N (f0 + s f1)·(V + q̇)`` over all pairs, None without friction [W]."""
    constant, slope = response.system.friction_constant, response.system.friction_slope
    sliding, moment = response.tables.sliding, response.tables.moment
    if constant is None or slope is None or sliding is None or moment is None:
        return None
    power = (_parabolas(sliding, x) * pair).sum(axis=-1) * (whole @ constant.T)
    power = power + (_parabolas(moment, x) * pair).sum(axis=-1) * (whole @ slope.T)
    return np.asarray(power.sum(axis=-1))


def _jumps(response: Response) -> float:
    """Return the energy that jumps of stiffness and gap between steps add, ``Σ ½ Δ(k x²)`` [J].

    The last is that from the end of the motion to the beginning of a further period.
    """
    n = len(response.system.load)
    begin, end = (
        _in_meshes(response, response.state[:, at, :n], side)
        for at, side in ((slice(None, -1), 0), (slice(1, None), 2))
    )
    after = np.append(begin.ravel()[1:], _in_meshes(response, response.state[-1:, -1:, :n], 0, 1).ravel())
    return float((after - end.ravel()).sum())


def _in_meshes(response: Response, q: Array, side: int, steps: int | None = None) -> Array:
    """Return the energy ``Σ ½ k x²`` of the meshes for q (…, n_steps, n) at one side of the steps [J]."""
    system, tables = response.system, response.tables
    stiffness, gap = tables.stiffness[:steps, side], tables.gap[:steps, side]
    delta = q @ system.direction.T - tables.error[:steps, side]
    approach = np.maximum(delta[..., None] - gap, 0.0)
    energy = 0.5 * (stiffness * approach**2).sum(axis=(-1, -2))
    if system.backlash is not None:
        behind = np.maximum(-system.backlash - delta, 0.0)
        energy = energy + 0.5 * (stiffness.sum(axis=-1) * behind**2).sum(axis=-1)
    return np.asarray(energy)


def _gained(response: Response, nominal: Array) -> float:
    """Return the stored energy at the end of the motion less that at its beginning [J]."""
    system, n = response.system, len(response.system.load)
    at = np.stack([response.state[0, 0], response.state[-1, -1]])
    q, v = at[:, :n], at[:, n:]
    momentum = v @ system.mass.T
    if system.gyroscopic is not None:
        momentum = momentum + system.rotation * q @ system.gyroscopic.T
    kinetic = 0.5 * (v * (v @ system.mass.T)).sum(axis=-1) + momentum @ nominal
    elastic = 0.5 * (q * (q @ system.total_stiffness.T)).sum(axis=-1)
    meshes = _in_meshes(response, q[:, None], 0, 1)[:, 0]
    before, after = kinetic + elastic + meshes
    return float(after - before)


def _within_steps(response: Response, x: Array) -> tuple[Array, Array]:
    """Return q and q̇ at fractions of the steps, (n_kept, n_nodes, n_steps, n)."""
    steps = len(response.tables.width)
    motion = response.motion.at(np.tile(np.arange(steps), len(x)), np.repeat(x, steps))
    q, v = (values.reshape(len(values), len(x), steps, -1) for values in motion)
    return q, v
