"""What a run says of itself: verdict, validity, error estimates, time and work."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.response import Response
from wearlab.gears import tip_contact
from wearlab.life.history import History
from wearlab.life.state import Vibration, WearState
from wearlab.mesh.excitation import mesh_force, stages
from wearlab.mesh.stages import StageGrid
from wearlab.scene import Scene
from wearlab.scene.build import PairParts
from wearlab.scene.build.vibration import fluctuation

Array = NDArray[np.float64]
Values = dict[str, Any]

ENDS_AS_ASKED = ("cycles", "depth")
RICHARDSON = 15.0
EXTENDED_CONTACT = 0.05


def trust_values(
    scene: Scene, parts: PairParts, lived: History, others: Sequence[Response | None] = ()
) -> Values:
    """Return verdict, validity, error estimates, run times and counts."""
    account = parts.coupling.account
    values: Values = {
        "verdict": verdict(lived, others),
        "validity": "\n".join(parts.validity + scene_validity(parts, lived)),
    }
    if parts.vibration is not None:
        values["error_estimate_mesh_force"] = [force_error(scene, parts, state) for state in lived.state]
        values["count_steps_per_period"] = len(parts.vibration.stages.grid.width)
    if lived.life is not None:
        life = lived.life
        values["error_estimate_wear_depth"] = np.interp(lived.cycle, life.cycle, life.accumulated_error)
        values["steps_cycle"] = life.cycle[1:]
        values["count_wear_steps"] = life.count_steps
        values["count_rejected_steps"] = life.count_rejected
        if life.end_reason == "depth":
            values["error_estimate_life"] = life.error_estimate_life
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
    responses = [state.response for state in lived.state if state.response is not None]
    for word, holds in (
        ("not converged", lambda v: not v.converged),
        ("aperiodic", lambda v: not v.periodic),
        ("non-unique", lambda v: not v.unique),
        ("unstable", lambda v: v.attracting is False),
    ):
        if any(holds(response.verdict) for response in responses):
            return word
    return "coexisting" if any(other is not None for other in others) else "completed"


def scene_validity(parts: PairParts, lived: History) -> tuple[str, ...]:
    """Return limits of validity that show only once the scene has run."""
    flags = []
    deflection = max(float(state.static.deflection.max()) for state in lived.state)
    extension = tip_contact.extension(parts.pair, deflection) / (parts.pair.path.E - parts.pair.path.A)
    if extension > EXTENDED_CONTACT:
        flags.append(f"deflection would extend the path of contact by {100 * extension:.0f} %")
    if lived.life is not None and lived.life.saw_tooth:
        flags.append("saw-tooth: steps over cycles beyond the stability limit")
    return tuple(flags)


def force_error(scene: Scene, parts: PairParts, state: WearState) -> float:
    """Estimate the error of the mesh force by solving once more with half the steps [N].

    The difference of two fourth-order solutions, over 2⁴ − 1; the finer one is kept.
    """
    vibration, response = parts.vibration, state.response
    assert vibration is not None and response is not None
    if response.period == 0:
        return float("nan")
    coarse = _halved(vibration.stages.grid)
    if coarse is None:
        return float("nan")
    rougher = replace(
        vibration,
        stages=stages(parts.analysis, coarse, parts.error),
        fluctuation=fluctuation(scene, coarse.phase),
    )
    again = rougher.solve(parts.analysis, state.nodes, state.fitted, response)
    if again.period != response.period:
        return float("nan")
    fine, rough = (_forces(parts, one, state, two) for one, two in ((vibration, response), (rougher, again)))
    return float(np.max(np.abs(fine - rough))) / RICHARDSON


def _forces(parts: PairParts, vibration: Vibration, state: WearState, response: Response) -> Array:
    deflection, _ = vibration.deflection(response, parts.output)
    forces = [
        mesh_force(parts.analysis, state.nodes, state.fitted, parts.output, one, vibration.backlash)
        for one in deflection
    ]
    return np.stack([force.elastic for force in forces])


def _halved(grid: StageGrid) -> StageGrid | None:
    """Return the grid with every two steps joined, None when a segment has an odd number of them."""
    start, width, segment = [], [], []
    for index in np.unique(grid.segment):
        steps = np.flatnonzero(grid.segment == index)
        if len(steps) % 2:
            return None
        start.append(grid.start[steps[::2]])
        width.append(2.0 * grid.width[steps[::2]])
        segment.append(grid.segment[steps[::2]])
    return StageGrid(np.concatenate(start), np.concatenate(width), np.concatenate(segment))
