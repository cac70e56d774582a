"""Models side by side: how probable the measurements are under each, and how well each foretells others.

Cases that were compared with the same measurements, errors that accumulate or not, k that changed or not. An
inspection left out is foretold exactly, without a sampling error: ln p(y_i | the others) = ln Z − ln Z₋ᵢ.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.updating.history import RunHistory
from wearlab.updating.layout import dataset, variable
from wearlab.updating.likelihood import Block, block_of
from wearlab.updating.outcome import ACCUMULATING, UpdateOutcome
from wearlab.updating.posterior import posterior

MOST = 3000  # runs times inspections up to which inspections are left out
EVIDENCE = (
    (1.0, "cannot tell {} from {}"),
    (3.0, "lean towards {} against {}"),
    (5.0, "clearly prefer {} to {}"),
)
STRONG = "strongly prefer {} to {}"


class Model(NamedTuple):
    """One of those compared: its name, its blocks, its runs and ln of how often each stands."""

    name: str
    blocks: tuple[Block, ...]
    runs: tuple[RunHistory, ...]
    often: Array


def models_of(outcome: UpdateOutcome) -> Iterator[Model]:
    """Yield the model that was asked for, and those that differ from it in one thing."""
    post, study = outcome.posterior, outcome.study
    accumulates, changes = study.spec.discrepancy == ACCUMULATING, study.spec.change != "none"
    drifts = any(block.data.error.drift is not None for block in post.blocks)
    words = {True: "accumulating noise", False: "independent errors"}
    own = [words[accumulates]] if drifts else []
    own += [f"k changes ({study.spec.change})"] if changes else []
    case = [study.label]
    yield Model(", ".join(case + own), post.blocks, post.histories, post.log_proposal)
    if drifts:
        made = (block_of(block.seen, accumulating=not accumulates) for block in post.blocks)
        kept = zip(made, post.blocks, strict=True)
        other = tuple(replace(m, rows=b.rows, numerical=b.numerical) for m, b in kept)
        named = [*case, words[not accumulates], *own[1:]]
        yield Model(", ".join(named), other, post.histories, post.log_proposal)
    if changes:
        named = [*case, *own[:-1], "k constant"]
        yield Model(", ".join(named), post.blocks, post.histories[:1], np.zeros(1))


def left_out(model: Model, outcome: UpdateOutcome, evidence: float) -> Array:
    """Return ln of the probability of each inspection given all others."""
    run = model.runs[0]
    cycles = [run.asked[n].cycle[block.rows] for n, block in enumerate(model.blocks)]
    found = []
    for cycle in np.unique(np.concatenate(cycles)):
        rest = tuple(
            replace(block, rows=block.rows[at != cycle])
            for block, at in zip(model.blocks, cycles, strict=True)
        )
        found.append(evidence - posterior(model.runs, rest, outcome.study.prior, model.often).evidence)
    return np.array(found)


def compared(outcomes: Sequence[UpdateOutcome]) -> xr.Dataset | None:
    """Return the models beside each other, the most probable first; None of a single one."""
    each = [(outcome, model) for outcome in outcomes for model in models_of(outcome)]
    if len(each) < 2 or not any(len(block.rows) for block in each[0][1].blocks):
        return None
    names, evidence, alone = [], [], []
    for outcome, model in each:
        names.append(model.name)
        evidence.append(posterior(model.runs, model.blocks, outcome.study.prior, model.often).evidence)
        seen = sum(len(asked.cycle) for asked in model.runs[0].asked)
        few = len(model.runs) * seen <= MOST
        alone.append(left_out(model, outcome, evidence[-1]) if few else np.full(1, np.nan))
    order = np.argsort(evidence)[::-1]
    off = [
        alone[i] - alone[order[0]] if len(alone[i]) == len(alone[order[0]]) else np.full(1, np.nan)
        for i in order
    ]
    spread = [np.sqrt(len(o)) * float(np.std(o, ddof=1)) if len(o) > 1 else np.nan for o in off]
    values = np.array(evidence)[order]
    return dataset(
        {
            "log_evidence": variable(values, "log of the probability of all measurements", "model"),
            "log_left_out": variable(
                [float(np.sum(alone[i])) for i in order],
                "sum of the logs of the probability of each inspection given all others",
                "model",
            ),
            "left_out_difference": variable(
                [float(np.sum(o)) for o in off], "of the sum to that of the most probable", "model"
            ),
            "left_out_error": variable(spread, "standard error of that difference", "model"),
            "model": variable(np.array([names[i] for i in order], dtype=object), "model", "model"),
        }
    ).set_coords("model")


def in_words(found: xr.Dataset) -> list[str]:
    """Return the table and one sentence."""
    names = [str(name) for name in found["model"].values]
    gain = found["log_evidence"].values - found["log_evidence"].values[0]
    off, error = found["left_out_difference"].values, found["left_out_error"].values
    width = max(len(name) for name in names)
    lines = [
        "models compared: ln of the evidence, and of each inspection foretold by the others, less the first's"
    ]
    for name, g, o, e in zip(names, gain, off, error, strict=True):
        told = "" if not np.isfinite(o) else f"  {o:7.3g} ± {e:.2g}" if o else "        0"
        lines.append(f"  {name:<{width}}  {g:7.3g}{told}")
    words = next((text for most, text in EVIDENCE if -gain[1] < most), STRONG)
    said = f"the data {words.format(names[0], names[1])}"
    if np.isfinite(off[1]) and off[1] > max(error[1], 0.0):
        said += f", but {names[1]} foretells single inspections better: more of them will tell"
    return [*lines, said]
