"""Integration over mesh periods: the map of a period, with its derivative beside it, and until steady.

The test whether a motion is steady cannot be fooled by a slow decay.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.compiled import by_type, jit
from wearlab.dynamics.integrators import (
    contact_change,
    damping_law,
    mesh_law,
    propagator,
    rk4,
)
from wearlab.dynamics.integrators.kernel import (
    Dense,
    Kernel,
    Propagated,
    Stepped,
    kernel_of,
    structure_of,
    write,
)
from wearlab.dynamics.integrators.mesh_law import NEXT, THIS
from wearlab.dynamics.rigid import rebalance, solved_load
from wearlab.dynamics.steady.response import (
    Counts,
    Found,
    Response,
    Verdict,
    split_periods,
)
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

BLOCK = 96
LOCATED, PERMANENT = 0, 1
"""Contact within a step: its changes located; or every pair in the path touches and
pushes, whatever the state."""


def _never(kernel: Any, step: int, w: Any, states: Any, i: Any, contact: Any) -> bool:
    return False


def _two(kernel: Any, step: int, w: Any, states: Any, i: Any, contact: Any) -> bool:
    if not kernel.structure.paired[step]:
        return False
    mesh_law.flank_law(kernel.flanks, step + 1, 0.0, 1.0, NEXT)
    mesh_law.channel_law(kernel.flanks, NEXT)
    mesh_law.fill_loads(kernel, step + 1, 0.0, 1.0, NEXT)
    propagator.exact_steps(
        kernel, step, kernel.structure.tables.double, propagator.OF_TWO, w, states[i:]
    )
    j = i + np.uint64(2 * len(kernel.structure.coordinates)) * w
    return contact == PERMANENT or (
        mesh_law.contact_holds(kernel, step, w, states, i, j, THIS)
        and mesh_law.contact_holds(kernel, step + 1, w, states, j, j + j - i, NEXT)
    )


two_steps = by_type(
    lambda kernel, *rest: _two if structure_of(kernel) is Propagated else _never
)
"""Advance two equal steps at once where the structure can and no contact changes;
return whether."""


def over_period(
    kernel: Any, columns: Any, states: Any, first: Any, contact: int
) -> int:
    """Advance state ``first`` over one mesh period, one state a step.

    Return the number of contact changes.

    Parameters
    ----------
    kernel : the system
    columns : columns to advance (uint64): 1 for the trajectory alone
    states : flat (…, 2n, width); state ``first`` is read, the n_steps after it are
        written
    contact : `LOCATED`, or `PERMANENT`, the affine map of a loaded mesh
    """
    w = np.uint64(len(kernel.width))
    size = np.uint64(2 * len(kernel.structure.coordinates)) * w
    i = np.uint64(first) * size
    changes, done = 0, 0
    for step in range(len(kernel.flanks.tables.width)):
        j = i + size
        parts = -1 if step >= done else 0
        if parts < 0 and contact == LOCATED:
            parts = damping_law.step_by_law(
                kernel.flanks.meshes.law, kernel, step, columns, w, states, i, j
            )
        if parts >= 0:
            changes += parts
            i = j
            continue
        if contact == PERMANENT:
            mesh_law.hold_all(kernel.flanks, step)
            mesh_law.flank_law(kernel.flanks, step, 0.0, 1.0, THIS)
        else:
            mesh_law.see_start(kernel, step, w, states, i)
        mesh_law.channel_law(kernel.flanks, THIS)
        mesh_law.fill_loads(kernel, step, 0.0, 1.0, THIS)
        if two_steps(kernel, step, w, states, i, contact):
            done = step + 2
        else:
            rk4.step_of(kernel, step, columns, w, states, i, j)
            if contact != PERMANENT and not mesh_law.contact_holds(
                kernel, step, w, states, i, j, THIS
            ):
                changes += contact_change.step_with_changes(
                    kernel, step, columns, w, states, i, j
                )
        i = j
    return changes


STEPS: dict[type, Callable[..., Any]] = {}
"""The step of every method that moves a single state, by the type of its memory."""
single_step = by_type(lambda memory, *rest: STEPS[memory.instance_class], counted=True)
"""Advance a state (2n,) over one step of the tables by the method of the memory; count
evaluations."""


def by_method(kernel: Any, columns: Any, states: Any, first: Any, contact: int) -> int:
    """Do what `over_period` does by the steps of a method.

    Return the number of evaluations.
    """
    rows = 2 * len(kernel.structure.coordinates)
    evaluations = 0
    for step in range(len(kernel.flanks.tables.width)):
        i = (first + step) * rows
        after = states[i + rows : i + 2 * rows]
        write(states[i : i + rows], after)
        evaluations += single_step(kernel.structure.work, kernel, step, after)
    return evaluations


one_period = by_type(
    lambda kernel, *rest: by_method if structure_of(kernel) is Stepped else over_period
)
"""Advance a state over one mesh period."""


@jit
def over_periods(
    kernel: Any, columns: Any, states: Any, strobe: Any, contact: int, balanced: bool
) -> int:
    """Integrate ``len(strobe) − 1`` periods, the last of them kept.

    Return what `one_period` counts.

    Every road to an orbit calls this one, so that it compiles once.

    Parameters
    ----------
    kernel, columns, contact : as in `over_period`
    states : (keep · n_steps + 1, 2n, width) flat, tangents of the first state given
    strobe : (count + 1, 2n) states at the start of every period, the first given
    balanced : a set free to turn is held at its mean speed after every period
    """
    rows = strobe.shape[1]
    steps = len(kernel.flanks.tables.width)
    w = len(kernel.width)
    count = len(strobe) - 1
    dropped = count - len(states) // (rows * w) // steps
    counted = 0
    for k in range(count):
        first = max(0, k - dropped) * steps
        begin = first * rows * w
        end = begin + steps * rows * w
        for row in range(rows):
            states[begin + row * w] = strobe[k, row]
        counted += one_period(kernel, columns, states, first, contact)
        for row in range(rows):
            strobe[k + 1, row] = states[end + row * w]
        if balanced:
            rebalance(kernel.balance, strobe[k], strobe[k + 1], kernel.flanks.period)
    return counted


class OnTables:
    """Integrates the tabulated map of a kernel by the steps of its structure."""

    def __init__(self, kernel: Kernel) -> None:
        self.kernel = kernel
        self.by_method = isinstance(kernel.structure, Stepped)
        self.maps, self.right_hand_sides, self.changes = 0, 0, 0

    @property
    def steps(self) -> int:
        """Steps of a mesh period."""
        return len(self.kernel.flanks.tables.width)

    def states(self, periods: int) -> Array:
        """Return memory for the states of so many periods, (periods · n_steps + 1, 2n, width)."""
        kernel = self.kernel
        return np.empty(
            (
                periods * self.steps + 1,
                2 * len(kernel.structure.coordinates),
                len(kernel.width),
            )
        )

    def advance(
        self,
        states: Array,
        start: Array,
        contact: int = LOCATED,
        *,
        tangents: bool = True,
    ) -> int:
        """Fill ``states`` from ``start`` (2n,) on, unknown loads in it, and count the changes of contact."""
        balance = self.kernel.balance
        held = self.kernel.balance.held
        rows = np.arange(len(start))
        states[0] = 0.0
        states[0, :, 0] = start
        balance.size[:] = start[held]
        states[0, held, 0] = balance.position
        if tangents:
            states[0, rows, 1 + rows] = 1.0
            states[0, held, 1 + held] = 0.0
        strobe = np.empty(((len(states) - 1) // self.steps + 1, len(start)))
        strobe[0] = states[0, :, 0]
        columns = np.uint64(states.shape[2] if tangents else 1)
        return int(
            over_periods(
                self.kernel, columns, states.reshape(-1), strobe, contact, False
            )
        )

    def integrate(self, state: Array, count: int, keep: int = 1) -> tuple[Array, Array]:
        """Integrate ``count`` periods and move ``state``.

        Strobed states and the last ``keep`` periods.
        """
        states = self.states(keep)
        strobe = np.empty((count + 1, len(state)))
        states[0], strobe[0] = 0.0, state
        counted = over_periods(
            self.kernel, np.uint64(1), states.reshape(-1), strobe, LOCATED, True
        )
        self.maps += count
        self.changes += 0 if self.by_method else counted
        self.right_hand_sides += counted if self.by_method else 4 * self.steps * count
        state[:] = strobe[-1]
        return strobe, split_periods(states[:, :, 0], keep)


@dataclass(frozen=True, kw_only=True)
class UntilSteady:
    """A method that integrates until its transient has died.

    Parameters
    ----------
    tolerance : remaining change of the strobed state, relative to its size
    most : mesh periods after which a response counts as aperiodic
    longest : longest period looked for [mesh periods]
    averaged : mesh periods kept of an aperiodic response
    """

    tolerance: float = 1e-7
    most: int = 5000
    longest: int = 24
    averaged: int = 200

    def memory(self, system: System, tables: StageTables) -> Any:
        """Return the memory of the method's own steps, `Dense`: it takes Runge–Kutta steps on the tables."""
        return Dense

    def integrator(
        self, system: System, tables: StageTables, period: float
    ) -> OnTables:
        """Return what integrates a system over mesh periods."""
        return OnTables(
            kernel_of(system, tables, period, way=self.memory(system, tables))
        )

    def solve(
        self, system: System, tables: StageTables, period: float, start: Found = None
    ) -> Response:
        """Integrate in blocks until some period m ≤ ``longest`` has settled, and return the response.

        Parameters as in `wearlab.dynamics.steady.periodic.Periodic.solve`.
        """
        integrator = self.integrator(system, tables, period)
        state = np.zeros(2 * len(system.load)) if start is None else start.end.copy()
        rate = unit_of_speed(tables, period)

        def response(
            m: int, kept: Array, residual: float, verdict: Verdict
        ) -> Response:
            counts = Counts(integrator.maps, integrator.right_hand_sides, 0)
            loaded = solved_load(system, integrator.kernel.balance)
            return Response(
                m,
                kept,
                np.empty(0, complex),
                verdict,
                counts,
                residual,
                loaded,
                tables,
                period,
            )

        while integrator.maps < self.most:
            strobe, _ = integrator.integrate(state, BLOCK, 1)
            if not np.isfinite(state).all():
                break
            for m in range(1, self.longest + 1):
                left = remaining_change(strobe, m, rate)
                if left <= self.tolerance:
                    m = _least_period(strobe, m, rate, self.tolerance)
                    _, kept = integrator.integrate(state, m, m)
                    return response(m, kept, left, Verdict(True, None, True, True))
        _, kept = integrator.integrate(state, self.averaged, self.averaged)
        if np.isfinite(kept).all():
            kept = under_one_load(integrator, kept, period)
        strobed = kept[:, 0, : len(system.load)]
        spread = float(np.ptp(strobed, axis=0).max() / (np.abs(strobed).max() or 1.0))
        return response(
            0, kept, spread, Verdict(False, None, True, bool(np.isfinite(kept).all()))
        )


