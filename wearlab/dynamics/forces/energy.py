"""Energy over a period of a response: every term integrated on its own, none by subtraction.

Multiply the equation of motion by the whole velocity V + q̇, V the nominal rotation
(d·V = 0), and integrate: ``∮ F·(V + q̇) − ∮ V·(C q̇ + (K − ω_c² K_ω) q) = friction + ∮
q̇ᵀ C q̇ + Σ_p ∮ D_p ẋ_p`` ``− Σ_p ∮ ½ k̇_p x_p² + Σ_p ∮ N_p (ġ_p + ė) + ΔE`` with ``D_p
= N_p − F_p``; where pairs share a gear body, the elastic part of the last two terms is
that of their springs. Stiffness that changes under load does work (the parametric term,
each jump of k adding ``½ Δk x²``), and so do flanks whose gaps and errors move. The
stored energy changes by ΔE over the averaged periods of an aperiodic response, ``E = ½
q̇ᵀ M q̇ + V·(M q̇ + ω_c G q) + ½ qᵀ (K − ω_c² K_ω) q + Σ_p ½ k_p x_p²``; over a period
it does not.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.steady.response import (
    Response,
    dashpot_of,
    friction_forces,
    motion_at,
)
from wearlab.dynamics.system import System
from wearlab.mesh.force import Deflections, NormalForces, normal_forces
from wearlab.mesh.stages import Springs, parabola

NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)
NEARBY = 1e-3
"""Fraction of a step over which the rates of stiffness and gap are taken, to both sides
[1]."""


class EnergyBalance(NamedTuple):
    """Mean powers over the period of a response [W].

    Parameters
    ----------
    input, output : work of the loads on the moving members, and what loads and turning
        supports take
    friction : lost between the teeth
    bearing_damping, mesh_damping : lost in the dampers of supports and of meshes
    parametric : −Σ ½ k̇ x² with the jumps of k: what changing stiffness takes from the
        motion
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
        return (
            (self.input - self.output - taken) / self.input
            if self.input
            else float("nan")
        )

    @property
    def efficiency(self) -> float:
        """Output over input power, NaN without load [1]."""
        return self.output / self.input if self.input else float("nan")


def nominal_speeds(system: System, given: Mapping[str, float]) -> Array:
    """Return the nominal speeds V of all coordinates in a rotation that no mesh resists, (n,) [m/s].

    Parameters
    ----------
    system : the equation of motion
    given : speeds of some coordinates, such as ``{"sun.u": r ω, "carrier.u": 0}``;
        translations rest [m/s]

    Raises
    ------
    ValueError
        When the speeds given do not determine a rotation, or contradict each other.
    """
    names = system.coordinates
    unknown = [at for at in np.flatnonzero(system.turns) if names[at] not in given]
    speed = np.array([given.get(name, 0.0) for name in names])
    turning, _, rank, _ = np.linalg.lstsq(
        system.direction[:, unknown], -system.direction @ speed, rcond=None
    )
    speed[unknown] = turning
    if (
        rank < len(unknown)
        or np.abs(system.direction @ speed).max() > 1e-9 * np.abs(speed).max()
    ):
        raise ValueError(
            f"the speeds of {', '.join(given)} do not say how the whole set turns"
        )
    return speed


def energy_balance(response: Response, nominal: Array) -> EnergyBalance:
    """Return the mean powers over the period, or over the kept periods, of a response.

    The motion within the steps is the response's `Path`; it and the mesh are integrated
    by Gauss's rule. A step in which contact changes is integrated with less accuracy.

    Parameters
    ----------
    response : a response; of an aperiodic one the kept periods, which follow each other
    nominal : (n,) nominal speeds, see `nominal_speeds` [m/s]
    """
    system = response.system
    tables = response.tables
    period = response.mesh_period
    between = response.within
    steps = len(tables.width)
    duration = len(response.state) * response.mesh_period
    step = np.tile(np.arange(steps), len(NODES))
    x = np.repeat(0.5 * (1.0 + NODES), steps)
    weight = np.outer(0.5 * WEIGHTS, tables.width * period).ravel()

    def mean(power: Array) -> float:
        return float(np.einsum("n,kn->", weight, power)) / duration

    q, v = response.motion.at(step, x)
    whole = v + nominal
    loads = system.load * whole
    if system.fluctuation_direction is not None and tables.fluctuation is not None:
        loads = (
            loads
            + parabola(tables.fluctuation, step, x)[:, None]
            * system.fluctuation_direction
            * whole
        )
    work = np.array([mean(load) for load in np.moveaxis(loads, -1, 0)])
    held = v @ system.damping.T + q @ system.total_stiffness.T
    springs = between.springs_at(step, x).per(period)
    motion = motion_at(response, step, x)
    forces = normal_forces(springs, motion, dashpot_of(system))
    before, after = (between.springs_at(step, x + moved) for moved in (-NEARBY, NEARBY))
    apart = 2.0 * NEARBY * period * tables.width[step, None, None]
    rates = [
        (late - early) / apart
        for early, late in zip(before[:2], after[:2], strict=True)
    ]
    error_rate = between.errors_at(step, x)[1] / period
    damped, parametric, moving = _flank_powers(
        system, springs, (*rates, error_rate), motion, forces
    )
    friction = 0.0
    if system.friction_constant is not None and system.friction_slope is not None:
        tangential, moment = friction_forces(
            response, forces, lambda table: parabola(table, step, x)
        )
        along = whole @ system.friction_constant.T
        about = whole @ system.friction_slope.T
        friction = mean((tangential * along + moment * about).sum(axis=-1))
    given = float(work[work > 0.0].sum())
    taken = float(-work[work < 0.0].sum()) + mean(held @ nominal)
    bearing_damping = mean((v * (v @ system.damping.T)).sum(axis=-1))
    lost = (
        friction,
        bearing_damping,
        mean(damped),
        -mean(parametric) - _jumps(response) / duration,
    )
    stored = _gained(response, nominal) / duration if response.period == 0 else 0.0
    return EnergyBalance(given, taken, *lost, moving_gaps=mean(moving), stored=stored)


