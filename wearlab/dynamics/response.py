"""The steady response of a system, and what is read off it at any phase."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from wearlab.arrays import Array, Complex, Flags, Index
from wearlab.dynamics.balance import balance_of
from wearlab.dynamics.between import Parabolas, TablesWithin
from wearlab.dynamics.modes import Modes, modes
from wearlab.dynamics.multipliers import multipliers_of
from wearlab.dynamics.path import Path, path
from wearlab.dynamics.pieces import StepParts
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageGrid, StageTables

if TYPE_CHECKING:
    from wearlab.dynamics.neighbour import Neighbour


class Verdict(NamedTuple):
    """What can be said of a response.

    Parameters
    ----------
    periodic : the orbit closes after `Response.period` mesh periods
    attracting : neighbouring motions approach it: max |multiplier| < 1 − margin (None: not computed)
    unique : no family of orbits, I − P is regular
    converged : the method met its own criterion
    """

    periodic: bool
    attracting: bool | None
    unique: bool
    converged: bool

    @property
    def words(self) -> tuple[str, ...]:
        """The verdict in words: what deviates from a unique, attracting periodic orbit; () when nothing."""
        words = {
            "aperiodic": not self.periodic,
            "not attracting": self.attracting is False,
            "non-unique": not self.unique,
            "not converged": not self.converged,
        }
        return tuple(word for word, holds in words.items() if holds)


ATTRACTING, NEUTRAL = Verdict(True, True, True, True), Verdict(True, False, True, True)
"""Of a unique periodic orbit that neighbouring motions approach, and of one that they may not."""


class Counts(NamedTuple):
    """Work done: mesh periods integrated, right-hand sides evaluated, Newton iterations."""

    period_maps: int
    right_hand_sides: int
    newton_iterations: int


@dataclass(frozen=True, eq=False)
class Response:
    """The steady response.

    Parameters
    ----------
    period : m, the response repeats after m mesh periods; 0: aperiodic
    state : (n_kept, n_steps + 1, 2n) q and q̇ at the ends of the steps [m], [m/s]
    found_multipliers : see `multipliers`; None: they are computed from the derivative when asked for
    verdict : what can be said of it
    counts : work done
    residual : closure of the orbit relative to its size; aperiodic: spread of the strobed states
    system, tables, mesh_period : what it is the response of, with the loads that were found; duration of a
        mesh period [s]
    derivative : (2n, 2n) of the map over m periods at its start, kept where a neighbour can use it, or None
    near : what neighbouring cases are found from where no flank parts, or None
    between : what the tables were taken of, for values between their stages; None: parabolas through them
    sections : of the mesh period, over the first of which the derivative goes, turned back; see
        `wearlab.dynamics.symmetry`
    pieces : which parts the steps are of those that were asked for, where they end at changes of contact
    """

    period: int
    state: Array
    found_multipliers: Complex | None
    verdict: Verdict
    counts: Counts
    residual: float
    system: System
    tables: StageTables
    mesh_period: float
    derivative: Array | None = None
    near: "Neighbour | None" = None
    between: TablesWithin | None = None
    sections: int = 1
    pieces: StepParts | None = None

    @cached_property
    def multipliers(self) -> Complex:
        """Floquet multipliers over m periods, largest first; empty when not computed or aperiodic."""
        if self.found_multipliers is not None:
            return self.found_multipliers
        assert self.derivative is not None
        balance = balance_of(self.system, self.mesh_period)
        return multipliers_of(self.system, balance, self.derivative, self.sections)

    @property
    def map_derivative(self) -> Array | None:
        """(2n, 2n) of the map over m periods at its start, where a neighbour can use it, or None."""
        return self.derivative

    @cached_property
    def modes(self) -> Modes:
        """The modes of the system with all pairs in contact, at the mean mesh stiffnesses."""
        return modes(self.system, self.tables.mean_stiffness)

    def first_speaks_for(self, meshes: int) -> bool:
        """Whether all meshes of a kind do what the first does, each in its own section of the period."""
        return self.sections == meshes

    @property
    def within(self) -> TablesWithin:
        """The meshes between the stages of their tables."""
        return Parabolas(self.tables) if self.between is None else self.between

    @property
    def end(self) -> Array:
        """(2n,) the state from which to continue."""
        end: Array = self.state[-1, -1]
        return end

    @cached_property
    def motion(self) -> Path:
        """The coordinates within the steps."""
        n = len(self.system.load)
        length = self.tables.width * self.mesh_period
        return path(self.state[..., :n], self.state[..., n:], accelerations(self), length)

    @cached_property
    def approach(self) -> Path:
        """The projections d·q of the meshes within the steps."""
        n, d = len(self.system.load), self.system.direction.T
        length = self.tables.width * self.mesh_period
        return path(self.state[..., :n] @ d, self.state[..., n:] @ d, accelerations(self) @ d, length)


def split_periods(path: Array, periods: int) -> Array:
    """Cut a path (periods · n_steps + 1, 2n) into (periods, n_steps + 1, 2n), ends shared."""
    if periods == 1:
        return path[None]
    steps = (len(path) - 1) // periods
    return np.stack([path[k * steps : (k + 1) * steps + 1] for k in range(periods)])


Side = Literal["right", "left"]
"""Of a boundary between two steps: the one that begins there, or the one that ends there."""


def step_of(grid: StageGrid, phase: Array, segment: Index | None = None, side: Side = "right") -> Index:
    """Return the step that holds each phase, (n,).

    Parameters
    ----------
    grid : steps of a mesh period
    phase : (n,) in [0, 1] [1]
    segment : (n,) the smooth segment each phase belongs to, which decides at breaks; None: ``side`` does
    side : "right" takes the step that begins at a phase on a boundary, "left" the one that ends there
    """
    last = len(grid.start) - 1
    if segment is None:
        step = np.searchsorted(grid.start, phase, side=side) - 1
        return np.clip(step, 0, last)
    step = np.searchsorted(grid.start, phase, side="right") - 1
    low = np.searchsorted(grid.segment, segment, side="left")
    high = np.searchsorted(grid.segment, segment, side="right") - 1
    return np.clip(step, low, high)


def deflection_at(
    response: Response,
    grid: StageGrid,
    phase: Array,
    segment: Index | None = None,
    side: Side = "right",
    meshes: slice = slice(None),
) -> tuple[Array, Array]:
    """Return mesh deflection δ and its rate at any phases, (n_kept, n_mesh, n_phases) [m], [m/s].

    ``δ = d·q − e``, by the polynomials of d·q on each two steps (`Path`).

    Parameters
    ----------
    response : the response
    grid : the steps it was computed on
    phase : (n,) in [0, 1] [1]
    segment, side : which side of a break is meant, see `step_of`
    meshes : of which meshes
    """
    step = step_of(grid, phase, segment, side)
    x = (phase - grid.start[step]) / grid.width[step]
    approach = response.approach
    position, velocity = approach._replace(coefficient=approach.coefficient[..., meshes]).at(step, x)
    error, slope = (values[:, meshes] for values in response.within.errors(step, x))
    delta, rate = position - error, velocity - slope / response.mesh_period
    return np.ascontiguousarray(delta.transpose(0, 2, 1)), np.ascontiguousarray(rate.transpose(0, 2, 1))


def coordinates_at(
    response: Response,
    grid: StageGrid,
    phase: Array,
    segment: Index | None = None,
    side: Side = "right",
) -> tuple[Array, Array]:
    """Return all coordinates q and q̇ at any phases, (n_kept, n, n_phases) [m], [m/s]; see `deflection_at`."""
    step = step_of(grid, phase, segment, side)
    x = (phase - grid.start[step]) / grid.width[step]
    position, velocity = response.motion.at(step, x)
    return position.transpose(0, 2, 1), velocity.transpose(0, 2, 1)


class StepForces(NamedTuple):
    """Mesh forces at the ends of steps, one-sided, (n_kept, n_steps, 2, n_mesh) [N]; pair: (…, n_pairs)."""

    elastic: Array
    damping: Array
    pair: Array


def step_forces(response: Response) -> StepForces:
    """Return elastic and damping force of each mesh at the start and the end of every step.

    ``W = Σ_p k_p max(0, δ − g_p) − Σ_p k_p max(0, −j_bn − δ)``; damping ``c δ̇``, gated by contact unless
    it always acts. The pair forces are those of the drive flanks.

    References
    ----------
    L16 Eqs. 1–6, pair by pair; W23 Eqs. 7–14.
    """
    system, tables, ends = response.system, response.tables, [0, 2]
    n = system.mass.shape[0]
    state = np.stack([response.state[:, :-1], response.state[:, 1:]], axis=2)
    delta = state[..., :n] @ system.direction.T - tables.error[:, ends]
    rate = state[..., n:] @ system.direction.T - tables.error_rate[:, ends] / response.mesh_period
    stiffness = tables.stiffness[:, ends]
    approach = delta[..., None] - tables.gap[:, ends]
    pair = np.where(approach > 0.0, stiffness * np.maximum(approach, 0.0), 0.0)
    elastic = pair.sum(axis=-1)
    touching = (pair > 0.0).any(axis=-1)
    if system.backlash is not None:
        back = stiffness.sum(axis=-1) * np.maximum(0.0, -system.backlash - delta)
        elastic, touching = elastic - back, touching | (back > 0.0)
    if response.pieces is not None:
        touching = _touching_throughout(response, delta, rate)[:, :, None]
    gate = 1.0 if system.damping_always else touching
    return StepForces(elastic, system.mesh_damping * rate * gate, pair)


def _touching_throughout(response: Response, delta: Array, rate: Array) -> Flags:
    """Whether any flank touches in steps that end where contact changes, (n_kept, n_steps, n_mesh).

    At such an end rounding says which side is meant: their middles do.
    """
    system, tables = response.system, response.tables
    eighth = 0.125 * (tables.width * response.mesh_period)[:, None]
    middle = delta.mean(axis=2) + eighth * (rate[:, :, 0] - rate[:, :, 1])
    pair = (tables.stiffness[:, 1] > 0.0) & (middle[..., None] > tables.gap[:, 1])
    touching: Flags = pair.any(axis=-1)
    return touching if system.backlash is None else touching | (middle < -system.backlash)


def friction_forces(response: Response, forces: StepForces) -> tuple[Array, Array]:
    """Return ``Σ_p Λμ_p F_p`` [N] and ``Σ_p Λμ_p s_p F_p`` [N m] of each mesh at the step ends.

    (n_kept, n_steps, 2, n_mesh) each, as in `StepForces`.

    References
    ----------
    B23, the friction of a pair and its lever, rederived.
    """
    tables, ends = response.tables, [0, 2]
    if tables.sliding is None or tables.moment is None:
        raise ValueError("the mesh tables carry no sliding: this response has no friction")
    tangential, moment = (
        (of_pairs[:, ends] * forces.pair).sum(axis=-1) for of_pairs in (tables.sliding, tables.moment)
    )
    return tangential, moment


def accelerations(response: Response) -> Array:
    """Return q̈ at the start and the end of every step, (n_kept, n_steps, 2, n), from the motion [m/s²]."""
    system, ends = response.system, [0, 2]
    n = system.mass.shape[0]
    forces = step_forces(response)
    state = np.stack([response.state[:, :-1], response.state[:, 1:]], axis=2)
    load = system.load - (forces.elastic + forces.damping) @ system.direction
    if system.friction_constant is not None and system.friction_slope is not None:
        tangential, moment = friction_forces(response, forces)
        load = load - tangential @ system.friction_constant - moment @ system.friction_slope
    if system.fluctuation_direction is not None and response.tables.fluctuation is not None:
        load = load + response.tables.fluctuation[:, ends, None] * system.fluctuation_direction
    load = load - state[..., :n] @ system.total_stiffness.T - state[..., n:] @ system.total_damping.T
    return np.ascontiguousarray(np.linalg.solve(system.mass, load.reshape(-1, n).T).T).reshape(load.shape)
