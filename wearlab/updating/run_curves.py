"""What one stored run says of every wear coefficient: h(N; f k0) = h(f N; k0).

Archard's law is linear in k, and under constant conditions nothing else knows how long
a cycle takes in wear: under static and under instant loads, with a film or a regression
whose k depends on the load, with loads of a duty mixed within each cycle. It ends where
something happens at a given cycle: stages of operation.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from wearlab import units
from wearlab.arrays import Array, Index
from wearlab.campaign.update_options import ALL_MEMBERS, THICKNESS, Limit
from wearlab.scene import Scene
from wearlab.store import Store, StoreError, reading
from wearlab.updating import calendar
from wearlab.updating.measurements import Observed, UpdateError

TINY = 1e-12
ROUNDING = 1e-6  # of a place across the face as messages write it [m]
FACE_POSITION = "face_position"
Names = Collection[str]
BITS = 60  # halvings to round-off
CLOSE = 1e-12  # of its range, by which a root may move last
OVERSHOOT = 3.0  # times the secants, up to which slopes make no cubic overshoot
LISTED = 8  # labels that a refusal lists
WHOLE = ("max_wear_depth", "worn_mass")  # quantities that are one number of a gear


def read_runs(
    store: Store, ids: Names, names: Names, once: Names = ()
) -> dict[str, xr.Dataset]:
    """Return the runs that have data, with those of the variables that they have.

    Every file is opened once, and compared with its hash when first read; the catalogue
    has dims and labels.

    Parameters
    ----------
    store, ids : the runs, in order
    names : of variables
    once : of variables that the first of them has besides

    Raises
    ------
    StoreError : a file is gone or was altered, or the catalogue does not describe it
    """
    archive = store.archive
    placed = {
        run.id: run
        for run in archive.heads(ids).values()
        if run.state == "done" and run.layout
    }
    layouts = archive.catalogue.layouts(str(run.layout) for run in placed.values())

    runs: dict[str, xr.Dataset] = {}
    coords: dict[Any, xr.Coordinates] = {}  # with indices, each made once
    for run_id in ids:
        if run_id not in placed:
            continue
        entry = placed[run_id]
        layout = layouts[str(entry.layout)]
        required = names if runs else {*names, *once}
        path = str(archive.file_of(run_id))
        variables = _variables(path, layout["variables"], required, entry.sha256)

        dims = frozenset(
            dim for of_variable, _ in variables.values() for dim in of_variable
        )
        key = (entry.layout, dims)
        if key not in coords:
            labels = layout["labels"]
            coords[key] = xr.Coordinates(
                {dim: labels[dim] for dim in labels if dim in dims}
            )
        runs[run_id] = xr.Dataset(variables, coords[key])
    return runs


def _variables(
    path: str, declared: Mapping[str, Any], required: Names, sha256: str | None
) -> dict[str, tuple[Any, Array]]:
    """Return dims and values of those required variables that a run's file has."""
    dims = {name: declared[name]["dims"] for name in required if name in declared}
    arrays = reading.read_variables(path, dims, sha256)
    for name, values in arrays.items():
        if values.ndim != len(dims[name]):
            raise StoreError(
                f"{path}: {name} is not as the catalogue says; 'wearlab reindex' mends "
                "it"
            )
    return {name: (dims[name], values) for name, values in arrays.items()}


