"""What is said of a life as a whole: wear, verdict, validity, errors, time and work."""

from collections.abc import Sequence

from wearlab.simulation import label, operating
from wearlab.simulation.dataset import (
    dynamics,
    errors,
    life,
    model_errors,
    planets,
    rating,
    validity,
    verdict,
    wear,
)
from wearlab.simulation.dataset.finished import ConditionsOfLife, FinishedLife


def life_variables(
    finished: FinishedLife, of_conditions: ConditionsOfLife, failures: list[str]
) -> label.Values:
    """Return the variables that belong to no single condition of operation.

    Parameters
    ----------
    finished : the life
    of_conditions : what its conditions of operation say for themselves
    failures : gets a line for each part that fails
    """
    scene = finished.scene
    model = finished.stages[0].first
    history = finished.history
    searches = [searched.search for searched in of_conditions.searches]

    values = life.life_values(scene, history)
    if scene.wear is not None:
        values |= wear.wear_values(model, history)
        loaded_share = finished.stages[0].loaded_share
        values["load_cycles"] *= loaded_share
        values |= wear.preset_depth(scene, model, history.state)
        values |= planets.planet_values(model, history, loaded_share)
    if model.vibration is not None:
        values["attractor"] = dynamics.attractor_numbers(history)

    values["verdict"] = verdict.verdict(history, searches)
    values["validity"] = validity.run_validity(
        scene, finished.stages, history, searches
    )
    values |= errors.error_values(of_conditions.errors, history, finished.inherited)
    values |= errors.flank_error_values(
        model.gears, of_conditions.errors, finished.inherited, values
    )
    values |= _work_values(finished.stages)
    values["model_error"] = label.diagnosed(
        "model error", failures, "", model_errors.model_errors, scene, model
    )

    calibration = finished.calibration
    if calibration is not None:
        values["calibrated_wear_coefficient"] = calibration.value
        values["error_estimate_wear_coefficient"] = calibration.error
    values |= label.diagnosed(
        "rating", failures, label.Values(), rating.spectrum_rating, scene
    )
    return values


def _work_values(stages: Sequence[operating.OperatingCondition]) -> label.Values:
    """Return the run times and counts of all conditions of operation together."""
    accounts = [model.coupling.account for stage in stages for model in stage.parts]
    values = label.Values()
    for activity in accounts[0].seconds:
        total = sum(account.seconds[activity] for account in accounts)
        values[f"run_time_{activity}"] = total
    for counted in accounts[0].counts:
        count = sum(account.counts[counted] for account in accounts)
        values[f"count_{counted}"] = count
    return values
