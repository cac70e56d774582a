"""Estimates of the numerical error: of the steps over cycles, of the integrator, of the nodes on the flanks.

A few states of the life are evaluated once more with half the steps and half the nodes. What the wear rate
changes by is carried along the cycles, and added to what the steps over cycles report of themselves.
"""

import time
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.response import Response
from wearlab.gears.errors import GearError
from wearlab.life.history import History
from wearlab.life.limits import StopWear
from wearlab.life.state import Wear, WearState
from wearlab.mesh.excitation import mesh_force
from wearlab.mesh.profile import ProfileGrid, interpolate, lookup
from wearlab.scene import Scene
from wearlab.scene.build import Parts, build
from wearlab.scene.build.mesh import profile_points
from wearlab.simulate.operating import Stage

Array = NDArray[np.float64]

MOST_SAMPLES = 5
"""States that are evaluated once more."""
COARSENED = 0.5
RATE_SHARE = 1.0
FORCE_SHARE = 0.3
WORN_SHARE = 1.0
"""Weights of the rougher twin, set on scenes of seed 1 (`wearlab.accuracy.estimates`)."""
DEEPEST = 0.95
"""Share of the largest depth from which a node counts as one that may end the life."""


class Rougher(NamedTuple):
    """One state evaluated once more, with half the steps and half the nodes.

    Parameters
    ----------
    cycle : of the state [1]
    wear : (n_rough,) its wear depth at the rougher nodes of all flanks [m]
    rate : (n_rough,) change of the wear rate, None without a wear law [m]
    flank : (n_rough,) which flank each node is on
    force : largest change of the mesh force, NaN without dynamics [N]
    """

    cycle: float
    wear: Array
    rate: Array | None
    flank: NDArray[np.int64]
    force: float


class Estimates(NamedTuple):
    """Estimated errors.

    Parameters
    ----------
    wear_depth : (n_updates,) [m], None when nothing wears on
    mesh_force : (n_updates,) in every condition of operation [N], None without dynamics
    life : [1], None without a depth limit that was reached
    """

    wear_depth: Array | None
    mesh_force: tuple[Array, ...] | None
    life: float | None


def rough_parts(scene: Scene, parts: Parts) -> Parts | None:
    """Return the scene's physics with half the steps and half the nodes, None when that cannot be."""
    changed: dict[str, int] = {"profile_points": max(9, int(COARSENED * profile_points(scene)))}
    if parts.vibration is not None:
        changed["steps_per_period"] = max(4, int(COARSENED * len(parts.vibration.stages.grid.width)))
    numerics = scene.numerics.model_copy(update=changed)
    try:
        return build(scene.model_copy(update={"numerics": numerics}))
    except GearError:
        return None


def carried(fine: ProfileGrid, values: Array, rough: ProfileGrid) -> Array:
    """Return values (k, n) at the nodes of a grid on those of another that has the same breaks, (k, n')."""
    phases, _ = rough.phase_nodes
    segment = np.repeat(np.arange(len(rough.intervals)), rough.intervals + 1)
    where = lookup(fine, phases, segment)
    pairs = rough.pairs_at_phase_nodes
    present = pairs >= 0
    found = np.empty((len(values), len(rough.touching)))
    for row, one in zip(found, fine.beyond(values), strict=True):
        at_phases = np.empty(pairs.shape)
        interpolate(fine.first, where, np.ascontiguousarray(one), 0.0, at_phases)
        row[pairs[present]] = at_phases[present]
    return found[:, rough.on_flank]


