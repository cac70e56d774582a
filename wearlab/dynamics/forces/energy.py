"""Energy over a period of a response.

Every term is integrated on its own, none is found by subtraction. Multiply the equation
of motion by the whole velocity V + q̇, V the nominal rotation (d·V = 0), and integrate:
``∮ F·(V + q̇) − ∮ V·(C q̇ + (K − ω_c² K_ω) q) = friction + ∮ q̇ᵀ C q̇ + Σ_p ∮ D_p ẋ_p``
``− Σ_p ∮ ½ k̇_p x_p² + Σ_p ∮ N_p (ġ_p + ė) + ΔE`` with ``D_p = N_p −
F_p``; where pairs share a gear body, the elastic part of the last two terms is that of
their springs. Stiffness that changes under load does work (the parametric term, each
jump of k adding ``½ Δk x²``), and so do flanks whose gaps and errors move. The
stored energy changes by ΔE over the averaged periods of an aperiodic response, ``E = ½
q̇ᵀ M q̇ + V·(M q̇ + ω_c G q) + ½ qᵀ (K − ω_c² K_ω) q + Σ_p ½ k_p x_p²``; over a period
it does not.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
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
        """Power that no term accounts for over the input power, NaN: no load [1]."""
        if not self.input:
            return float("nan")
        lost = self.friction + self.bearing_damping + self.mesh_damping
        accounted = lost + self.parametric + self.moving_gaps + self.stored
        return (self.input - self.output - accounted) / self.input

    @property
    def efficiency(self) -> float:
        """Output over input power, NaN without load [1]."""
        return self.output / self.input if self.input else float("nan")


def nominal_speeds(system: System, speeds: Mapping[str, float]) -> Array:
    """Return the nominal speeds V of all coordinates as the set turns, (n,) [m/s].

    No mesh resists this rotation.

    Parameters
    ----------
    system : the equation of motion
    speeds : of some coordinates, such as ``{"sun.u": r ω, "carrier.u": 0}``;
        translations rest [m/s]

    Raises
    ------
    ValueError
        When the speeds given do not determine a rotation, or contradict each other.
    """
    names = system.coordinates
    direction = system.direction
    unknown = [row for row in np.flatnonzero(system.turns) if names[row] not in speeds]
    speed = np.array([speeds.get(name, 0.0) for name in names])
    solution, _, rank, _ = np.linalg.lstsq(
        direction[:, unknown], -direction @ speed, rcond=None
    )
    speed[unknown] = solution
    resisted = np.abs(direction @ speed).max() > 1e-9 * np.abs(speed).max()
    if rank < len(unknown) or resisted:
        raise ValueError(
            f"the speeds of {', '.join(speeds)} do not say how the whole set turns"
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
    instants = _instants(response)
    system = response.system
    step = instants.step
    x = instants.fraction
    mean = instants.mean
    duration = instants.duration

    q, v = response.motion.at(step, x)
    whole = v + nominal
    powers_of_loads = np.moveaxis(_load_powers(response, instants, whole), -1, 0)
    work = np.array([mean(power) for power in powers_of_loads])
    held = v @ system.damping.T + q @ system.total_stiffness.T

    springs = response.within.springs_at(step, x).per(response.mesh_period)
    motion = motion_at(response, step, x)
    forces = normal_forces(springs, motion, dashpot_of(system))
    powers = _flank_powers(system, springs, _rates(response, instants), motion, forces)
    stored = _gained(response, nominal) / duration if response.period == 0 else 0.0
    return EnergyBalance(
        input=float(work[work > 0.0].sum()),
        output=float(-work[work < 0.0].sum()) + mean(held @ nominal),
        friction=_friction_power(response, instants, whole, forces),
        bearing_damping=mean((v * (v @ system.damping.T)).sum(axis=-1)),
        mesh_damping=mean(powers.damping),
        parametric=-mean(powers.parametric) - _jumps(response) / duration,
        moving_gaps=mean(powers.moving_gaps),
        stored=stored,
    )


class GaussNodes(NamedTuple):
    """The nodes of Gauss's rule in all steps of a response.

    Parameters
    ----------
    step, fraction : (n,) step of each, and fraction of the step [1]
    weight : (n,) of each in a mesh period [s]
    duration : of all periods [s]
    """

    step: Index
    fraction: Array
    weight: Array
    duration: float

    def mean(self, power: Array) -> float:
        """Return the mean over time.

        Parameters
        ----------
        power : (n_periods, n) at the instants [W]
        """
        return float(np.einsum("n,kn->", self.weight, power)) / self.duration


def _instants(response: Response) -> GaussNodes:
    """Return the nodes of Gauss's rule in all steps of a response."""
    steps = len(response.tables.width)
    width = response.tables.width * response.mesh_period
    return GaussNodes(
        step=np.tile(np.arange(steps), len(NODES)),
        fraction=np.repeat(0.5 * (1.0 + NODES), steps),
        weight=np.outer(0.5 * WEIGHTS, width).ravel(),
        duration=len(response.state) * response.mesh_period,
    )


