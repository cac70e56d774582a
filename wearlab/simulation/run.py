"""A scene becomes its dataset, its wear coefficient found from one life where it is to have a given life."""

import math
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from wearlab import assembly
from wearlab.gears.specification import GearError
from wearlab.life import history, limits
from wearlab.options import Stored
from wearlab.scene import Scene, calibrated_coefficient, calibrating
from wearlab.simulation import (
    attractors,
    estimates,
    label,
    life_run,
    rating,
    static,
    trust,
    vibration,
)
from wearlab.wear.coefficients.calibrated import UNCALIBRATED, CalibrationLife
from wearlab.wear.coefficients.constant import ConstantCoefficient

LABELS: dict[str, Any] = {"axis": ["x", "y", "z"], "part": ["real", "imaginary"]}
ALONG_STATES = ("mesh_cycles", "operating_hours", "preset_depth")
ALONG_SPEED = ("response_speed", "direction", "order", "edge", "end")

FIRST_STATE = {
    "section vanished": "a section of a tooth vanishes under its initial wear; give "
    "less of it",
    "unbounded motion": "the motion grows without bound: at this speed the changing "
    "mesh stiffness drives it "
    "faster than anything damps it; give mesh.damping_ratio or mesh.damping, or "
    "another speed",
}
"""Why no first state can be, by what would end a life."""


class Calibration(NamedTuple):
    """A wear coefficient found from one life.

    Parameters
    ----------
    life : that life, and the run that lived it
    value : the constant k [m²/N]
    error : estimated numerical error of it [m²/N]
    told : what it was calibrated on, in words
    """

    life: CalibrationLife
    value: float
    error: float
    told: str


def simulate(scene: Scene) -> xr.Dataset:
    """Simulate one scene.

    Parameters
    ----------
    scene : the scene

    Returns
    -------
    Dataset of the run (SCENE §4).

    Raises
    ------
    Refused
        When no such gears can exist or run, with the reason.
    """
    begun = time.time()
    clock = time.perf_counter()
    try:
        settled, calibration = calibrated(scene)
        stages = life_run.operating_conditions(settled)
        lived = life_run.integrate_life(settled, stages)
    except GearError as error:
        raise label.Refused(str(error)) from error
    except limits.StopWear as stop:
        reason = FIRST_STATE.get(stop.reason, stop.reason)
        raise label.Refused(
            f"the gears cannot run in their first state: {reason}"
        ) from stop
    dataset = _dataset(settled, stages, lived, calibration, clock)
    dataset.attrs = {"Conventions": label.CONVENTIONS, **label.discovery(scene, begun)}
    dataset.attrs |= label.provenance(
        scene, begun, None if calibration is None else calibration.life
    )
    return dataset


def _dataset(
    scene: Scene,
    stages: tuple[life_run.OperatingCondition, ...],
    lived: history.History,
    calibration: Calibration | None,
    clock: float,
) -> xr.Dataset:
    """Return what every condition of operation says for itself, and what is the life's."""
    reached = stages[: len(lived.stages)]
    first = stages[0].first
    inherited = life_run.inherited_error(scene, first)
    found = list[attractors.Searched]()
    failures = list[str]()
    estimate = (
        estimates.estimated if first.face is None else estimates.estimated_over_face
    )
    each = list[label.Labelled]()
    errors = list[estimates.Estimates]()
    for k, (stage, own) in enumerate(zip(reached, lived.stages, strict=True)):
        kept = [
            lived.kept(k).in_block(block).state for block in range(len(stage.parts))
        ]
        pairs = zip(stage.parts, kept, strict=True)
        of_each = [
            _of_condition(parts, states, lived.life, found, failures)
            for parts, states in pairs
        ]
        unknown = estimates.not_estimated(own)
        errors.append(
            label.diagnosed(
                "estimates", failures, unknown, estimate, stage, own, inherited
            )
        )
        each += [
            _with_errors(one, errors[-1], block, len(kept[0]))
            for block, one in enumerate(of_each)
        ]
    conditions = each[0]
    if scene.operation.duty is not None or scene.operation.stage is not None:
        join = (
            life_run.along_duty
            if scene.operation.duty is not None
            else life_run.in_order
        )
        conditions = label.parts_of(join(list(map(label.joined, each))))
    values = static.life_values(scene, lived)
    if scene.wear is not None:
        values |= static.wear_values(first, lived) | static.preset_depth(
            scene, first, lived.state
        )
    if first.vibration is not None:
        values["attractor"] = vibration.attractor(lived)
    values |= trust.trust_values(
        reached, lived, errors, [one.search for one in found], inherited
    )
    values["model_error"] = label.diagnosed(
        "model error", failures, "", trust.model_errors, scene, first
    )
    if calibration is not None:
        values["calibrated_wear_coefficient"] = calibration.value
        values["error_estimate_wear_coefficient"] = calibration.error
    values |= label.diagnosed(
        "rating", failures, label.Values(), rating.rated, scene, first
    )
    coordinates = {"cycle": lived.cycle, **static.coordinates(first)}
    coordinates |= life_run.condition_coordinates(scene, lived)
    coordinates |= {name: values.pop(name) for name in ALONG_STATES if name in values}
    sizes = {
        dim: n
        for variable in conditions.variables.values()
        for dim, n in variable.sizes.items()
    }
    coordinates |= {
        name: labels[: sizes[name]] for name, labels in LABELS.items() if name in sizes
    }
    if "mode" in sizes:
        coordinates["mode"] = np.arange(1, sizes["mode"] + 1)
    values["run_time_total"] = time.perf_counter() - clock
    dataset = label.joined(conditions, label.labelled(values, coordinates))
    dataset = label.with_results(dataset, failures, scene.store.results)
    share = (
        float(dataset["separation_fraction"].max())
        if "separation_fraction" in dataset
        else 0.0
    )
    damped = (
        f"contact lost for {100.0 * share:.2g} % of the time: outside what the damping "
        "is known for"
    )
    ends = [
        "" if calibration is None else calibration.told,
        damped if share > 0.0 else "",
    ]
    ends += [*rating.rating_flags(scene, first), *failures]
    lines = filter(None, [dataset["validity"].item(), *dict.fromkeys(ends)])
    dataset = dataset.assign(validity=dataset["validity"].copy(data="\n".join(lines)))
    left_out = [name for name in dataset.data_vars if not scene.store.keeps(str(name))]
    return dataset.drop_vars(left_out) if left_out else dataset


