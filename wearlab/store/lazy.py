"""One variable of all runs of a grid, read when a point of it is asked for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.store.reading import read_variable

Places = tuple[list[int] | None, ...]


@dataclass(frozen=True)
class RunGroup:
    """Runs that are alike: the same variables, the same lengths.

    Parameters
    ----------
    sizes : length of each dimension
    variables : dims, dtype and attributes of each variable
    labels : labels of dimensions
    """

    sizes: Mapping[str, int]
    variables: Mapping[str, dict[str, Any]]
    labels: Mapping[str, list[Any]]


@dataclass(frozen=True)
class RunFile:
    """The file of one run.

    Parameters
    ----------
    path, sha256 : the file and the recorded hash of its bytes
    group : what the run is like
    """

    path: str
    sha256: str | None
    group: int


@dataclass(frozen=True, repr=False)
class LazyVariable:
    """An array over grid and run dims; indexing it by slices reads the points that the slices hold.

    Parameters
    ----------
    name : of the variable
    numbers : number of the run at each grid point, −1 where there is none (grid shape)
    files, groups : the runs
    places : per group, where its values go along each run dim (None: from 0 on)
    padded : lengths of the run dims
    dtype, fill : of the result
    """

    name: str
    numbers: NDArray[np.intp]
    files: Sequence[RunFile]
    groups: Sequence[RunGroup]
    places: Mapping[int, Places]
    padded: tuple[int, ...]
    dtype: np.dtype[Any]
    fill: Any

    @property
    def shape(self) -> tuple[int, ...]:
        """Lengths of grid and run dims."""
        return self.numbers.shape + self.padded

    @property
    def ndim(self) -> int:
        """Number of grid and run dims."""
        return len(self.shape)

    def __getitem__(self, index: Any) -> NDArray[Any]:
        """Return the values in a block of points, given by a slice or a number for each dim."""
        index = index if isinstance(index, tuple) else (index,)
        index += (slice(None),) * (self.ndim - len(index))
        grid = self.numbers.ndim
        wide = tuple(i if isinstance(i, slice) else slice(int(i), int(i) + 1) for i in index[:grid])
        numbers = np.asarray(self.numbers[wide])
        result = np.full(numbers.shape + self.padded, self.fill, self.dtype)
        for point in np.ndindex(numbers.shape):
            number = int(numbers[point])
            if number >= 0 and self.files[number].group in self.places:
                values = self._values(self.files[number])
                # a 0-d array of texts would stand in an object array as an array
                result[(*point, *self._where(self.files[number].group, values.shape))] = values[()]
        kept = tuple(slice(None) if isinstance(i, slice) else 0 for i in index[:grid])
        return np.asarray(result[kept + index[grid:]])

    def _where(self, group: int, lengths: tuple[int, ...]) -> tuple[Any, ...]:
        """Return the index of a group's values among the padded ones."""
        places = self.places[group]
        if all(place is None for place in places):
            return tuple(slice(n) for n in lengths)
        where = zip(lengths, places, strict=True)
        return np.ix_(*(np.arange(n) if place is None else np.asarray(place) for n, place in where))

    def _values(self, file: RunFile) -> NDArray[Any]:
        return read_variable(file.path, self.name, file.sha256)