def _load_powers(response: Response, instants: GaussNodes, speed: Array) -> Array:
    """Return the power of the load on every coordinate, (n_periods, n, n_q) [W]."""
    system = response.system
    fluctuation = response.tables.fluctuation
    power = system.load * speed
    if system.fluctuation_direction is None or fluctuation is None:
        return power
    share = parabola(fluctuation, instants.step, instants.fraction)
    return power + share[:, None] * system.fluctuation_direction * speed


def _friction_power(
    response: Response,
    instants: GaussNodes,
    speed: Array,
    forces: NormalForces,
) -> float:
    """Return the mean power lost between the teeth [W]."""
    system = response.system
    if system.friction_constant is None or system.friction_slope is None:
        return 0.0
    tangential, moment = friction_forces(
        response,
        forces,
        lambda table: parabola(table, instants.step, instants.fraction),
    )
    along = speed @ system.friction_constant.T
    about = speed @ system.friction_slope.T
    return instants.mean((tangential * along + moment * about).sum(axis=-1))


class Rates(NamedTuple):
    """How the meshes change in time.

    Parameters
    ----------
    stiffness, gap : (n, n_mesh, n_pairs) of the springs [N/m/s], [m/s]
    error : (n, n_mesh) of the errors [m/s]
    """

    stiffness: Array
    gap: Array
    error: Array


def _rates(response: Response, instants: GaussNodes) -> Rates:
    """Return how stiffness, gap and errors change, by differences within a step."""
    between = response.within
    step = instants.step
    x = instants.fraction
    period = response.mesh_period
    early = between.springs_at(step, x - NEARBY)
    late = between.springs_at(step, x + NEARBY)
    time = 2.0 * NEARBY * period * response.tables.width[step, None, None]
    return Rates(
        stiffness=(late[0] - early[0]) / time,
        gap=(late[1] - early[1]) / time,
        error=between.errors_at(step, x)[1] / period,
    )


class FlankPowers(NamedTuple):
    """Powers taken at instants, summed over all flanks [W].

    Parameters
    ----------
    damping : by dashpots
    parametric : by the change of stiffness, ``Σ ½ k̇ x²``
    moving_gaps : by the motion of gaps and errors
    """

    damping: Array
    parametric: Array
    moving_gaps: Array


