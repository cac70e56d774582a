"""Estimated numerical errors of a life, and of the forces of its stored states."""

from collections.abc import Sequence

import numpy as np

from wearlab.arrays import Array
from wearlab.life import history
from wearlab.mesh.gear_set import GearSet
from wearlab.simulation import estimates, face_estimates, label, operating

TRUSTED = "as usual"
"""Quality of estimates against which nothing speaks."""


def stage_errors(
    stage: operating.OperatingCondition,
    life_history: history.History,
    inherited: float,
    failures: list[str],
) -> estimates.Estimates:
    """Estimate the errors of one stage of a life.

    Parameters
    ----------
    stage : the stage
    life_history : the life in it
    inherited : error of the wear that the run starts from [m]
    failures : gets a line where nothing can be estimated
    """
    estimate = estimates.estimated
    if stage.first.face is not None:
        estimate = face_estimates.estimated_over_face
    unknown = estimates.not_estimated(life_history)
    errors: estimates.Estimates = label.diagnosed(
        "estimates", failures, unknown, estimate, stage, life_history, inherited
    )
    return errors


def error_values(
    errors: Sequence[estimates.Estimates],
    life_history: history.History,
    inherited: float,
) -> label.Values:
    """Return the quality of the estimates, and the errors of depth and life.

    Parameters
    ----------
    errors : estimated, of each stage of the life
    life_history : the life through these stages
    inherited : error of the wear that the run starts from [m]
    """
    doubts = dict.fromkeys(doubt for of_stage in errors for doubt in of_stage.doubts)
    quality = f"doubtful: {'; '.join(doubts)}" if doubts else TRUSTED
    values: label.Values = {"estimate_quality": quality}

    life = life_history.life
    if life is None:
        return values
    depth, of_life = accumulated(errors, life_history, inherited)
    values["error_estimate_wear_depth"] = depth
    values["steps_cycle"] = life.cycle[1:]
    values["count_wear_steps"] = life.count_steps
    values["count_rejected_steps"] = life.count_rejected
    if of_life is not None:
        values["error_estimate_life"] = of_life
    return values


def accumulated(
    errors: Sequence[estimates.Estimates],
    life_history: history.History,
    inherited: float = 0.0,
) -> tuple[Array, float | None]:
    """Return the errors of wear depth and life over all stages: errors add up.

    Parameters
    ----------
    errors : estimated, of each stage of the life
    life_history : the life through these stages
    inherited : error of the wear that the run starts from, which is added like an
        earlier stage [m]

    Returns
    -------
    depth : errors of the depth at the stored states (n_updates,) [m]
    life : error of the life [1], None without a depth limit that was reached
    """
    earlier = inherited
    depths = []
    for number, estimate in enumerate(errors):
        assert estimate.wear_depth is not None
        first = 1 if number else 0  # a later stage begins with the end of the last
        depths.append(earlier + estimate.wear_depth[first:])
        before_last_stage = earlier
        earlier = earlier + float(estimate.wear_depth[-1])

    of_life = errors[-1].life
    life = life_history.life
    fastest = 0.0 if life is None else float(life.rate[-1].max(initial=0.0))
    if of_life is not None and fastest > 0.0:
        of_life += before_last_stage / fastest
    return np.concatenate(depths), of_life


def flank_error_values(
    gears: GearSet,
    errors: Sequence[estimates.Estimates],
    inherited: float,
    values: label.Values,
) -> label.Values:
    """Return the errors of the depth of every flank: errors of stages add up.

    One motion wears all flanks: what its steps make of one they may make of another. So
    every flank is off by as much of its depth as the one that is off most, and by no
    more than the largest error of all. Of planets that wear apart the largest counts.

    Parameters
    ----------
    gears : the gears of the scene
    errors : estimated, of each stage of the life
    inherited : error of the wear that the run starts from [m]
    values : of the life, its depths and the largest errors among them
    """
    earlier: Array | float = inherited
    pieces = []
    for number, estimate in enumerate(errors):
        depth = estimate.flank_depth
        if depth is None:
            return {}
        first = 1 if number else 0  # a later stage begins with the end of the last
        pieces.append(earlier + depth[:, first:])
        earlier = earlier + depth[:, -1:]

    of_places = np.concatenate(pieces, axis=1)
    rows = []
    for name in gears.flanks:
        numbers = [2 * kind + gear for kind, gear in gears.places_of(name)]
        rows.append(of_places[numbers].max(axis=0))
    of_flanks = np.stack(rows, axis=1)

    deepest = np.nanmax(values["wear_depth"], axis=-1)
    shares = label.ratio(of_flanks, deepest)
    share = np.fmax.reduce(shares, axis=1, keepdims=True, initial=0.0)
    largest = values["error_estimate_wear_depth"][:, None]
    error = np.minimum(largest, np.maximum(of_flanks, share * deepest))
    return {"error_estimate_flank_wear_depth": error}


def condition_error_values(
    errors: estimates.Estimates, block: int, updates: int, bearings: bool
) -> label.Values:
    """Return the errors of contact and forces of the stored states in one condition.

    Parameters
    ----------
    errors : estimated, of the stage
    block : number of the condition of operation
    updates : number of its last states that are stored
    bearings : whether the bearings bear forces
    """
    values: label.Values = {}
    if errors.period:
        of_period = errors.period[block]
        values["error_estimate_stiffness"] = of_period.stiffness[-updates:]
        transmission_error = of_period.transmission_error[-updates:]
        values["error_estimate_transmission_error"] = transmission_error
        if of_period.face_load_factor is not None:
            factor = of_period.face_load_factor[-updates:]
            values["error_estimate_face_load_factor"] = factor

    if errors.force is None:
        return values
    of_states = errors.force[block]
    values["error_estimate_mesh_force"] = of_states.mesh[-updates:]
    values["error_estimate_mesh_force_max"] = of_states.largest[-updates:]
    values["error_estimate_mesh_force_min"] = of_states.least[-updates:]
    if bearings:
        values["error_estimate_bearing_force"] = of_states.bearing[-updates:]
    return values
