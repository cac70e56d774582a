"""Every figure of a campaign drawn from the store, one for a program, one again by what its file says."""

import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr
from pydantic import ValidationError

from wearlab.campaign import claims
from wearlab.campaign.campaign import FigureSpec
from wearlab.figures import curves, doubt, kinds, layout, wording
from wearlab.figures.kind import (
    FigureError,
    FigureRequest,
    Kind,
    Run,
    is_of_update,
    no_kind,
    read,
)
from wearlab.figures.kinds import cycles, update
from wearlab.figures.plot import BESIDE, Plot, Series, apart_from, grouped, narrow
from wearlab.figures.published import published
from wearlab.figures.question import Question, asked_by, embedded, question, texts
from wearlab.figures.runs import (
    BASE,
    Point,
    along_axes,
    axis_named,
    pick,
    read_runs,
    require,
)
from wearlab.nearest import choices
from wearlab.schema import VARIABLES, origin_of
from wearlab.sources import SHORT_ID, is_other_code
from wearlab.store.files import StoreError, write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from wearlab.campaign import Campaign
    from wearlab.store import Store


FORMATS = ("png", "svg", "pdf")


def draw(
    campaign: "Campaign", store: "Store", out: Path, ending: str = "png"
) -> list[Path]:
    """Draw one file for every ``[[figure]]`` of a campaign, named by its number and kind.

    Parameters
    ----------
    campaign : its figures, and the runs to draw
    store : where the runs are; nothing is computed
    out : folder of the figures, made when absent
    ending : png, svg or pdf

    Returns
    -------
    The files, in the order of the campaign file. The same store gives the same bytes.

    Raises
    ------
    FigureError
        When some cannot be drawn: one line each; the others are drawn all the same
        (``error.drawn``).
    StoreError
        When there is no store.
    """
    check_format(ending)
    grid = store.open(campaign)

    def written(asked: Question) -> Path:
        write_whole(
            path := out / f"{asked.name}.{ending}",
            file_of(asked, grid, store, ending)[0],
        )
        return path

    told = list(each_figure(campaign, written))
    drawn = [path for _, path, _ in told if path]
    if len(drawn) < len(told):
        raise FigureError(
            "\n".join(problem for *_, problem in told if problem), tuple(drawn)
        )
    return drawn


def each_figure(
    campaign: "Campaign", make: Callable[[Question], Any]
) -> Iterator[tuple[Any, Any, str]]:
    """Yield each ``[[figure]]`` of a campaign with what is made of it, or with why it cannot be drawn."""
    for number, spec in enumerate(campaign.figures, 1):
        made, problem = None, ""
        try:
            made = make(question(campaign, spec, number))
        except (FigureError, StoreError) as error:
            problem = str(error)
        except Exception as error:  # a fault of ours in one figure stops no other
            problem = fault_message(f"figure {number} ({spec.kind})", error)
        yield spec, made, problem


def fault_message(name: str, error: Exception) -> str:
    """Return what to say of a figure that fails by a fault of ours: which, what, and where."""
    frames = traceback.extract_tb(error.__traceback__)
    where = (
        f" in {Path(frames[-1].filename).name}, line {frames[-1].lineno}"
        if frames
        else ""
    )
    said = (
        f"{name}: a fault of wearlab, not of the file: {type(error).__name__}: "
        f"{error}{where}"
    )
    return (
        f"{said}; the other figures are drawn; please report this line with the "
        "campaign"
    )


def check_format(ending: str) -> None:
    """Refuse a format that figures are not written in.

    Raises
    ------
    FigureError : no such format
    """
    if ending not in FORMATS:
        raise FigureError(f"format {ending!r}: {choices(ending, FORMATS)}")


