"""Is the error estimate of a run over a face honest? The run beside one on more than
twice its slices and nodes.
"""

from collections.abc import Callable

import numpy as np
import xarray as xr
from estimate_score import LESS_TIGHT, TOO_LONG, Apart, Pair, Score, comparable_run
from face_life_estimates import FINE
from processor_time import OutOfTime, bounded

from wearlab.scene import Scene
from wearlab.simulation import Refused, simulate
from wearlab.simulation.dataset.errors import TRUSTED


def score_over_face(
    scene: Scene,
    told: Callable[[bool], None] = lambda trusted: None,
    longest: float = np.inf,
) -> Score:
    """Compare the estimates of a scene with a face with its errors.

    Parameters
    ----------
    scene : the scene
    told : told whether the run trusts its estimates, when it is done and the reference
        begins
    longest : what the reference may take of the processor [s]

    Raises
    ------
    Apart
        When there is nothing to compare, with the reason.
    """
    data = comparable_run(scene)
    end = str(data.end_reason.values)
    trusted = str(data.estimate_quality.values) == TRUSTED
    told(trusted)
    last = data.isel(update=-1)
    truth = _reference(scene, float(last.cycle), longest)
    spent = float(data.run_time_estimates)
    return Score(
        wear_depth=_pair(last, truth, "wear_depth", ("max_wear_depth",)),
        life=_life(data, truth) if end == "depth" else None,
        mesh_force=None,
        cost=spent / (float(data.run_time_total) - spent),
        trusted=trusted,
        mesh_force_max=_pair(last, truth, "mesh_force_max", ("mesh_force_max",)),
        reference=LESS_TIGHT,
        mesh_force_range=_range(last, truth),
        transmission_error=_pair(
            last, truth, "transmission_error", ("ste_max", "ste_peak_to_peak")
        ),
    )


def _reference(scene: Scene, cycle: float, longest: float) -> xr.Dataset:
    """Return the state at a cycle on finer slices and nodes."""
    fine = scene.replace(FINE).replace("wear.until.cycles", cycle)
    assert scene.wear is not None
    until = scene.wear.until
    for name in ("flank", "depth"):
        if getattr(until, name) is not None:
            fine = fine.replace(f"wear.until.{name}", None)
    if scene.wear.snapshots is not None:
        fine = fine.replace("wear.snapshots", None)
    try:
        with bounded(longest):
            run = simulate(fine)
    except OutOfTime:
        raise Apart(f"reference {TOO_LONG}") from None
    except Refused as refusal:
        raise Apart(f"reference refused: {refusal}") from refusal
    if float(run.cycle.values[-1]) < (1.0 - 1e-9) * cycle:
        raise Apart(f"reference ends early: {run.end_reason.values}")
    return run


def _pair(
    last: xr.Dataset, truth: xr.Dataset, estimate: str, names: tuple[str, ...]
) -> Pair | None:
    """Return the largest error of some quantities in the last state, and its estimate.

    None: the run has no such thing.
    """
    told = f"error_estimate_{estimate}"
    if told not in last or names[0] not in last:
        return None
    true = truth.isel(update=-1)
    errors = [float(np.abs(last[name] - true[name]).max()) for name in names]
    return max(errors), float(last[told])


def _range(last: xr.Dataset, truth: xr.Dataset) -> Pair | None:
    """Return the largest error of largest less least mesh force, and its estimate."""
    if "mesh_force_max" not in last:
        return None
    true = truth.isel(update=-1)
    ranges = [run.mesh_force_max - run.mesh_force_min for run in (last, true)]
    ends = (last.error_estimate_mesh_force_max, last.error_estimate_mesh_force_min)
    return float(np.abs(ranges[0] - ranges[1]).max()), float(sum(ends))


def _life(data: xr.Dataset, truth: xr.Dataset) -> Pair | None:
    """Return what the deepest flank is missed by in cycles, and the estimate of it.

    None where it wears no more.
    """
    flank = int(data.max_wear_depth.values[-1].argmax())
    depth = truth.max_wear_depth.values[:, flank]
    rate = float((depth[-1] - depth[-2]) / np.diff(truth.cycle.values[-2:])[0])
    if rate <= 0.0:
        return None
    missed = abs(float(data.max_wear_depth.values[-1, flank]) - float(depth[-1]))
    return missed / rate, float(data.error_estimate_life)
