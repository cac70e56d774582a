"""Results that follow from others join the dataset of a run."""

from functools import partial

import numpy as np
import xarray as xr

from wearlab.results import RESULTS
from wearlab.simulation.diagnostics import diagnosed
from wearlab.simulation.label import joined, labelled, parts_of
from wearlab.variable import Result


def with_results(run: xr.Dataset, failures: list[str] | None = None) -> xr.Dataset:
    """Return the dataset with what `wearlab.results` finds from its variables, labelled as declared.

    Parameters
    ----------
    run : the dataset
    failures : gets a line for each result that fails, which is missing then; None: its error is raised
    """
    results: dict[str, np.ndarray] = {}
    for result in RESULTS:
        if all(name in run for name in result.needs):
            find = partial(_values, result, run)
            values = find() if failures is None else diagnosed(result.name, find, None, failures)
            results |= {} if values is None else {result.name: values}
    return joined(parts_of(run), labelled(results, {})) if results else run


def _values(result: Result, run: xr.Dataset) -> np.ndarray:
    return np.asarray(result.of(run).transpose(*result.variable.dims).values)
