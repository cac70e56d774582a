"""The steady response of a system, and what is read off it at any phase."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from wearlab.arrays import Array, Complex, Index
from wearlab.compiled import jit
from wearlab.dynamics.modes import Modes, modes
from wearlab.dynamics.system import System
from wearlab.mesh.force import Dashpot, Deflections, NormalForces, normal_forces
from wearlab.mesh.stages import NO_TABLES, Springs, StageGrid, StageTables

Both = tuple[Array, Array]
"""Something and its rate, or another two arrays alike."""
ALL = slice(None)
DEGREE = 8
NINE = [(place, order) for place in (-1.0, 0.0, 1.0) for order in (0, 1, 2)]
POWERS = np.eye(DEGREE + 1)
BASIS = np.linalg.inv([polyval(place, polyder(POWERS, order)) for place, order in NINE])
"""Row: power of the time from the middle in steps; column: value, slope, curvature at
start, middle, end."""


class Path(NamedTuple):
    """Signals over the steps.

    Parameters
    ----------
    coefficient : (n_powers, n_kept, n_steps / 2, n_signals) of the powers of the time
        from the middle of two steps, in steps
    length : (n_steps / 2,) duration of one of them [s]
    """

    coefficient: Array
    length: Array

    def at(self, step: Index, fraction: Array) -> tuple[Array, Array]:
        """Return the signals and their rates, both (n_kept, n, n_signals).

        Parameters
        ----------
        step, fraction : (n,) step of each instant, and fraction of the step [1]
        """
        two = step // 2
        x = step % 2 + fraction - 1.0
        _, kept, _, signals = self.coefficient.shape
        value, rate = np.zeros((2, kept, len(x), signals))
        _fill_by_horner(self.coefficient, two, x, value, rate)
        return value, rate / self.length[two, None]


@jit
def _fill_by_horner(
    coefficient: Array, two: Index, x: Array, value: Array, rate: Array
) -> None:
    """Add the values of polynomials, and their slopes, to zeros.

    Parameters
    ----------
    coefficient : as in `Path`
    two, x : (n,) which of two steps, and where in them [1]
    value, rate : (n_kept, n, n_signals) written
    """
    powers, kept, _, signals = coefficient.shape
    for period in range(kept):
        for i in range(len(x)):
            for power in range(powers - 1, -1, -1):
                for signal in range(signals):
                    slope = rate[period, i, signal] * x[i] + value[period, i, signal]
                    rate[period, i, signal] = slope
                    value[period, i, signal] *= x[i]
                    value[period, i, signal] += coefficient[
                        power, period, two[i], signal
                    ]


def path(position: Array, velocity: Array, acceleration: Array, length: Array) -> Path:
    """Return the polynomials of signals.

    Parameters
    ----------
    position, velocity : (n_kept, n_steps + 1, n_signals) at the ends of the steps
    acceleration : (n_kept, n_steps, 2, n_signals) at the start and the end of every
        step
    length : (n_steps,) duration of the steps, two and two equal [s]
    """
    h = length[::2]
    first = acceleration[:, ::2]
    second = acceleration[:, 1::2]
    value = np.stack([position[:, :-1:2], position[:, 1::2], position[:, 2::2]])
    slope = np.stack([velocity[:, :-1:2], velocity[:, 1::2], velocity[:, 2::2]])
    bend = np.stack(
        [first[:, :, 0], 0.5 * (first[:, :, 1] + second[:, :, 0]), second[:, :, 1]]
    )
    nine = np.stack([value, slope * h[:, None], bend * (h * h)[:, None]], axis=1)
    nine = nine.reshape(DEGREE + 1, *value.shape[1:])
    return Path(np.tensordot(BASIS, nine, axes=1), h)


class Within(Protocol):
    """The meshes anywhere within steps (n,), at fractions of them."""

    def errors_at(
        self, step: Index, fraction: Array, meshes: slice = ALL
    ) -> tuple[Array, Array]:
        """Return prescribed errors and their rates by phase, (n, n_mesh) [m]."""
        ...

    def springs_at(self, step: Index, fraction: Array) -> Springs:
        """Return the springs of all meshes, (n, n_mesh, n_pairs)."""
        ...

    def springs_within(self, fractions: Array) -> Springs:
        """Return the springs in every step, (n_steps, k, n_mesh, n_pairs)."""
        ...


class Verdict(NamedTuple):
    """What can be said of a response.

    Parameters
    ----------
    periodic : the orbit closes after `Response.period` mesh periods
    attracting : neighbouring motions approach it: max |multiplier| < 1 − margin (None:
        not computed)
    unique : no family of orbits, I − P is regular
    converged : the method met its own criterion
    """

    periodic: bool
    attracting: bool | None
    unique: bool
    converged: bool

    @property
    def deviations(self) -> tuple[str, ...]:
        """The verdict in words: what deviates from a unique, attracting periodic orbit.

        () when nothing.
        """
        words = "aperiodic", "not attracting", "non-unique", "not converged"
        wrong = (
            not self.periodic,
            self.attracting is False,
            not self.unique,
            not self.converged,
        )
        return tuple(compress(words, wrong))


class Counts(NamedTuple):
    """Mesh periods integrated, right-hand sides evaluated, Newton iterations."""

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
    multipliers : Floquet multipliers over m periods, largest first; empty when not
        computed or aperiodic
    verdict : what can be said of it
    counts : work done
    residual : closure of the orbit relative to its size; aperiodic: spread of the
        strobed states
    system, tables, mesh_period : what it is the response of, with the loads that were
        found; duration of a mesh period [s]
    derivative : (2n, 2n) of the map over m periods at its start, kept where a neighbour
        can use it, or None
    between : what the tables were taken of, for values between their stages; None:
        parabolas through them
    """

    period: int
    state: Array
    multipliers: Complex
    verdict: Verdict
    counts: Counts
    residual: float
    system: System
    tables: StageTables
    mesh_period: float
    derivative: Array | None = None
    between: Within | None = None

    @cached_property
    def modes(self) -> Modes:
        """The modes with all pairs in contact, at the mean mesh stiffnesses."""
        return modes(self.system, self.tables.mean_stiffness)

    @property
    def largest(self) -> float:
        """Modulus of the largest multiplier."""
        return float(abs(self.multipliers[0]))

    @property
    def within(self) -> Within:
        """The meshes between the stages of their tables.

        They are parabolas where nothing else is known.
        """
        return self.tables if self.between is None else self.between

    @property
    def end(self) -> Array:
        """(2n,) the state from which to continue."""
        return np.asarray(self.state[-1, -1])

    @property
    def ends(self) -> "Response":
        """Its first and last state, no tables: what a neighbour starts from."""
        states = np.stack([self.state[0, 0], self.state[-1, -1]])
        return replace(self, state=states[None], tables=NO_TABLES, between=None)

    @cached_property
    def motion(self) -> Path:
        """The coordinates within the steps."""
        return self._path_of(np.asarray)

    @cached_property
    def approach(self) -> Path:
        """The projections d·q of the meshes within the steps."""
        along = self.system.direction.T
        return self._path_of(lambda coordinates: product(coordinates, along))

    def _path_of(self, signals: Callable[[Array], Array]) -> Path:
        """Return the polynomials of signals (…) of the coordinates (…, n)."""
        position, velocity = np.split(self.state, 2, axis=-1)
        return path(
            signals(position),
            signals(velocity),
            signals(self.acceleration),
            self.tables.width * self.mesh_period,
        )

    @cached_property
    def acceleration(self) -> Array:
        """Accelerations q̈ at both ends of steps, (n_kept, n_steps, 2, n) [m/s²]."""
        return accelerations(self)


