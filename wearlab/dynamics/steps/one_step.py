"""The step of each structure, and the loads in the form that it takes: chosen by type."""

from typing import Any

import numpy as np
from numba.extending import overload

from wearlab.compiled import UNCOUNTED
from wearlab.dynamics.steps.exact import exact_step
from wearlab.dynamics.steps.kernel import Dense, Diagonal, Propagated
from wearlab.dynamics.steps.rk4 import dense_step, diagonal_step

STEPS = {Diagonal: diagonal_step, Dense: dense_step, Propagated: exact_step}


def step_of(structure: Any, *rest: Any) -> None:
    """Advance by the step of the structure's kind."""
    raise NotImplementedError("compiled code only")


@overload(step_of, jit_options=UNCOUNTED, strict=False)
def _choose_step(structure: Any, *rest: Any) -> Any:
    return STEPS[structure.instance_class]


def fill_load(structure: Any, kernel: Any, tables: Any, step: Any, w: Any, force: Any, load: Any) -> None:
    """Fill ``load`` with what acts beside the springs and dampers: offsets of the channels and the loads."""
    raise NotImplementedError("compiled code only")


@overload(fill_load, jit_options=UNCOUNTED, strict=False)
def _choose_load(structure: Any, *rest: Any) -> Any:
    return _inputs if structure.instance_class is Propagated else _accelerations


def _accelerations(
    structure: Any, kernel: Any, tables: Any, step: Any, w: Any, force: Any, load: Any
) -> None:
    n, channels, balance = len(structure.push), len(kernel.meshes.channels), kernel.balance
    for stage in range(3):
        factor = tables.fluctuation[step, stage] if kernel.fluctuates else 0.0
        for row in range(n):
            total = structure.push[row] + factor * kernel.series.fluctuation[row]
            for c in range(channels):
                total += structure.per_force[c * n + row] * force[stage * channels + c]
            for b in range(len(balance.held)):
                total += balance.size[b] * balance.push[b, row]
            load[np.uint64(stage * n + row) * w] = total


def _inputs(structure: Any, kernel: Any, tables: Any, step: Any, w: Any, force: Any, load: Any) -> None:
    channels, inputs, balance = len(kernel.meshes.channels), len(structure.force) // 5, kernel.balance
    for stage in range(3):
        at = stage * inputs
        for c in range(channels):
            load[at + c] = force[stage * channels + c]
        load[at + channels] = 1.0
        if kernel.fluctuates:
            load[at + channels + 1] = tables.fluctuation[step, stage]
        for b in range(len(balance.held)):
            load[at + inputs - len(balance.held) + b] = balance.size[b]
