"""The error of the wear along a life, and states worn by as much further.

``e' = Δr + (r(h + e) − r(h))``: what half the steps and nodes change of the rate drives
the error, and the rate levels it, as flanks that are worn too little carry more: over
tens of micrometres the drive alone adds up to twenty times what is left of it. One look
at the rate of a state worn by its error tells how fast, ``g = e·Δr(e)/e·e``. A step
between two states takes the drive as it is; where it would be levelled many times over
within the step and is no longer small, an implicit step, see `levelled`.

Where a flank is deepest it carries most, and levels soonest what is off: of a life the
same look tells for each node by itself, which costs nothing more.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from wearlab.arrays import Array, Index
from wearlab.life import coupled, limits
from wearlab.simulation.companion_runs import Rougher, alike

DEEPEST = 0.95
"""Share of the largest depth from which a node counts as one that may end the life."""
BETWEEN = 1.5
"""Weight of what the nodes miss of the deepest place: a parabola is right but for the
third difference."""


End = tuple[float, float, Index, Index]


def end_of(depth: Array, rate: Array, flank: Index, counts: limits.Flanks) -> End:
    """Return the last state of a life, on the flanks whose depth may end it.

    Parameters
    ----------
    depth, rate : (n,) at the nodes of all flanks, flat [m], [m per cycle]
    flank : (n,) which flank each node is on
    counts : entries of the flanks whose depth the limit is about

    Returns
    -------
    rate : wear rate where they are worn deepest [m per cycle]
    between : by how much a flank may be worn deeper between its nodes [m]
    flanks : (k,) numbers of the flanks that are as deep
    nodes : (m,) entries on these flanks where they are
    """
    numbers = np.unique(flank[counts])
    largest = np.array([depth[flank == number].max() for number in numbers])
    deep = numbers[largest >= DEEPEST * largest.max()]
    at = int(np.argmax(np.where(np.isin(flank, numbers), depth, -np.inf)))
    between = BETWEEN * max(above_nodes(depth[flank == number]) for number in deep)
    nodes = np.flatnonzero(np.isin(flank, deep) & (depth >= DEEPEST * largest.max()))
    return float(rate[at]), between, deep, nodes


def late_rate(cycle: Array, depth: Array) -> Array:
    """Return the mean wear rate over the last tenth of the depth, (n,) [m per cycle].

    One rate of a motion that does not repeat says little of what an error is worth in
    cycles.

    Parameters
    ----------
    cycle, depth : (m,), (m, n) of the accepted states [1], [m]
    """
    deepest = depth.max(axis=1)
    since = max(0, int(np.searchsorted(deepest, 0.9 * deepest[-1])) - 1)
    way = cycle[-1] - cycle[since]
    return np.asarray(
        (depth[-1] - depth[since]) / way if way > 0.0 else np.zeros_like(depth[-1])
    )


def above_nodes(depth: Array) -> float:
    """Return by how much a profile rises above its highest node [m].

    ``y(t) = y₀ + b t + c t²`` has its vertex ``−b²/4c`` higher, if it has one within an
    interval. Through that node and the next two on one side, because a node may be a
    corner; next to an end its neighbours.

    Parameters
    ----------
    depth : (n,) at evenly spaced nodes [m]
    """
    top = int(np.argmax(depth))
    ahead = depth[top : top + 3]
    behind = depth[max(0, top - 2) : top + 1][::-1]
    rises = [
        _vertex(
            0.5 * (4.0 * second - 3.0 * first - third),
            0.5 * (first + third - 2.0 * second),
        )
        for first, second, third in (side for side in (ahead, behind) if len(side) == 3)
    ]
    if 2 in (len(ahead), len(behind)):
        left, middle, right = depth[top - 1 : top + 2]
        rises.append(_vertex(0.5 * abs(right - left), 0.5 * (left + right) - middle))
    return max(rises)


def _vertex(b: float, c: float) -> float:
    return float(-b * b / (4.0 * c)) if 0.0 < b < -2.0 * c else 0.0


MAX_ANSWERS, CLOSE = 6, 0.05
"""Most rates that one step asks for, and the residual over the drive at which it asks
for no more."""
CLOSE_OF_FINER = 0.2
"""The same of finer twins, whose rates take longer [1]."""


def levelled(
    drive: Array,
    step: float,
    answer: Callable[[Array], Array | None],
    share: float = 1.0,
    close: float = CLOSE,
) -> Array:
    """Return the error at the end of an implicit step, by a Krylov method.

    ``(1 − ΔN ∂r/∂h) e = drive``.

    The derivative is taken over as much as the drive, or a share of it: gaps close and
    open within it. The drive itself comes back where the rate does not tell, or levels
    nothing.

    Parameters
    ----------
    drive : (n,) error when nothing levels it [m]
    step : ΔN [1]
    answer : what an error (n,) [m] changes of the rate (n,) [m per cycle], None where
        it cannot be told
    share : of the largest entry of the drive over which the derivative is taken [1]
    close : residual over the drive at which no more is asked [1]
    """
    size = float(np.abs(drive).max(initial=0.0))
    asked_over = share * size
    answers = True

    def product(v: Array) -> Array:
        nonlocal answers
        unit = float(np.abs(v).max()) / asked_over
        answered = answer(v / unit) if unit > 0.0 and answers else None
        if answered is None:
            answers = answers and unit == 0.0
            return v
        return np.asarray(v - step * unit * answered)

    if size == 0.0:
        return drive
    system = LinearOperator((len(drive), len(drive)), matvec=product, dtype=np.float64)
    error, _ = gmres(system, drive, rtol=close, restart=MAX_ANSWERS, maxiter=1)
    return np.asarray(error) if answers and float(np.abs(error).max()) < size else drive


WORN_FORCE_SHARE = 1.2
"""Weight of the error of the wear in what wear changes of the forces, set on seed 1."""
WORTH, LEVELS = 0.01, 5.0
"""Error by the drive alone, over the depth, and exponent −g ΔN from which an implicit
step is taken."""


MOVED = 1e-3
"""Share of the largest change of wear from which that of a node says how fast the node
levels its error."""

UNLEVELLED = 0.05
"""Share of the largest drive that may be left where it is levelled: half the nodes are
asked at the shape that all of them wore to, not at their own. Set on lives of NGW11-6
to 25, 100 and 400 µm, beside those on twice and four times the nodes."""

SHARES = (1.0, 0.25, 0.0625)
"""Of an error, over which it is asked how the rate levels it: all of it, or, where
nothing levels that, less."""


class WornFurther(NamedTuple):
    """The error of the wear at one state.

    Parameters
    ----------
    twin : the rougher twin of the state, in all conditions together
    error : (n_rough,) error of the wear with its sign [m]
    by_node : (n_rough,) the same, as each node by itself levels it [m]
    unlevelled : what it may be beside that anywhere, in the last step that levelled any
        [m]
    worse : the twin worn by as much further, in every condition; None where it responds
        otherwise
    """

    twin: Rougher
    error: Array
    by_node: Array
    unlevelled: float
    worse: tuple[coupled.WearState | None, ...]


def errors_of_wear(
    joint: Sequence[Rougher | None], stepping: Array, inherited: float = 0.0
) -> list[WornFurther | None]:
    """Return the error of the wear from state to state, None where a state has no twin.

    Parameters
    ----------
    joint : rougher twins of the states, in all conditions together
    stepping : error of the depth at the states by the steps over cycles [m]
    inherited : error of the depth by what was before [m]
    """
    errors = list[WornFurther | None]()
    last = None
    for twin, steps in zip(joint, stepping, strict=True):
        errors.append(
            None if twin is None else _next(twin, float(steps), inherited, last)
        )
        last = errors[-1] or last
    return errors


def _next(
    twin: Rougher, steps: float, inherited: float, previous: WornFurther | None
) -> WornFurther:
    """Return the error at the next state that has twins."""
    cycle = 0.0
    start = np.zeros_like(twin.wear)
    start_by_node = start
    unlevelled = 0.0
    last = None
    if previous is not None:
        cycle = previous.twin.cycle
        start = previous.error
        start_by_node = previous.by_node
        unlevelled = previous.unlevelled
        last = previous.twin.rate

    step = twin.cycle - cycle
    grown = np.zeros_like(start)
    if twin.rate is not None:  # when nothing levels it since the state before
        grown = step * (twin.rate if last is None else 0.5 * (twin.rate + last))
    error = start + grown

    stepping = steps + inherited
    further = _further(twin, error, stepping)
    worse = _worn_by(twin, further)
    while_levelled = _while_levelled(twin, step, error, stepping, worse)
    if while_levelled is not error:
        levelled_worse = _worn_by(twin, _further(twin, while_levelled, stepping))
        worse = worse if None in levelled_worse else levelled_worse
        left = UNLEVELLED * float(np.abs(error).max())
        return WornFurther(twin, while_levelled, while_levelled, left, worse)

    look = worse
    if inherited > 0.0:  # its own error alone tells how soon that is levelled
        further = _further(twin, error, steps)
        look = _worn_by(twin, further, rate_only=True)
    levels = _levelling_of_nodes(further, _answer(twin, look))
    by_node = (start_by_node + grown) / (1.0 + step * levels)
    return WornFurther(twin, error, by_node, unlevelled, worse)


def _levelling_of_nodes(further: Array, change: Array | None) -> Array:
    """Return how fast each node levels what is off there, (n,) [1 per cycle].

    None of it where wear further off makes the rate no slower, or where a node is
    hardly worn further.

    Parameters
    ----------
    further : (n,) by how much the nodes are worn further [m]
    change : (n,) what that changes of the rate [m per cycle]; None: not known
    """
    size = np.abs(further)
    is_moved = size > MOVED * float(size.max(initial=0.0))
    if change is None:
        return np.zeros_like(further)
    slower = np.maximum(0.0, -change * np.sign(further))
    return np.divide(slower, size, out=np.zeros_like(further), where=is_moved)


def _while_levelled(
    joint: Rougher,
    step: float,
    error: Array,
    stepping: float,
    worse: Sequence[coupled.WearState | None],
) -> Array:
    """Return what the rate leaves of a large error within a step, (n,) [m].

    The error itself where nothing levels it many times over. Worn by all of it a twin
    may respond otherwise, or strike; while it is levelled it stays small.

    Parameters
    ----------
    joint, step : the twin, and cycles since the state before [1]
    error : (n,) when nothing levels it [m]
    stepping : error of the depth by the steps over cycles [m]
    worse : the twin worn by all of it, in every condition
    """
    if float(np.abs(error).max()) <= WORTH * float(joint.wear.max(initial=0.0)):
        return error

    def answer(further: Array) -> Array | None:
        """Return what wear by so much further (n,) [m] changes of the rate."""
        return _answer(joint, _worn_by(joint, further, rate_only=True))

    off = _further(joint, error, stepping)
    close = CLOSE_OF_FINER if joint.is_finer else CLOSE
    for share in SHARES:
        change = _answer(joint, worse) if share == 1.0 else answer(share * off)
        if change is None:
            continue
        levels = -float(off @ change) * step >= share * LEVELS * float(off @ off)
        if not levels:
            continue
        left = levelled(error, step, answer, share, close)
        if left is not error:
            return left
    return error


def _answer(joint: Rougher, worse: Sequence[coupled.WearState | None]) -> Array | None:
    """Return what further wear changes of the rate of all conditions, or None."""
    changes = []
    for share, twin, moved in zip(joint.shares, joint.conditions, worse, strict=True):
        if moved is None or not (moved.wears and twin.state.wears):
            return None
        flat = twin.parts.coupling.flat
        changes.append(share * (flat(moved.rate) - flat(twin.state.rate)))
    return np.sum(changes, axis=0)


def _further(joint: Rougher, error: Array, stepping: float) -> Array:
    """Return by how much the twin is worn further: by its error, and that of steps."""
    of_wear = WORN_FORCE_SHARE * error
    of_steps = stepping * joint.wear / (joint.wear.max(initial=0.0) or 1.0)
    return np.asarray(
        of_wear - of_steps if of_wear @ of_steps < 0.0 else of_wear + of_steps
    )


def _worn_by(
    joint: Rougher, off: Array, *, rate_only: bool = False
) -> tuple[coupled.WearState | None, ...]:
    """Return the twins worn by so much further, None where one responds otherwise.

    Where the rate alone is asked, without the responses that it does not need.
    """
    if not np.isfinite(off).all():
        return (None,) * len(joint.conditions)
    if not off.any():
        return tuple(twin.state for twin in joint.conditions)
    worn = [
        twin.parts.coupling.split(np.maximum(0.0, twin.wear + off))
        for twin in joint.conditions
    ]
    companions = zip(joint.conditions, worn, strict=True)
    return tuple(
        alike(twin.parts, wear, twin.state.start_alike, twin.state, rate_only=rate_only)
        for twin, wear in companions
    )
