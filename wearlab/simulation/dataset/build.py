"""The dataset of a run, from its conditions of operation and its life."""

import time
from typing import Any

import numpy as np
import xarray as xr

from wearlab.scene import Scene
from wearlab.simulation import label
from wearlab.simulation.dataset import (
    conditions,
    coordinates,
    errors,
    planets,
    rating,
)
from wearlab.simulation.dataset.finished import ConditionsOfLife, FinishedLife
from wearlab.simulation.dataset.of_condition import condition_values
from wearlab.simulation.dataset.of_life import life_variables

LABELS: dict[str, Any] = {
    "axis": ["x", "y", "z"],
    "part": ["real", "imaginary"],
    "place": ["root", "flank"],
    "limit": ["wear", "temperature", "backlash"],
}
"""Labels of dimensions that are the same in every run."""
ALONG_STATES = ("mesh_cycles", "operating_hours", "preset_depth")
"""Variables of a life that are coordinates of the updates."""
ALONG_SPEED = ("response_speed", "direction", "order", "edge", "end")
"""Variables of a condition that are coordinates."""


def build(finished: FinishedLife, started_clock: float) -> xr.Dataset:
    """Return the dataset of a life that has ended, without attributes.

    Parameters
    ----------
    finished : the life
    started_clock : when the run started, by `time.perf_counter` [s]
    """
    scene = finished.scene
    failures = list[str]()
    of_conditions = _conditions_of_life(finished, failures)
    joined = _joined(scene, of_conditions.variables)

    values = life_variables(finished, of_conditions, failures)
    labels = _coordinates(finished)
    labels |= {name: values.pop(name) for name in ALONG_STATES if name in values}
    labels |= _labels_of_dimensions(joined)
    values["run_time_total"] = time.perf_counter() - started_clock

    dataset = label.joined(joined, label.labelled(values, labels))
    dataset = label.with_results(dataset, failures, scene.store.results)
    dataset = _with_remarks(dataset, finished, failures)
    left_out = [name for name in dataset.data_vars if not scene.store.keeps(str(name))]
    return dataset.drop_vars(left_out) if left_out else dataset


def _conditions_of_life(
    finished: FinishedLife, failures: list[str]
) -> ConditionsOfLife:
    """Return what every condition of operation says for itself, stage after stage."""
    of_life = ConditionsOfLife([], [], [])
    for number in range(len(finished.stages)):
        _add_stage(of_life, finished, number, failures)
    return of_life


def _add_stage(
    of_life: ConditionsOfLife, finished: FinishedLife, number: int, failures: list[str]
) -> None:
    """Add the conditions of one stage: their values, with the errors of these."""
    stage = finished.stages[number]
    history = finished.history.stages[number]
    kept = finished.history.kept(number)
    ended = finished.history.life is not None

    blocks = []
    for block, model in enumerate(stage.parts):
        states = kept.in_block(block).state
        condition = condition_values(model, states, failures, ended=ended)
        blocks.append(condition.values)
        of_life.searches.extend(condition.searches)

    of_stage = errors.stage_errors(stage, history, finished.inherited, failures)
    of_life.errors.append(of_stage)

    for block, values in enumerate(blocks):
        bearings = "bearing_force" in values
        updates = len(kept.state)
        values |= errors.condition_error_values(of_stage, block, updates, bearings)
        labels = {name: values.pop(name) for name in ALONG_SPEED if name in values}
        of_life.variables.append(label.labelled(values, labels))


def _joined(scene: Scene, variables: list[label.Labelled]) -> label.Labelled:
    """Return the variables of all conditions, along duty blocks or stages if any."""
    operation = scene.operation
    if operation.duty is None and operation.stage is None:
        return variables[0]
    datasets = [label.joined(of_condition) for of_condition in variables]
    if operation.duty is not None:
        return label.parts_of(conditions.along_duty(datasets))
    return label.parts_of(conditions.in_order(datasets))


def _coordinates(finished: FinishedLife) -> dict[str, Any]:
    """Return the coordinates of the dataset but for those that conditions bring."""
    history = finished.history
    return {
        "cycle": history.cycle,
        **coordinates.coordinates(finished.stages[0].first),
        **planets.planet_numbers(finished.stages[0].first),
        **conditions.condition_coordinates(finished.scene, history),
    }


def _labels_of_dimensions(joined: label.Labelled) -> dict[str, Any]:
    """Return the labels of the dimensions that the variables of the conditions have."""
    sizes = {
        dim: size
        for variable in joined.variables.values()
        for dim, size in variable.sizes.items()
    }
    labels: dict[str, Any] = {
        name: texts[: sizes[name]] for name, texts in LABELS.items() if name in sizes
    }
    if "mode" in sizes:
        labels["mode"] = np.arange(1, sizes["mode"] + 1)
    return labels


def _with_remarks(
    dataset: xr.Dataset, finished: FinishedLife, failures: list[str]
) -> xr.Dataset:
    """Return the dataset with the last lines of its validity.

    These tell of the calibration, of lost contact, of the rating and of what failed.
    """
    remarks = list[str]()
    if finished.calibration is not None:
        remarks.append(finished.calibration.message)
    if "separation_fraction" in dataset:
        share = float(dataset["separation_fraction"].max())
        if share > 0.0:
            remarks.append(
                f"contact lost for {100.0 * share:.2g} % of the time: outside what the "
                "damping is known for; teeth strike when they meet again"
            )
    dataset = planets.told_of_the_mean(dataset)
    remarks += planets.overload_flags(dataset)
    remarks += planets.wear_flags(finished.stages[0].first, dataset)
    remarks += rating.rating_flags(finished.scene)
    remarks += failures

    lines = filter(None, [dataset["validity"].item(), *dict.fromkeys(remarks)])
    validity = dataset["validity"].copy(data="\n".join(lines))
    return dataset.assign(validity=validity)