def _flank_powers(
    system: System,
    springs: Springs,
    rates: Rates,
    motion: Deflections,
    forces: NormalForces,
) -> FlankPowers:
    """Return the powers that all flanks take.

    The back flank is one spring more, pressed the other way; dashpots are those of the
    pairs and of the back flank, or one that follows the pair of the least gap.
    """
    error = rates.error
    compressed = _compressed(system, springs.stiffness, springs.gap, motion.deflection)
    elastic = compressed.stiffness * compressed.by
    stiffening = _beside(rates.stiffness, rates.stiffness.sum(axis=-1))
    opening = _beside(rates.gap, np.zeros_like(error))
    sense = np.append(np.ones(springs.stiffness.shape[-1]), -1.0)
    with_error = sense * error[..., None]
    parametric = (0.5 * stiffening * compressed.by**2).sum(axis=(-1, -2))
    moving = (elastic * (opening + with_error)).sum(axis=(-1, -2))

    if system.damping_always:
        dashpot = forces.normal - forces.elastic
        damped = (dashpot * (motion.rate - springs.lead_rate)).sum(axis=-1)
        moved = (dashpot * (springs.lead_rate + error)).sum(axis=-1)
        return FlankPowers(damped, parametric, moving + moved)

    back = forces.pair_normal.sum(axis=-1) - forces.normal - elastic[..., -1]
    dashpot = _beside(forces.pair_normal - forces.pair, back)
    pair_rate = _beside(springs.pair_rate, np.zeros_like(error))
    approach = sense * motion.rate[..., None] - pair_rate
    damped = (dashpot * approach).sum(axis=(-1, -2))
    moved = (dashpot * (pair_rate + with_error)).sum(axis=(-1, -2))
    return FlankPowers(damped, parametric, moving + moved)


class Compressed(NamedTuple):
    """All springs of the meshes, last the back flank.

    Parameters
    ----------
    stiffness : (…, n_pairs + 1) [N/m]
    by : (…, n_pairs + 1) compression, 0 where it does not touch [m]
    """

    stiffness: Array
    by: Array


def _compressed(
    system: System, stiffness: Array, gap: Array, deflection: Array
) -> Compressed:
    """Return stiffness and compression of all springs."""
    backlash = np.inf if system.backlash is None else system.backlash
    drive = np.maximum(deflection[..., None] - gap, 0.0) * (stiffness > 0.0)
    back = np.maximum(-backlash - deflection, 0.0)
    all_stiffness = _beside(stiffness, stiffness.sum(axis=-1))
    return Compressed(all_stiffness, _beside(drive, back))


def _beside(drive: Array, back: Array) -> Array:
    """Return values of the drive flanks (…, n_pairs), and of the back flank last."""
    return np.concatenate([drive, back[..., None]], axis=-1)


def _jumps(response: Response) -> float:
    """Return the energy that jumps between steps add, ``Σ ½ Δ(k x²)`` [J].

    The last is that from the end of the motion to the beginning of a further period.
    """
    q = response.state[..., : len(response.system.load)]
    begin = _mesh_energy(response, q[:, :-1], 0).ravel()
    end = _mesh_energy(response, q[:, 1:], 2).ravel()
    further = _mesh_energy(response, q[-1:, -1:], 0, 1).ravel()
    return float((np.append(begin[1:], further) - end).sum())


def _mesh_energy(
    response: Response, q: Array, side: int, steps: int | None = None
) -> Array:
    """Return the energy ``Σ ½ k x²`` of the meshes at one side of the steps [J].

    Parameters
    ----------
    response : whose tables are read
    q : (…, n_steps, n) coordinates [m]
    side : stage of the steps, 0: their start, 2: their end
    steps : how many, the first ones; None: all
    """
    system = response.system
    tables = response.tables
    delta = q @ system.direction.T - tables.error[:steps, side]
    stiffness = tables.stiffness[:steps, side]
    compressed = _compressed(system, stiffness, tables.gap[:steps, side], delta)
    energies = compressed.stiffness * compressed.by**2
    return np.asarray(0.5 * energies.sum(axis=(-1, -2)))


def _gained(response: Response, nominal: Array) -> float:
    """Return the stored energy at the end of the motion less that at its start [J]."""
    system = response.system
    n = len(response.system.load)
    ends = np.stack([response.state[0, 0], response.state[-1, -1]])
    q = ends[:, :n]
    v = ends[:, n:]
    momentum = v @ system.mass.T
    if system.gyroscopic is not None:
        momentum = momentum + system.rotation * q @ system.gyroscopic.T
    kinetic = 0.5 * (v * (v @ system.mass.T)).sum(axis=-1) + momentum @ nominal
    elastic = 0.5 * (q * (q @ system.total_stiffness.T)).sum(axis=-1)
    energy = kinetic + elastic + _mesh_energy(response, q[:, None], 0, 1)[:, 0]
    return float(energy[1] - energy[0])
