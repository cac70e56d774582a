"""What the catalogue keeps of a run, so that it can be asked for.

Lengths, variables, scalar results, and values along the life.

A grid opens and a question is answered without opening files. All of it follows from
the file of the run and its scene, so that `wearlab verify` can compare both.
"""

import hashlib
import json
import math
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearlab.files import read_regular
from wearlab.query import evaluate, keys
from wearlab.store import files, outcome, watching

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import NDArray

LIFE = "update"
ALONG_PHASE = ("mesh_stiffness", "static_transmission_error", "dynamic_mesh_force")
WARNINGS = "warnings"  # attribute of a run that was computed with some
CODE = ("commit", "model_version")
LONGEST = 200  # characters of a text that can be asked for
Fact = tuple[str, str, Any]  # source, name, value
NEW_KEY = "INSERT INTO keys VALUES (NULL, ?, ?, ?, ?, ?, ?) RETURNING number"
# those of a run, found by their key
FACTS = "facts WHERE run = ? AND key IN (SELECT number FROM keys)"


def describe(dataset: "xr.Dataset") -> dict[str, Any]:
    """Return what the catalogue records of a dataset.

    So that a grid opens without opening files.

    Parameters
    ----------
    dataset : a run

    Returns
    -------
    By name, as an outcome has it

    sizes : length of each dimension
    layout : JSON: per variable its dims, dtype, attributes, whether it is a coordinate;
        labels of dimensions
    digests : hash of the values of each coordinate
    summary : scalar results; the largest of each result at a wear state; of some along
        the phase the smallest, largest and mean; the code that made it
    histories : each result at the wear states, smallest and largest where there are
        several; float64
    """
    variables: dict[str, dict[str, Any]] = {}
    for name, variable in dataset.variables.items():
        dtype = "str" if variable.dtype.kind in "OUS" else variable.dtype.str
        attributes = {str(key): plain(value) for key, value in variable.attrs.items()}
        variables[str(name)] = {
            "dims": list(variable.dims),
            "dtype": dtype,
            "attrs": attributes,
        }
        variables[str(name)]["coordinate"] = name in dataset.coords
    labels = {
        str(dim): dataset[dim].values.tolist()
        for dim in dataset.dims
        if dim in dataset.coords
    }
    summary, histories = _results(dataset)
    sizes = {str(dim): n for dim, n in dataset.sizes.items()}
    layout = json.dumps({"variables": variables, "labels": labels}, sort_keys=True)
    digests = {str(name): _digest(values) for name, values in dataset.coords.items()}
    return {
        "sizes": sizes,
        "layout": layout,
        "digests": digests,
        "summary": summary,
        "histories": histories,
    }


def _digest(values: "xr.DataArray") -> str:
    data = values.values
    content = (
        repr(data.tolist()).encode() if data.dtype.kind in "OUS" else data.tobytes()
    )
    return hashlib.sha256(
        repr((values.dims, values.shape)).encode() + content
    ).hexdigest()[:16]


def _results(dataset: "xr.Dataset") -> tuple[dict[str, Any], dict[str, bytes]]:
    """Return summary and histories, as `describe` does."""
    import numpy as np

    summary = _of_attributes(dataset)
    histories: dict[str, bytes] = {}
    for key, variable in dataset.variables.items():
        name = str(key)
        if variable.ndim == 0:
            summary[name] = plain(variable.values)
        elif variable.dtype.kind not in "fiu":
            continue
        elif keys.REDUCED_DIMS.issuperset(variable.dims):
            values = np.asarray(variable.values, float)
            summary[name] = plain(_reduced(values, np.fmax))
            if variable.dims[0] == LIFE:
                histories[name] = _history(values)
        elif name in ALONG_PHASE:
            summary[f"{name}_min"] = plain(_reduced(variable.values, np.fmin))
            # as a file gives them: sums round by the order of their terms
            in_order = np.ascontiguousarray(variable.values)
            summary[f"{name}_mean"] = plain(np.mean(in_order))
            summary[f"{name}_max"] = plain(_reduced(variable.values, np.fmax))
    return summary, histories


def _of_attributes(dataset: "xr.Dataset") -> dict[str, Any]:
    """Return what of a dataset's attributes stands in its summary."""
    summary: dict[str, Any] = {
        name: str(dataset.attrs[name])
        for name in (*CODE, outcome.CALIBRATION)
        if name in dataset.attrs
    }
    for name in ("parent_cycle", outcome.CALIBRATION_LIFE):
        with suppress(KeyError, ValueError, TypeError):
            summary[name] = plain(float(dataset.attrs[name]))
    return summary


def _history(values: "NDArray[Any]") -> bytes:
    """Return a result at all wear states.

    The lowest, then the highest, where there are several at a state.
    """
    import numpy as np

    along_places = tuple(range(1, values.ndim))
    lowest = np.fmin.reduce(values, axis=along_places)
    if values.ndim == 1:
        return bytes(lowest.tobytes())
    highest = np.fmax.reduce(values, axis=along_places)
    return bytes(np.concatenate([lowest, highest]).tobytes())


def _reduced(values: "NDArray[Any]", choose: Any) -> Any:
    """Return one of all values, by a function such as ``np.fmax``; NaN of none."""
    return choose.reduce(values, axis=None) if values.size else math.nan


def plain(value: Any) -> Any:
    """Return a value that JSON can hold; what is not finite becomes None.

    Parameters
    ----------
    value : of numpy, or plain
    """
    if hasattr(value, "tolist"):  # of numpy
        value = value.tolist()
    if isinstance(value, list):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if isinstance(value, str | int | float | bool | None) else str(value)


