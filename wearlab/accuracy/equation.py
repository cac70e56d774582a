"""The equation of motion of one wear state for foreign integrators, and CyRK on it.

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
from wearlab.compiled import jit, jit_inner
from wearlab.dynamics.system import System
from wearlab.life.vibration import Vibration
from wearlab.mesh import clock, excitation, stages

DEGREE = 4
NEVER = 1e300
"""A backlash that no motion reaches: no back flank."""
FIRST, LAST, START = range(3)
"""Arguments of the callback: the first cell of the smooth segment, the one after its
last, its phase."""
CELLS_OF_SEVERAL = 96
"""Cells of a smooth segment of several meshes."""


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
    vibration: Vibration,
    system: System,
    friction: clock.Friction | None,
) -> Motion:
    """Write a wear state as a :class:`Motion`.

    Parameters
    ----------
    kinds : contact of the wear state of every kind of mesh, and what the excitation was
        fitted to
    vibration : the dynamics; its slow errors must not turn (no hunting)
    system : its structure with all loads known
    friction : of the flanks, None without
    """
    sampling = vibration.sampling
    edges, segment = _edges(kinds, vibration)
    tables = _tables_of_half_cells(kinds, sampling, edges, segment, friction)

    backlash = system.backlash
    if backlash is None:
        backlash = np.full(len(sampling.meshes), NEVER)
    inverse = np.linalg.inv(system.mass)
    return Motion(
        stiffness=inverse @ system.total_stiffness,
        damping=inverse @ system.total_damping,
        direction=system.direction,
        mesh_damping=system.mesh_damping,
        backlash=backlash,
        push=inverse @ system.load,
        per_force=system.force_vectors[1] @ inverse.T,
        edges=edges,
        coefficients=_coefficients(tables),
        breaks=sampling.edges,
        first_cell=np.searchsorted(edges, sampling.edges - 1e-12),
        pairs=tables.stiffness.shape[3],
        period=vibration.period,
        gated=not system.damping_always,
        rubs=tables.sliding is not None,
        shared=tables.part is not None,
    )


def _edges(
    kinds: Sequence[excitation.MeshFlanks], vibration: Vibration
) -> tuple[Array, Index]:
    """Return cell edges (n_cells + 1,) and the smooth segment of each cell.

    One mesh bends at its nodes. Of several meshes the bends are too many, and too small
    to be told apart: each segment has `CELLS_OF_SEVERAL` cells.
    """
    sampling = vibration.sampling
    bends = np.empty(0)
    if len(sampling.meshes) == 1:
        analysis = kinds[0].analysis
        bends = np.concatenate([analysis.grid.phase_nodes[0], analysis.stiffness.bends])

    edges = [sampling.edges[:1]]
    segments = []
    for index, (low, high) in enumerate(pairwise(sampling.edges)):
        is_inside = (bends > low + 1e-9) & (bends < high - 1e-9)
        inside = np.unique(np.round(bends[is_inside], 12))
        if not len(bends):
            inside = np.linspace(low, high, CELLS_OF_SEVERAL + 1)[1:-1]
        edges += [inside, np.array([high])]
        segments += [index] * (len(inside) + 1)
    return np.concatenate(edges), np.array(segments)


def _tables_of_half_cells(
    kinds: Sequence[excitation.MeshFlanks],
    sampling: clock.Sampling,
    edges: Array,
    segment: Index,
    friction: clock.Friction | None,
) -> stages.StageTables:
    """Return the mesh at start, middle and end of both halves of every cell."""
    width = np.diff(edges)
    starts = np.stack([edges[:-1], edges[:-1] + 0.5 * width], 1).ravel()
    half_cells = stages.StageGrid(
        starts, np.repeat(0.5 * width, 2), np.repeat(segment, 2)
    )
    grids = [kind.analysis.grid for kind in kinds]
    sampled = clock.sampling(
        grids, sampling.meshes, sampling.edges, half_cells, friction
    )
    return excitation.stage_tables(kinds, sampled, None)


def _coefficients(tables: stages.StageTables) -> Array:
    """Return coefficients (n_cells, n_mesh, quantities, 5), constant first.

    They go through five points of a cell.
    """
    quantities = [tables.stiffness, tables.gap, tables.pair_rate]
    if tables.part is not None:
        quantities.append(tables.part.reshape(*tables.part.shape[:3], -1))
    if tables.sliding is not None and tables.moment is not None:
        quantities += [tables.sliding, tables.moment]
    quantities += [
        tables.lead_rate[..., None],
        tables.error[..., None],
        tables.error_rate[..., None],
    ]

    # at start, middle and end of every half cell
    values = np.concatenate(quantities, axis=3)
    five_points = np.concatenate([values[0::2], values[1::2, 1:]], axis=1)
    places = np.linspace(0.0, 1.0, DEGREE + 1)
    inverse = np.linalg.inv(np.vander(places, increasing=True))
    return np.ascontiguousarray(np.einsum("kp,tpmq->tmqk", inverse, five_points))


def starting_state(system: System, mean: Array) -> Array:
    """Return the static equilibrium at mean mesh stiffnesses, at rest: a first guess.

    Parameters
    ----------
    system : the equation of motion
    mean : (n_mesh,) stiffnesses [N/m]

    Returns
    -------
    (2n,) coordinates [m] and their rates [m/s]
    """
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
    """Return the cell that holds a phase, on one side of a jump.

    Parameters
    ----------
    edges : (n_cells + 1,) phases at which cells begin and end [1]
    first, last : the cells ``first … last − 1`` are searched
    phase : of the mesh period [1]
    """
    found = int(np.searchsorted(edges[first:last], phase, "right"))
    return max(first, first + found - 1)


@jit
def motion_in_cell(equation: Any, cell: int, phase: float, y: Any, out: Any) -> None:
    """Write ẏ at a phase of a cell; flanks that approach each other touch.

    Parameters
    ----------
    equation : a `Motion`
    cell, phase : of the mesh period
    y : (2n,) coordinates [m] and their rates [m/s]
    out : (2n,) written, rates [m/s] and accelerations [m/s²]
    """
    n = len(equation.push)
    pairs = equation.pairs
    start = equation.edges[cell]
    u = (phase - start) / (equation.edges[cell + 1] - start)
    elastic = np.zeros(pairs)
    tangent = np.zeros(pairs)
    _move_without_meshes(equation, y, out)
    for m in range(len(equation.backlash)):
        mesh = equation.coefficients[cell, m]
        damping = equation.mesh_damping[m]
        delta = -polynomial(mesh[-2], u)
        rate = -polynomial(mesh[-1], u) / equation.period
        for row in range(n):
            delta += equation.direction[m, row] * y[row]
            rate += equation.direction[m, row] * y[n + row]

        mesh_stiffness, touching_stiffness = _press_springs(
            equation, mesh, u, delta, elastic, tangent
        )
        force, rubbed, moment = _forces_of_pairs(
            equation, mesh, u, rate, damping, touching_stiffness, elastic, tangent
        )

        back = -equation.backlash[m] - delta
        if back > 0.0:
            damped = damping * rate if equation.gated else 0.0
            force -= max(0.0, mesh_stiffness * back - damped)
        if not equation.gated:
            force += damping * (rate - polynomial(mesh[-3], u) / equation.period)

        _subtract_mesh(equation, m, force, rubbed, moment, out)


@jit_inner(inline=True)
def _move_without_meshes(equation: Any, y: Any, out: Any) -> None:
    """Write the rates, and the accelerations by loads and supports."""
    n = len(equation.push)
    for row in range(n):
        out[row] = y[n + row]
        a = equation.push[row]
        for col in range(n):
            elastic = equation.stiffness[row, col] * y[col]
            damped = equation.damping[row, col] * y[n + col]
            a -= elastic + damped
        out[n + row] = a


@jit_inner(inline=True)
def _press_springs(
    equation: Any,
    mesh: Any,
    u: float,
    delta: float,
    elastic: Any,
    tangent: Any,
) -> tuple[float, float]:
    """Write what springs hand to every pair.

    Parameters
    ----------
    equation : a `Motion`
    mesh : (quantities, 5) coefficients of the mesh in the cell
    u : place in the cell [1]
    delta : deflection of the mesh [m]
    elastic, tangent : (pairs,) written, elastic forces [N] and stiffnesses [N/m]

    Returns
    -------
    stiffness of all springs, and of those that touch [N/m]
    """
    pairs = equation.pairs
    mesh_stiffness = 0.0
    touching_stiffness = 0.0
    for p in range(pairs):
        elastic[p] = 0.0
        tangent[p] = 0.0
    for j in range(pairs):
        k = polynomial(mesh[j], u)
        if k > 0.0:
            mesh_stiffness += k
            approach = delta - polynomial(mesh[pairs + j], u)
            if approach > 0.0:
                touching_stiffness += k
                for p in range(pairs):
                    part = 1.0 if p == j else 0.0
                    if equation.shared:
                        part = polynomial(mesh[3 * pairs + j * pairs + p], u)
                    elastic[p] += part * k * approach
                    tangent[p] += part * k
    return mesh_stiffness, touching_stiffness


@jit_inner(inline=True)
def _forces_of_pairs(
    equation: Any,
    mesh: Any,
    u: float,
    rate: float,
    damping: float,
    touching_stiffness: float,
    elastic: Any,
    tangent: Any,
) -> tuple[float, float, float]:
    """Return normal force, friction [N] and moment of friction [N m] of all pairs.

    A pair that touches is damped by its part of the stiffness that touches, and never
    pulls.
    """
    pairs = equation.pairs
    first = 3 * pairs + (pairs * pairs if equation.shared else 0)
    force, rubbed, moment = 0.0, 0.0, 0.0
    for p in range(pairs):
        normal = elastic[p]
        if equation.gated and tangent[p] != 0.0:
            gap_rate = polynomial(mesh[2 * pairs + p], u) / equation.period
            share = damping * tangent[p] / touching_stiffness
            normal = max(0.0, normal + share * (rate - gap_rate))
        force += normal
        if equation.rubs:
            rubbed += normal * polynomial(mesh[first + p], u)
            moment += normal * polynomial(mesh[first + pairs + p], u)
    return force, rubbed, moment


@jit_inner(inline=True)
def _subtract_mesh(
    equation: Any,
    m: int,
    force: float,
    rubbed: float,
    moment: float,
    out: Any,
) -> None:
    """Subtract the accelerations by the forces of a mesh."""
    n = len(equation.push)
    meshes = len(equation.backlash)
    for row in range(n):
        out[n + row] -= equation.per_force[m, row] * force
        if equation.rubs:
            out[n + row] -= equation.per_force[meshes + m, row] * rubbed
            out[n + row] -= equation.per_force[2 * meshes + m, row] * moment


@jit
def motion_of(time: float, y: Any, equation: Motion) -> Any:
    """Return ẏ (2n,) at a time; the mesh repeats every period.

    Parameters
    ----------
    time : since phase 0 of any period [s]
    y : (2n,) coordinates [m] and their rates [m/s]
    equation : of motion
    """
    cells = len(equation.edges) - 1
    begin = np.floor(time / equation.period) * equation.period
    return motion_within(time - begin, y, equation, 0, cells)


@jit
def motion_within(
    time: float,
    y: Any,
    equation: Motion,
    first: int,
    last: int,
) -> Any:
    """Return ẏ (2n,) in one smooth segment, ends included.

    Parameters
    ----------
    time : since phase 0 of the period [s]
    y : (2n,) coordinates [m] and their rates [m/s]
    equation : of motion
    first, last : the segment is the cells ``first … last − 1``
    """
    out = np.empty(len(y))
    phase = time / equation.period
    cell = cell_within(equation.edges, first, last, phase)
    motion_in_cell(equation, cell, phase, y, out)
    return out


def motion_callback(equation: Motion) -> Any:
    """Compile ``void (ẏ, t, y, arguments)``; its ``address`` is what CyRK takes.

    Parameters
    ----------
    equation : the equation of motion of a wear state; time counts from the start of a
        smooth segment, whose cells the arguments name

    Returns
    -------
    the compiled callback; it must be kept as long as its address is used
    """
    import numba
    from numba import carray, types

    rows = 2 * len(equation.push)
    per_period = 1.0 / equation.period
    double = types.CPointer(types.float64)

    @numba.cfunc(types.void(double, types.float64, double, double), error_model="numpy")
    def callback(out: Any, time: float, y: Any, arguments: Any) -> None:
        segment = carray(arguments, 3)
        phase = segment[START] + time * per_period
        first = int(segment[FIRST])
        last = int(segment[LAST])
        cell = cell_within(equation.edges, first, last, phase)
        motion_in_cell(equation, cell, phase, carray(y, rows), carray(out, rows))

    return callback


Solve = Callable[[int, float, Array, Array], Array | None]
"""Piece of a period, its beginning [s], state there, times [s] → (n_times, 2n) states,
None: it gave up."""


def landing(
    equation: Motion, start: Array, periods: int, phases: Array, solve: Solve
) -> tuple[Array, Array]:
    """Integrate mesh periods from jump to jump.

    Parameters
    ----------
    equation : the equation of motion
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
        for piece, (low, high) in enumerate(pairwise(equation.breaks)):
            inside = np.flatnonzero((phases >= low - 1e-12) & (phases < high - 1e-12))
            times = np.append(phases[inside], high).clip(low, high) * equation.period
            values = solve(piece, low * equation.period, state, times)
            if values is None:
                return np.full(states.shape, np.nan), np.full(start.shape, np.nan)
            states[period, inside] = values[:-1]
            state = values[-1]
    return states, state