@dataclass(frozen=True)
class RunCurve:
    """Quantities over the cycles of a run: cubic between states, straight beyond.

    Parameters
    ----------
    cycle : (states,) rising
    value, slope : (states, columns) and their derivative by the cycle
    """

    cycle: Array
    value: Array
    slope: Array

    def at(self, cycle: Array, column: Index | int = 0) -> Array:
        """Return values at cycles; the shapes are broadcast.

        Parameters
        ----------
        cycle : when
        column : of each cycle
        """
        last = self.cycle[-1]
        inside = np.clip(cycle, self.cycle[0], last)
        beyond = np.maximum(cycle - last, 0.0)
        if self.value.shape[1] == 1:
            return np.asarray(self._cubics(inside)[..., 0] + beyond * self.slope[-1, 0])

        pieces = np.searchsorted(self.cycle, inside, side="right") - 1
        i = np.clip(pieces, 0, len(self.cycle) - 2)
        values = np.polyval(self._cubics.c[:, i, column], inside - self.cycle[i])
        return np.asarray(values + beyond * self.slope[-1, column])

    @cached_property
    def _cubics(self) -> CubicHermiteSpline:
        """The cubics between the states."""
        return CubicHermiteSpline(self.cycle, self.value, self.slope)

    def first_above(self, level: Array) -> Array:
        """Return the cycles at which column 0 first reaches levels.

        Beyond the run it goes on with its last slope.

        Parameters
        ----------
        level : values of the quantity [SI]
        """
        level = np.asarray(level, float)
        highest = np.maximum.accumulate(self.value[:, 0])
        i = np.searchsorted(highest, level, side="left")
        low = np.clip(i, 1, len(highest) - 1) - 1
        piece = self._cubics.c[:, low, 0]
        length = np.diff(self.cycle)[low]

        def rising(x: Array) -> Array:
            return np.polyval(piece, x)

        within = invert_rising(rising, level, 0.0, length)
        rate = self.slope[-1, 0]
        ahead = np.full(level.shape, np.inf)
        if rate > 0.0:
            ahead = (level - self.value[-1, 0]) / rate
        beyond = np.where(i == 0, self.cycle[0], self.cycle[-1] + ahead)
        is_within = (i > 0) & (i < len(highest))
        return np.where(is_within, self.cycle[low] + within, beyond)


def invert_rising(
    rising: Callable[..., Array],
    targets: Array,
    low: Any,
    high: Any,
    close: float = CLOSE,
) -> Array:
    """Return where a rising function reaches values, by Ridders' method (1979).

    An end where it does not. It converges faster than linearly.

    Parameters
    ----------
    rising : the function, of an array
    targets : values that it is to reach
    low, high : between which it is looked for
    close : the last move over the range
    """
    left = np.broadcast_to(np.asarray(low, float), np.shape(targets))
    right = np.broadcast_to(np.asarray(high, float), np.shape(targets))
    short = rising(left) - targets
    over = rising(right) - targets
    estimate = np.full(left.shape, np.inf)
    tolerance = close * (right - left)
    for _ in range(BITS):
        middle = 0.5 * (left + right)
        off = rising(middle) - targets
        root = np.sqrt(np.maximum(off * off - short * over, 1e-300))
        previous = estimate
        estimate = np.clip(middle - (middle - left) * off / root, left, right)
        if np.all(np.abs(estimate - previous) <= tolerance):
            break
        for at, y in ((middle, off), (estimate, rising(estimate) - targets)):
            under = (y < 0.0) & (at > left)
            above = (y >= 0.0) & (at < right)
            left = np.where(under, at, left)
            short = np.where(under, y, short)
            right = np.where(above, at, right)
            over = np.where(above, y, over)
    return estimate


class ObservationPoints(NamedTuple):
    """What a block of observations asks of a run.

    Parameters
    ----------
    curve : what it is compared with
    column, cycle : (n,) of the curve and when, of each value
    clock : of a gear that was replaced, or of what weighs otherwise [that of the run]
    begin : cycle at which a gear that was replaced was new [the run's start]
    since : (n,) cycle from which each value counts, None where all count from `begin`
    """

    curve: RunCurve
    column: Index
    cycle: Array
    clock: "Clock | None" = None
    begin: float | None = None
    since: Array | None = None


class Course(NamedTuple):
    """How the wear rate drifts over the time inspected (`rate_drift`).

    Parameters
    ----------
    kind : power | change | running-in
    size : ln of the power, or of the ratio of rates
    place : share of the time inspected at which the rate changes
    """

    kind: str
    size: float
    place: float


