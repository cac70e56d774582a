"""One wear state as a function of time that any integrator can call, and CyRK at its best on it.

Our own methods read tables at their stages; a foreign integrator asks at times of its
own. So the mesh is written as polynomials of degree four on cells that end wherever
anything in it bends: at the profile nodes, the jumps and the points of a given table.
For CyRK it becomes a C callback with tables and sizes frozen in, so that the compiler
unrolls every loop; its compiled entry point is called from a compiled loop, so that
nothing but its own work is timed.
"""

from collections.abc import Callable, Sequence
from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.compiled import jit
from wearlab.dynamics.system import System
from wearlab.life.coupled import Vibration
from wearlab.mesh import clock, excitation, stages

DEGREE = 4
NEVER = 1e300
"""A backlash that no motion reaches: no back flank."""


class Motion(NamedTuple):
    """The equation of motion of one wear state; forces are divided by the masses.

    Parameters
    ----------
    stiffness, damping : (n, n) of supports
    direction : (n_mesh, n) of the mesh deflections
    mesh_damping, backlash : (n_mesh,) [N s/m], normal backlash [m]
    push : (n,) acceleration by the loads [m/s²]
    per_force : (channels, n) acceleration by a unit mesh force, then by its friction
    edges : (n_cells + 1,) phases at which cells begin and end [1]
    coefficients : (n_cells, n_mesh, quantities, 5) stiffness and gap of every spring,
        rate of every pair's gap, what springs hand to pairs, friction, rate of the
        least gap, error and its rate
    breaks : (n_segments + 1,) phases between which the mesh is smooth [1]
    first_cell : (n_segments + 1,) cell with which each segment begins
    pairs : pairs in the path of a mesh
    period : duration of a mesh period [s]
    gated : whether meshes damp in contact alone
    rubs : whether flanks rub
    shared : whether springs are shared by pairs on one gear body
    """

    stiffness: Array
    damping: Array
    direction: Array
    mesh_damping: Array
    backlash: Array
    push: Array
    per_force: Array
    edges: Array
    coefficients: Array
    breaks: Array
    first_cell: Index
    pairs: int
    period: float
    gated: bool
    rubs: bool
    shared: bool


def motion(
    kinds: Sequence[excitation.MeshFlanks],
    moves: Vibration,
    system: System,
    friction: clock.Friction | None,
) -> Motion:
    """Write a wear state as a :class:`Motion`.

    Parameters
    ----------
    kinds : contact of the wear state of every kind of mesh, and what the excitation was
        fitted to
    moves : the dynamics; its slow errors must not turn (no hunting)
    system : its structure with all loads known
    friction : of the flanks, None without
    """
    given = moves.sampling
    edges, segment = _edges(kinds, moves)
    width = np.diff(edges)
    starts = np.stack([edges[:-1], edges[:-1] + 0.5 * width], 1).ravel()
    halves = stages.StageGrid(starts, np.repeat(0.5 * width, 2), np.repeat(segment, 2))
    grids = [kind.analysis.grid for kind in kinds]
    sampled = clock.sampling(grids, given.meshes, given.edges, halves, friction)
    tables = excitation.stage_tables(kinds, sampled, None)
    meshes = len(given.meshes)
    inverse = np.linalg.inv(system.mass)
    return Motion(
        inverse @ system.total_stiffness,
        inverse @ system.total_damping,
        system.direction,
        system.mesh_damping,
        np.full(meshes, NEVER) if system.backlash is None else system.backlash,
        inverse @ system.load,
        system.force_vectors[1] @ inverse.T,
        edges,
        _coefficients(tables),
        given.edges,
        np.searchsorted(edges, given.edges - 1e-12),
        tables.stiffness.shape[3],
        moves.period,
        not system.damping_always,
        tables.sliding is not None,
        tables.part is not None,
    )


def _edges(
    kinds: Sequence[excitation.MeshFlanks], vibration: Vibration
) -> tuple[Array, Index]:
    """Return cell edges (n_cells + 1,) and the smooth segment of each cell.

    One mesh bends at its nodes; of several meshes the bends are too many and too small
    to be told.
    """
    inner = np.empty(0)
    if len(vibration.sampling.meshes) == 1:
        analysis = kinds[0].analysis
        inner = np.concatenate([analysis.grid.phase_nodes[0], analysis.stiffness.bends])
    edges = [vibration.sampling.edges[:1]]
    segments = []
    for index, (low, high) in enumerate(pairwise(vibration.sampling.edges)):
        inside = np.unique(
            np.round(inner[(inner > low + 1e-9) & (inner < high - 1e-9)], 12)
        )
        if not len(
            inner
        ):  # 96 cells, for the nodes of several meshes together are too many
            inside = np.linspace(low, high, 97)[1:-1]
        edges += [inside, np.array([high])]
        segments += [index] * (len(inside) + 1)
    return np.concatenate(edges), np.array(segments)