def unit_of_speed(tables: StageTables, period: float) -> float:
    """Return the rate that velocities are measured by, of an oscillation in 16 steps [1/s]."""
    return float(2.0 * np.pi * len(tables.width) / (16.0 * period))


def in_one_unit(strobe: Array, rate: float) -> Array:
    """Return strobed states (n, 2n), velocities over a rate [1/s]."""
    n = strobe.shape[1] // 2
    return np.hstack([strobe[:, :n], strobe[:, n:] / rate])


def remaining_change(strobe: Array, m: int, rate: float) -> float:
    """Return how far strobed states (n, 2n) still are from their limit over ``m`` periods, relative to size.

    The change ``D_k = |y_k − y_{k−m}|`` decays like ρ^k; what remains is the geometric
    sum ``D ρ^m/(1 − ρ^m)``. With ρ = 0.98 that is fifty times the last change: a test
    of the change alone would stop far too early.
    """
    scaled = in_one_unit(strobe, rate)
    size = float(np.abs(scaled).max())
    change = np.abs(scaled[m:] - scaled[:-m]).max(axis=1)
    third = len(change) // 3
    early = float(change[:third].max())
    late = float(change[-third:].max())
    if late <= 1e-13 * size:
        return late / size if size > 0.0 else 0.0
    ratio = (late / early) ** (m / (len(change) - third))
    return np.inf if ratio >= 1.0 else late * ratio / (1.0 - ratio) / size