class Clock(NamedTuple):
    """Cycles of equal wear at a constant coefficient and load over real cycles.

    Parameters
    ----------
    cycle, equal : (n,) real cycles and those of equal wear, straight between
    off : of a record, by what the ends of the interval of k differ in equal cycles
    """

    cycle: Array
    equal: Array
    off: float = 0.0  # of a record: between the ends of the interval of k

    def __call__(self, cycle: Array) -> Array:
        """Return how many cycles at the run's own coefficient and load wear as much.

        Parameters
        ----------
        cycle : real cycles
        """
        rate = (self.equal[-1] - self.equal[-2]) / (self.cycle[-1] - self.cycle[-2])
        return calendar.straight(
            np.maximum(cycle, self.cycle[0]), self.cycle, self.equal, rate
        )

    def at_pace(self, cycle: Array, equal: Array) -> Array:
        """Return cycles of equal wear where the rate drifts as on this clock, (n,).

        Parameters
        ----------
        cycle : (n+1,) real cycles, after the last inspection
        equal : (n+1,) cycles of equal wear then at a steady rate
        """
        pace = np.diff(self(cycle)) / np.diff(cycle)
        return np.asarray(equal[0] + np.cumsum(pace * np.diff(equal)))

    def inverse(self, equal: Array) -> Array:
        """Return the real cycles.

        Parameters
        ----------
        equal : cycles of equal wear
        """
        return Clock(self.equal, self.cycle)(equal)


class DoubtedSheet(NamedTuple):
    """A sheet with a scale of its own, and what it tells of ln f within a run.

    Parameters
    ----------
    blocks : numbers of its blocks
    alone : the posterior by this sheet alone
    run : place of the run in that
    """

    blocks: tuple[int, ...]
    alone: Any
    run: int


@dataclass(frozen=True)
class RunHistory:
    """A stored run as an update needs it.

    Parameters
    ----------
    id : of the run
    factor : the factor on the wear coefficient that it was made with
    coefficient : largest wear coefficient along the flank at its first state, at factor
        1 [m²/N]
    start, end : first and last stored cycle
    seconds_per_cycle : operating time of one cycle [s]
    points : what each block of observations compares with it
    limit : the quantity that ends the life
    level : of it at which it does [SI]
    limit_cycle : cycle of this run at which it does, ∞ never
    beside : what else is predicted over the cycles: max_wear_depth, worn_mass
    numerical : relative error of the depth anywhere along the flanks, as the run
        estimates it, and that of the largest depth and of masses, where the run tells
        the error of its life
    clock : where coefficient or load change in time: cycles of equal wear
    change : at which cycle the coefficient changed, the ratio of that after it to that
        before, and the width of the cycles that this one stands for
    draw : which draw it is of the unknowns that cost runs
    log_weight : ln of how much more often it was drawn than its prior has it
    new_at : cycle at which the gear that ends the life was new [start]
    course : of its wear where the rate drifts, None where it is steady
    doubted : the sheet that has a scale of its own, None where all are sound
    freedom : degrees of freedom of the Student-t law of independent errors, infinitely
        many of a normal law
    scatter : relative error of a value besides those that its file names
    """

    id: str
    factor: float
    coefficient: float
    start: float
    end: float
    seconds_per_cycle: float
    points: tuple[ObservationPoints, ...]
    limit: RunCurve
    level: float
    limit_cycle: float
    beside: Mapping[str, RunCurve]
    numerical: tuple[float, float]
    clock: Clock | None = None
    change: tuple[float, float, float] | None = None
    draw: int = 0
    log_weight: float = 0.0
    new_at: float | None = None
    course: Course | None = None
    doubted: DoubtedSheet | None = None
    freedom: float = np.inf
    scatter: float = 0.0

    @property
    def is_as_stated(self) -> bool:
        """Whether its rate is that of the scene, and errors are those of the files."""
        return self.course is None and not self.scatter

    @property
    def new_cycle(self) -> float:
        """The cycle at which the gear that ends the life was new."""
        return self.start if self.new_at is None else self.new_at

    def numerical_of(self, quantity: str) -> float:
        """Return the relative numerical error of a quantity.

        Parameters
        ----------
        quantity : one number of a gear, or a profile
        """
        return self.numerical[quantity in WHOLE]

    def begin(self, number: int) -> float:
        """Return the cycle from which a block's wear counts.

        Parameters
        ----------
        number : of the block
        """
        begin = self.points[number].begin
        return self.start if begin is None else begin

    def equal(self, cycle: Array, clock: Clock | None = None) -> Array:
        """Return the cycles from the start that wear as much at constant k and load.

        Parameters
        ----------
        cycle : real cycles
        clock : of a block whose gear has one of its own [that of the run]
        """
        clock = self.clock if clock is None else clock
        return (cycle if clock is None else clock(cycle)) - self.start

    def equivalent_cycle(
        self, cycle: Array, factor: Array, clock: Clock | None = None
    ) -> Array:
        """Return the cycle of this run at which wear is as with another factor.

        Parameters
        ----------
        cycle : when
        factor : on the wear coefficient
        clock : of a block whose gear has one of its own [that of the run]
        """
        return self.start + self.equal(cycle, clock) * (factor / self.factor)

    def real_cycle(self, run_cycle: Array, factor: Array) -> Array:
        """Return the cycle after which wear with a factor is as at a cycle of this run.

        Parameters
        ----------
        run_cycle : of this run
        factor : on the wear coefficient
        """
        with np.errstate(divide="ignore", over="ignore"):
            equal = self.start + (run_cycle - self.start) * (self.factor / factor)
        return np.asarray(equal if self.clock is None else self.clock.inverse(equal))

    def life(self, factor: Array) -> Array:
        """Return the cycles to the limit.

        Parameters
        ----------
        factor : on the wear coefficient
        """
        return self.real_cycle(np.asarray(self.limit_cycle), factor)