def _coefficients(tables: stages.StageTables) -> Array:
    """Return coefficients (n_cells, n_mesh, quantities, 5), constant first, through five points a cell."""
    quantities = [tables.stiffness, tables.gap, tables.pair_rate]
    if tables.part is not None:
        quantities.append(tables.part.reshape(*tables.part.shape[:3], -1))
    if tables.sliding is not None and tables.moment is not None:
        quantities += [tables.sliding, tables.moment]
    ends = (
        each[..., None] for each in (tables.lead_rate, tables.error, tables.error_rate)
    )
    values = np.concatenate(
        [*quantities, *ends], axis=3
    )  # at start, middle and end of every half cell
    five = np.concatenate([values[0::2], values[1::2, 1:]], axis=1)
    inverse = np.linalg.inv(
        np.vander(np.linspace(0.0, 1.0, DEGREE + 1), increasing=True)
    )
    return np.ascontiguousarray(np.einsum("kp,tpmq->tmqk", inverse, five))


def starting_state(system: System, mean: Array) -> Array:
    """Return the static equilibrium at mean mesh stiffnesses (n_mesh,), at rest, (2n,): a first guess."""
    q = np.linalg.lstsq(system.in_contact(mean), system.load, rcond=1e-12)[0]
    return np.concatenate([q, np.zeros(len(q))])


@jit
def polynomial(coefficients: Any, u: float) -> float:
    """Return ``Σ c_k u^k``."""
    value = coefficients[DEGREE]
    for power in range(DEGREE - 1, -1, -1):
        value = value * u + coefficients[power]
    return value


@jit
def cell_within(edges: Any, first: int, last: int, phase: float) -> int:
    """Return the cell among ``first … last − 1`` that holds ``phase``: one side of a jump."""
    return max(
        first, first + int(np.searchsorted(edges[first:last], phase, "right")) - 1
    )


@jit
def motion_in_cell(given: Any, cell: int, phase: float, y: Any, out: Any) -> None:
    """Write ẏ (2n,) at ``phase`` of ``cell``; flanks that approach each other touch."""
    n = len(given.push)
    pairs = given.pairs
    meshes = len(given.backlash)
    u = (phase - given.edges[cell]) / (given.edges[cell + 1] - given.edges[cell])
    elastic = np.zeros(pairs)
    tangent = np.zeros(pairs)
    for row in range(n):
        out[row] = y[n + row]
        a = given.push[row]
        for col in range(n):
            a -= (
                given.stiffness[row, col] * y[col]
                + given.damping[row, col] * y[n + col]
            )
        out[n + row] = a
    for m in range(meshes):
        mesh = given.coefficients[cell, m]
        delta = -polynomial(mesh[-2], u)
        rate = -polynomial(mesh[-1], u) / given.period
        for row in range(n):
            delta += given.direction[m, row] * y[row]
            rate += given.direction[m, row] * y[n + row]
        every, total = 0.0, 0.0
        for p in range(pairs):
            elastic[p], tangent[p] = 0.0, 0.0
        for j in range(pairs):
            k = polynomial(mesh[j], u)
            if k > 0.0:
                every += k
                approach = delta - polynomial(mesh[pairs + j], u)
                if approach > 0.0:
                    total += k
                    for p in range(pairs):
                        part = 1.0 if p == j else 0.0
                        if given.shared:
                            part = polynomial(mesh[3 * pairs + j * pairs + p], u)
                        elastic[p] += part * k * approach
                        tangent[p] += part * k
        force, rubbed, moment = 0.0, 0.0, 0.0
        first = 3 * pairs + (pairs * pairs if given.shared else 0)
        damping = given.mesh_damping[m]
        for p in range(pairs):
            normal = elastic[p]
            if given.gated and tangent[p] != 0.0:
                gap_rate = polynomial(mesh[2 * pairs + p], u) / given.period
                normal = max(
                    0.0, normal + damping * tangent[p] / total * (rate - gap_rate)
                )
            force += normal
            if given.rubs:
                rubbed += normal * polynomial(mesh[first + p], u)
                moment += normal * polynomial(mesh[first + pairs + p], u)
        back = -given.backlash[m] - delta
        if back > 0.0:
            force -= max(0.0, every * back - (damping * rate if given.gated else 0.0))
        if not given.gated:
            force += damping * (rate - polynomial(mesh[-3], u) / given.period)
        for row in range(n):
            out[n + row] -= given.per_force[m, row] * force
            if given.rubs:
                out[n + row] -= given.per_force[meshes + m, row] * rubbed
                out[n + row] -= given.per_force[2 * meshes + m, row] * moment


@jit
def motion_of(time: float, y: Any, given: Motion) -> Any:
    """Return ẏ (2n,) at ``time`` [s]; the mesh repeats every period."""
    phase = time / given.period
    return motion_within(
        time - np.floor(phase) * given.period, y, given, 0, len(given.edges) - 1
    )


@jit
def motion_within(time: float, y: Any, given: Motion, first: int, last: int) -> Any:
    """Return ẏ (2n,) in one smooth segment, the cells ``first … last − 1``, ends included."""
    out = np.empty(len(y))
    phase = time / given.period
    motion_in_cell(given, cell_within(given.edges, first, last, phase), phase, y, out)
    return out