def write_facts(
    connection: sqlite3.Connection, run: int, facts: Iterator[Fact]
) -> None:
    """Write the facts of one run, in the place of all that it had.

    A key has the kind of its first value.

    Parameters
    ----------
    connection : to the catalogue, within a transaction
    run, facts : the number of the run, and what can be asked of it
    """
    connection.execute(f"DELETE FROM {FACTS}", (run,))
    key_of_name = {
        name: columns
        for name, *columns in connection.execute("SELECT name, number, kind FROM keys")
    }
    rows = {}
    for source, name, value in facts:
        if name not in key_of_name:
            kind = kind_of(value)
            key = keys.key_of(name.removesuffix(evaluate.HISTORY), source, kind)
            columns = (name, source, kind, key.unit, key.quantity, key.display_unit)
            ((number,),) = connection.execute(NEW_KEY, columns).fetchall()
            key_of_name[name] = [number, kind]
        number, kind = key_of_name[name]
        rows[number] = (number, run, stored(value, kind))
    connection.executemany("INSERT INTO facts VALUES (?, ?, ?)", rows.values())


def kind_of(value: Any) -> str:
    """Return the kind of a fact: history, text or number."""
    return (
        "history"
        if isinstance(value, bytes)
        else "text"
        if isinstance(value, str)
        else "number"
    )


def stored(value: Any, kind: str) -> Any:
    """Return a value as it stands under a key of this kind.

    Parameters
    ----------
    value : of a fact
    kind : number, text or history
    """
    return value if kind_of(value) == kind else str(value)


def facts_of(
    scene: str, summary: Mapping[str, Any], histories: Mapping[str, bytes]
) -> Iterator[Fact]:
    """Yield every fact of a run.

    Values of its scene, scalar results, and values along its life.

    Parameters
    ----------
    scene : canonical JSON
    summary : results by name
    histories : per variable its values at all wear states, the lower ones first where
        there are two of each
    """
    scene_values = dict(keys.flat(json.loads(scene or "{}")))
    facts = [("scene", *pair) for pair in scene_values.items()]
    facts += [
        ("result", *pair) for pair in summary.items() if pair[0] not in scene_values
    ]
    for source, name, value in facts:
        if isinstance(value, int | float) or (
            isinstance(value, str) and len(value) <= LONGEST
        ):
            yield source, name, int(value) if isinstance(value, bool) else value
    yield from (
        ("history", name + evaluate.HISTORY, values)
        for name, values in histories.items()
    )


MAX_LABELS = 1_000_000  # of one dimension: the catalogue keeps them as text


class ForeignRun(files.StoreError):
    """A file that bears another run's name."""


def outcome_of(path: Path) -> outcome.Outcome:
    """Return the outcome of a run from its file alone.

    Parameters
    ----------
    path : the file, named by the run's id

    Raises
    ------
    StoreError : the file cannot be read, does not hold what was sealed, or is another
        run's
    """
    from wearlab.store import netcdf, reading

    dataset = reading.read_run(path)
    with files.readable(f"{path}:", "is no run of wearlab"):
        for dim, size in dataset.sizes.items():
            if dim in dataset.coords and size > MAX_LABELS:
                message = (
                    f"the dimension {str(dim)[:40]} has {size} labels, more than any "
                    "run"
                )
                raise files.StoreError(f"{path}: {message}")
        if netcdf.is_intact(dataset) is False:
            raise files.StoreError(f"{path}: its content is not what was sealed in it")
        if (name := str(dataset.attrs.get("id", path.stem))) != path.stem:
            raise ForeignRun(f"{path}: holds run {name}, which is not its name")
        begun = str(dataset.attrs.get("date_created", ""))
        seconds = float(dataset.get("run_time_total", 0.0))
        contents = {
            "scene": str(dataset.attrs.get("scene", "{}")),
            "warnings": warnings_of(dataset),
            **recorded(dataset, read_regular(path)),
        }
        return outcome.Outcome(path.stem, "done", begun, seconds, **contents)


def warnings_of(dataset: "xr.Dataset") -> tuple[str, ...]:
    """Return the warnings of a run, as its file carries them.

    Parameters
    ----------
    dataset : a run; those of older versions carry none
    """
    texts = json.loads(dataset.attrs.get(WARNINGS, "[]"))
    return tuple(str(text) for text in texts)


def outcomes_of(
    runs: files.RunFiles, problems: list[files.Problem]
) -> Iterator[outcome.Outcome]:
    """Yield the outcomes of all runs that have a file.

    Those whose file is none become problems.

    Parameters
    ----------
    runs : the folder of the files
    problems : grows by what is wrong
    """
    for path in watching.each_told(list(runs.held())):
        try:
            yield outcome_of(path)
        except files.StoreError as error:
            problems.append(files.Problem(path, "unreadable", str(error)))


def recorded(dataset: "xr.Dataset", image: bytes) -> dict[str, Any]:
    """Return what an outcome has of a run's dataset and its file.

    Parameters
    ----------
    dataset : a run
    image : the bytes of its file
    """
    names = ("source_hash", "wearlab_version")
    code = {name: str(dataset.attrs[name]) for name in names if name in dataset.attrs}
    return {
        "image": image,
        "sha256": hashlib.sha256(image).hexdigest(),
        **describe(dataset),
        **code,
    }