Runs = Sequence[RunHistory]


def refuse_stages(scene: Scene) -> None:
    """Refuse a scene in which something happens at a given cycle.

    Its wear is no function of k·N.

    Parameters
    ----------
    scene : of a run

    Raises
    ------
    UpdateError : it has stages of operation
    """
    if scene.operation is not None and scene.operation.stage:
        raise UpdateError(
            "operation.stage: stages begin at given cycles, so that the wear is no "
            "function of k·N and one run does not serve every k; update a campaign "
            "with operation.duty, mixed within each cycle"
        )


def history_of(
    run: xr.Dataset, scene: Scene, observations: Sequence[Observed], limit: Limit
) -> RunHistory:
    """Return what a stored run says over the cycles.

    Parameters
    ----------
    run : a stored run
    scene : that it is of
    observations : the observations that it is compared with
    limit : what ends the life

    Raises
    ------
    UpdateError : the run lacks a quantity, or what happens in it does not scale with k
    """
    refuse_stages(scene)
    if "cycle" not in run or run["cycle"].size < 2:
        raise UpdateError(
            "the stored run has one wear state: wear.until is required, and k > 0"
        )
    run = distinct(run)
    limit_curve = curve_of(run, limit.quantity, limit.where, {}, "update.limit")
    limit_cycle = float(limit_curve.first_above(np.array(limit.value)))
    factor = float(getattr(scene.wear and scene.wear.coefficient, "factor", 1.0))
    return RunHistory(
        id=str(scene.id),
        factor=factor,
        coefficient=_coefficient(run, scene, limit.where) / factor,
        start=float(limit_curve.cycle[0]),
        end=float(limit_curve.cycle[-1]),
        seconds_per_cycle=per_cycle(run, "operating_hours"),
        points=tuple(
            points_of(run, observed, limit, limit_curve) for observed in observations
        ),
        limit=limit_curve,
        level=limit.value,
        limit_cycle=limit_cycle,
        beside=_predicted_curves(run, limit, limit_curve),
        numerical=_numerical_errors(run, limit_cycle),
    )


def distinct(run: xr.Dataset) -> xr.Dataset:
    """Return a run with the states that count: of several at one cycle the first.

    Parameters
    ----------
    run : a stored run
    """
    cycle = run["cycle"].values
    keep = np.append(True, np.diff(cycle) > TINY * max(cycle[-1], 1.0))
    return run if keep.all() else run.isel(update=keep)