def _flank_powers(
    system: System,
    springs: Springs,
    rates: Sequence[Array],
    motion: Deflections,
    forces: NormalForces,
) -> tuple[Array, Array, Array]:
    """Return what damping, changes of stiffness and moving gaps take, summed over all flanks (…) [W].

    The back flank is one spring more, pressed the other way; dashpots are those of the
    pairs and of the back flank, or one that follows the pair of the least gap.

    Parameters
    ----------
    rates : by time, of stiffness and gap of the springs (n, n_mesh, n_pairs), of errors
        (n, n_mesh)
    """
    stiffening, opening, error = rates
    stiffness, pressed = _pressed(
        system, springs.stiffness, springs.gap, motion.deflection
    )
    stiffening = _beside(stiffening, stiffening.sum(axis=-1))
    opening = _beside(opening, np.zeros_like(error))
    pair_rate = _beside(springs.pair_rate, np.zeros_like(error))
    sense = np.append(np.ones(springs.stiffness.shape[-1]), -1.0)
    with_error = sense * error[..., None]
    parametric = (0.5 * stiffening * pressed**2).sum(axis=(-1, -2))
    moving = (stiffness * pressed * (opening + with_error)).sum(axis=(-1, -2))
    if system.damping_always:
        dashpot = forces.normal - forces.elastic
        damped = (dashpot * (motion.rate - springs.lead_rate)).sum(axis=-1)
        return (
            damped,
            parametric,
            moving + (dashpot * (springs.lead_rate + error)).sum(axis=-1),
        )
    back = (
        forces.pair_normal.sum(axis=-1) - forces.normal - (stiffness * pressed)[..., -1]
    )
    dashpot = _beside(forces.pair_normal - forces.pair, back)
    damped = (dashpot * (sense * motion.rate[..., None] - pair_rate)).sum(axis=(-1, -2))
    return (
        damped,
        parametric,
        moving + (dashpot * (pair_rate + with_error)).sum(axis=(-1, -2)),
    )


def _pressed(
    system: System, stiffness: Array, gap: Array, deflection: Array
) -> tuple[Array, Array]:
    """Return stiffness and compression of all springs, last the back flank, (…, n_pairs + 1) each."""
    backlash = np.inf if system.backlash is None else system.backlash
    drive = np.maximum(deflection[..., None] - gap, 0.0) * (stiffness > 0.0)
    return _beside(stiffness, stiffness.sum(axis=-1)), _beside(
        drive, np.maximum(-backlash - deflection, 0.0)
    )


def _beside(drive: Array, back: Array) -> Array:
    """Return values of the drive flanks (…, n_pairs) and that of the back flank after them."""
    return np.concatenate([drive, back[..., None]], axis=-1)


def _jumps(response: Response) -> float:
    """Return the energy that jumps of stiffness and gap between steps add, ``Σ ½ Δ(k x²)`` [J].

    The last is that from the end of the motion to the beginning of a further period.
    """
    q = response.state[..., : len(response.system.load)]
    begin = _in_meshes(response, q[:, :-1], 0)
    end = _in_meshes(response, q[:, 1:], 2)
    after = np.append(
        begin.ravel()[1:], _in_meshes(response, q[-1:, -1:], 0, 1).ravel()
    )
    return float((after - end.ravel()).sum())


def _in_meshes(
    response: Response, q: Array, side: int, steps: int | None = None
) -> Array:
    """Return the energy ``Σ ½ k x²`` of the meshes for q (…, n_steps, n) at one side of the steps [J]."""
    system = response.system
    tables = response.tables
    delta = q @ system.direction.T - tables.error[:steps, side]
    stiffness, pressed = _pressed(
        system, tables.stiffness[:steps, side], tables.gap[:steps, side], delta
    )
    return np.asarray(0.5 * (stiffness * pressed**2).sum(axis=(-1, -2)))


def _gained(response: Response, nominal: Array) -> float:
    """Return the stored energy at the end of the motion less that at its beginning [J]."""
    system = response.system
    n = len(response.system.load)
    at = np.stack([response.state[0, 0], response.state[-1, -1]])
    q = at[:, :n]
    v = at[:, n:]
    momentum = v @ system.mass.T
    if system.gyroscopic is not None:
        momentum = momentum + system.rotation * q @ system.gyroscopic.T
    kinetic = 0.5 * (v * (v @ system.mass.T)).sum(axis=-1) + momentum @ nominal
    elastic = 0.5 * (q * (q @ system.total_stiffness.T)).sum(axis=-1)
    before, after = kinetic + elastic + _in_meshes(response, q[:, None], 0, 1)[:, 0]
    return float(after - before)