def split_periods(path: Array, periods: int) -> Array:
    """Cut a path into its periods, (periods, n_steps + 1, 2n), ends shared.

    Parameters
    ----------
    path : (periods · n_steps + 1, 2n)
    periods : how many
    """
    if periods == 1:
        return path[None]
    steps = (len(path) - 1) // periods
    starts = range(0, periods * steps, steps)
    return np.stack([path[start : start + steps + 1] for start in starts])


def step_of(
    grid: StageGrid,
    phase: Array,
    segment: Index | None = None,
    side: Literal["right", "left"] = "right",
) -> Index:
    """Return the step that holds each phase, (n,).

    Parameters
    ----------
    grid : steps of a mesh period
    phase : (n,) in [0, 1] [1]
    segment : (n,) the smooth segment each phase belongs to, which decides at breaks;
        None: ``side`` does
    side : "right" takes the step that begins at a phase on a boundary, "left" the one
        that ends there
    """
    low = np.zeros(1, int)
    high = np.full(1, len(grid.start) - 1)
    if segment is not None:
        low = np.searchsorted(grid.segment, segment, side="left")
        high = np.searchsorted(grid.segment, segment, side="right") - 1
    step = np.searchsorted(grid.start, phase, side=side) - 1
    return np.clip(step, low, high)