def cycles_of(run: xr.Dataset, observed: Observed) -> Array:
    """Return the cycles of a run at which a block was measured, (n,).

    Parameters
    ----------
    run : a stored run
    observed : the block
    """
    cycle = _on_the_run(run, observed, observed.time)
    start = float(run["cycle"].values[0])
    if len(cycle) and cycle.min() < start:
        row = observed.row[int(np.argmin(cycle))]
        raise UpdateError(
            f"{observed.data.file}: line {row}: is before the cycle at which the run "
            "starts"
        )
    return cycle


def since_of(run: xr.Dataset, observed: Observed) -> Array | None:
    """Return the cycles of a run from which values count, None where all of them do.

    Parameters
    ----------
    run : a stored run
    observed : the block
    """
    if observed.since is None:
        return None
    return _on_the_run(run, observed, observed.since)


def _on_the_run(run: xr.Dataset, observed: Observed, time: Array) -> Array:
    """Return the cycles of a run at times of a block."""
    start = float(run["cycle"].values[0])
    cycle = np.asarray(time, float)
    if observed.clock != "cycle":
        clock = "operating_hours" if observed.clock == "hours" else "mesh_cycles"
        cycle = start + cycle / per_cycle(run, clock)
    return cycle


def points_of(
    run: xr.Dataset, observed: Observed, limit: Limit, limit_curve: RunCurve | None
) -> ObservationPoints:
    """Return what a block of observations asks of a run.

    Parameters
    ----------
    run, observed : the run, the block
    limit, limit_curve : what ends the life, and its curve, where it is of this run
    """
    data = observed.data
    cycle = cycles_of(run, observed)
    if observed.place_kind is not None:
        places, column = np.unique(observed.place, return_inverse=True)
        curve = _profile(run, observed, places)
        return ObservationPoints(curve, column.astype(np.intp), cycle)

    column = np.zeros(len(observed), np.intp)
    same_place = (data.quantity, data.where) == (limit.quantity, limit.where)
    if limit_curve is not None and same_place and not data.select:
        curve = limit_curve
    else:
        curve = curve_of(run, data.quantity, data.where, data.select, data.place)
    return ObservationPoints(curve, column, cycle, since=since_of(run, observed))


def curve_of(
    run: xr.Dataset, name: str, where: str | None, select: dict[str, Any], place: str
) -> RunCurve:
    """Return a scalar over the cycles.

    Every dimension with several labels needs one.

    Parameters
    ----------
    run : a stored run
    name : of a variable
    where : flank or member
    select : labels of other dimensions
    place : of the campaign file, for refusals
    """
    if name not in run:
        raise UpdateError(
            f"{place}: the stored run has no {name}: ask for it in store.variables"
        )
    values = _selected(run[name], where, select, place)
    cycle = np.asarray(run["cycle"].values, float)
    y = np.asarray(values.values, float)
    if name == "max_wear_depth" and "wear_rate" in run and "wear_depth" in run:
        slope = _slope_without_overshoot(cycle, y, _rate_at_the_deepest(run, where))
    elif len(cycle) == 2:
        slope = np.full(2, (y[1] - y[0]) / (cycle[1] - cycle[0]))
    else:
        slope = np.asarray(PchipInterpolator(cycle, y).derivative()(cycle))
    return RunCurve(cycle, y[:, None], slope[:, None])


def _selected(
    values: xr.DataArray, where: str | None, select: dict[str, Any], place: str
) -> xr.DataArray:
    """Return a variable over the cycles alone, at its labels.

    Of all flanks it is the deepest.
    """
    name = str(values.name)
    labels = dict(select)
    where_dims = [dim for dim in ("flank", "member") if dim in values.dims]
    where_dim = where_dims[0] if where_dims else None
    if where_dim == "member" and where == ALL_MEMBERS:
        values = values.sum("member", keep_attrs=True)
        where_dim = None
    if where_dim is not None and where is not None:
        labels[where_dim] = where
    if where_dim == "flank" and "flank" not in labels and name == "max_wear_depth":
        values = values.max("flank")
    for dim in select:
        if dim not in values.dims:
            raise UpdateError(f"{place}.select.{dim}: {name} has no such dimension")

    for dim in [str(dim) for dim in values.dims if dim != "update"]:
        choices = values[dim].values.tolist()
        key = dim if dim in ("flank", "member") else f"select.{dim}"
        listed = ", ".join(map(str, choices[:LISTED]))
        if dim not in labels and len(choices) > 1:
            raise UpdateError(f"{place}.{key}: required for {name}: one of {listed}")
        if dim in labels and labels[dim] not in choices:
            raise UpdateError(f"{place}.{key}: {labels[dim]!r} is not one of {listed}")
        index = choices.index(labels[dim]) if dim in labels else 0
        values = values.isel({dim: index})
    return values


