"""What a request leaves open is filled in, and what its runs cannot show is refused."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import xarray as xr

from wearlab.campaign import claims
from wearlab.figures import censoring, layout
from wearlab.figures.kind import FigureRequest, Kind, Run
from wearlab.figures.runs import (
    OF_WORN_OUT,
    Point,
    along_axes,
    axis_named,
    read_runs,
    require,
)
from wearlab.nearest import choices
from wearlab.schema import VARIABLES, origin_of

LIVES = ("life", "service_life")
"""Results of which a run that ended before its limit tells a lower bound."""


def with_defaults(
    request: FigureRequest, kind: Kind, grid: xr.Dataset
) -> tuple[FigureRequest, list[str]]:
    """Return the request with defaults for what it leaves open, and notes on them.

    Its note is filled with the campaign's numbers. Where one flank is enough, the first
    is chosen; a line of a result of each run gets an axis for x. A role for cases where
    there is but one, as in a file that drops the others, is left out, with a note.

    Parameters
    ----------
    request : what the figure asks for
    kind : of the figure
    grid : the campaign's dataset
    """
    if request.note:
        request = replace(request, note=claims.filled(request.note, grid))

    names = {role: getattr(request, role) for role in (*layout.ROLES, "x")}
    axes: Any = {role: axis_named(grid, name) for role, name in names.items() if name}
    request = replace(request, **axes)
    request = _with_flank(request, kind, grid)
    if kind.name == "line" and request.x is None and _is_one_value_a_run(request, grid):
        request = replace(request, x=_longest_axis(request, grid))

    of_cases = [role for role in layout.ROLES if getattr(request, role) == "case"]
    empty = [] if "case" in grid.dims else of_cases
    notes = [
        f"{role} = 'case' tells nothing apart here: there is one case."
        for role in empty
    ]
    return replace(request, **dict.fromkeys(empty)), notes  # type: ignore[arg-type]


def _with_flank(request: FigureRequest, kind: Kind, grid: xr.Dataset) -> FigureRequest:
    """Return the request for the first flank, where one is enough and none is named."""
    roles = (request.hue, request.rows, request.cols)
    is_named = "flank" in (*request.select, *roles)
    if not kind.one_flank or "flank" not in grid.coords or is_named:
        return request
    flank = str(grid["flank"].values[0])
    return replace(request, select={**request.select, "flank": flank})


def _is_one_value_a_run(request: FigureRequest, grid: xr.Dataset) -> bool:
    """Say whether a request names results, each one value for a run."""
    dims = set(grid.run_id.dims)
    return bool(request.y) and all(
        name in grid.variables and set(grid[name].dims) <= dims for name in request.y
    )


def _longest_axis(request: FigureRequest, grid: xr.Dataset) -> str | None:
    """Return the longest axis without a role, of numbers where there is one."""
    roles = (request.hue, request.rows, request.cols)
    dims = [str(dim) for dim in grid.run_id.dims]
    free = [dim for dim in dims if dim not in roles and grid.sizes[dim] > 1]
    sweeps = [dim for dim in free if grid[dim].dtype.kind in "fiu"]
    return max(sweeps or free, key=lambda dim: grid.sizes[dim], default=None)


class AbleRuns(NamedTuple):
    """The runs that have what a figure needs, and notes on lives that have it not."""

    runs: list[Run]
    notes: list[str]


def able_runs(
    grid: xr.Dataset, request: FigureRequest, kind: Kind, points: Sequence[Point]
) -> AbleRuns:
    """Return the picked runs that have what a figure needs.

    Of a kind that takes censored runs, those too whose lives ended before their limit;
    of others a note counts these.

    Parameters
    ----------
    grid : the campaign's dataset
    request : what the figure asks for
    kind : of the figure
    points : the runs that were picked

    Raises
    ------
    FigureError : a name that the runs do not have or that the kind cannot draw
    """
    if not (request.y or kind.needs):
        raise request.error(f"y names no variable; {_near('', grid.data_vars)}")
    fixed = _fixed_variables(kind)
    _check_ordinates(grid, request, kind, fixed)
    _check_abscissa(grid, request, kind)

    x = [request.x] if request.x else []
    names = [*kind.needs, *kind.also, *request.y, *x]
    if fixed or not request.y:
        needed = [*kind.needs, *request.y[:1]]
    else:
        coordinates = [name for name in kind.needs if name in grid.coords]
        needed = [*coordinates, *request.y[:1]]
    runs = read_runs(grid, points, names, request)
    able = require(runs, needed, request, _end_reasons(grid, points))

    y = request.y[:1] or (kind.y,)
    if kind.takes_censored and y[0] in LIVES:
        complete = {run.id for run in able}
        return AbleRuns([run for run in runs if run.end or run.id in complete], [])
    return AbleRuns(able, _lives_left_out(runs, able, needed))


def _lives_left_out(
    runs: Sequence[Run], able: Sequence[Run], needed: Sequence[str]
) -> list[str]:
    """Return how many lives are left out because they ended before their limit."""
    drawn = {run.id for run in able}
    ends = [run.end for run in runs if run.end and run.id not in drawn]
    if not ends or not OF_WORN_OUT.intersection(needed):
        return []
    reasons = censoring.listed_reasons(end.reason for end in ends)
    return [
        f"Not drawn: {len(ends)} of {len(runs)} runs that ended before their limit "
        f"({reasons}); the others alone look shorter-lived than all."
    ]


def _fixed_variables(kind: Kind) -> list[str]:
    """Return the variables of a kind that draws no others, [] of one that does."""
    if not kind.needs or kind.y or kind.titled:
        return []
    return [*kind.needs, *kind.also]


def _check_ordinates(
    grid: xr.Dataset, request: FigureRequest, kind: Kind, fixed: Sequence[str]
) -> None:
    """Refuse a y that is absent, no number, or nothing that the kind draws."""
    for name in request.y:
        if name not in grid.variables:
            remedy = _near(name, grid.data_vars)
            if name in VARIABLES:
                remedy = f"it takes {origin_of(name)[1]}"
            raise request.error(f"y = {name!r} is not there; {remedy}")
        if grid[name].dtype.kind not in "fiub":
            raise request.error(f"y = {name!r} holds text, not numbers")

    foreign = [name for name in request.y if fixed and name not in fixed]
    if foreign:
        raise request.error(
            f'y = {foreign[0]!r}: this kind draws {" and ".join(fixed)}; kind = "line" '
            "draws it"
        )

    if not request.y:
        return
    dims = set(grid[request.y[0]].dims)
    lacking = [choice for choice in kind.dims if not set(choice.split("|")) & dims]
    if lacking:
        raise request.error(
            f"y = {request.y[0]!r} does not run along {' and '.join(lacking)}, which "
            'this kind shows; kind = "line" draws it'
        )


def _check_abscissa(grid: xr.Dataset, request: FigureRequest, kind: Kind) -> None:
    """Refuse an x that is absent, or a sweep that the kind does not draw over."""
    if request.x in along_axes(grid) and not kind.over_sweeps:
        raise request.error(
            f'x = {request.x!r} is a sweep, which kind = "line" or "scatter" draws '
            "over; here it may be hue, rows or cols"
        )
    if request.x and request.x not in grid.variables and request.x not in grid.dims:
        remedy = _near(request.x, grid.coords)
        raise request.error(f"x = {request.x!r} is not there; {remedy}")


def _end_reasons(grid: xr.Dataset, points: Sequence[Point]) -> Counter[str]:
    """Return how many of the picked runs ended for which reason."""
    reasons: Counter[str] = Counter()
    if "end_reason" in grid.variables:
        ends = grid["end_reason"]
        reasons.update(str(ends.isel(point.place).values) for point in points)
    del reasons[""]
    return reasons


def _near(name: str, names: Iterable[object]) -> str:
    """Return the valid names, the nearest first."""
    return choices(name, sorted(map(str, names)))
