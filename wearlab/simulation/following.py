"""Results that follow from others join the dataset of a run."""

import xarray as xr

from wearlab.results import RESULTS
from wearlab.simulation.label import joined, labelled, parts_of


def with_results(run: xr.Dataset) -> xr.Dataset:
    """Return the dataset with what `wearlab.results` finds from its variables, labelled as declared."""
    found = {
        one.name: one.of(run).transpose(*one.variable.dims).values
        for one in RESULTS
        if all(name in run for name in one.needs)
    }
    return joined(parts_of(run), labelled(found, {})) if found else run
