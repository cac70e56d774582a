"""Features for statistics and learning.

One row for each wear state of each run, one column for each number.

Whatever differs between the runs' scenes comes first, by its key; then what results
tell. A variable along flanks, meshes, members, harmonics, orders or modes gives one
column for each label, named by dots: ``ste_harmonics.pinion-gear.1``. A signal along
the phase gives its indicators: mean, RMS and range of its fluctuation, crest factor,
kurtosis and amplitudes at mesh orders, at the stored phases. Only the variables that
become columns are read, each file once.
"""

from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wearlab.arrays import Array
from wearlab.query.keys import declared_key, differing_keys, scene_key
from wearlab.store import reading
from wearlab.store.files import StoreError
from wearlab.store.table import Column, Table

if TYPE_CHECKING:
    from wearlab.store import catalogue
    from wearlab.store.stored_runs import StoredRuns

ORDERS = 5
STILL = 1e-12  # of the mean: what moves less does not move
UNITLESS = ("crest_factor", "kurtosis")
"""Indicators of shape; all others have the unit of the signal."""


STATE = "update"
NAMED = frozenset(
    "flank member mesh harmonic order mode axis duty stage multiplier part".split()
)
"""Dimensions whose labels become part of a column's name."""
ALONG = ("mesh_period", "phase")
LEFT_OUT = (
    "run_time",
    "count",
    "residual",
    "error_weight",
    "secant_stiffness",
    "excitation",
)
HARMONICS = (
    "mesh_stiffness",
    "static_transmission_error",
    "dynamic_transmission_error",
)
"""Signals whose RMS and amplitudes at mesh orders the dataset has already, jumps
between phases included."""
ALWAYS = ("operation.torque", "operation.speed")
RUN = Column("run")
NUMBER = Column("state")
TIMES = (Column("cycle", "1", "1"), Column("operating_hours", "s", "h"))
Values = dict[Column, list[Any]]


def indicators(signal: Array) -> dict[str, Array]:
    """Return indicators of periodic signals, and amplitudes at the first mesh orders.

    mean x̄; rms √⟨(x−x̄)²⟩; peak_to_peak max x − min x; crest_factor max|x−x̄|/rms;
    kurtosis ⟨(x−x̄)⁴⟩/rms⁴; order_k 2|X_k|, X the discrete Fourier transform of the
    mean mesh period.

    Parameters
    ----------
    signal : x at equally spaced phases of whole mesh periods, (..., periods, phases); a
        period that is not finite throughout only pads and is left out

    Returns
    -------
    One number a signal (...), in the unit of the signal, crest factor and kurtosis
    without; NaN of no period, and of the shape of what does not move.
    """
    both = (-2, -1)
    is_whole = np.isfinite(signal).all(axis=-1, keepdims=True)
    periods_reached = is_whole.sum(axis=both)
    periods = np.where(periods_reached > 0, periods_reached, np.nan)
    count = periods * signal.shape[-1]

    values = np.where(is_whole, signal, 0.0)
    mean = values.sum(axis=both) / count
    moving = np.where(is_whole, signal - mean[..., None, None], 0.0)
    rms = np.sqrt((moving**2).sum(axis=both) / count)
    moves = rms > STILL * np.maximum(np.abs(mean), 1e-300)
    rms_of_moving = np.where(moves, rms, np.nan)
    highest = np.max(signal, axis=both, where=is_whole, initial=-np.inf)
    lowest = np.min(signal, axis=both, where=is_whole, initial=np.inf)
    peak = np.abs(moving).max(axis=both, initial=0.0)
    fourth_moment = (moving**4).sum(axis=both) / count

    result = {
        "mean": mean,
        "rms": rms,
        "peak_to_peak": np.where(np.isfinite(periods), highest - lowest, np.nan),
        "crest_factor": peak / rms_of_moving,
        "kurtosis": fourth_moment / rms_of_moving**4,
    }
    mean_period = values.sum(axis=-2) / periods[..., None]
    spectrum = np.fft.rfft(mean_period)[..., 1 : ORDERS + 1]
    amplitudes = 2.0 * np.abs(spectrum) / signal.shape[-1]
    for order in range(1, amplitudes.shape[-1] + 1):
        result[f"order_{order}"] = amplitudes[..., order - 1]
    return result