def both_widths(
    asked: Question, grid: xr.Dataset, store: "Store"
) -> tuple[bytes, bytes | None]:
    """Return the picture of a figure on a page, and one for small screens where the first would be too broad.

    A figure of one column is drawn once: it fits both.

    Raises
    ------
    FigureError : it cannot be drawn
    """
    from wearlab.figures.render import lightened, rendered

    plot, _, _ = plot_of(asked, grid, store)
    small = lightened(rendered(narrow(plot), {})) if plot.columns > 1 else None
    return lightened(rendered(plot, {})), small


def file_of(
    asked: Question, grid: xr.Dataset, store: "Store", ending: str
) -> tuple[bytes, tuple[str, ...]]:
    """Return the file of a figure, and the names of the runs that are missing.

    Parameters
    ----------
    asked : the question
    grid : the campaign as the store has it
    store : of the grid, for what it knows of the runs
    ending : png, svg or pdf

    Raises
    ------
    FigureError : it cannot be drawn
    """
    from wearlab.figures.render import rendered

    plot, runs, missing = plot_of(asked, grid, store)
    return rendered(
        plot,
        texts(asked, store.archive.entries(run.id for run in runs), missing),
        ending,
    ), missing


def plot_of(
    asked: Question, grid: xr.Dataset, store: "Store"
) -> tuple[Plot, list[Run], tuple[str, ...]]:
    """Return a figure of runs or of the kept update as data, the runs it shows, the names of those missing.

    Raises
    ------
    FigureError : it cannot be drawn
    """
    request = asked.request
    return (
        (of_update(asked.subject, store, request), [], ())
        if is_of_update(request.kind)
        else plotted(grid, request)
    )


def of_update(subject: str, store: "Store", request: FigureRequest) -> Plot:
    """Return a figure of a kept update as data, by the identity of what it is of.

    Raises
    ------
    FigureError : no update that shows it is kept
    """
    kind = kinds.KINDS[request.kind]
    cases = update.updated_cases(subject, store, request, kind.needs)
    series = [
        curve for case in cases for curve in kind.curves(case, request) if len(curve.x)
    ]
    if not series:
        raise request.error("the update has nothing to show of it")
    return layout.compose(
        series, request, kind, {"case": ""}, [request.note] if request.note else []
    )


def plotted(
    grid: xr.Dataset, request: FigureRequest
) -> tuple[Plot, list[Run], tuple[str, ...]]:
    """Return a figure as data, the runs it shows, and the names of those that are missing.

    Raises
    ------
    FigureError : it cannot be drawn
    """
    if request.kind not in kinds.KINDS:
        raise request.error(no_kind(request.kind))
    kind = kinds.KINDS[request.kind]
    request = (
        replace(request, note=claims.filled(request.note, grid))
        if request.note
        else request
    )
    request, one_case = _with_defaults(request, kind, grid)
    points, missing = pick(grid, request, all_cases=kind.all_cases)
    runs = _able(grid, request, kind, points)
    series = [_told(curve, run) for run in runs for curve in kind.curves(run, request)]
    series = [curve for curve in series if len(curve.x)] or series
    if not series:
        raise request.error(
            f"no selected run has {' or '.join(request.y or kind.also or kind.needs)}"
        )
    dims = {str(dim): str(grid[dim].attrs.get("key", "")) for dim in grid.run_id.dims}
    notes = [*one_case, *_left_out(runs, series), *_cases_left_out(grid, request, kind)]
    series, alike = curves.drawn_once(series, request)
    notes += [*alike, *dict.fromkeys(curve.caveat for curve in series if curve.caveat)]
    if kind.over_sweeps and kind.joined is None and request.x in along_axes(grid):
        series = cycles.joined(
            curves.states_in_common(series, dims), str(grid[request.x].dims[0])
        )
    if kind.joined is not None:
        try:
            series = kind.joined(series)
        except FigureError as error:
            raise request.error(error) from error
    else:
        series, drawn, rare = _sampled(grid, request, series)
        series, said = curves.of_samples(
            series, drawn, curves.ended_of((*request.y, kind.y)[0])
        )
        notes += rare + said
    uncertain = doubt.note(
        runs, request.y or ([kind.y] if kind.y else [*kind.needs, *kind.also]), series
    )
    absent = f"Not drawn: {'; '.join(missing)}." if missing else ""
    notes = list(filter(None, [request.note, absent, *notes, uncertain]))
    if request.published is not None and all(
        "source" not in curve.key for curve in series
    ):
        hue = layout.laid_out(series, request, kind, dims).roles.get("hue")
        series += published(request.published, series, hue, request)
    return layout.compose(series, request, kind, dims, notes), runs, tuple(missing)