def place_of(
    grid: StageGrid, phase: Array, segment: Index | None = None
) -> tuple[Index, Array]:
    """Return the step that holds each phase, and the fraction of it, (n,) each.

    Parameters
    ----------
    grid, phase, segment : as in `step_of`
    """
    step = step_of(grid, phase, segment)
    return step, (phase - grid.start[step]) / grid.width[step]


def deflection_at(
    response: Response,
    grid: StageGrid,
    phase: Array,
    segment: Index | None = None,
    meshes: slice = ALL,
) -> Both:
    """Return mesh deflection δ [m] and its rate [m/s] at any phases.

    ``δ = d·q − e``, by the polynomials of d·q on each two steps (`Path`).

    Parameters
    ----------
    response : the response
    grid : the steps it was computed on
    phase : (n,) in [0, 1] [1]
    segment : which side of a break is meant, see `step_of`
    meshes : of which meshes
    """
    step, fraction = place_of(grid, phase, segment)
    motion = motion_at(response, step, fraction, meshes=meshes)
    delta = np.ascontiguousarray(motion.deflection.transpose(0, 2, 1))
    rate = np.ascontiguousarray(motion.rate.transpose(0, 2, 1))
    return delta, rate


def coordinates_at(
    response: Response, grid: StageGrid, phase: Array, segment: Index | None = None
) -> Both:
    """Return all coordinates q and q̇ at any phases, (n_kept, n, n_phases) [m], [m/s].

    See `deflection_at`.
    """
    step, fraction = place_of(grid, phase, segment)
    position, velocity = response.motion.at(step, fraction)
    return position.transpose(0, 2, 1), velocity.transpose(0, 2, 1)


def dashpot_of(system: System, mesh: int | slice = slice(None)) -> Dashpot:
    """Return the damping and the backlash of all meshes, or of one."""
    backlash = system.backlash
    law = system.damping_law
    behind = None if backlash is None else backlash[mesh]
    if law is not None:
        law = type(law)(*(np.atleast_1d(values[mesh]) for values in law))
    return Dashpot(system.mesh_damping[mesh], system.damping_always, behind, law)


def motion_at(
    response: Response,
    step: Index,
    fraction: Array,
    kept: slice = ALL,
    meshes: slice = ALL,
) -> Deflections:
    """Return the motion of some meshes, (n_kept, n, n_mesh).

    Parameters
    ----------
    response : the response
    step, fraction : (n,) step of each instant, and fraction of the step [1]
    kept, meshes : which periods, and which meshes
    """
    approach = response.approach
    approach = approach._replace(coefficient=approach.coefficient[:, kept, :, meshes])
    place, speed = approach.at(step, fraction)
    error, slope = response.within.errors_at(step, fraction, meshes)
    return Deflections(place - error, speed - slope / response.mesh_period)


def forces_at(
    response: Response, step: Index, fraction: Array, kept: slice = ALL
) -> NormalForces:
    """Return the forces of all meshes, (n_kept, n, n_mesh[, n_pairs]).

    Fraction 0 of a step and fraction 1 of the one before are the two sides of a jump.

    Parameters
    ----------
    response : the response
    step, fraction : where, (n,) [1]
    kept : which of the kept periods
    """
    springs = response.within.springs_at(step, fraction).per(response.mesh_period)
    motion = motion_at(response, step, fraction, kept)
    return normal_forces(springs, motion, dashpot_of(response.system))