def _of_condition(
    parts: assembly.GearModel,
    states: static.States,
    life: Any,
    more: list[attractors.Searched],
    failures: list[str],
) -> label.Values:
    """Return the contact and the dynamics of the kept states in one condition.

    Of a life that has ended, a part that fails is missing; ``failures`` gets a line for
    it, ``more`` what the searches for other attractors came to.
    """

    def found(name: str, find: Callable[..., label.Values], *given: Any) -> Any:
        return label.diagnosed(
            name, None if life is None else failures, {}, find, *given
        )

    values = found("quasi-static contact", static.mesh_values, parts, states)
    values |= found("values along the path", static.path_values, parts, states)
    values |= static.exact_values(parts, states, failures)
    if parts.vibration is not None:
        values |= found(
            "dynamics of the states", vibration.dynamic_values, parts, states
        )
        values |= found("modes", vibration.mode_values, parts)
        values["count_steps_per_period"] = len(parts.vibration.sampling.grid.width)
    searching = "search for other attractors"
    coexisting = label.diagnosed(
        searching, failures, [], attractors.other_attractors, parts, states
    )
    more += coexisting
    values |= attractors.attractor_values(coexisting)
    dynamics = parts.scene.dynamics
    if dynamics is not None and dynamics.response is not None:
        values |= found(
            "response over speed", attractors.over_speed_values, parts, states[0]
        )
    return values


def _with_errors(
    values: label.Values, errors: estimates.Estimates, block: int, kept: int
) -> label.Labelled:
    """Return the values of so many kept states in one condition with the errors of their forces."""
    if errors.force is not None:
        mesh, largest, bearing = (error[-kept:] for error in errors.force[block])
        values |= {
            "error_estimate_mesh_force": mesh,
            "error_estimate_mesh_force_max": largest,
        }
        if "bearing_force" in values:
            values["error_estimate_bearing_force"] = bearing
    along = {name: values.pop(name) for name in ALONG_SPEED if name in values}
    return label.labelled(values, along)


_LIVES: dict[str, CalibrationLife] = {}
"""Lives that calibrate, by the run that would store them, as long as the process
lives."""


def calibrated(scene: Scene) -> tuple[Scene, Calibration | None]:
    """Return the scene with a constant coefficient in place of a calibrated one, and how it was found.

    The life to a depth is inversely proportional to k, whatever the load, the film and
    the dynamics do: ``k = k' N(k') / N`` needs one life of these gears alone. A scene
    brings it along where a store has it.

    Raises
    ------
    Refused
        When these gears do not reach that depth.
    """
    wear = scene.wear
    given = calibrated_coefficient(scene)
    if wear is None or given is None:
        return scene, None
    life = scene.calibration or _calibration_life(scene)
    if life.end_reason != limits.WORN_OUT:
        raise label.Refused(
            f"these gears cannot be calibrated on {1e6 * given.depth:g} µm on the "
            f"{given.flank}: "
            f"their life ends before, by {life.end_reason}"
        )
    value = UNCALIBRATED * life.cycles / given.life
    kept: dict[str, Any] = {"film": given.film, "factor": given.factor}
    constant = ConstantCoefficient(model="constant", value=Stored(value), **kept)
    told = (
        f"wear coefficient {value:.4g} m²/N calibrated on a life of {given.life:.4g} "
        "cycles to "
        f"{1e6 * given.depth:g} µm on the {given.flank} at {given.torque:g} N·m and "
        f"{given.speed * 30.0 / math.pi:g} rpm"
    )
    if scene.errors is not None and scene.errors.slow.realised:
        told += ", without the errors of this realisation"
    settled = scene.model_copy(
        update={"wear": wear.model_copy(update={"coefficient": constant})}
    )
    return settled, Calibration(life, value, value * life.error / life.cycles, told)


def _calibration_life(scene: Scene) -> CalibrationLife:
    """Return the life that calibrates a scene, lived here: no store is at hand, or it has none."""
    alone = calibrating(scene)
    assert alone is not None
    if alone.id not in _LIVES:
        stages = life_run.operating_conditions(alone)
        (lived,) = life_run.integrate_life(alone, stages).stages
        assert lived.life is not None
        error = estimates.estimated(stages[0], lived).life or 0.0
        cycles = float(lived.life.cycle[-1])
        reason = lived.life.end_reason
        _LIVES[alone.id] = CalibrationLife(alone.id, cycles, error, reason)
    return _LIVES[alone.id]