FIRST, LAST, START = range(3)
"""Arguments of the callback: the first cell of the smooth segment, the one after its
last, its phase."""


def motion_callback(given: Motion) -> Any:
    """Compile ``void (ẏ, t, y, arguments)``; its ``address`` is what CyRK takes.

    Parameters
    ----------
    given : the equation of motion of a wear state; time counts from the start of a
        smooth segment, whose cells the arguments name

    Returns
    -------
    the compiled callback; it must be kept as long as its address is used
    """
    import numba
    from numba import carray, types

    rows = 2 * len(given.push)
    per_period = 1.0 / given.period
    double = types.CPointer(types.float64)

    @numba.cfunc(types.void(double, types.float64, double, double), error_model="numpy")
    def callback(out: Any, time: float, y: Any, arguments: Any) -> None:
        segment = carray(arguments, 3)
        phase = segment[START] + time * per_period
        cell = cell_within(given.edges, int(segment[FIRST]), int(segment[LAST]), phase)
        motion_in_cell(given, cell, phase, carray(y, rows), carray(out, rows))

    return callback


Solve = Callable[[int, float, Array, Array], Array | None]
"""Piece of a period, its beginning [s], state there, times [s] → (n_times, 2n) states,
None: it gave up."""


def landing(
    given: Motion, start: Array, periods: int, phases: Array, solve: Solve
) -> tuple[Array, Array]:
    """Integrate mesh periods from jump to jump.

    Parameters
    ----------
    given : the equation of motion
    start : (2n,) state at phase 0
    periods : how many
    phases : (n_phases,) where states are wanted, ascending in [0, 1) [1]
    solve : integrates from one jump to the next, the last of its times

    Returns
    -------
    states (periods, n_phases, 2n), state at the end (2n,); NaN where ``solve`` gives up
    """
    states = np.empty((periods, len(phases), len(start)))
    state = start
    for period in range(periods):
        for piece, (low, high) in enumerate(pairwise(given.breaks)):
            inside = np.flatnonzero((phases >= low - 1e-12) & (phases < high - 1e-12))
            times = np.append(phases[inside], high).clip(low, high) * given.period
            values = solve(piece, low * given.period, state, times)
            if values is None:
                return np.full(states.shape, np.nan), np.full(start.shape, np.nan)
            states[period, inside] = values[:-1]
            state = values[-1]
    return states, state


class CyRKIntegrator:
    """CyRK on the equation of motion of one wear state.

    Parameters
    ----------
    given : the equation of motion
    method : of CyRK, such as "VERN7"
    """

    def __init__(self, given: Motion, method: str) -> None:
        self.callback = motion_callback(given)
        self.method = method
        self.given = given
        cells = given.first_cell
        starts = given.breaks
        self.pieces = np.stack([cells[:-1], cells[1:], starts[:-1]], axis=1).astype(
            float
        )
        self.widths = np.diff(starts) * given.period

    def integrate(
        self, start: Array, periods: int, tolerance: float, scale: Array
    ) -> Array:
        """Return the state (2n,) after so many mesh periods, NaN where CyRK gives up."""
        found: Array = compiled_integration()(
            int(self.callback.address),
            start,
            periods,
            self.pieces,
            self.widths,
            self.method,
            np.array([tolerance]),
            tolerance * scale,
        )
        return found

    def states(
        self, start: Array, periods: int, phases: Array, tolerance: float, scale: Array
    ) -> Array:
        """Return the states at phases in [0, 1) of so many mesh periods, (periods, n_phases, 2n)."""
        from CyRK import nbsolve2_ivp

        def solve(piece: int, begun: float, state: Array, times: Array) -> Array | None:
            solution = nbsolve2_ivp(
                int(self.callback.address),
                (0.0, self.widths[piece]),
                np.ascontiguousarray(state),
                self.method,
                np.minimum(times - begun, self.widths[piece]),
                False,
                self.pieces[piece],
                tolerance,
                tolerance,
                np.array([tolerance]),
                tolerance * scale,
            )
            values = np.array(solution.y.T) if solution.success else None
            solution.free()
            return values

        return landing(self.given, start, periods, phases, solve)[0]


@cache
def compiled_integration() -> Any:
    """Return the loop around CyRK's compiled entry point that goes from jump to jump."""
    import numba
    from CyRK import nbsolve2_ivp

    @numba.njit
    def integrate(
        address: int,
        start: Any,
        periods: int,
        pieces: Any,
        widths: Any,
        method: str,
        rtols: Any,
        atols: Any,
    ) -> Any:
        state = start.copy()
        for _ in range(periods):
            for k in range(len(widths)):
                solution = nbsolve2_ivp(
                    address,
                    (0.0, widths[k]),
                    state,
                    method,
                    None,
                    False,
                    pieces[k],
                    1e-3,
                    1e-6,
                    rtols,
                    atols,
                )
                after = (
                    solution.y[:, -1].copy()
                    if solution.success
                    else np.full(len(start), np.nan)
                )
                solution.free()
                state = after
        return state

    return integrate
