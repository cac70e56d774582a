"""Formulas of stored variables, computed from the files of runs.

No catalogue keeps these numbers. Of a file only the variables in the formula are read.
"""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import xarray as xr

from wearlab.query import Key
from wearlab.query.formula import (
    STATES,
    AmountError,
    Formula,
    SeveralNumbersError,
    one_number,
)
from wearlab.store import reading
from wearlab.store.catalogue import Catalogue, Entry
from wearlab.store.files import RunFiles, StoreError

UPDATE = "update"


class FormulaColumns:
    """Computes formulas of runs, each once.

    Parameters
    ----------
    catalogue : knows the variables of the runs
    files : of the runs

    Attributes
    ----------
    units : of the formulas that were computed, by their text
    unreadable : why the file of a run could not be read, by its id
    """

    def __init__(self, catalogue: Catalogue, files: RunFiles) -> None:
        self.catalogue = catalogue
        self.files = files
        self.units: dict[str, str] = {}
        self.unreadable: dict[str, str] = {}
        self._numbers: dict[tuple[str, str], float | None] = {}
        self._unknown_places: dict[str, AmountError] = {}

    def values(self, key: Key, run_ids: Sequence[str]) -> list[float | None]:
        """Return the number that a formula has in each run, None where it has none.

        Parameters
        ----------
        key : of the formula
        run_ids : of the runs

        Raises
        ------
        SeveralNumbersError : several numbers remain in a run
        """
        unread = [
            run_id for run_id in run_ids if (key.name, run_id) not in self._numbers
        ]
        entries = self.catalogue.entries(unread, "sizes")
        layouts = self.catalogue.layouts(
            str(entry.layout) for entry in entries.values() if entry.layout
        )
        for entry in entries.values():
            number = None
            if entry.layout:
                number = self._number(key, entry, layouts[str(entry.layout)])
            self._numbers[key.name, entry.id] = number
        return [self._numbers.get((key.name, run_id)) for run_id in run_ids]

    def all_values(self, name: str, run_id: str) -> list[float] | None:
        """Return the distinct values of a variable in a run, None where it has none.

        Parameters
        ----------
        name : of the variable
        run_id : of the run
        """
        entry = self.catalogue.entries([run_id], "sizes")[run_id]
        if not entry.layout:
            return None
        layout = self.catalogue.layouts([str(entry.layout)])[str(entry.layout)]
        if name not in layout["variables"]:
            return None
        try:
            values = self._dataset(entry, layout, [name])[name].values
        except StoreError as error:
            self.unreadable[run_id] = str(error)
            return None
        distinct: list[float] = np.unique(values).tolist()
        return distinct

    def refuse_unknown_places(self) -> None:
        """Refuse a formula that names a place which no run has.

        Raises
        ------
        AmountError : such as ``flank = 'sun'`` where all runs are of gear pairs
        """
        for text, error in self._unknown_places.items():
            if text not in self.units:
                raise error

    def _number(self, key: Key, entry: Entry, layout: dict[str, Any]) -> float | None:
        """Return the number that a formula has in one run, None where it has none."""
        formula: Formula = key.formula
        names = {name for name, _ in formula.names}
        if not names.issubset(layout["variables"]):
            return None
        try:
            dataset = self._dataset(entry, layout, names)
            measured = formula.worked_out(dataset, {})
            number = one_number(measured, key.name)
        except StoreError as error:
            self.unreadable[entry.id] = str(error)
            return None
        except SeveralNumbersError:
            raise
        except AmountError as error:
            self._unknown_places.setdefault(key.name, error)
            return None
        self.units[key.name] = measured.units
        return number

    def _dataset(
        self, entry: Entry, layout: dict[str, Any], names: Iterable[str]
    ) -> xr.Dataset:
        """Return some variables of a run, with what counts its wear states."""
        described = layout["variables"]
        states = [name for name in STATES if name in described]
        needed = list(dict.fromkeys([*names, *states]))
        path = str(self.files.path(entry.id))
        stored = reading.read_variables(path, needed, entry.sha256)
        variables: dict[str, Any] = {
            name: (described[name]["dims"], values, described[name]["attrs"])
            for name, values in stored.items()
        }
        variables["n_updates"] = entry.sizes.get(UPDATE, 1)

        dims = {dim for name in needed for dim in described[name]["dims"]}
        coordinates = {
            dim: (dim, layout["labels"][dim], described[dim]["attrs"])
            for dim in dims
            if dim in layout["labels"] and dim not in variables
        }
        return xr.Dataset(variables, coordinates).set_coords(states)