def _slope_without_overshoot(cycle: Array, y: Array, rate: Array) -> Array:
    """Return rates, limited by the secants so that no cubic piece overshoots."""
    secant = np.diff(y) / np.diff(cycle)
    after = np.append(secant, secant[-1])
    before = np.insert(secant, 0, secant[0])
    smallest = np.maximum(np.minimum(after, before), 0.0)
    return np.clip(rate, 0.0, OVERSHOOT * smallest)


def _rate_at_the_deepest(run: xr.Dataset, where: str | None) -> Array:
    """Return the wear rate where the wear is deepest.

    Of unworn flanks, where it is fastest.
    """
    flank_run = run if where is None else run.sel(flank=where)

    def by_state(name: str) -> Array:
        field = flank_run[name]
        return np.nan_to_num(field.values.reshape(len(field), -1))

    depth = by_state("wear_depth")
    rate = by_state("wear_rate")
    is_worn = depth.max(axis=1) > 0.0
    node = np.where(is_worn, depth.argmax(axis=1), rate.argmax(axis=1))
    return np.asarray(rate[np.arange(len(node)), node])


def _profile(run: xr.Dataset, observed: Observed, places: Array) -> RunCurve:
    """Return the wear at places on a flank over the cycles.

    Of a thickness, what the arc has lost.
    """
    data = observed.data
    kind = str(observed.place_kind)
    flanks = run["flank"].astype(str).values.tolist()
    if data.where not in flanks:
        raise UpdateError(
            f"{data.place}.flank: {data.where!r} is not one of {', '.join(flanks)}"
        )
    flank = run.isel(flank=flanks.index(data.where)).sortby(kind)
    flank = flank.isel(profile=np.isfinite(flank[kind].values))
    across = _across_the_face(run, observed)
    x = flank[kind].values
    outside = (observed.place < x[0] - TINY) | (observed.place > x[-1] + TINY)
    if outside.any():
        i = int(np.argmax(outside))
        raise UpdateError(
            f"{data.file}: line {observed.row[i]}, {kind} {observed.place[i]:g}: "
            f"outside the active flank, which goes from {x[0]:g} to {x[-1]:g} (SI)"
        )

    # along the arc: 1/cos of the pressure angle there, whose tan is the roll
    is_thickness = data.quantity == THICKNESS
    stretch = np.hypot(1.0, flank["roll_angle"].values) if is_thickness else None

    def at_places(name: str) -> Array:
        values = flank[name].values
        values = values if across is None else np.einsum("f,ufn->un", across, values)
        values = values if stretch is None else values * stretch
        return np.stack([np.interp(places, x, state) for state in values])

    cycle = np.asarray(run["cycle"].values, float)
    return RunCurve(cycle, at_places("wear_depth"), at_places("wear_rate"))