def _told(curve: Series, run: Run) -> Series:
    """Return a curve that knows its run, and whether that is in doubt."""
    if curve.style in (*BESIDE, "area"):
        return curve
    doubtful = np.ones(len(curve.x), bool) if run.doubts else None
    return replace(curve, runs=np.full(len(curve.x), run.id), doubtful=doubtful)


def _sampled(
    grid: xr.Dataset, request: FigureRequest, series: list[Series]
) -> tuple[list[Series], list[str], list[str]]:
    """Return series, the sampled axes along which they become bands (those no role names), and notes."""
    told = {request.hue, request.rows, request.cols, request.x}
    axes = [axis for axis in curves.sampled_axes(grid) if axis not in told]
    varied = [axis for axis in axes if any(axis in curve.key for curve in series)]
    if not varied:
        return series, [], []
    dims = list(map(str, grid.run_id.dims))
    kept, said = curves.states_of_most(curves.states_in_common(series, dims), dims)
    return kept, varied, said


def _left_out(runs: Sequence[Run], series: Sequence[Series]) -> list[str]:
    """Say how many wear states and speeds are not drawn though nobody chose."""
    notes = []
    over = {"update": "wear states are drawn, spread over the life"}
    for dim, words in {
        **over,
        "response_speed": "speeds are drawn, spread over all",
    }.items():
        groups = grouped(
            [curve for curve in series if dim in curve.key], apart_from(dim)
        ).values()
        drawn = max(
            (len({curve.key[dim] for curve in group}) for group in groups), default=0
        )
        most = max(run.data.sizes.get(dim, 1) for run in runs)
        if 0 < drawn < most:
            notes.append(f"{drawn} of {most} {words}; select.{dim} names others.")
    return notes


def _cases_left_out(grid: xr.Dataset, request: FigureRequest, kind: Kind) -> list[str]:
    """Name the cases that are not drawn though nobody chose."""
    cases = list(map(str, grid["case"].values)) if "case" in grid.dims else []
    others = [case for case in cases if case != BASE]
    told = kind.all_cases or "case" in (
        *request.select,
        request.hue,
        request.rows,
        request.cols,
        request.x,
    )
    if told or BASE not in cases or not others:
        return []
    return [
        "The base alone; further cases, for select.case or hue: "
        f"{wording.first_of(others, 8)}."
    ]


def _with_defaults(
    request: FigureRequest, kind: Kind, grid: xr.Dataset
) -> tuple[FigureRequest, list[str]]:
    """Return the request with what it leaves to its kind: the first flank where one is enough, an axis for x.

    A role for cases where there is but one, as in a file that drops the others, is left
    out, with a note.
    """
    named = {role: getattr(request, role) for role in (*layout.ROLES, "x")}
    meant: Any = {role: axis_named(grid, name) for role, name in named.items() if name}
    request = replace(request, **meant)
    roles = (request.hue, request.rows, request.cols)
    if (
        kind.one_flank
        and "flank" in grid.coords
        and "flank" not in (*request.select, *roles)
    ):
        request = replace(
            request, select={**request.select, "flank": str(grid["flank"].values[0])}
        )
    dims = set(grid.run_id.dims)
    single = all(
        name in grid.variables and set(grid[name].dims) <= dims for name in request.y
    )
    if kind.name == "line" and request.x is None and request.y and single:
        free = [
            str(d) for d in grid.run_id.dims if d not in roles and grid.sizes[d] > 1
        ]
        sweeps = [dim for dim in free if grid[dim].dtype.kind in "fiu"]
        request = replace(
            request,
            x=max(sweeps or free, key=lambda dim: grid.sizes[dim], default=None),
        )
    alone = [
        role
        for role in layout.ROLES
        if getattr(request, role) == "case" and "case" not in grid.dims
    ]
    said = [
        f"{role} = 'case' tells nothing apart here: there is one case."
        for role in alone
    ]
    return replace(request, **dict.fromkeys(alone)), said  # type: ignore[arg-type]


