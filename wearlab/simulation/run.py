"""A scene becomes its dataset."""

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from wearlab.dynamics.orbits.coexisting import Search
from wearlab.gears.specification import GearError
from wearlab.life.history import History
from wearlab.life.limits import StopWear
from wearlab.scene import Scene
from wearlab.scene.build import build_modes
from wearlab.simulation import attractors, exact, face, label, over_speed, trust
from wearlab.simulation import static as named
from wearlab.simulation import vibration as vibrating
from wearlab.simulation.calibration import Calibration, calibrated, calibrated_values
from wearlab.simulation.estimates import Estimates, estimated, not_estimated
from wearlab.simulation.face import estimated_over_face
from wearlab.simulation.living import inherited_error, initial_wear, live, live_through
from wearlab.simulation.operating import Stage, along_duty, condition_coordinates, in_order, stages_of
from wearlab.simulation.rating import rated, rating_flags

__all__ = ["initial_wear", "live", "simulate"]

Values = dict[str, Any]

LABELS: dict[str, Any] = {"axis": ["x", "y", "z"], "part": ["real", "imaginary"]}
ALONG_STATES = ("mesh_cycles", "operating_hours", "preset_depth")
ALONG_SPEED = ("response_speed", "direction", "order", "edge", "end")

FIRST_STATE = {
    "section vanished": "a section of a tooth vanishes under its initial wear; give less of it",
    "unbounded motion": "the motion grows without bound: at this speed the changing mesh stiffness drives it "
    "faster than anything damps it; give mesh.damping_ratio or mesh.damping, or another speed",
}
"""Why no first state can be, by what would end a life."""


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
    begun, clock = time.time(), time.perf_counter()
    try:
        settled, calibration = calibrated(scene)
        stages = stages_of(settled)
        lived = live_through(settled, stages)
    except GearError as error:
        raise label.Refused(str(error)) from error
    except StopWear as stop:
        reason = FIRST_STATE.get(stop.reason, stop.reason)
        raise label.Refused(f"the gears cannot run in their first state: {reason}") from stop
    dataset = _dataset(settled, stages, lived, calibration, clock)
    dataset.attrs = {"Conventions": label.CONVENTIONS, **label.discovery(scene, begun)}
    dataset.attrs |= label.provenance(scene, begun, None if calibration is None else calibration.life)
    return dataset


def _dataset(
    scene: Scene, stages: tuple[Stage, ...], lived: History, calibration: Calibration | None, clock: float
) -> xr.Dataset:
    """Return what every condition of operation says for itself, and what is the life's."""
    reached = stages[: len(lived.stages)]
    first = stages[0].first
    inherited = inherited_error(scene, first)
    others: list[Search] = []
    failures: list[str] = []
    by_condition = [
        [_of_condition(stage, k, block, lived, others, failures) for block in range(len(stage.parts))]
        for k, stage in enumerate(reached)
    ]
    estimates = [
        label.diagnosed(
            "estimates",
            partial(estimated if first.face is None else estimated_over_face, stage, own, inherited),
            not_estimated(own),
            failures,
        )
        for stage, own in zip(reached, lived.stages, strict=True)
    ]
    each = [
        [
            _with_errors(values, own, block, len(lived.kept(k).cycle))
            for block, values in enumerate(by_condition[k])
        ]
        for k, own in enumerate(estimates)
    ]
    conditions = each[0][0]
    if scene.operation.duty is not None:
        conditions = label.parts_of(along_duty([label.joined(parts) for parts in each[0]]))
    elif scene.operation.stage is not None:
        conditions = label.parts_of(in_order([label.joined(parts) for (parts,) in each]))
    sizes = conditions.sizes
    values = named.life_values(scene, lived)
    if scene.wear is not None:
        values |= (named if first.face is None else face).wear_values(first, lived)
        preset = named.preset_depth(scene, first, lived.state)
        values |= {} if preset is None else {"preset_depth": preset}
    if first.vibration is not None:
        values["attractor"] = vibrating.attractor(lived)
    values |= trust.trust_values(reached, lived, estimates, others, calibration, inherited)
    values["model_error"] = label.diagnosed(
        "model error", partial(trust.model_errors, scene, first), "", failures
    )
    values |= calibrated_values(calibration)
    rating: Values = label.diagnosed("rating", partial(rated, scene, first), {}, failures)
    values |= rating
    coordinates = {"cycle": lived.cycle, **named.coordinates(first), **condition_coordinates(scene, lived)}
    coordinates |= face.coordinates(first)
    coordinates |= {name: values.pop(name) for name in ALONG_STATES if name in values}
    coordinates |= {name: labels[: sizes[name]] for name, labels in LABELS.items() if name in sizes}
    if "mode" in sizes:
        coordinates["mode"] = np.arange(1, sizes["mode"] + 1)
    values["run_time_total"] = time.perf_counter() - clock
    dataset = label.with_results(
        label.joined(conditions, label.labelled(values, coordinates)), failures, scene.store.results
    )
    told = [*contact_lost(dataset), *rating_flags(scene, first), *failures]
    dataset = label.with_told(dataset, told)
    left_out = [name for name in dataset.data_vars if not scene.store.keeps(str(name))]
    return dataset.drop_vars(left_out) if left_out else dataset


def contact_lost(run: xr.Dataset) -> list[str]:
    """Return the line that says for how long flanks part at worst, none where they never do."""
    share = float(run["separation_fraction"].max()) if "separation_fraction" in run else 0.0
    if not share > 0.0:
        return []
    return [f"contact lost for {100.0 * share:.2g} % of the time: outside what the damping is known for"]


def _of_condition(
    stage: Stage, number: int, block: int, lived: History, others: list[Search], failures: list[str]
) -> Values:
    """Return the contact and the dynamics of the kept states in one condition.

    Of a life that has ended, a part that fails is missing; ``failures`` gets a line for it.
    """
    scene, parts = stage.parts[block].scene, stage.parts[block]
    states = lived.kept(number).in_block(block).state

    def found(name: str, find: Callable[[], Values]) -> Values:
        return find() if lived.life is None else label.diagnosed(name, find, {}, failures)

    of_states = named if parts.face is None else face
    values = found("quasi-static contact", lambda: of_states.mesh_values(parts, states))
    values |= found("values along the path", lambda: of_states.path_values(parts, states))
    values |= exact.exact_values(scene, parts, states, failures)
    if parts.vibration is not None:
        values |= found("dynamics of the states", lambda: vibrating.dynamic_values(parts, states))
        values |= found("modes", lambda: vibrating.mode_values(build_modes(parts)))
        values["count_steps_per_period"] = len(parts.vibration.sampling.grid.width)
    coexisting: list[attractors.Searched] = label.diagnosed(
        "search for other attractors", partial(attractors.other_attractors, parts, states), [], failures
    )
    others += [one.search for one in coexisting]
    values |= attractors.attractor_values(coexisting)
    if scene.dynamics is not None and scene.dynamics.response is not None:
        values |= found("response over speed", lambda: over_speed.over_speed_values(parts, states[0]))
    return values


def _with_errors(values: Values, estimates: Estimates, block: int, kept: int) -> label.Labelled:
    """Return the values of so many kept states in one condition with the errors of their forces."""
    if estimates.force is not None:
        mesh, largest, bearing = (error[-kept:] for error in estimates.force[block])
        values |= {"error_estimate_mesh_force": mesh, "error_estimate_mesh_force_max": largest}
        if "bearing_force" in values:
            values["error_estimate_bearing_force"] = bearing
    along = {name: values.pop(name) for name in ALONG_SPEED if name in values}
    return label.labelled(values, along)