def _across_the_face(run: xr.Dataset, observed: Observed) -> Array | None:
    """Return the weight of each slice of a face where a profile was measured, (face,).

    None of gears without a face.

    Raises
    ------
    UpdateError : the place is not said, is no length, or lies beside the face
    """
    data = observed.data
    place = f"{data.place}.select.{FACE_POSITION}"
    stated = data.select.get(FACE_POSITION)
    if "face" not in run["wear_depth"].dims:
        if stated is not None:
            raise UpdateError(f"{place}: the gears have no face: leave it out")
        return None

    position = np.asarray(run[FACE_POSITION].values, float)
    low, high = float(position.min()), float(position.max())
    inside = f"from {1e3 * low:.4g} to {1e3 * high:.4g} mm"
    if stated is None:
        raise UpdateError(
            f"{place}: required: where across the face the profile was measured, "
            f'{inside}, such as select = {{ {FACE_POSITION} = "{1e3 * low:.4g} mm" }}'
        )
    try:
        at = units.quantity(str(stated), "length")
    except units.UnitError as error:
        raise UpdateError(f"{place}: {error}") from None
    if not low - ROUNDING <= at <= high + ROUNDING:
        raise UpdateError(f"{place}: {stated} lies beside the face, {inside}")
    slices = np.eye(len(position))
    order = np.argsort(position)
    columns = (np.interp(at, position[order], one[order]) for one in slices)
    return np.array(list(columns))


def gear(where: str) -> str:
    """Return the gear that a flank, or what is called by it, belongs to.

    Parameters
    ----------
    where : such as planet-sun
    """
    return where.split("-")[0]


def per_cycle(run: xr.Dataset, clock: str) -> float:
    """Return how much of a clock one cycle takes.

    Conditions are constant, so any span tells.

    Parameters
    ----------
    run : a stored run
    clock : one of its variables, such as operating_hours
    """
    if clock not in run:
        return np.nan
    cycle = run["cycle"].values
    reading = run[clock].values
    return float((reading[-1] - reading[0]) / (cycle[-1] - cycle[0]))


def _predicted_curves(
    run: xr.Dataset, limit: Limit, limit_curve: RunCurve
) -> dict[str, RunCurve]:
    """Return depth and mass of the gear that ends the life, where the run has them."""
    member = limit.where and gear(limit.where)
    flank = limit.where if limit.quantity == "max_wear_depth" else member
    curves: dict[str, RunCurve] = {}
    for name, dim, where in (
        ("max_wear_depth", "flank", flank),
        ("worn_mass", "member", member),
    ):
        if name == limit.quantity and where == limit.where:
            curves[name] = limit_curve
        elif name in run and (where is None or where in run.get(dim, ())):
            with suppress(UpdateError):
                curves[name] = curve_of(run, name, where, {}, "")
    return curves


def _coefficient(run: xr.Dataset, scene: Scene, where: str | None) -> float:
    """Return the largest wear coefficient along the flank at the first state [m²/N].

    Of a run that does not store it, that of the scene where it is constant, else NaN.
    """
    if "effective_wear_coefficient" not in run:
        stated = scene.wear and scene.wear.coefficient
        constant = float(getattr(stated, "value", None) or np.nan)
        return constant * float(getattr(stated, "factor", 1.0))
    values = run["effective_wear_coefficient"].isel(update=0)
    member = where and gear(where)
    of_member = [gear(str(flank)) == member for flank in values["flank"].values]
    if any(of_member):
        values = values.isel(flank=of_member)
    return float(values.max())


def _numerical_errors(run: xr.Dataset, limit_cycle: float) -> tuple[float, float]:
    """Return the relative error of the depth anywhere, and that of whole quantities.

    Whole are the largest depth and masses; their error is that of the run's life, where
    it tells one.
    """
    anywhere = _depth_error(run, limit_cycle)
    if "life" not in run or "error_estimate_life" not in run:
        return anywhere, anywhere
    whole = float(run["error_estimate_life"]) / float(run["life"])
    return anywhere, whole if np.isfinite(whole) else anywhere


def _depth_error(run: xr.Dataset, limit_cycle: float) -> float:
    """Return the largest relative error of the depth until the limit, else 0."""
    if "error_estimate_wear_depth" not in run or "max_wear_depth" not in run:
        return 0.0
    cycle = run["cycle"].values
    depth = run["max_wear_depth"].max("flank").values
    error = run["error_estimate_wear_depth"].values
    last = max(limit_cycle, cycle[1]) * (1.0 + 1e-9)
    until_limit = cycle <= last
    late = until_limit & (depth > 0.05 * depth[until_limit][-1])
    ratio = error[late] / depth[late]
    return float(np.nanmax(ratio)) if np.isfinite(ratio).any() else 0.0