def rougher(parts: Parts, rough: Parts, cycle: float, state: WearState) -> Rougher | None:
    """Evaluate one state once more, None when the response is another one or none."""
    responses = state.responses
    if any(response.period == 0 for response in responses):
        return None
    try:
        wear = tuple(np.maximum(0.0, one) for one in _carried(parts, state.wear, rough))
        again = rough.coupling.evaluate(wear, responses)
    except StopWear:
        return None
    if [one.period for one in again.responses] != [one.period for one in responses]:
        return None
    rate = None
    if state.wears and again.wears:
        rate = rough.coupling.flat(again.rate) - rough.coupling.flat(_carried(parts, state.rate, rough))
    force = np.nan
    if responses:
        force = max(
            _change_of_force(_force(parts, state, one), _force(rough, again, other))
            for one, other in zip(responses, again.responses, strict=True)
        )
    sizes = [len(one.analysis.grid.position) for one in rough.kinds for _ in (0, 1)]
    flank = np.repeat(np.arange(len(sizes)), sizes)
    return Rougher(cycle, rough.coupling.flat(again.wear), rate, flank, force)


def _carried(parts: Parts, values: Wear, rough: Parts) -> Wear:
    return tuple(
        carried(fine.analysis.grid, one, other.analysis.grid)
        for fine, one, other in zip(parts.kinds, values, rough.kinds, strict=True)
    )


def _change_of_force(fine: Array, coarse: Array) -> float:
    """Return the largest difference of two forces that may begin in any of their periods [N]."""
    turns = range(len(fine))
    return float(min(np.abs(np.roll(coarse, turn, axis=0) - fine).max() for turn in turns))


def _force(parts: Parts, state: WearState, response: Response) -> Array:
    """Return the force of every mesh, (n_periods, n_mesh, n_phases) [N]."""
    vibration = parts.vibration
    assert vibration is not None
    deflection, _ = vibration.deflection(response, vibration.look(parts.phase))
    touching = parts.coupling.touching(state)
    return np.stack(
        [
            np.stack([
                mesh_force(
                    touching[one.kind], parts.look(mesh, parts.phase), row, vibration.backlash_of(mesh)
                ).elastic
                for row in deflection[:, mesh]
            ])
            for mesh, one in enumerate(parts.meshes)
        ],
        axis=1,
    )  # fmt: skip


def samples(lived: History) -> list[int]:
    """Return which of the kept states are evaluated once more: the first, the last, some between."""
    count = len(lived.state)
    return sorted({round(at) for at in np.linspace(0, count - 1, min(count, MOST_SAMPLES))})


def estimated(stage: Stage, lived: History) -> Estimates:
    """Estimate the errors of a life at its kept states.

    Parameters
    ----------
    stage : what runs, in all its conditions
    lived : its history

    Notes
    -----
    Wear depth: what the steps over cycles accumulate, and the integral of the change of rate over the cycles.
    Mesh force: its own change, and what the error of the wear depth is worth at the mean mesh stiffness.
    A state whose rougher twin responds otherwise counts as its neighbours do; without any twin there is no
    estimate of the force.
    """
    clock = time.perf_counter()
    blocks = range(len(stage.parts))
    each = [_twins(*one, lived) for one in zip(stage.scenes, stage.parts, blocks, strict=True)]
    found = [together(list(twins), stage.shares.weight) for twins in zip(*each, strict=True)]
    stage.first.coupling.account.seconds["estimates"] += time.perf_counter() - clock
    known = [twin for twin in found if twin is not None]
    depth = _depth(lived, known)
    force = None
    if stage.first.vibration is not None:
        force = tuple(
            _force_error(parts, in_block(lived, block), [twin for twin in twins if twin is not None], depth)
            for block, (parts, twins) in enumerate(zip(stage.parts, each, strict=True))
        )
    return Estimates(depth, force, _life(lived, known))


def _twins(scene: Scene, parts: Parts, block: int, lived: History) -> list[Rougher | None]:
    """Return the rougher twins of some kept states in one condition."""
    rough = rough_parts(scene, parts)
    own = in_block(lived, block)
    chosen = samples(own) if rough is not None else []
    return [rougher(parts, rough, float(own.cycle[k]), own.state[k]) for k in chosen if rough is not None]


