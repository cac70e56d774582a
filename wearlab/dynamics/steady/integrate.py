"""The map of a state over mesh periods, with its derivative beside it."""

from collections.abc import Callable
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.compiled import by_type, jit, jit_inner
from wearlab.dynamics.integrators import (
    contact_change,
    damping_law,
    mesh_law,
    propagator,
    rk4,
)
from wearlab.dynamics.integrators.kernel import (
    Kernel,
    Propagated,
    Stepped,
    structure_of,
    write,
)
from wearlab.dynamics.integrators.mesh_law import END, NEXT, START, THIS
from wearlab.dynamics.rigid import rebalance
from wearlab.dynamics.steady.response import split_periods

LOCATED = 0
PERMANENT = 1
"""Contact within a step: its changes located; or every pair in the path touches and
pushes, whatever the state."""


def _no_double_step(
    kernel: Any,
    step: int,
    w: Any,
    states: Any,
    i: Any,
    contact: Any,
) -> bool:
    """Leave the step to others: the structure has no double steps."""
    return False


def _double_step(
    kernel: Any,
    step: int,
    w: Any,
    states: Any,
    i: Any,
    contact: Any,
) -> bool:
    """Advance two equal steps by the propagator; return whether contact allows it."""
    if not kernel.structure.paired[step]:
        return False
    mesh_law.fill_flank_laws(kernel.flanks, step + 1, 0.0, 1.0, NEXT)
    mesh_law.fill_channel_laws(kernel.flanks, NEXT)
    mesh_law.fill_load_inputs(kernel.flanks, kernel.balance, step + 1, 0.0, 1.0, NEXT)
    structure = kernel.structure
    scratch = kernel.flanks.scratch
    double = structure.tables.double
    propagator.exact_steps(
        structure, scratch, step, double, propagator.OF_TWO, w, states[i:]
    )
    if contact == PERMANENT:
        return True
    size = np.uint64(2 * len(structure.coordinates)) * w
    mesh_law.set_motion(kernel, END, w, states, i + size)
    if not mesh_law.contact_holds(kernel.flanks, step, THIS):
        return False
    mesh_law.set_motion(kernel, START, w, states, i + size)
    mesh_law.set_motion(kernel, END, w, states, i + size + size)
    if not mesh_law.contact_holds(kernel.flanks, step + 1, NEXT):
        mesh_law.set_motion(kernel, START, w, states, i)
        return False
    return True


def _choose_double_step(kernel: Any, *rest: Any) -> Callable[..., bool]:
    """Return how a kernel takes two steps at once, by the type of its structure."""
    return _double_step if structure_of(kernel) is Propagated else _no_double_step


two_steps = by_type(_choose_double_step)
"""Advance two equal steps at once where the structure can and no contact changes;
return whether."""


@jit_inner(counted=False, inline=True)
def _fill_laws(
    kernel: Any, step: int, w: Any, states: Any, i: Any, contact: int
) -> None:
    """Set what touches and pushes in a step, and fill its laws and inputs.

    They go into the scratch: the steps, and the test whether contact holds, read them
    there.
    """
    if contact == PERMANENT:
        mesh_law.set_permanent_contact(kernel.flanks, step)
        mesh_law.fill_flank_laws(kernel.flanks, step, 0.0, 1.0, THIS)
    else:
        mesh_law.set_motion(kernel, START, w, states, i)
        mesh_law.set_contact(kernel.flanks, step)
    mesh_law.fill_channel_laws(kernel.flanks, THIS)
    mesh_law.fill_load_inputs(kernel.flanks, kernel.balance, step, 0.0, 1.0, THIS)


@jit_inner(counted=False, inline=True)
def _begin_period(kernel: Any, states: Any, begin: int, start: Any) -> None:
    """Write the state at the start of a period among the states."""
    w = len(kernel.width)
    for row in range(len(start)):
        states[begin + row * w] = start[row]


