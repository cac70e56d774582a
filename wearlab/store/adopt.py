"""A run file on its own becomes an entry of a catalogue again, when it is what it says."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

from wearlab.store.errors import StoreError
from wearlab.store.outcome import Outcome
from wearlab.store.runs import hash_of

if TYPE_CHECKING:
    import xarray as xr


MOST_LABELS = 1_000_000  # of one dimension: the catalogue keeps them as text


class ForeignRun(StoreError):
    """A file that bears another run's name."""


def outcome_of(path: Path) -> Outcome:
    """Return the outcome of a run from its file alone.

    Raises
    ------
    StoreError : the file cannot be read, does not hold what was sealed, or is another run's
    """
    from wearlab.store.reading import read_run

    dataset = read_run(path)
    try:
        return _outcome(path, dataset)
    except StoreError:
        raise
    except Exception as error:  # a stranger's file may hold anything
        raise StoreError(
            f"{path}: is no run of wearlab ({type(error).__name__}: {str(error)[:200]})"
        ) from error


def _outcome(path: Path, dataset: "xr.Dataset") -> Outcome:
    from wearlab.store.description import describe
    from wearlab.store.netcdf import is_intact

    attributes = dataset.attrs
    for dim, size in dataset.sizes.items():
        if dim in dataset.coords and size > MOST_LABELS:
            raise StoreError(f"{path}: the dimension {str(dim)[:40]} has {size} labels, more than any run")
    if is_intact(dataset) is False:
        raise StoreError(f"{path}: its content is not what was sealed in it")
    if "id" in attributes and str(attributes["id"]) != path.stem:
        raise ForeignRun(f"{path}: holds run {attributes['id']}, which is not its name")
    seconds = float(dataset["run_time_total"]) if "run_time_total" in dataset else 0.0
    image = path.read_bytes()
    return Outcome(
        *(path.stem, "done", str(attributes.get("date_created", "")), seconds),
        scene=str(attributes.get("scene", json.dumps({}))),
        image=image,
        sha256=hash_of(path),
        **describe(dataset)._asdict(),
        source_hash=str(attributes.get("source_hash", "")),
        wearlab_version=str(attributes.get("wearlab_version", "")),
    )