class _RunForm:
    """Runs of the same form: which of their variables become columns, and how.

    Parameters
    ----------
    layout : their variables, with labels along dimensions
    sizes : lengths of dimensions
    chosen : names [every number]
    """

    def __init__(
        self,
        layout: dict[str, Any],
        sizes: dict[str, int],
        chosen: Sequence[str] | None,
    ) -> None:
        self.variables = layout["variables"]
        self.labels = layout["labels"]
        self.states = sizes.get(STATE, 1)
        self.names = [
            name
            for name, description in self.variables.items()
            if _has_columns(name, description, chosen)
        ]

    def rows(
        self, run: "catalogue.Entry", path: str, inputs: Mapping[Column, Any]
    ) -> Values:
        """Return the values of each column of one run, one a wear state.

        None for what is not finite.

        Parameters
        ----------
        run : the run, of this form
        path : its file
        inputs : what its scene has, by column
        """
        times = [
            time
            for time in TIMES
            if self.variables.get(time.name, {}).get("dims") == [STATE]
        ]
        names = [*(time.name for time in times), *self.names]
        stored = reading.read_variables(path, names, run.sha256)

        block: Values = {RUN: [run.id] * self.states, NUMBER: list(range(self.states))}
        for time in times:
            block[time] = _plain(stored[time.name])
        for column, value in inputs.items():
            block[column] = [value] * self.states
        for name in self.names:
            for column, values in self.columns(name, stored[name]).items():
                block[column] = _plain(values)
        return block

    def columns(self, name: str, stored: NDArray[Any]) -> dict[Column, Array]:
        """Return each column's numbers, one a wear state.

        A variable without wear states is the same at each.

        Parameters
        ----------
        name : of the variable
        stored : its values, along its dims
        """
        dims = self.variables[name]["dims"]
        attributes = self.variables[name]["attrs"]
        sizes = dict(zip(dims, stored.shape, strict=True))
        named_dims = [dim for dim in dims if dim in NAMED]
        signals = self._signals(name, dims, sizes, stored)
        if signals is None:
            values = np.asarray(stored, float)
            order = [dims.index(dim) for dim in (STATE, *named_dims) if dim in dims]
            by_place = values.transpose(order).reshape(sizes.get(STATE, 1), -1)
            indicated = {"": by_place}
        else:
            indicated = signals

        labels_along = (
            self.labels.get(dim) or range(1, sizes[dim] + 1) for dim in named_dims
        )
        units = [str(attributes.get(key, "")) for key in ("units", "display_units")]
        columns = {}
        for place, labels in enumerate(product(*labels_along)):
            for indicator, values in indicated.items():
                stem = f"{name}_{indicator}" if indicator else name
                title = ".".join([stem, *map(str, labels)])
                unit, display_unit = ("1", "1") if indicator in UNITLESS else units
                column = Column(title, unit, display_unit)
                columns[column] = np.broadcast_to(values[:, place], self.states)
        return columns

    def _signals(
        self, name: str, dims: Sequence[str], sizes: Mapping[str, int], stored: Any
    ) -> dict[str, Array] | None:
        """Return the indicators (state, place) of a signal, None of no signal.

        Those that the dataset has already are left out.
        """
        lengths = [sizes[dim] for dim in ALONG if dim in sizes]
        if not lengths:
            return None
        named_dims = [dim for dim in dims if dim in NAMED]
        order = [dims.index(dim) for dim in (STATE, *named_dims, *ALONG) if dim in dims]
        padded = (1,) * (len(ALONG) - len(lengths))
        shape = (sizes.get(STATE, 1), -1, *padded, *lengths)
        signal = np.asarray(stored, float).transpose(order).reshape(shape)
        left_out = ("rms", "order_") if name in HARMONICS else ()
        return {
            indicator: values
            for indicator, values in indicators(signal).items()
            if not indicator.startswith(left_out)
        }