@jit_inner(counted=False, inline=True)
def _end_period(
    kernel: Any, states: Any, end: int, start: Any, last: Any, balanced: bool
) -> None:
    """Read the state at the end of a period, and hold a free set at its mean speed."""
    w = len(kernel.width)
    for row in range(len(last)):
        last[row] = states[end + row * w]
    if balanced:
        rebalance(kernel.balance, start, last, kernel.flanks.period)


@jit
def over_periods(
    kernel: Any,
    columns: Any,
    states: Any,
    strobe: Any,
    contact: int,
    balanced: bool,
) -> int:
    """Integrate ``len(strobe) − 1`` periods, the last of them kept, one state a step.

    Return the number of contact changes.

    Every way to an orbit calls this one, so that it compiles once. Each level of
    kernels compiles all below it once more: so the loop over the steps is in here.

    Parameters
    ----------
    kernel : the system; what touches and pushes, and the laws of flanks and channels,
        are handed from call to call in its scratch
    columns : columns to advance (uint64): 1 for the trajectory alone
    states : (keep · n_steps + 1, 2n, width) flat, tangents of the first state given
    strobe : (count + 1, 2n) states at the start of every period, the first given
    contact : `LOCATED`, or `PERMANENT`, the affine map of a loaded mesh
    balanced : a set free to turn is held at its mean speed after every period
    """
    w = np.uint64(len(kernel.width))
    size = np.uint64(strobe.shape[1]) * w
    steps = len(kernel.flanks.tables.width)
    count = len(strobe) - 1
    dropped = count - len(states) // (strobe.shape[1] * len(kernel.width)) // steps
    changes = 0
    for k in range(count):
        first = max(0, k - dropped) * steps
        i = np.uint64(first) * size
        _begin_period(kernel, states, np.int64(i), strobe[k])
        next_step = 0  # beyond the current one after a double step
        for step in range(steps):
            j = i + size
            parts = -1 if step >= next_step else 0
            if parts < 0 and contact == LOCATED:
                law = kernel.damping_law
                parts = damping_law.step_by_law(
                    law, kernel, step, columns, w, states, i, j
                )
            if parts >= 0:
                changes += parts
                i = j
                continue

            _fill_laws(kernel, step, w, states, i, contact)
            if two_steps(kernel, step, w, states, i, contact):
                next_step = step + 2
            else:
                rk4.step_of(kernel, step, columns, w, states, i, j)
                if contact != PERMANENT:
                    mesh_law.set_motion(kernel, END, w, states, j)
                    if not mesh_law.contact_holds(kernel.flanks, step, THIS):
                        changes += contact_change.step_with_changes(
                            kernel.flanks,
                            kernel.series,
                            kernel.balance,
                            step,
                            columns,
                            states,
                            i,
                            j,
                        )
            i = j
        _end_period(kernel, states, np.int64(i), strobe[k], strobe[k + 1], balanced)
    return changes


def _advance_of(memory: Any, *rest: Any) -> Callable[..., int]:
    """Return the step of a method, by the type of its memory."""
    advance: Callable[..., int] = memory.instance_class.advance
    return advance


single_step = by_type(_advance_of, counted=True)
"""Advance a state (2n,) over one step of the tables by the method of the memory; count
evaluations."""


@jit
def over_periods_by_method(
    kernel: Any, states: Any, strobe: Any, balanced: bool
) -> int:
    """Do what `over_periods` does by the steps of a method; count the evaluations.

    Parameters
    ----------
    kernel, states, strobe, balanced : as there, the structure
        `wearlab.dynamics.integrators.kernel.Stepped`: a method moves one state, contact
        is its own affair
    """
    rows = strobe.shape[1]
    steps = len(kernel.flanks.tables.width)
    count = len(strobe) - 1
    dropped = count - len(states) // rows // steps
    evaluations = 0
    for k in range(count):
        i = max(0, k - dropped) * steps * rows
        _begin_period(kernel, states, i, strobe[k])
        for step in range(steps):
            state = states[i + rows : i + 2 * rows]
            write(states[i : i + rows], state)
            evaluations += single_step(kernel.structure.work, kernel, step, state)
            i += rows
        _end_period(kernel, states, i, strobe[k], strobe[k + 1], balanced)
    return evaluations


