"""Limits of validity that a run has reached, and what ended it unfinished."""

from collections.abc import Sequence

import numpy as np

from wearlab import assembly
from wearlab.dynamics.steady.coexisting import Search
from wearlab.life import history, integrate
from wearlab.scene import Scene
from wearlab.simulation import initial_wear, operating
from wearlab.simulation.dataset import monitoring, thermal, vdi_rating
from wearlab.simulation.dataset.path import half_widths_of

INSTEAD = (
    "go on from this run with [start], let the static force wear (wear.load = "
    '"static"), or ask for less with numerics.tolerance'
)
ENDS_OF_WORK = {
    "evaluation limit": "the life ends unfinished, after as many wear rates as a "
    f"life may take: {INSTEAD}",
    "work limit": "the life ends unfinished, after as many right-hand sides as a life "
    f"may take: raise numerics.most_right_hand_sides, {INSTEAD}",
}
"""Message of a life that its bounds on the work end, by the reason of its end."""

BEARING = 0.1
"""Force over the mesh force from which a place counts as bearing [1]."""
MUCH_WIDER = 2.0
"""Change of the width of contact over a life from which a run says so [1]."""


def run_validity(
    scene: Scene,
    stages: Sequence[operating.OperatingCondition],
    life_history: history.History,
    searches: Sequence[Search],
) -> str:
    """Return all limits of validity of a run, one a line.

    Parameters
    ----------
    scene : the scene
    stages : those that were reached
    life_history : the life through them
    searches : what the searches for other attractors of the states came to
    """
    flags = list[str]()
    for stage, of_stage in zip(stages, life_history.stages, strict=True):
        for block, model in enumerate(stage.parts):
            flags += model.validity
            flags += scene_validity(model, of_stage.in_block(block))
    life = life_history.life
    if life is not None and life.end_detail:
        flags.append(f"the life ends by {life.end_reason}: {life.end_detail}")
    flags += initial_wear.left_behind(scene, stages[0].first)
    cut_off = sum(search.cut_off for search in searches)
    if cut_off:
        flags.append(
            f"the search for coexisting attractors was cut off in {cut_off} of "
            f"{len(searches)} states by its bound on the work: ask for fewer "
            "snapshots, or look in single states by wear.initial"
        )
    return "\n".join(dict.fromkeys(flags))


def scene_validity(
    model: assembly.GearModel, life_history: history.History
) -> tuple[str, ...]:
    """Return limits of validity that show only once the scene has run.

    Parameters
    ----------
    model : the physics in one condition of operation
    life_history : the life in that condition
    """
    flags = list[str]()
    if model.face is None:
        flags += _contact_flags(model, life_history)
        flags += monitoring.spectrum_flags(model, life_history.state)
    if model.vibration is not None and len(model.meshes) > 1:
        flags.append(
            "coexisting attractors of a set of several meshes are not looked for"
        )
    flags += thermal.thermal_flags(model, life_history)
    flags += vdi_rating.vdi_flags(model)
    if life_history.life is not None:
        flags += _width_flags(model, life_history)
        flags += _life_flags(life_history.life)
    return tuple(flags)


def _width_flags(model: assembly.GearModel, life_history: history.History) -> list[str]:
    """Return where the width of contact changes much over the life.

    At places that bear something at the beginning and then.
    """
    states = life_history.state
    most = 1.0
    for number in range(len(model.kinds)):
        least = BEARING * model.gears.kinds[number].load
        widths = half_widths_of(model, states, number)
        forces = np.stack([state.kind[number].patch_force for state in states])
        bears = (forces > least) & (forces[0] > least)
        first = np.broadcast_to(widths[0], widths.shape).reshape(bears.shape)
        now = widths.reshape(bears.shape)
        wider = now[bears] / first[bears]
        most = max(
            most, float(wider.max(initial=1.0)), float((1.0 / wider).max(initial=1.0))
        )
    if most <= MUCH_WIDER:
        return []
    told = f"the width of contact changes by up to {most:.2g} times over the life"
    patches = [kind.patch for kind in model.coupling.kinds]
    if all(patch is not None and patch.follows for patch in patches):
        return [f"{told}, and the patch that spreads and levels wear with it"]
    return [
        f"{told}: wear is spread and levelled over that of unworn flanks; "
        'wear.contact_patch = "following" takes that of the moment'
    ]


def _contact_flags(
    model: assembly.GearModel, life_history: history.History
) -> list[str]:
    """Return where the contact of the most deflected state leaves its range."""
    flags = list[str]()
    for section in model.gears.sections:
        alike = [
            number
            for number, kind in enumerate(model.gears.kinds)
            if kind.section == section and model.gears.is_loaded(number)
        ]
        places = [
            (number, at) for number in alike for at in range(len(life_history.state))
        ]
        deflections = [
            life_history.state[at].kind[number].static.deflection
            for number, at in places
        ]
        largest = [float(deflection.max()) for deflection in deflections]
        worst = largest.index(max(largest))
        number, at = places[worst]
        kind = model.kinds[number]
        state = life_history.state[at]
        nodes = state.kind[number].flanks.nodes
        flags += assembly.contact.reached_limits(
            kind.pair,
            kind.analysis,
            state.wear[number],
            nodes.gap,
            deflections[worst],
        )
        flags += assembly.contact.cut_short(kind.pair, kind.analysis, nodes)
    return flags


def _life_flags(life: integrate.Life) -> list[str]:
    """Return what the integration over cycles says of its own validity."""
    flags = list[str]()
    if life.saw_tooth:
        flags.append("saw-tooth: steps over cycles beyond the stability limit")
    if life.end_reason in ENDS_OF_WORK:
        flags.append(ENDS_OF_WORK[life.end_reason])
    if life.wave_growth > 0.0:
        fold = float(life.rate[0].max()) / life.wave_growth
        flags.append(
            f"the flanks corrugate: waves of wear grow e-fold every {1e6 * fold:.3g} "
            "um of wear, so that where they end is not foreseeable; only what they do "
            "on the average is"
        )
    return flags
