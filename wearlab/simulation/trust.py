"""What a run says of itself: verdict, validity, errors, time and work.

And how far its models are off.

Model errors are measurements, not estimates for this very scene; `docs/model_error.md`
says how each was made.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.dynamics.steady.coexisting import Search
from wearlab.life import history, limits
from wearlab.scene import Scene
from wearlab.simulation import estimates, life_run, vibration
from wearlab.wear.coefficients import CoefficientModel

TRUSTED = "as usual"
BEYOND = 1e-3
"""Distance beyond 1 at which motions leave: the margin of attraction, on the other side
of 1."""
INSTEAD = (
    "go on from this run with [start], let the static force wear (wear.load = "
    '"static"), or ask for '
    "less with numerics.tolerance"
)
ENDS_OF_WORK = {
    "evaluation limit": "the life ends unfinished, after as many wear rates as a "
    f"life may take: {INSTEAD}",
    "work limit": "the life ends unfinished, after as many right-hand sides as a life "
    "may take: raise "
    f"numerics.most_right_hand_sides, {INSTEAD}",
}


def trust_values(
    stages: Sequence[life_run.OperatingCondition],
    life_history: history.History,
    errors: Sequence[estimates.Estimates],
    searches: Sequence[Search],
    inherited: float,
) -> dict[str, Any]:
    """Return verdict, validity, error estimates, run times and counts.

    Parameters
    ----------
    stages : those that were reached
    life_history : the life through them
    errors : estimated, of each stage
    searches : what the searches for other attractors of the states came to
    inherited : error of the wear that the run starts from [m]
    """
    models = [parts for stage in stages for parts in stage.parts]
    flags = list[str]()
    for stage, part in zip(stages, life_history.stages, strict=True):
        for block, parts in enumerate(stage.parts):
            flags += [*parts.validity, *scene_validity(parts, part.in_block(block))]
    if cut := sum(search.cut_off for search in searches):
        flags.append(
            f"the search for coexisting attractors was cut off in {cut} of "
            f"{len(searches)} states by its "
            "bound on the work: ask for fewer snapshots, or look in single states by "
            "wear.initial"
        )
    doubts = dict.fromkeys(doubt for part in errors for doubt in part.doubts)
    values: dict[str, Any] = {"verdict": verdict(life_history, searches)}
    values["validity"] = "\n".join(dict.fromkeys(flags))
    values["estimate_quality"] = f"doubtful: {'; '.join(doubts)}" if doubts else TRUSTED
    if (life := life_history.life) is not None:
        depth, of_life = accumulated(errors, life_history, inherited)
        values |= {"error_estimate_wear_depth": depth, "steps_cycle": life.cycle[1:]}
        values |= {
            "count_wear_steps": life.count_steps,
            "count_rejected_steps": life.count_rejected,
        }
        if of_life is not None:
            values["error_estimate_life"] = of_life
    accounts = [parts.coupling.account for parts in models]
    values |= {
        f"run_time_{stage}": sum(a.seconds[stage] for a in accounts)
        for stage in accounts[0].seconds
    }
    return values | {
        f"count_{counted}": sum(a.counts[counted] for a in accounts)
        for counted in accounts[0].counts
    }


def accumulated(
    errors: Sequence[estimates.Estimates],
    whole: history.History,
    inherited: float = 0.0,
) -> tuple[Array, float | None]:
    """Return the errors of wear depth (n_updates,) [m] and life [1] over all stages: errors add up.

    What the run inherits from the one it goes on from [m] is added like an earlier
    stage.
    """
    earlier = inherited
    depths = []
    for number, estimate in enumerate(errors):
        assert estimate.wear_depth is not None
        depths.append(earlier + estimate.wear_depth[1 if number else 0 :])
        last = earlier
        earlier = earlier + float(estimate.wear_depth[-1])
    of_life = errors[-1].life
    life = whole.life
    fastest = 0.0 if life is None else float(life.rate[-1].max(initial=0.0))
    if of_life is not None and fastest > 0.0:
        of_life += last / fastest
    return np.concatenate(depths), of_life


def verdict(life_history: history.History, searches: Sequence[Search] = ()) -> str:
    """Return in one word what the run amounts to.

    What deviates most from an ordinary run wins.

    Parameters
    ----------
    life_history : the states
    searches : what the searches for other attractors of the states came to
    """
    if life_history.life is not None and life_history.life.end_reason not in (
        limits.ALL_CYCLES,
        limits.WORN_OUT,
    ):
        return "stopped"
    responses = [
        response for state in life_history.state for response in state.responses
    ]
    for word, good in (
        ("not converged", "converged"),
        ("aperiodic", "periodic"),
        ("non-unique", "unique"),
    ):
        if not all(getattr(response.verdict, good) for response in responses):
            return word
    largest = [
        abs(orbit.multipliers[0])
        for orbit in responses
        if orbit.verdict.attracting is False
    ]
    if largest:
        return (
            "unstable"
            if max(largest) > 1.0 + BEYOND
            else "not attracting within the margin"
        )
    return (
        "coexisting"
        if any(search.rival is not None for search in searches)
        else "completed"
    )


def scene_validity(
    parts: assembly.GearModel, life_history: history.History
) -> tuple[str, ...]:
    """Return limits of validity that show only once the scene has run."""
    flags: list[str] = []
    for kind, mesh_kind in enumerate(parts.kinds if parts.face is None else ()):
        state = max(
            life_history.state,
            key=lambda state: float(state.kind[kind].static.deflection.max()),
        )
        worst = state.kind[kind].static.deflection
        nodes = state.kind[kind].flanks.nodes
        pair = mesh_kind.pair
        analysis = mesh_kind.analysis
        flags += assembly.contact.reached_limits(
            pair, analysis, state.wear[kind], nodes.gap, worst
        )
        flags += assembly.contact.cut_short(pair, analysis, nodes)
    if parts.face is None:
        flags += vibration.uncarried(parts, life_history.state)
    if parts.vibration is not None and len(parts.meshes) > 1:
        flags.append(
            "coexisting attractors of a set of several meshes are not looked for"
        )
    if life_history.life is None:
        return tuple(flags)
    if life_history.life.saw_tooth:
        flags.append("saw-tooth: steps over cycles beyond the stability limit")
    if life_history.life.end_reason in ENDS_OF_WORK:
        flags.append(ENDS_OF_WORK[life_history.life.end_reason])
    if life_history.life.wave_growth > 0.0:
        fold = float(life_history.life.rate[0].max()) / life_history.life.wave_growth
        flags.append(
            f"the flanks corrugate: waves of wear grow e-fold every {1e6 * fold:.3g} "
            "um of wear, so that "
            "where they end is not foreseeable; only what they do on the average is"
        )
    return tuple(flags)


TABLE = "tests/benchmarks/defaults_table.py"
SHARE_OFF, ERROR_OFF, FORCE_OFF = 0.027, 0.007, 0.08
"""Largest model errors of the defaults from elements: of the share of a pair, of the
mean static transmission error, of the largest vibrating mesh force [1]."""
EXTENDED = (
    f"onset of contact: pairs carry within {100 * SHARE_OFF:.2g} % of the load of "
    "what elements alone give "
    f"them, the mean transmission error is within {100 * ERROR_OFF:.2g} %, the "
    "largest vibrating mesh force "
    f"within {100 * FORCE_OFF:.2g} % ({TABLE}, fresh_pairs.py)"
)
JUMP = (
    "onset of contact: a jump at A, which overstates forces and wear at A of "
    "vibrating pairs 1.2 to 2.8 "
    "times (campaigns/extended_contact.toml, two meshes)"
)
SERIES = (
    "excitation: a truncated series; forces and lives move by tens of per cent with "
    "its harmonics"
)
EVERYWHERE = (
    "load: even across the face, every tooth alike, isothermal; misalignment raises "
    "wear where the face "
    "carries most, in proportion (mesh.face_load_factor)"
)

OVER_FACE = (
    "load over the face: every tooth alike, isothermal; bodies of the gears even along "
    "it"
)
"""What is known of the load of flanks with a width, before what their coupling leaves
out."""


def model_errors(scene: Scene, parts: assembly.GearModel) -> str:
    """Return the known model errors of a scene's models with size and source, one a line."""
    return "\n".join(dict.fromkeys(_lines(scene, parts)))


