"""Measured flanks as points over curves along the flank.

A machine tells a place by its length of roll, a figure by what its axis shows. Between
them stand the coordinates that runs store: the base radius is ``d/(2√(1 + φ²))`` of a
diameter ``d`` and its roll angle ``φ``, and the length of roll is ``r_b φ``.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import xarray as xr

from wearlab import tables
from wearlab.arrays import Array
from wearlab.figures.kind import FigureError, FigureRequest, Points
from wearlab.figures.places_of_points import PRODUCT, CurvesOfFigure
from wearlab.figures.plot import Series
from wearlab.figures.wording import Label, converted
from wearlab.tables.flank_zero import zero_line
from wearlab.tables.measured_flank import ABSCISSAE, MeasuredFlank, measured_flank_of

PATH = "path_position"
DEPTH = "wear_depth"
DEVIATION = "flank_deviation"
STORED = ("diameter", "roll_angle", PATH)


class StoredFlank(NamedTuple):
    """Where the nodes of a flank lie.

    Parameters
    ----------
    base_radius : of the gear [m]
    roll_length, path_position : of the nodes, (n,) [m]
    removed : by modifications at the nodes, (n,) [m]; None where that is not stored
    is_leading : whether the length of roll grows along the path
    """

    base_radius: float
    roll_length: Array
    path_position: Array
    removed: Array | None
    is_leading: bool

    def roll_lengths(self, along: str, place: Array) -> Array:
        """Return the lengths of roll at places on the flank, (m,) [m].

        Parameters
        ----------
        along : what tells the places, a key of `ABSCISSAE`
        place : (m,) [SI]

        Raises
        ------
        ValueError : a diameter lies below the base circle
        """
        if along == "roll_length":
            return place
        if along == "roll_angle":
            return self.base_radius * place
        if along == PATH:
            line = np.polyfit(self.path_position, self.roll_length, 1)
            return np.asarray(np.polyval(line, place))

        square = (0.5 * place) ** 2 - self.base_radius**2
        if square.min() < 0.0:
            raise ValueError(
                f"a diameter of {1e3 * place.min():.6g} mm lies below the base circle, "
                f"{2e3 * self.base_radius:.6g} mm: leave out points off the involute"
            )
        return np.sqrt(square)

    def places(self, along: str, roll_length: Array) -> Array:
        """Return where lengths of roll lie on an axis of a figure, (m,) [SI].

        Parameters
        ----------
        along : what the axis shows, one of `STORED`
        roll_length : (m,) [m]
        """
        if along == "roll_angle":
            return roll_length / self.base_radius
        if along == "diameter":
            return 2.0 * np.hypot(self.base_radius, roll_length)
        line = np.polyfit(self.roll_length, self.path_position, 1)
        return np.asarray(np.polyval(line, roll_length))


def flank_points(
    points: Points, curves: CurvesOfFigure, quantity: str, request: FigureRequest
) -> Series:
    """Return a measured flank as points over the curves of its flank.

    Parameters
    ----------
    points : of the flank, ``zero`` among them
    curves : that the points are drawn over
    quantity : that these show
    request : the figure, for messages and its ``x``

    Raises
    ------
    FigureError : the file cannot be read, tells another quantity than the curves or
        another flank, or has no place among the panels
    """
    along = request.x or PATH
    if quantity not in (DEPTH, DEVIATION) or along not in STORED:
        raise request.error(
            f"published: {points.name} is a measured flank: it stands over {DEPTH} or "
            f"{DEVIATION} along {', '.join(STORED)}, in kind = 'wear-profile'"
        )
    try:
        content = points.text.encode()
        table = tables.table_of(
            points.name, content, decimal=points.decimal(request.decimal)
        )
        measured = measured_flank_of(table, {})
    except tables.TableError as error:
        raise request.error(f"published: {error}") from None
    if measured.across is not None or measured.x not in ABSCISSAE:
        raise request.error(
            f"published: {points.name} was measured over the face: a map takes it, "
            "kind = 'wear-map'"
        )

    curve = _curve_of(points, curves, request)
    _refuse_further_panels(curves, request)
    assert curve.runs is not None
    run_id = str(curve.runs[0])
    flank = stored_flank(curves.grid, run_id, str(curve.key["flank"].value))
    try:
        roll_length = flank.roll_lengths(measured.x, np.array(measured.abscissa))
        value = values_of(measured, roll_length, flank, points.zero, quantity)
    except (FigureError, ValueError) as error:
        raise request.error(f"published: {points.name}: {error}") from None

    x = flank.places(along, roll_length)
    return Series(
        key={"flank": curve.key["flank"]},
        x=converted(x, ABSCISSAE[along], curve.x_scale.units),
        y=converted(value, "m", curve.y_scale.units),
        x_scale=curve.x_scale,
        y_scale=curve.y_scale,
        style="published",
        text="measured",
    )


def _curve_of(points: Points, curves: CurvesOfFigure, request: FigureRequest) -> Series:
    """Return the first curve of the flank that was measured."""
    labels: Mapping[str, Label] = {
        str(label.value): label for label in curves.labels("flank")
    }
    flank = points.flank or (next(iter(labels)) if len(labels) == 1 else "")
    if flank not in labels:
        asked = f"there is no flank {flank!r} here" if flank else "which flank is it?"
        raise request.error(
            f"published: {points.name}: {asked} Write published = {{ file = …, flank = "
            f"'{next(iter(labels), 'pinion')}' }}, of {', '.join(labels)}"
        )
    of_flank = (
        curve
        for curve in curves.series
        if curve.key.get("flank") == labels[flank] and curve.runs is not None
    )
    curve = next(of_flank, None)
    if curve is None:
        raise request.error(
            f"published: {points.name}: bands of many runs stand here, and a measured "
            "flank lies on the gears of one: choose a run in select"
        )
    return curve


def _refuse_further_panels(curves: CurvesOfFigure, request: FigureRequest) -> None:
    """Refuse a measurement that would stand in several panels of its flank."""
    panels = [curves.roles[role] for role in ("cols", "rows") if role in curves.roles]
    for dim in (part for name in panels for part in name.split(PRODUCT)):
        if dim == "flank":
            continue
        raise request.error(
            f"published: a panel for each {dim.replace('_', ' ')} stands here, and a "
            f"measured flank belongs to one: choose it in select.{dim}"
        )


def stored_flank(grid: xr.Dataset, run_id: str, flank: str) -> StoredFlank:
    """Return where the nodes of a run's flank lie.

    Parameters
    ----------
    grid : the campaign's dataset
    run_id : the run
    flank : its name
    """
    at = np.argwhere(np.asarray(grid.run_id.values == run_id))[0]
    place = dict(zip(grid.run_id.dims, at.tolist(), strict=True))
    names = [name for name in (*STORED, DEPTH, DEVIATION) if name in grid.variables]
    data = grid[names].isel(place, missing_dims="ignore").sel(flank=flank)
    data = data.isel(update=0, missing_dims="ignore").load(scheduler="synchronous")

    inside = np.isfinite(data[PATH].values)
    data = data.isel(profile=inside)
    angle = data["roll_angle"].values
    radii = 0.5 * data["diameter"].values / np.hypot(1.0, angle)
    base_radius = float(np.median(radii))

    removed = None
    if {DEPTH, DEVIATION} <= {*names} and "face" not in data[DEVIATION].dims:
        removed = -data[DEVIATION].values - data[DEPTH].values
    flanks = list(map(str, grid["flank"].values))
    return StoredFlank(
        base_radius=base_radius,
        roll_length=base_radius * angle,
        path_position=data[PATH].values,
        removed=removed,
        is_leading=flanks.index(flank) % 2 == 0,
    )


def values_of(
    measured: MeasuredFlank,
    roll_length: Array,
    flank: StoredFlank,
    zero: str,
    quantity: str,
) -> Array:
    """Return depths or deviations of a measured flank at its points, (m,) [m].

    Parameters
    ----------
    measured : the flank
    roll_length : of its points, (m,) [m]
    flank : where the nodes lie, and what modifications took off there
    zero : what counts as unworn, as of ``wear.initial``
    quantity : ``wear_depth`` or ``flank_deviation``

    Raises
    ------
    FigureError : depths and deviations differ by modifications that are not stored
    """
    value = np.array(measured.ordinate)
    own_quantity = DEPTH if measured.y == "depth" else DEVIATION
    if quantity == own_quantity and zero == "as-measured":
        return value
    if flank.removed is None:
        raise FigureError(
            "it tells deviations or needs a zero, and the modifications of gears with "
            f"a face vary over it: draw y = '{DEVIATION}' with zero = 'as-measured', "
            "or give depths"
        )

    order = np.argsort(flank.roll_length, kind="stable")
    removed = np.interp(roll_length, flank.roll_length[order], flank.removed[order])
    depth = value if measured.y == "depth" else -value - removed
    depth = depth - _zero(depth, roll_length, flank, zero)
    return depth if quantity == DEPTH else -depth - removed


def _zero(depth: Array, roll_length: Array, flank: StoredFlank, zero: str) -> Array:
    """Return the depth that counts as unworn at measured points, (m,) [m]."""
    from scipy.interpolate import PchipInterpolator

    where = flank.places(PATH, roll_length)
    rising, at = np.unique(where, return_index=True)
    path = np.sort(flank.path_position)
    inside = np.clip(path, rising[0], rising[-1])
    at_nodes = PchipInterpolator(rising, depth[at])(inside)
    line = zero_line(zero, 0 if flank.is_leading else 1, path, at_nodes)
    ends = np.broadcast_to(line, path.shape)[[0, -1]]
    slope = (ends[1] - ends[0]) / (path[-1] - path[0])
    return np.asarray(ends[0] + slope * (where - path[0]))
