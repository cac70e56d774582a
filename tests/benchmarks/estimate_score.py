"""Is the error estimate of a run honest? The run beside a reference to a tolerance of
1e-5.

Where that reference takes longer than it may, one to 1e-4 serves if its own estimated
errors are small beside those that the run tells of itself.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from processor_time import OutOfTime, bounded

from wearlab.assembly import GearModel
from wearlab.dynamics.forces.mesh_forces import extremes
from wearlab.gears.specification import GearError
from wearlab.life.coupled import Wear, WearState
from wearlab.mesh.profile import ProfileGrid
from wearlab.scene import Scene
from wearlab.simulation import Refused, simulate
from wearlab.simulation.companion_runs import carried
from wearlab.simulation.dataset.dynamics import phase_forces
from wearlab.simulation.dataset.errors import TRUSTED
from wearlab.simulation.dataset.mesh_period import contact_over_period
from wearlab.simulation.dataset.validity import ENDS_OF_WORK
from wearlab.simulation.estimates import Estimates, estimated
from wearlab.simulation.life_run import integrate_life
from wearlab.simulation.operating import operating_conditions

Array = NDArray[np.float64]

TIGHT, LESS_TIGHT = 1e-5, 1e-4
"""Tolerances of the reference, and of the one that serves where that takes too long."""
ADEQUATE = 0.5
"""Largest own error of the latter, over the estimate that it is to judge."""
TOO_LONG = "too long"
SHORT, REPEATS = 0.5, 3
"""A run that takes less [s] is timed so often: a busy machine may stretch either part
of it."""
QUANTITIES = (
    "wear_depth",
    "life",
    "mesh_force",
    "mesh_force_max",
    "mesh_force_range",
    "transmission_error",
)
Pair = tuple[float, float]


class Score(NamedTuple):
    """True and estimated errors of one scene, at the end of its life.

    Parameters
    ----------
    wear_depth, life, mesh_force, mesh_force_max, mesh_force_range,
    transmission_error : (true error, estimate) [m], [1], [N], [N], [N], [m]; None: the
        run has no such thing. An error is infinite where the reference responds
        otherwise.
    cost : time spent on the estimates over the time of everything else in the run [1]
    trusted : whether the run says that its estimates are as usual
    reference : tolerance of the reference [1]
    """

    wear_depth: Pair | None
    life: Pair | None
    mesh_force: Pair | None
    cost: float
    trusted: bool = True
    mesh_force_max: Pair | None = None
    reference: float = TIGHT
    mesh_force_range: Pair | None = None
    transmission_error: Pair | None = None


class Apart(Exception):
    """Why a scene has no score: it is aperiodic, unfinished, or refused."""


class Truth(NamedTuple):
    """The end of a life to a tight tolerance.

    Parameters
    ----------
    cycle : where it ends [1]
    end_reason : why
    wear, rate : of every kind of mesh, each (2, n) [m], [m per cycle]
    grids : nodes of every kind of mesh
    force : at every error angle, (n_mesh, n_periods, n_phases) [N]
    largest, least : at every error angle, (n_mesh,) [N]
    transmission_error : largest value, and peak to peak, (2, n_mesh) [m]
    period : of the response at every error angle, 0 where it does not repeat
    tolerance : [1]
    own : its own estimated errors, None for the tightest
    """

    cycle: float
    end_reason: str
    wear: Wear
    rate: Wear
    grids: list[ProfileGrid]
    force: list[Array]
    largest: Array
    least: Array
    transmission_error: Array
    period: list[int]
    tolerance: float = TIGHT
    own: Estimates | None = None


def reference(scene: Scene, cycle: float, tolerance: float = TIGHT) -> Truth:
    """Return the life of a scene to a tight tolerance, to the same
    cycle whatever the depth.
    """
    tight = scene.replace("numerics.tolerance", tolerance).replace(
        "wear.until.cycles", cycle
    )
    for key in ("wear.until.flank", "wear.until.depth"):
        tight = tight.replace(key, None)
    tight = (
        tight.replace("wear.snapshots", None)
        if scene.wear and scene.wear.snapshots
        else tight
    )
    tight = tight.replace(
        "wear.snapshots", {"cycles": [cycle]}
    )  # no others are worked out in full
    try:
        (stage,) = operating_conditions(tight)
        lived = integrate_life(tight, (stage,)).stages[0]
    except GearError as refusal:
        raise Apart(f"reference refused: {refusal}") from refusal
    assert lived.life is not None
    last = lived.state[-1]
    return Truth(
        float(lived.cycle[-1]),
        lived.life.end_reason,
        last.wear,
        last.rate,
        _grids(stage.first),
        [
            phase_forces(stage.first, last, one).transpose(1, 0, 2)
            for one in last.responses
        ],
        np.array([extremes(one).largest for one in last.responses]),
        np.array([extremes(one).least for one in last.responses]),
        _transmission_errors(stage.first, last),
        [one.period for one in last.responses],
        tolerance,
        None if tolerance == TIGHT else estimated(stage, lived),
    )


def _transmission_errors(model: GearModel, state: WearState) -> Array:
    """Return largest transmission error and peak to peak of every mesh, (2, n) [m]."""
    columns = []
    for number, mesh in enumerate(model.meshes):
        flanks = state.flanks[mesh.kind]
        constant = model.constant_error[number]
        contact = contact_over_period(
            flanks.analysis,
            flanks.nodes,
            mesh.lag,
            lambda phase, mesh=mesh, constant=constant: (  # type: ignore[misc]
                mesh.error.value(phase) + constant
            ),
        )
        columns.append([contact.largest_error, contact.peak_to_peak])
    return np.transpose(columns)


def reference_within(scene: Scene, cycle: float, longest: float) -> Truth:
    """Return the tightest reference that ends within a time of the processor.

    Parameters
    ----------
    scene, cycle : the scene and its end [1]
    longest : what each reference may take [s]

    Raises
    ------
    Apart
        When none ends in time.
    """
    for tolerance in (TIGHT, LESS_TIGHT):
        try:
            with bounded(longest):
                return reference(scene, cycle, tolerance)
        except OutOfTime:
            pass
    raise Apart(f"reference {TOO_LONG}")


def score(
    scene: Scene,
    told: Callable[[bool], None] = lambda trusted: None,
    longest: float = np.inf,
) -> Score:
    """Compare the estimates of a scene with its errors against a tight reference.

    Parameters
    ----------
    scene : the scene
    told : told whether the run trusts its estimates, when it is done and the reference
        begins
    longest : what a reference may take of the processor [s]

    Raises
    ------
    Apart
        When there is nothing to compare, with the reason.
    """
    data = comparable_run(scene)
    end = str(data.end_reason.values)
    trusted = str(data.estimate_quality.values) == TRUSTED
    told(trusted)
    truth = reference_within(scene, float(data.cycle.values[-1]), longest)
    if truth.cycle < (1.0 - 1e-9) * float(data.cycle[-1]):
        raise Apart(f"reference ends early: {truth.end_reason}")
    (stage,) = operating_conditions(scene)
    worn = data.wear_depth.values[-1]
    missed = max(
        float(np.abs(carried(fine, truly, own) - worn[rows, : len(own.position)]).max())
        for rows, truly, fine, own in zip(
            _pairs(len(worn)), truth.wear, truth.grids, _grids(stage.first), strict=True
        )
    )
    if not _adequate(truth, data):
        raise Apart("reference too rough")
    return Score(
        (missed, float(data.error_estimate_wear_depth[-1])),
        _life(data, truth) if end == "depth" else None,
        _force(data, truth) if "dynamic_mesh_force" in data else None,
        _cost(scene, data),
        trusted,
        _largest(data, truth) if "mesh_force_max" in data else None,
        truth.tolerance,
        _range(data, truth) if "mesh_force_max" in data else None,
        _transmission_error(data, truth),
    )


def _adequate(truth: Truth, data: xr.Dataset) -> bool:
    """Return whether the reference's own errors are small beside the estimates that it
    is to judge.
    """
    own = truth.own
    if own is None:
        return True
    pairs = [("wear_depth", own.wear_depth), ("life", own.life)]
    if own.force is not None:
        pairs += [
            ("mesh_force", own.force[0].mesh),
            ("mesh_force_max", own.force[0].largest),
        ]
    return all(
        np.ravel(error)[-1] <= ADEQUATE * data[f"error_estimate_{name}"].values.flat[-1]
        for name, error in pairs
        if error is not None and f"error_estimate_{name}" in data
    )


def _life(data: xr.Dataset, truth: Truth) -> Pair | None:
    """Return what the first flank's deepest place is missed by in cycles.

    None where it wears no more.
    """
    truly = truth.wear[0][0]
    rate = truth.rate[0][0]
    at = int(np.argmax(truly))
    limit = float(np.asarray(data.max_wear_depth.values)[-1, 0])
    if rate[at] <= 0.0:
        return None
    return abs(limit - float(truly[at])) / float(rate[at]), float(
        data.error_estimate_life
    )


def _force(data: xr.Dataset, truth: Truth) -> Pair:
    """Return the largest difference of the mesh forces.

    Infinite where periods are not the same.
    """
    estimate = float(data.error_estimate_mesh_force[-1])
    last = data.isel(update=-1)
    if not np.array_equal(np.atleast_1d(last.response_period.values), truth.period):
        return float("inf"), estimate
    found = last.dynamic_mesh_force
    angles = range(len(truth.force)) if "error_angle" in found.dims else [0]
    each = [found.isel(error_angle=k, missing_dims="ignore") for k in angles]
    return max(
        _differ(one, true) for one, true in zip(each, truth.force, strict=True)
    ), estimate


def _largest(data: xr.Dataset, truth: Truth) -> Pair:
    """Return the largest difference of the largest mesh forces."""
    missed = float(np.abs(_last(data, "mesh_force_max") - truth.largest).max())
    return missed, float(data.error_estimate_mesh_force_max[-1])


def _range(data: xr.Dataset, truth: Truth) -> Pair:
    """Return the largest difference of largest less least mesh force."""
    found = _last(data, "mesh_force_max") - _last(data, "mesh_force_min")
    missed = float(np.abs(found - (truth.largest - truth.least)).max())
    of_ends = (data.error_estimate_mesh_force_max, data.error_estimate_mesh_force_min)
    return missed, float(sum(estimate[-1] for estimate in of_ends))


def _last(data: xr.Dataset, name: str) -> Array:
    """Return a quantity of meshes in the last state, (n_angles, n_mesh)."""
    last = data[name].isel(update=-1)
    turned = "error_angle" in last.dims and last.dims[0] == "mesh"
    return np.atleast_2d(last.values.T if turned else last.values)


def _transmission_error(data: xr.Dataset, truth: Truth) -> Pair:
    """Return the largest difference of largest transmission error and peak to peak."""
    last = data.isel(update=-1)
    found = np.stack([last.ste_max.values, last.ste_peak_to_peak.values])
    missed = float(np.abs(found - truth.transmission_error).max())
    return missed, float(data.error_estimate_transmission_error[-1])


def _differ(found: xr.DataArray, true: Array) -> float:
    """Return the largest difference of forces (mesh, mesh_period, phase) that begin in
    any period [N].
    """
    one = found.transpose("mesh", "mesh_period", "phase").values[:, : true.shape[1]]
    return min(
        float(np.abs(np.roll(one, turn, axis=1) - true).max())
        for turn in range(one.shape[1])
    )


def _cost(scene: Scene, data: xr.Dataset) -> float:
    """Return the time of the estimates over that of the rest, each the shortest of
    several short runs.
    """
    times = [_times(data)]
    if sum(times[0]) < SHORT:
        times += [_times(_simulated(scene)) for _ in range(REPEATS - 1)]
    spent, rest = (min(each) for each in zip(*times, strict=True))
    return spent / rest


def _times(data: xr.Dataset) -> tuple[float, float]:
    spent = float(data.run_time_estimates)
    return spent, float(data.run_time_total) - spent


def _simulated(scene: Scene) -> xr.Dataset:
    try:
        return simulate(scene)
    except Refused as refusal:
        raise Apart(f"refused: {refusal}") from refusal


def comparable_run(scene: Scene) -> xr.Dataset:
    """Return the run of a scene whose life ends and whose motion repeats.

    Parameters
    ----------
    scene : the scene

    Raises
    ------
    Apart
        When it is no such run, with the reason.
    """
    data = _simulated(scene)
    if _aperiodic(data):
        raise Apart("aperiodic")
    end = str(data.end_reason.values)
    if end in ENDS_OF_WORK:
        raise Apart(f"unfinished: {end}")
    return data


def _grids(parts: GearModel) -> list[ProfileGrid]:
    return [kind.analysis.grid for kind in parts.kinds]


def _pairs(flanks: int) -> list[slice]:
    """Return which flanks belong to each kind of mesh."""
    return [slice(first, first + 2) for first in range(0, flanks, 2)]


def _aperiodic(data: xr.Dataset) -> bool:
    return "response_period" in data and bool((data.response_period == 0).any())


def summary(
    scores: Sequence[Score], missed: int = 0
) -> dict[str, tuple[int, float, float]]:
    """Return for each quantity: scenes, share with error below estimate, median of
    estimate over error.

    An estimate that is missing (NaN) counts as one that the error exceeds.

    Parameters
    ----------
    scores : of scenes
    missed : further scenes whose errors took too long to find: each counts as above its
        estimate
    """
    found = {}
    for name in QUANTITIES:
        values = np.array(
            [getattr(one, name) for one in scores if getattr(one, name) is not None]
        )
        if len(values):
            true, estimate = values.T
            known = np.isfinite(estimate) & np.isfinite(true)
            ratio = (
                np.median(estimate[known] / np.maximum(true[known], 1e-300))
                if known.any()
                else np.nan
            )
            count = len(values) + missed
            found[name] = (count, float(np.sum(true <= estimate)) / count, float(ratio))
    return found