def _lines(scene: Scene, parts: assembly.GearModel) -> Iterator[str]:
    sections = {kind.section: kind for kind in parts.gears.kinds}
    for section, part in sections.items():
        mesh = scene.mesh.of(section)
        name = " and ".join(gear.name for gear in part.pair.gears)
        stiffness = f"stiffness: {mesh.stiffness.model_error}"
        yield f"{name}, {stiffness}" if len(sections) > 1 else stiffness
        if mesh.excitation.by_pairs:
            yield EXTENDED if mesh.extended_contact else JUMP
        else:
            yield SERIES
        if mesh.contact.model_error and scene.wear is not None:
            yield f"gaps: {mesh.contact.model_error}"
    if scene.wear is not None and scene.wear.coefficient is not None:
        remark = getattr(
            scene.wear.coefficient, "model_error", CoefficientModel.model_error
        )
        yield f"wear coefficient: {remark}"
    if parts.face is None:
        yield EVERYWHERE
    else:
        for section, kind in zip(sections, parts.face.kinds, strict=True):
            remark = scene.mesh.of(section).coupling.model_error
            solid = kind.contact.solid
            if solid is not None:
                softer = 100.0 * (solid.even / kind.contact.section.body - 1.0)
                remark += (
                    f"; at even load {softer.min():+.1f} to {softer.max():+.1f} % "
                    "against plane elements"
                )
            yield f"{OVER_FACE}: {remark}"