def _has_columns(
    name: str, description: Mapping[str, Any], chosen: Sequence[str] | None
) -> bool:
    is_chosen = not name.startswith(LEFT_OUT) if chosen is None else name in chosen
    is_numeric = np.dtype(description["dtype"]).kind in "fiu" and set(
        description["dims"]
    ) <= {
        STATE,
        *NAMED,
        *ALONG,
    }
    return (
        is_chosen
        and is_numeric
        and not description.get("coordinate")
        and declared_key(name) is not None
    )


def features(
    store: "StoredRuns", where: str = "", variables: Sequence[str] | None = None
) -> Table:
    """Return the features of the runs that meet a condition.

    Parameters
    ----------
    store : where they are
    where : condition as in `Store.query` [all runs that are done]
    variables : from which columns are made [every number]

    Returns
    -------
    Table with the columns run, state (number of the wear state), cycle,
    operating_hours, the values of the scenes that differ, then the features.

    Raises
    ------
    QueryError : the condition cannot be read
    StoreError : there is no store, no such run, or no run has a variable
    """
    ids = store.query(where, columns=())["id"]
    finished = {
        key: entry
        for key, entry in store.archive.entries(ids).items()
        if entry.state == "done"
    }
    if not finished:
        raise StoreError(
            "features: no run "
            f"{'that is done meets the condition' if where else 'is done'}"
        )
    inputs = _differing(finished)
    layouts = store.archive.catalogue.layouts(
        run.layout for run in finished.values() if run.layout
    )
    forms = {
        run.form: _RunForm(layouts[run.layout or ""], run.sizes, variables)
        for run in finished.values()
    }
    blocks = [
        forms[e.form].rows(e, str(store.archive.files.path(e.id)), inputs[e.id])
        for e in finished.values()
    ]
    columns = tuple(
        dict.fromkeys(
            (RUN, NUMBER, *TIMES, *(column for block in blocks for column in block))
        )
    )
    _refuse_unknown(
        variables,
        columns,
        {name for layout in layouts.values() for name in layout["variables"]},
    )
    records: list[tuple[Any, ...]] = []
    for block in blocks:
        records += zip(
            *(block.get(column, [None] * len(block[RUN])) for column in columns),
            strict=True,
        )
    return Table(columns, records)


def _plain(values: NDArray[Any]) -> list[float | None]:
    """Return numbers, None for what is not finite."""
    return list(np.where(np.isfinite(values), values, np.array(None)))


def _refuse_unknown(
    variables: Sequence[str] | None, columns: Iterable[Column], available: set[str]
) -> None:
    for name in variables or ():
        if declared_key(name) is None:
            near = get_close_matches(name, sorted(available), 1)
            remedy = (
                f"did you mean {near[0]!r}?"
                if near
                else "'wearlab variables' lists them"
            )
            raise StoreError(f"features: {name!r}: there is no such variable; {remedy}")
        if not any(column.name.startswith(name) for column in columns):
            raise StoreError(
                f"features: {name!r}: no run here has it as numbers at its wear states"
            )


def _differing(
    entries: Mapping[str, "catalogue.Entry"],
) -> dict[str, dict[Column, Any]]:
    """Return torque, speed and every value in which the scenes differ."""
    scenes = {run_id: entry.values for run_id, entry in entries.items()}
    columns = {}
    for key in differing_keys(list(scenes.values()), ALWAYS):
        description = scene_key(
            key, any(isinstance(scene.get(key), str) for scene in scenes.values())
        )
        columns[key] = Column(
            key, description.unit, description.display_unit, given=True
        )
    return {
        run_id: {
            column: scene[key]
            for key, column in columns.items()
            if scene.get(key) is not None
        }
        for run_id, scene in scenes.items()
    }
