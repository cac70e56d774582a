"""What a run says of itself: verdict, validity, error estimates, time and work."""

from collections.abc import Sequence
from typing import Any

from wearlab.dynamics.response import Response
from wearlab.life.history import History
from wearlab.scene import Scene
from wearlab.scene.build import Parts
from wearlab.scene.build.contact import reached_limits
from wearlab.simulate.estimates import estimated

Values = dict[str, Any]

ENDS_AS_ASKED = ("cycles", "depth")


def trust_values(
    scene: Scene, parts: Parts, lived: History, others: Sequence[Response | None] = ()
) -> Values:
    """Return verdict, validity, error estimates, run times and counts."""
    account = parts.coupling.account
    values: Values = {
        "verdict": verdict(lived, others),
        "validity": "\n".join(parts.validity + scene_validity(parts, lived)),
    }
    errors = estimated(scene, parts, lived)
    if parts.vibration is not None:
        values["error_estimate_mesh_force"] = errors.mesh_force
        values["count_steps_per_period"] = len(parts.vibration.stages.grid.width)
    if lived.life is not None:
        life = lived.life
        values["error_estimate_wear_depth"] = errors.wear_depth
        values["steps_cycle"] = life.cycle[1:]
        values["count_wear_steps"] = life.count_steps
        values["count_rejected_steps"] = life.count_rejected
        if errors.life is not None:
            values["error_estimate_life"] = errors.life
    values |= {f"run_time_{stage}": seconds for stage, seconds in account.seconds.items()}
    return values | {f"count_{what}": count for what, count in account.counts.items()}


def verdict(lived: History, others: Sequence[Response | None] = ()) -> str:
    """Return in one word what the run amounts to; what deviates most from an ordinary run wins.

    Parameters
    ----------
    lived : the states
    others : other attractors of the states, None where none is known
    """
    if lived.life is not None and lived.life.end_reason not in ENDS_AS_ASKED:
        return "stopped"
    responses = [response for state in lived.state for response in state.responses]
    for word, holds in (
        ("not converged", lambda v: not v.converged),
        ("aperiodic", lambda v: not v.periodic),
        ("non-unique", lambda v: not v.unique),
        ("unstable", lambda v: v.attracting is False),
    ):
        if any(holds(response.verdict) for response in responses):
            return word
    return "coexisting" if any(other is not None for other in others) else "completed"


def scene_validity(parts: Parts, lived: History) -> tuple[str, ...]:
    """Return limits of validity that show only once the scene has run."""
    flags: list[str] = []
    for kind, one in enumerate(parts.kinds):
        state = max(lived.state, key=lambda state: float(state.kind[kind].static.deflection.max()))
        found = state.kind[kind]
        flags += reached_limits(
            one.pair, one.analysis, state.wear[kind], found.nodes.gap, found.static.deflection
        )
    if lived.life is not None and lived.life.saw_tooth:
        flags.append("saw-tooth: steps over cycles beyond the stability limit")
    return tuple(flags)