def _least_period(strobe: Array, m: int, rate: float, tolerance: float) -> int:
    """Return the least divisor of ``m`` after which settled states come back (its own test may lag)."""
    scaled = in_one_unit(strobe, rate)[-2 * m - 1 :]
    size = float(np.abs(scaled).max())
    back = (
        np.abs(scaled[d:] - scaled[:-d]).max() <= 100.0 * tolerance * size
        for d in range(1, m + 1)
    )
    return next((d for d, same in enumerate(back, 1) if same and m % d == 0), m)


def under_one_load(integrator: OnTables, kept: Array, period: float) -> Array:
    """Return a motion that follows kept periods (n_kept, n_steps + 1, 2n) under a constant load.

    The load and the speed of a set free to turn are corrected after every period. It
    goes on for as many periods once to find the mean load, and once more under it; any
    other system keeps its motion.
    """
    balance = integrator.kernel.balance
    if not len(balance.held):
        return kept
    kernel = integrator.kernel
    state = kept[-1, -1].copy()
    count = len(kept)
    held = balance._replace(gain=balance.gain * np.inf, shape=0.0 * balance.shape)
    integrator.kernel = kernel._replace(balance=held)
    strobe, _ = integrator.integrate(state.copy(), count, 1)
    n = len(state) // 2
    balance.size[:] -= (
        balance.momentum
        @ (strobe[-1, n:] - strobe[0, n:])
        / (count * period * balance.gain)
    )
    _, motion = integrator.integrate(state, count, count)
    integrator.kernel = kernel
    return motion


@dataclass(frozen=True)
class RungeKutta4(UntilSteady):
    """Fixed steps of order four on the tables, contact changes located (Kutta 1901).

    See `UntilSteady`.
    """