class OnTables:
    """Integrates the tabulated map of a kernel by the steps of its structure.

    Parameters
    ----------
    kernel : the system; one integration at a time uses its scratch

    Attributes
    ----------
    maps, right_hand_sides, changes : mesh periods, evaluations and changes of contact
        so far
    """

    def __init__(self, kernel: Kernel) -> None:
        self.kernel = kernel
        self.by_method = isinstance(kernel.structure, Stepped)
        self.maps = 0
        self.right_hand_sides = 0
        self.changes = 0

    @property
    def steps(self) -> int:
        """Steps of a mesh period."""
        return len(self.kernel.flanks.tables.width)

    def states(self, periods: int) -> Array:
        """Return memory for the states of some periods.

        Parameters
        ----------
        periods : how many

        Returns
        -------
        (periods · n_steps + 1, 2n, width), not filled
        """
        rows = 2 * len(self.kernel.structure.coordinates)
        return np.empty((periods * self.steps + 1, rows, len(self.kernel.width)))

    def advance(
        self,
        states: Array,
        start: Array,
        contact: int = LOCATED,
        *,
        tangents: bool = True,
    ) -> int:
        """Fill the states of some periods, and count the changes of contact.

        The sizes of unknown loads, which stand in ``start`` for the coordinates held,
        go into the kernel's balance.

        Parameters
        ----------
        states : (periods · n_steps + 1, 2n, width), written
        start : (2n,) state to start from, sizes of unknown loads in it
        contact : as in `over_periods`
        tangents : whether the derivatives by the start are computed, too
        """
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

        periods = (len(states) - 1) // self.steps
        strobe = np.empty((periods + 1, len(start)))
        strobe[0] = states[0, :, 0]
        columns = np.uint64(states.shape[2] if tangents else 1)
        changes = over_periods(
            self.kernel, columns, states.reshape(-1), strobe, contact, False
        )
        return int(changes)

    def integrate(
        self,
        state: Array,
        count: int,
        keep: int = 1,
    ) -> tuple[Array, Array]:
        """Integrate some periods and move ``state`` to their end.

        Parameters
        ----------
        state : (2n,) moved
        count : mesh periods
        keep : of how many of them, the last ones, the states are returned

        Returns
        -------
        strobed states (count + 1, 2n), and those of the last periods (keep, n_steps +
        1, 2n)
        """
        states = self.states(keep)
        strobe = np.empty((count + 1, len(state)))
        states[0] = 0.0
        strobe[0] = state
        flat = states.reshape(-1)
        self.maps += count
        if self.by_method:
            self.right_hand_sides += over_periods_by_method(
                self.kernel, flat, strobe, True
            )
        else:
            self.changes += over_periods(
                self.kernel, np.uint64(1), flat, strobe, LOCATED, True
            )
            self.right_hand_sides += 4 * self.steps * count
        state[:] = strobe[-1]
        return strobe, split_periods(states[:, :, 0], keep)


def under_one_load(integrator: OnTables, path: Array, period: float) -> Array:
    """Return a motion that follows some periods under a constant load.

    The load and the speed of a set free to turn are corrected after every period. It
    goes on for as many periods once to find the mean load, and once more under it; any
    other system keeps its motion.

    Parameters
    ----------
    integrator : of the system
    path : (n_kept, n_steps + 1, 2n)
    period : duration of a mesh period [s]
    """
    balance = integrator.kernel.balance
    if not len(balance.held):
        return path
    kernel = integrator.kernel
    state = path[-1, -1].copy()
    n = len(state) // 2
    count = len(path)

    uncorrected = balance._replace(
        gain=balance.gain * np.inf, shape=0.0 * balance.shape
    )
    integrator.kernel = kernel._replace(balance=uncorrected)
    strobe, _ = integrator.integrate(state.copy(), count, 1)
    change = strobe[-1, n:] - strobe[0, n:]
    gained = balance.momentum @ change
    balance.size[:] -= gained / (count * period * balance.gain)

    _, motion = integrator.integrate(state, count, count)
    integrator.kernel = kernel
    return motion
