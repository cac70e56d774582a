"""Results that follow from others join the dataset of a run."""

from collections.abc import Iterable
from functools import partial

import numpy as np
import xarray as xr

from wearlab.results import OF_PLUGINS, RESULTS
from wearlab.schema import attributes
from wearlab.simulation.diagnostics import diagnosed
from wearlab.variable import Result


def with_results(run: xr.Dataset, failures: list[str] | None = None, added: Iterable[str] = ()) -> xr.Dataset:
    """Return the dataset with what `wearlab.results` finds from its variables, labelled as declared.

    Parameters
    ----------
    run : the dataset
    failures : gets a line for each result that fails, which is missing then; None: its error is raised
    added : names of the results of plug-ins that the run has besides
    """
    for result in (*RESULTS.values(), *(OF_PLUGINS[name] for name in added)):
        if all(name in run for name in result.needs):
            find = partial(_variable, result, run)
            found = find() if failures is None else diagnosed(result.name, find, None, failures)
            run = run if found is None else run.assign({result.name: found})
    return run


def _variable(result: Result, run: xr.Dataset) -> xr.Variable:
    """Return a result as declared; what conditions or errors move has their dimension after the first."""
    dims, values = result.variable.dims, result.of(run)
    beside = [dim for dim in values.dims if dim not in dims]
    order = (*dims[:1], *beside, *dims[1:])
    return xr.Variable(order, np.asarray(values.transpose(*order).values), attributes(result.name))
