"""Features for statistics and learning: one row for each wear state of each run, one column for each number.

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
    from wearlab.store.store import Store

ORDERS = 5
STILL = 1e-12  # of the mean: what moves less does not move
UNITLESS = ("crest_factor", "kurtosis")
"""Indicators of shape; all others have the unit of the signal."""


def indicators(signal: Array) -> dict[str, Array]:
    """Return indicators of periodic signals and their amplitudes at the first mesh orders.

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
    held = np.isfinite(signal).all(axis=-1, keepdims=True)
    reached = held.sum(axis=(-2, -1))
    periods = np.where(reached > 0, reached, np.nan)
    count = periods * signal.shape[-1]
    kept = np.where(held, signal, 0.0)
    mean = kept.sum(axis=(-2, -1)) / count
    moving = np.where(held, signal - mean[..., None, None], 0.0)
    rms = np.sqrt((moving**2).sum(axis=(-2, -1)) / count)
    shaped = np.where(rms > STILL * np.maximum(np.abs(mean), 1e-300), rms, np.nan)
    highest = np.max(signal, axis=(-2, -1), where=held, initial=-np.inf)
    lowest = np.min(signal, axis=(-2, -1), where=held, initial=np.inf)
    one_period = kept.sum(axis=-2) / periods[..., None]
    amplitudes = (
        2.0 * np.abs(np.fft.rfft(one_period)[..., 1 : ORDERS + 1]) / signal.shape[-1]
    )
    told = {"mean": mean, "rms": rms}
    told["peak_to_peak"] = np.where(np.isfinite(periods), highest - lowest, np.nan)
    told["crest_factor"] = np.abs(moving).max(axis=(-2, -1), initial=0.0) / shaped
    told["kurtosis"] = (moving**4).sum(axis=(-2, -1)) / count / shaped**4
    return told | {
        f"order_{k}": amplitudes[..., k - 1] for k in range(1, amplitudes.shape[-1] + 1)
    }


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


class _Alike:
    """Runs that are alike: which of their variables become columns, and how.

    Parameters
    ----------
    layout, sizes : their variables with labels along dimensions, and lengths of
        dimensions
    wanted : names [every number]
    """

    def __init__(
        self,
        layout: dict[str, Any],
        sizes: dict[str, int],
        wanted: Sequence[str] | None,
    ) -> None:
        self.variables = layout["variables"]
        self.labels = layout["labels"]
        self.states = sizes.get(STATE, 1)
        self.names = [
            name
            for name, told in self.variables.items()
            if _has_columns(name, told, wanted)
        ]

    def rows(
        self, run: "catalogue.Entry", path: str, inputs: Mapping[Column, Any]
    ) -> Values:
        """Return the values of each column of one run, one a wear state, None for what is not finite."""
        times = [
            time
            for time in TIMES
            if self.variables.get(time.name, {}).get("dims") == [STATE]
        ]
        stored = reading.read_variables(
            path, [*(time.name for time in times), *self.names], run.sha256
        )
        block: Values = {RUN: [run.id] * self.states, NUMBER: list(range(self.states))}
        block |= {time: _plain(stored[time.name]) for time in times}
        block |= {column: [value] * self.states for column, value in inputs.items()}
        for name in self.names:
            block |= {
                column: _plain(values)
                for column, values in self.columns(name, stored[name]).items()
            }
        return block

    def columns(self, name: str, stored: NDArray[Any]) -> dict[Column, Array]:
        """Return each column's numbers, one a wear state.

        What knows no wear states is the same at each.
        """
        dims = self.variables[name]["dims"]
        attributes = self.variables[name]["attrs"]
        lengths = dict(zip(dims, stored.shape, strict=True))
        own = [dim for dim in dims if dim in NAMED]
        order = [dims.index(dim) for dim in (STATE, *own, *ALONG) if dim in dims]
        signal = [lengths[dim] for dim in ALONG if dim in lengths]
        shape = (lengths.get(STATE, 1), -1, *(1,) * (len(ALONG) - len(signal)), *signal)
        values = np.asarray(stored, float).transpose(order).reshape(shape)
        told = indicators(values) if signal else {"": values[..., 0, 0]}
        known = ("rms", "order_") if name in HARMONICS else ()
        places = product(
            *(self.labels.get(dim) or range(1, lengths[dim] + 1) for dim in own)
        )
        units = [str(attributes.get(key, "")) for key in ("units", "display_units")]
        made = {}
        for (place, labels), (what, column) in product(enumerate(places), told.items()):
            if not what.startswith(known):
                head = ".".join([f"{name}_{what}" if what else name, *map(str, labels)])
                of = Column(head, *(("1", "1") if what in UNITLESS else units))
                made[of] = np.broadcast_to(column[:, place], self.states)
        return made


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
    store: "Store", where: str = "", variables: Sequence[str] | None = None
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
            f"{'that is finished meets the condition' if where else 'is done'}"
        )
    inputs = _differing(finished)
    layouts = store.archive.catalogue.layouts(
        run.layout for run in finished.values() if run.layout
    )
    groups = {
        run.form: _Alike(layouts[run.layout or ""], run.sizes, variables)
        for run in finished.values()
    }
    blocks = [
        groups[e.form].rows(e, str(store.archive.files.path(e.id)), inputs[e.id])
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
    """Return torque, speed and every value of the scenes that is not the same in all of them."""
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
