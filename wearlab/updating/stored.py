"""A stored run as an update reads it: the few arrays that it needs, with dims and labels, and nothing else.

A thousand draws are read in this form: building a dataset of each, and indexing it, takes longer than the
files and the arithmetic together.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wearlab.store.errors import StoreError

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.store import Store


@dataclass(frozen=True)
class StoredVariable:
    """A variable.

    Parameters
    ----------
    values : its array
    dims : their names
    labels : of those dims that have some
    """

    values: NDArray[Any]
    dims: tuple[str, ...]
    labels: Mapping[str, list[Any]]

    def at(self, dim: str, index: "int | list[int]") -> "StoredVariable":
        """Return the values at a place of a dim, which goes with it, or at some places."""
        dims = (
            self.dims
            if isinstance(index, list)
            else tuple(own_dim for own_dim in self.dims if own_dim != dim)
        )
        return StoredVariable(np.take(self.values, index, axis=self.dims.index(dim)), dims, self.labels)

    def largest(self, dim: str) -> "StoredVariable":
        """Return the largest along a dim, of those that are numbers."""
        top = np.fmax.reduce(self.values, axis=self.dims.index(dim))
        return StoredVariable(top, tuple(own_dim for own_dim in self.dims if own_dim != dim), self.labels)

    def known(self, dim: str) -> list[Any]:
        """Return the labels of a dim, numbers from 0 on where it has none."""
        return self.labels.get(dim) or list(range(self.values.shape[self.dims.index(dim)]))


@dataclass(frozen=True)
class StoredRun:
    """Variables by name."""

    variables: Mapping[str, StoredVariable]

    @classmethod
    def of(cls, run: "xr.Dataset") -> "StoredRun":
        """Return the variables of a dataset."""
        labels = {str(dim): run[dim].values.tolist() for dim in run.dims if dim in run.coords}
        return cls(
            {
                str(name): _labelled(np.asarray(variable.values), tuple(map(str, variable.dims)), labels)
                for name, variable in run.variables.items()
            }
        )

    def __contains__(self, name: str) -> bool:
        return name in self.variables

    def __getitem__(self, name: str) -> StoredVariable:
        return self.variables[name]


def _labelled(values: NDArray[Any], dims: tuple[str, ...], labels: Mapping[str, list[Any]]) -> StoredVariable:
    return StoredVariable(values, dims, {dim: labels[dim] for dim in dims if dim in labels})


def read_runs(store: "Store", ids: Collection[str], names: Collection[str]) -> dict[str, StoredRun]:
    """Return the runs among ``ids`` that have data, with those variables of ``names`` that they have.

    Every file is opened once, and compared with its hash when first read; the catalogue has dims and labels.

    Raises
    ------
    StoreError : a file is gone or was altered, or the catalogue does not describe it
    """
    from wearlab.store.reading import read_variables

    placed = {run.id: run for run in store.catalogue.placed(ids) if run.state == "done" and run.layout}
    layouts = store.catalogue.layouts(str(run.layout) for run in placed.values())
    runs = {}
    for run_id, run in placed.items():
        layout = layouts[str(run.layout)]
        dims = {name: layout["variables"][name]["dims"] for name in names if name in layout["variables"]}
        path = str(store.file_of(run_id))
        arrays = read_variables(path, dims, run.sha256)
        for name, values in arrays.items():
            if values.ndim != len(dims[name]):
                raise StoreError(f"{path}: {name} is not as the catalogue says; 'wearlab reindex' mends it")
        runs[run_id] = StoredRun(
            {name: _labelled(values, tuple(dims[name]), layout["labels"]) for name, values in arrays.items()}
        )
    return runs