class CyRKIntegrator:
    """CyRK on the equation of motion of one wear state.

    Parameters
    ----------
    equation : the equation of motion
    method : of CyRK, such as "VERN7"
    """

    def __init__(self, equation: Motion, method: str) -> None:
        self.callback = motion_callback(equation)
        self.method = method
        self.equation = equation
        cells = equation.first_cell
        starts = equation.breaks
        pieces = np.stack([cells[:-1], cells[1:], starts[:-1]], axis=1)
        self.pieces = pieces.astype(float)
        self.widths = np.diff(starts) * equation.period

    def integrate(
        self, start: Array, periods: int, tolerance: float, scale: Array
    ) -> Array:
        """Return the state (2n,) after mesh periods, NaN where CyRK gives up.

        Parameters
        ----------
        start : (2n,) state at phase 0
        periods : how many
        tolerance : relative tolerance [1]
        scale : (2n,) size of the states
        """
        end: Array = compiled_integration()(
            int(self.callback.address),
            start,
            periods,
            self.pieces,
            self.widths,
            self.method,
            np.array([tolerance]),
            tolerance * scale,
        )
        return end

    def states(
        self, start: Array, periods: int, phases: Array, tolerance: float, scale: Array
    ) -> Array:
        """Return the states at phases of mesh periods, (periods, n_phases, 2n).

        Parameters
        ----------
        start, periods, tolerance, scale : as for `integrate`
        phases : (n_phases,) ascending in [0, 1) [1]
        """
        from CyRK import nbsolve2_ivp

        def solve(piece: int, begin: float, state: Array, times: Array) -> Array | None:
            solution = nbsolve2_ivp(
                int(self.callback.address),
                (0.0, self.widths[piece]),
                np.ascontiguousarray(state),
                self.method,
                np.minimum(times - begin, self.widths[piece]),
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

        return landing(self.equation, start, periods, phases, solve)[0]


@cache
def compiled_integration() -> Any:
    """Return the loop around CyRK that goes from jump to jump."""
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
                if solution.success:
                    state = solution.y[:, -1].copy()
                else:
                    state = np.full(len(start), np.nan)
                solution.free()
        return state

    return integrate