def _able(
    grid: xr.Dataset, request: FigureRequest, kind: Kind, points: Sequence[Point]
) -> list[Run]:
    names = [*kind.needs, *kind.also, *request.y, *([request.x] if request.x else [])]
    if not (request.y or kind.needs):
        raise request.error(f"y names no variable; {_near('', grid.data_vars)}")
    for name in request.y:
        if name not in grid.variables:
            takes = (
                f"it takes {origin_of(name)[1]}"
                if name in VARIABLES
                else _near(name, grid.data_vars)
            )
            raise request.error(f"y = {name!r} is not there; {takes}")
        if grid[name].dtype.kind not in "fiub":
            raise request.error(f"y = {name!r} holds text, not numbers")
    own = (
        [*kind.needs, *kind.also] if kind.needs and not (kind.y or kind.titled) else []
    )
    if other := [name for name in request.y if own and name not in own]:
        raise request.error(
            f'y = {other[0]!r}: this kind draws {" and ".join(own)}; kind = "line" '
            "draws it"
        )
    lacking = [
        d
        for d in kind.dims
        if request.y and not set(d.split("|")) & set(grid[request.y[0]].dims)
    ]
    if lacking:
        said = (
            f"y = {request.y[0]!r} does not run along {' and '.join(lacking)}, which this "
            "kind shows"
        )
        raise request.error(f'{said}; kind = "line" draws it')
    if request.x in along_axes(grid) and not kind.over_sweeps:
        said = (
            f'x = {request.x!r} is a sweep, which kind = "line" or "scatter" draws over'
        )
        raise request.error(f"{said}; here it may be hue, rows or cols")
    needed = [
        *(
            kind.needs
            if own or not request.y
            else [n for n in kind.needs if n in grid.coords]
        ),
        *request.y[:1],
    ]
    if request.x and request.x not in grid.variables and request.x not in grid.dims:
        raise request.error(
            f"x = {request.x!r} is not there; {_near(request.x, grid.coords)}"
        )
    ends = grid["end_reason"].isel if "end_reason" in grid.variables else None
    ended = (
        Counter(str(ends(point).values) for point, _, _ in points)
        if ends
        else Counter()
    )
    del ended[""]
    return require(read_runs(grid, points, names, request), needed, request, ended)


def _near(name: str, known: Iterable[object]) -> str:
    return choices(name, sorted(map(str, known)))


WHERE = "figure"
Size = float | tuple[float, float] | None
"""Width, or width and height [inches]."""


def figure(
    of: Any, kind: str, *, ax: Any = None, size: Size = None, **options: Any
) -> "Figure":
    """Return a figure of stored or simulated runs.

    Parameters
    ----------
    of : a grid (`Store.open`), one run (`Store.run`, `simulate`), or what `run`
        returned
    kind : listed by ``wearlab schema --figures``
    ax : axes of matplotlib to draw in, one for each panel; title and legend stand in
        them, notes are left out
    size : width, or width and height [inches]; text and lines grow with the width [the
        house's]
    options : as in ``[[figure]]``: select, x, y, hue, rows, cols, units, title, note,
        published

    Returns
    -------
    A figure of matplotlib; notebooks show it, ``savefig`` writes it. What the reader's
    rcParams set (fonts, ``text.usetex``, ``font.size``) holds before the house style;
    ``title=""`` leaves the title out.

    Raises
    ------
    FigureError : no such kind or option, or nothing of it can be drawn
    """
    plot, _, _ = plotted(_grid(of), read(specified({"kind": kind, **options}), 1, None))
    from wearlab.figures.render import drawn

    return drawn(plot, size, ax)


