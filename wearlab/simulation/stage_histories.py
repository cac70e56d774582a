"""The histories of stages, one after another, become the history of the whole life."""

from collections.abc import Sequence
from itertools import chain
from typing import Any

import numpy as np

from wearlab.life import history, integrate
from wearlab.life.step import Step
from wearlab.simulation.operating import OperatingCondition

FROM_THE_SECOND_ROW = ("cycle", "depth", "rate", "accumulated_error")
"""Arrays of a life whose first row repeats the last of the stage before."""
ALL_ROWS = ("snapshot_cycle", "snapshot_depth")
"""Arrays of a life of which every stage has its own rows."""
LARGEST = ("saw_tooth", "wave_growth", "hurried")
"""Properties of a life of which the largest of all stages counts."""
SUMS = ("count_rate_evaluations", "count_rejected")
"""Counts of a life that add up."""


def seconds_of(stage: OperatingCondition, cycles: Any) -> Any:
    """Return the time that cycles take in a stage [s], NaN where nothing turns.

    Parameters
    ----------
    stage : the stage
    cycles : a number, or an array
    """
    return cycles * 2 * np.pi / (stage.speed or np.nan)


def joined(
    histories: list[history.History],
    stages: Sequence[OperatingCondition],
    reason: str,
    detail: str = "",
) -> history.History:
    """Return histories one after another.

    A later stage's first state is the end of the stage before.

    Parameters
    ----------
    histories : of the stages that were reached
    stages : all stages
    reason, detail : why the life ends, in a word and in a sentence
    """
    whole = histories[0]._replace(stages=tuple(histories))
    lives = [of_stage.life for of_stage in histories if of_stage.life is not None]
    cycle = 0.0
    clock = 0.0
    error = 0.0
    cycles = []
    seconds = []
    later = []
    for number, (stage, life) in enumerate(zip(stages, lives, strict=False)):
        of_stage = whole.kept(number).cycle
        cycles.append(cycle + of_stage)
        seconds.append(clock + seconds_of(stage, of_stage))
        later.append(_later(life, cycle, error))

        cycle = cycle + float(life.cycle[-1])
        error = error + float(life.accumulated_error[-1])
        clock += seconds_of(stage, float(life.cycle[-1]))

    states = [whole.kept(number).state for number in range(len(lives))]
    return whole._replace(
        cycle=np.concatenate(cycles),
        state=tuple(chain(*states)),
        life=_joined_life(later)._replace(end_reason=reason, end_detail=detail),
        sampled=None,
        seconds=np.concatenate(seconds),
    )


def _later(life: integrate.Life, cycle: float, error: float) -> integrate.Life:
    """Return a life that begins at a later cycle [1] with an error of its depth [m]."""
    jumps = tuple(jump._replace(cycle=jump.cycle + cycle) for jump in life.jumps)
    return life._replace(
        cycle=life.cycle + cycle,
        snapshot_cycle=life.snapshot_cycle + cycle,
        jumps=jumps,
        accumulated_error=life.accumulated_error + error,
        depth_error=life.depth_error + np.copysign(error, life.depth_error),
        steps=tuple(_later_step(step, cycle) for step in life.steps),
    )


def _later_step(step: Step, cycle: float) -> Step:
    """Return a step that begins so many cycles later."""
    start = step.start._replace(cycle=step.start.cycle + cycle)
    end = step.end._replace(cycle=step.end.cycle + cycle)
    return step._replace(start=start, end=end)


def _joined_life(lives: Sequence[integrate.Life]) -> integrate.Life:
    """Return the lives of stages, which begin where the one before ends, as one."""

    def of_all(name: str) -> list[Any]:
        return [getattr(life, name) for life in lives]

    fields: dict[str, Any] = {
        "jumps": tuple(chain(*of_all("jumps"))),
        "steps": tuple(chain(*of_all("steps"))),
    }
    for name in FROM_THE_SECOND_ROW:
        first, *later = of_all(name)
        fields[name] = np.concatenate([first, *(rows[1:] for rows in later)])
    for name in ALL_ROWS:
        fields[name] = np.concatenate(of_all(name))
    for name in LARGEST:
        fields[name] = max(of_all(name))
    for name in SUMS:
        fields[name] = sum(of_all(name))
    return lives[-1]._replace(**fields)
