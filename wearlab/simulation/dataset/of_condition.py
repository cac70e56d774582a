"""What each condition of operation of a life says for itself: contact and dynamics."""

from collections.abc import Callable
from typing import Any, NamedTuple

from wearlab import assembly
from wearlab.simulation import attractors, label
from wearlab.simulation.dataset import (
    contact,
    dynamics,
    exact_contact,
    modes,
    over_speed,
    path,
    rating,
    thermal,
    vdi_rating,
)
from wearlab.simulation.dataset.attractors import attractor_values
from wearlab.simulation.dataset.coordinates import States


class ConditionValues(NamedTuple):
    """Values of the stored states in one condition.

    Parameters
    ----------
    values : variable → its values
    searches : what the searches for other attractors came to
    """

    values: label.Values
    searches: list[attractors.Searched]


def condition_values(
    model: assembly.GearModel, states: States, failures: list[str], *, ended: bool
) -> ConditionValues:
    """Return the contact and the dynamics of the stored states in one condition.

    Parameters
    ----------
    model : the physics in that condition
    states : the wear states that are stored
    failures : gets a line for each part that fails
    ended : whether a life has ended, of which a part that fails is left out; without a
        life nothing is lost, and the error is raised
    """

    def diagnosed(
        name: str, function: Callable[..., label.Values], *arguments: Any
    ) -> label.Values:
        messages = failures if ended else None
        values: label.Values = label.diagnosed(name, messages, {}, function, *arguments)
        return values

    values = diagnosed("quasi-static contact", contact.mesh_values, model, states)
    values |= diagnosed("values along the path", path.path_values, model, states)
    values |= diagnosed("temperature", thermal.thermal_values, model, states)
    values |= label.diagnosed(
        "rating", failures, label.Values(), rating.condition_rating, model
    )
    values |= label.diagnosed(
        "rating by VDI 2736", failures, label.Values(), vdi_rating.vdi_rating, model
    )
    values |= exact_contact.exact_values(model, states, failures)
    if model.vibration is not None:
        values |= diagnosed(
            "dynamics of the states", dynamics.dynamic_values, model, states
        )
        values |= diagnosed("modes", modes.mode_values, model)
        steps = model.vibration.sampling.grid.width
        values["count_steps_per_period"] = len(steps)

    name = "search for other attractors"
    searches: list[attractors.Searched] = label.diagnosed(
        name, failures, [], attractors.other_attractors, model, states
    )
    values |= attractor_values(searches)

    options = model.scene.dynamics
    if options is not None and options.response is not None:
        values |= diagnosed(
            "response over speed", over_speed.over_speed_values, model, states[0]
        )
    return ConditionValues(values, searches)