def specified(given: dict[str, Any]) -> FigureSpec:
    """Return options as of ``[[figure]]`` as a campaign has them.

    Raises
    ------
    FigureError : no such kind or option
    """
    known = FigureSpec.model_fields
    for key in given:
        if key not in known:
            raise FigureError(
                f"{WHERE}: {key!r} is no option; {choices(key, sorted(known))}"
            )
    if given["kind"] not in kinds.KINDS:
        raise FigureError(f"{WHERE}: {no_kind(str(given['kind']))}")
    try:
        told = {
            key: tuple(value) if isinstance(value, list) else value
            for key, value in given.items()
        }
        return FigureSpec.model_validate(told)
    except ValidationError as error:
        key = str(error.errors()[0]["loc"][0])
        wanted = FigureSpec.texts()[key]["description"]
        raise FigureError(
            f"{WHERE}: {key} = {given[key]!r}: wanted: {wanted}"
        ) from None


def _grid(of: Any) -> xr.Dataset:
    """Return a grid; of one run, a grid of one point."""
    grid = (
        of.to_xarray()
        if hasattr(of, "to_xarray") and not isinstance(of, xr.Dataset)
        else of
    )
    if not isinstance(grid, xr.Dataset):
        raise FigureError(
            f"{WHERE}: {type(of).__name__} is no dataset: give a grid, a run, or a "
            "report"
        )
    if "run_id" in grid:
        return grid
    if "id" not in grid.attrs:
        raise FigureError(f"{WHERE}: this dataset is neither a run nor a grid of runs")
    states = {
        "run_id": str(grid.attrs["id"]),
        "status": "done",
        "n_updates": grid.sizes.get("update", 1),
    }
    return grid.assign(states)


class Redrawn(NamedTuple):
    """A figure drawn again.

    Parameters
    ----------
    path : the new file
    same : whether it has the bytes of the one that asked
    missing : runs without data, by name and state
    stale : runs made by other code than the present
    changed : runs computed again since the figure was first drawn
    """

    path: Path
    same: bool
    missing: tuple[str, ...]
    stale: tuple[str, ...]
    changed: tuple[str, ...]


def redraw(figure: Path, store: "Store", out: Path) -> Redrawn:
    """Draw a figure again from a store, by what its file says.

    Parameters
    ----------
    figure : PNG, SVG or PDF drawn by wearlab
    store : where the runs are; nothing is computed
    out : folder of the new figure, which may be that of the old one

    Returns
    -------
    Redrawn

    Raises
    ------
    FigureError : the file carries no question, or none of its runs is there
    StoreError : there is no store, or a file of it is damaged
    """
    asked = asked_by(embedded(figure), figure)
    ending = figure.suffix.lower().removeprefix(".")
    check_format(ending)
    before = figure.read_bytes()
    image, missing = file_of(asked, store.open(asked.campaign), store, ending)  # type: ignore[arg-type]
    write_whole(path := out / f"{asked.name}.{ending}", image)
    recorded = asked.runs or {}
    entries = store.archive.entries(recorded)
    stale = tuple(
        i[:SHORT_ID] for i, entry in entries.items() if is_other_code(entry.source_hash)
    )
    changed = tuple(
        i[:SHORT_ID] for i, entry in entries.items() if entry.sha256 != recorded[i]
    )
    return Redrawn(path, image == before, missing, stale, changed)