def in_block(lived: History, block: int) -> History:
    """Return a life as one of the conditions that take turns saw it."""
    return lived._replace(state=tuple(state.block[block] if state.block else state for state in lived.state))


def together(twins: list[Rougher | None], weight: Array) -> Rougher | None:
    """Return the twins of one state in all conditions as one, None where one is missing."""
    known = [twin for twin in twins if twin is not None]
    if len(known) < len(twins):
        return None
    rates = [twin.rate for twin in known if twin.rate is not None]
    rate = None
    if len(rates) == len(known):
        rate = np.asarray(sum(w * own for w, own in zip(weight, rates, strict=True)))
    return known[0]._replace(rate=rate, force=max(twin.force for twin in known))


def _depth(lived: History, found: list[Rougher]) -> Array | None:
    life = lived.life
    if life is None:
        return None
    stepping = np.interp(lived.cycle, life.cycle, life.accumulated_error)
    noise = np.array([state.noise for state in lived.state])
    total = stepping + _integral(lived.cycle, noise)
    known = [(twin.cycle, twin.rate) for twin in found if twin.rate is not None]
    if not known:
        return total
    cycle = np.array([at for at, _ in known])
    change = np.stack([rate for _, rate in known])
    carried_on = np.abs(_integral(cycle, change)).max(axis=1)
    if len(cycle) == 1:
        carried_on, cycle = np.abs(change).max() * lived.cycle, lived.cycle
    return np.asarray(total + RATE_SHARE * np.interp(lived.cycle, cycle, carried_on))


def _integral(cycle: Array, values: Array) -> Array:
    """Return the integral of values (n, …) over cycles (n,), 0 at the first."""
    step = np.diff(cycle).reshape(-1, *(1,) * (values.ndim - 1))
    pieces = 0.5 * step * (values[1:] + values[:-1])
    return np.concatenate([np.zeros_like(values[:1]), np.cumsum(pieces, axis=0)])


def _force_error(parts: Parts, lived: History, found: list[Rougher], depth: Array | None) -> Array:
    known = [twin for twin in found if np.isfinite(twin.force)]
    if not known:
        return np.full(len(lived.state), np.nan)
    force = np.interp(lived.cycle, [twin.cycle for twin in known], [twin.force for twin in known])
    weights = [one.analysis.grid.phase_nodes[1] for one in parts.kinds]
    stiffness = np.array([
        max(weight @ one.static.tangent for weight, one in zip(weights, state.kind, strict=True))
        for state in lived.state
    ])  # fmt: skip
    worn = 0.0 if depth is None else stiffness * depth
    aperiodic = [any(one.period == 0 for one in state.responses) for state in lived.state]
    return np.where(aperiodic, np.nan, FORCE_SHARE * force + WORN_SHARE * worn)


def _life(lived: History, found: list[Rougher]) -> float | None:
    """Return the error of the deepest depth over the fastest wear, at the end of the life [1]."""
    life = lived.life
    if life is None or life.end_reason != "depth":
        return None
    fastest = float(life.rate[-1].max(initial=0.0))
    if fastest <= 0.0:
        return 0.0
    return (float(life.accumulated_error[-1]) + RATE_SHARE * _deepest_change(found)) / fastest


def _deepest_change(found: list[Rougher]) -> float:
    """Return the integral of the change of rate where a flank is worn most [m]."""
    known = [(twin.cycle, twin.rate) for twin in found if twin.rate is not None]
    if len(known) < 2:
        return 0.0
    last = next(twin for twin in reversed(found) if twin.rate is not None)
    cycle = np.array([at for at, _ in known])
    carried_on = np.abs(_integral(cycle, np.stack([rate for _, rate in known]))[-1])
    deepest_of_flank = np.array([last.wear[last.flank == flank].max() for flank in np.unique(last.flank)])
    return float(carried_on[last.wear >= DEEPEST * deepest_of_flank[last.flank]].max())