def product(vectors: Array, matrix: Array) -> Array:
    """Return vectors (…, n) times a matrix (n, m), (…, m), as one product of matrices.

    Parameters
    ----------
    vectors, matrix : NumPy multiplies each vector of a longer array by itself
    """
    flat = vectors.reshape(-1, vectors.shape[-1])
    return np.asarray(flat @ matrix).reshape(*vectors.shape[:-1], matrix.shape[1])


def at_ends(table: Array) -> Array:
    """Return a table at the start and the end of every step, (n_steps, 2, …).

    Parameters
    ----------
    table : (n_steps, 3, …) at the stages
    """
    return table[:, ::2]


def states_at_ends(response: Response) -> tuple[Array, Array]:
    """Return q and q̇ at both ends of every step, (n_kept, n_steps, 2, n) each."""
    q, v = np.split(response.state, 2, axis=-1)
    return _both_ends(q), _both_ends(v)


def _both_ends(states: Array) -> Array:
    """Return states (n_kept, n_steps + 1, n) by steps, (n_kept, n_steps, 2, n)."""
    return np.stack([states[:, :-1], states[:, 1:]], axis=2)


def step_forces(response: Response) -> NormalForces:
    """Return forces of each mesh at both ends of steps, (n_kept, n_steps, 2, n_mesh).

    References
    ----------
    L16 Eqs. 1–6, pair by pair; W23 Eqs. 7–14.
    """
    tables = response.tables
    period = response.mesh_period
    direction = response.system.direction
    q, v = states_at_ends(response)
    deflection = product(q, direction.T) - at_ends(tables.error)
    rate = product(v, direction.T) - at_ends(tables.error_rate) / period
    motion = Deflections(deflection, rate)
    springs = tables.springs.each(at_ends).per(period)
    return normal_forces(springs, motion, dashpot_of(response.system))


AtInstants = Callable[[Array], Array]
"""A table (n_steps, 3, …) at some instants (…), such as `at_ends`."""


def friction_forces(
    response: Response, forces: NormalForces, at: AtInstants = at_ends
) -> Both:
    """Return ``Σ_p Λμ_p N_p`` [N] and ``Σ_p Λμ_p s_p N_p`` [N m] of each mesh.

    (n_kept, n_steps, 2, n_mesh) each at the step ends, as in `step_forces`.

    References
    ----------
    B23, the friction of a pair and its lever, rederived.
    """
    tables = response.tables
    if tables.sliding is None or tables.moment is None:
        raise ValueError(
            "the mesh tables carry no sliding: this response has no friction"
        )
    tangential = at(tables.sliding) * forces.pair_normal
    moment = at(tables.moment) * forces.pair_normal
    return tangential.sum(axis=-1), moment.sum(axis=-1)


def accelerations(response: Response) -> Array:
    """Return q̈ at both ends of every step, (n_kept, n_steps, 2, n) [m/s²]."""
    q, v = states_at_ends(response)
    return acceleration(response, q, v, step_forces(response), at_ends)


def acceleration(
    response: Response, q: Array, v: Array, forces: NormalForces, at: AtInstants
) -> Array:
    """Return ``q̈ = M⁻¹(F − Σ d W − friction − C q̇ − K q)``, (n_kept, …, n) [m/s²].

    Parameters
    ----------
    response : the response
    q, v : (n_kept, …, n) coordinates and their rates [m], [m/s]
    forces : of the meshes
    at : tables at these instants
    """
    system = response.system
    tables = response.tables
    load = system.load - forces.normal @ system.direction
    if system.friction_constant is not None and system.friction_slope is not None:
        tangential, moment = friction_forces(response, forces, at)
        load = (
            load
            - tangential @ system.friction_constant
            - moment @ system.friction_slope
        )
    if system.fluctuation_direction is not None and tables.fluctuation is not None:
        load = load + at(tables.fluctuation)[..., None] * system.fluctuation_direction
    load = load - product(q, system.total_stiffness.T)
    load = load - product(v, system.total_damping.T)
    inverse = np.asarray(np.linalg.inv(system.mass), dtype=np.float64)
    return product(load, inverse.T)
