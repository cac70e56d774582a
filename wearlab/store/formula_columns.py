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
        layouts = self._layouts(entries.values())
        for entry in entries.values():
            number = None
            if entry.layout:
                number = self._number(key, entry, layouts[str(entry.layout)])
            self._numbers[key.name, entry.id] = number
        return [self._numbers.get((key.name, run_id)) for run_id in run_ids]

    def all_values(self, name: str, entries: Sequence[Entry]) -> dict[str, list[float]]:
        """Return the distinct values of a variable by run, of those that have it.

        Parameters
        ----------
        name : of the variable
        entries : of the runs in the catalogue
        """
        layouts = self._layouts(entries)
        distinct = {}
        for entry in entries:
            layout = layouts.get(str(entry.layout))
            if layout is None or name not in layout["variables"]:
                continue
            try:
                values = self._dataset(entry, layout, [name])[name].values
            except StoreError as error:
                self.unreadable[entry.id] = str(error)
                continue
            distinct[entry.id] = np.unique(values).tolist()
        return distinct

    def _layouts(self, entries: Iterable[Entry]) -> dict[str, dict[str, Any]]:
        """Return the layouts of runs that have any, by their names."""
        return self.catalogue.layouts(
            str(entry.layout) for entry in entries if entry.layout
        )

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
