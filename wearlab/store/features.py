"""Features for statistics and learning: one row for each wear state of each run, one column for each number.

Whatever differs between the runs' scenes comes first, by its key; then what results tell
(`wearlab.store.feature_columns`). Only the variables that become columns are read, each file once.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wearlab.query.keys import declared_key, flat, scene_key
from wearlab.store.errors import StoreError
from wearlab.store.feature_columns import STATE, Source, sources
from wearlab.store.kept_runs import KeptRuns
from wearlab.store.reading import read_variables
from wearlab.store.table import Column, Table

if TYPE_CHECKING:
    from wearlab.store.catalogue import Entry, Placed

ALWAYS = ("operation.torque", "operation.speed")
RUN, NUMBER = Column("run"), Column("state")
TIMES = (Column("cycle", "1", "1"), Column("operating_hours", "s", "h"))
Values = dict[Column, list[Any]]


def features(store: KeptRuns, where: str = "", variables: Sequence[str] | None = None) -> Table:
    """Return the features of the runs that meet a condition.

    Parameters
    ----------
    store : where they are
    where : condition as in `Store.query` [all runs that are done]
    variables : from which columns are made [every number]

    Returns
    -------
    Table with the columns run, state (number of the wear state), cycle, operating_hours, the values of the
    scenes that differ, then the features.

    Raises
    ------
    QueryError : the condition cannot be read
    StoreError : there is no store, no such run, or no run has a variable
    """
    ids = store.query(where, columns=())["id"]
    done = {key: entry for key, entry in store.entries(ids).items() if entry.state == "done"}
    if not done:
        raise StoreError(f"features: no run {'that is done meets the condition' if where else 'is done'}")
    inputs = _differing(done)
    runs = store.catalogue.placed(done)
    layouts = store.catalogue.layouts(run.layout for run in runs if run.layout)
    plans = {(run.layout, run.sizes): _plan(layouts[run.layout or ""], run.sizes, variables) for run in runs}
    blocks = []
    for run in runs:
        plan = plans[run.layout, run.sizes]
        blocks.append(_block(run, plan, str(store.files.path(run.id)), inputs[run.id]))
    own = (RUN, NUMBER, *TIMES)
    columns = tuple(dict.fromkeys((*own, *(column for _, block in blocks for column in block))))
    known = {name for layout in layouts.values() for name in layout["variables"]}
    _refuse_unknown(variables, columns, known)
    stacked = [
        [value for count, block in blocks for value in block.get(column) or [None] * count]
        for column in columns
    ]
    return Table(columns, list(zip(*stacked, strict=True)))


def _plan(
    layout: Mapping[str, Any], sizes: str | None, wanted: Sequence[str] | None
) -> tuple[int, tuple[Column, ...], list[Source]]:
    """Return the number of wear states, the times and the sources of runs that are alike."""
    known, lengths = layout["variables"], json.loads(sizes or "{}")
    times = tuple(time for time in TIMES if time.name in known and known[time.name]["dims"] == [STATE])
    return lengths.get(STATE, 1), times, sources(known, layout["labels"], lengths, wanted)


def _block(
    run: "Placed",
    plan: tuple[int, tuple[Column, ...], list[Source]],
    path: str,
    given: Mapping[Column, Any],
) -> tuple[int, Values]:
    """Return the rows of one run: their number, and the values of each column."""
    states, times, of = plan
    stored = read_variables(
        path, [*(time.name for time in times), *(feature.name for feature in of)], run.sha256
    )
    block: Values = {RUN: [run.id] * states, NUMBER: list(range(states))}
    block |= {time: _plain(stored[time.name]) for time in times}
    block |= {column: [value] * states for column, value in given.items()}
    for feature in of:
        block |= {
            column: _plain(values) for column, values in feature.columns(stored[feature.name], states).items()
        }
    return states, block


def _plain(values: NDArray[Any]) -> list[float | None]:
    """Return numbers, None for what is not finite."""
    numbers: list[float | None] = np.asarray(values, float).tolist()
    if np.isfinite(values).all():
        return numbers
    return [
        number if known else None for number, known in zip(numbers, np.isfinite(values).tolist(), strict=True)
    ]


def _refuse_unknown(variables: Sequence[str] | None, columns: Iterable[Column], known: set[str]) -> None:
    present = [column.name for column in columns]
    for name in variables or ():
        if declared_key(name) is None:
            near = get_close_matches(name, sorted(known), 1)
            meant = f"did you mean {near[0]!r}?" if near else "'wearlab variables' lists them"
            raise StoreError(f"features: {name!r}: there is no such variable; {meant}")
        if not any(feature.startswith(name) for feature in present):
            raise StoreError(f"features: {name!r}: no run here has it as numbers at its wear states")


def _differing(entries: Mapping[str, "Entry"]) -> dict[str, dict[Column, Any]]:
    """Return torque, speed and every value of the scenes that is not the same in all of them."""
    scenes = {run_id: dict(flat(json.loads(entry.scene or "{}"))) for run_id, entry in entries.items()}
    keys = dict.fromkeys(key for scene in scenes.values() for key in scene)
    kept = [
        key for key in keys if key in ALWAYS or len({repr(scene.get(key)) for scene in scenes.values()}) > 1
    ]
    columns = {key: _input(key, [scene.get(key) for scene in scenes.values()]) for key in kept}
    return {
        run_id: {columns[key]: scene.get(key) for key in kept if scene.get(key) is not None}
        for run_id, scene in scenes.items()
    }


def _input(key: str, values: list[Any]) -> Column:
    known = scene_key(key, any(isinstance(value, str) for value in values))
    return Column(key, known.unit, known.display_unit, given=True)
