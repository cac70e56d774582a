"""One case updated, with the runs that this takes: longer ones, or more draws."""

from dataclasses import replace
from functools import partial

from wearlab.scene import SceneError
from wearlab.updating import answers, cases, grids
from wearlab.updating.change_points import runs_with_change
from wearlab.updating.lives import Answer
from wearlab.updating.measurements import UpdateError
from wearlab.updating.new_parts import needs_parts, with_parts
from wearlab.updating.replacements import with_replacements
from wearlab.updating.run_curves import Runs
from wearlab.updating.second_round import with_second_round
from wearlab.updating.study_runs import Runner

# posterior probability beyond the stored runs that they are not made longer for
NEGLIGIBLE_BEYOND = 1e-3
MAX_LONGER = 8.0  # times its own limits that a run is made to last
MIN_EFFECTIVE_RUNS = 100.0  # below which more are drawn


def update_case(study: cases.Subject, runner: Runner) -> answers.UpdateOutcome:
    """Return what one case comes to; what is missing for it is run.

    Parameters
    ----------
    study : the case
    runner : of its runs
    """
    (runs,) = runner.run([study])
    if study.replaced:
        if needs_parts(study):
            study, history = with_parts(study, runs[0], runner)
        else:
            study, history = with_replacements(study, partial(runner.stored, study))
        runs = [history]
        answer = answers.answer_of(study, runs, answers.blocks_of(study, runs))
    else:
        study, runs, answer = _with_runs_long_enough(study, runs, runner)
    if study.spec.change != "none":
        blocks = answers.blocks_of(study, runs)
        posterior_of = partial(grids.Posterior, blocks=blocks, prior=study.prior)
        changed_runs = runs_with_change(runs[0], study.spec.change, posterior_of)
        return answers.outcome_of(study, changed_runs)

    needed = min(MIN_EFFECTIVE_RUNS, 0.5 * len(runs))
    if len(runs) > 1 and answer.posterior.effective_runs < needed:
        return with_second_round(study, answer.posterior, runner)
    return answers.outcome_of(study, runs, answer)


def _with_runs_long_enough(
    study: cases.Subject, runs: Runs, runner: Runner
) -> tuple[cases.Subject, Runs, Answer]:
    """Return a study whose runs hold the wear at the last inspection, if they can."""
    while True:
        answer = answers.answer_of(study, runs, answers.blocks_of(study, runs))
        enough = answer.beyond <= NEGLIGIBLE_BEYOND
        if enough or study.longer >= MAX_LONGER:
            return study, runs, answer
        longer = replace(study, longer=2.0 * study.longer)
        try:
            (longer_runs,) = runner.run([longer])
        except (SceneError, UpdateError):
            return study, runs, answer
        if longer_runs[0].end <= runs[0].end * 1.01:
            return study, runs, answer
        study = longer
        runs = longer_runs
