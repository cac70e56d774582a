"""One variable of a run as columns of numbers, one number for each wear state.

A variable along flanks, meshes, members, harmonics, orders or modes gives one column for each label, named
by dots: ``ste_harmonics.pinion-gear.1``. A signal along the phase gives its indicators: mean, RMS and range
of its fluctuation, crest factor, kurtosis and amplitudes at mesh orders, at the stored phases.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.arrays import Array
from wearlab.query.keys import declared_key
from wearlab.store.indicators import INDICATORS, indicators
from wearlab.store.table import Column

STATE = "update"
NAMED = frozenset(
    ("flank", "member", "mesh", "harmonic", "order", "mode", "axis", "duty", "stage", "multiplier", "part")
)
"""Dimensions whose labels become part of a column's name."""
ALONG = ("mesh_period", "phase")
LEFT_OUT = ("run_time", "count", "residual", "error_weight", "secant_stiffness", "excitation")
HARMONICS = ("mesh_stiffness", "static_transmission_error", "dynamic_transmission_error")
"""Signals whose RMS and amplitudes at mesh orders the dataset has already, jumps between phases included."""


@dataclass(frozen=True)
class Source:
    """A variable that features are made of.

    Parameters
    ----------
    name, dims : as stored
    units, display_units : of its values
    ends : end of the column's name for each place along the named dims
    """

    name: str
    dims: tuple[str, ...]
    units: str
    display_units: str
    ends: tuple[str, ...]

    def columns(self, stored: NDArray[Any], states: int) -> dict[Column, Array]:
        """Return each column's numbers, one a wear state; what knows no wear states is the same at each."""
        order = [dim for dim in self.dims if dim not in (STATE, *ALONG)]
        order += [dim for dim in ALONG if dim in self.dims]
        shown = [STATE, *order] if STATE in self.dims else order
        values = np.asarray(stored, float).transpose([self.dims.index(dim) for dim in shown])
        along = [dim for dim in order if dim in ALONG]
        signal = values.shape[len(shown) - len(along) :]
        count = values.shape[0] if STATE in self.dims else 1
        if not along:
            return self._named({"": values.reshape(count, -1)}, states)
        flat = values.reshape(count, -1, *((1,) if len(along) == 1 else ()), *signal)
        told = indicators(flat)
        twice = ("rms", "order_") if self.name in HARMONICS else ()
        kept = {what: indicator for what, indicator in told.items() if not (twice and what.startswith(twice))}
        return self._named(kept, states)

    def _named(self, named: Mapping[str, Array], states: int) -> dict[Column, Array]:
        return {
            Column(
                f"{self.name}{what and '_'}{what}{end}",
                INDICATORS.get(what) or self.units,
                INDICATORS.get(what) or self.display_units,
            ): np.broadcast_to(values[:, place], states)
            for place, end in enumerate(self.ends)
            for what, values in named.items()
        }


def sources(
    variables: Mapping[str, Mapping[str, Any]],
    labels: Mapping[str, Sequence[Any]],
    sizes: Mapping[str, int],
    wanted: Sequence[str] | None,
) -> list[Source]:
    """Return the variables of runs that are alike, of which features are made.

    Parameters
    ----------
    variables : dims, dtype and attributes of each, and whether it is a coordinate
    labels : along dimensions
    sizes : lengths of dimensions
    wanted : names [every number]
    """
    return [
        Source(
            name,
            tuple(variable["dims"]),
            str(variable["attrs"].get("units", "")),
            str(variable["attrs"].get("display_units", "")),
            _ends([dim for dim in variable["dims"] if dim in NAMED], labels, sizes),
        )
        for name, variable in variables.items()
        if np.dtype(variable["dtype"]).kind in "fiu"
        and not variable["coordinate"]
        and declared_key(name) is not None
        and (not name.startswith(LEFT_OUT) if wanted is None else name in wanted)
        and set(variable["dims"]) <= {STATE, *NAMED, *ALONG}
    ]


def _ends(
    dims: Sequence[str], labels: Mapping[str, Sequence[Any]], sizes: Mapping[str, int]
) -> tuple[str, ...]:
    ends = [""]
    for dim in dims:
        along = labels.get(dim) or range(1, sizes[dim] + 1)
        ends = [f"{end}.{label}" for end in ends for label in along]
    return tuple(ends)
