"""Results that follow from others join the dataset of a run."""

import xarray as xr

from wearlab.results import RESULTS
from wearlab.simulation.label import joined, labelled, parts_of


def with_results(run: xr.Dataset) -> xr.Dataset:
    """Return the dataset with what `wearlab.results` finds from its variables, labelled as declared."""
    results = {
        result.name: result.of(run).transpose(*result.variable.dims).values
        for result in RESULTS
        if all(name in run for name in result.needs)
    }
    return joined(parts_of(run), labelled(results, {})) if results else run
