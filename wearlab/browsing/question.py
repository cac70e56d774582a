"""What a figure of a window asks, read from an address: one question for screen and print."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any
from urllib.parse import urlencode

from wearlab.browsing import recorded
from wearlab.campaign.campaign import RecordedCampaign
from wearlab.figures import FigureError, drawing, kinds, plot
from wearlab.figures.question import KEYS, Question
from wearlab.schema import VARIABLES

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.store import Store

ROLES = ("x", "hue", "rows", "cols", "y")
MOST_RUNS = 200
AT = {"first": {"update": 0}, "last": {"update": -1}, "all": {}}
OF_RUN = ("wear-profile", "tvms", "ste", "mesh-force", "orders")
"""Kinds that tell of one run at its wear states, before those of a flank with a width."""
OF_CAMPAIGN = ("wear-profile", "max-wear", "tvms", "mesh-force", "scatter", "cases")
"""Kinds that a campaign without figures of its own is shown by, the first that can be drawn."""
FIRST_NUMBERS = ("life", "service_life", "max_wear_depth", "dynamic_factor")
"""Results that a sweep is drawn of, before the others."""


@dataclass(frozen=True)
class WantedFigure:
    """A figure as an address asks for it.

    Parameters
    ----------
    runs : ids of the runs that were marked
    campaign : key of a campaign, "" where runs were marked
    kind : of figure, "" for the first that can be drawn
    options : as of ``[[figure]]``
    """

    runs: tuple[str, ...] = ()
    campaign: str = ""
    kind: str = ""
    options: Mapping[str, Any] = field(default_factory=dict)

    @property
    def address(self) -> str:
        """What comes behind the question mark of the address."""
        pairs = [("run", run) for run in self.runs] + [("campaign", self.campaign), ("kind", self.kind)]
        options = dict(self.options)
        pairs += [("select", f"{dim}={label}") for dim, label in (options.pop("select", None) or {}).items()]
        return urlencode([*(pair for pair in pairs if pair[1]), *options.items()])


def first(arguments: Mapping[str, Sequence[str]]) -> dict[str, str]:
    """Return the first value of every argument of an address."""
    return {name: values[0] for name, values in arguments.items() if values}


def put_first(preferred: Sequence[str], names: Iterable[str]) -> list[str]:
    """Return names with some of them before the others.

    >>> put_first(("b", "c"), "abd")
    ['b', 'a', 'd']
    """
    return sorted(names, key=lambda name: preferred.index(name) if name in preferred else len(preferred))


def wanted(arguments: Mapping[str, Sequence[str]]) -> WantedFigure:
    """Return what the arguments of an address ask for.

    Raises
    ------
    FigureError : too many runs
    """
    runs = tuple(dict.fromkeys(run for run in arguments.get("run", ()) if run))
    if len(runs) > MOST_RUNS:
        raise FigureError(f"{len(runs)} runs are more than the {MOST_RUNS} that one figure shows")
    given = {name: value for name, value in first(arguments).items() if value}
    chosen = (pair.partition("=") for pair in arguments.get("select", ()))
    select = {dim: _label(label) for dim, sign, label in chosen if sign and dim}
    select |= AT.get(given.get("state", ""), {})
    options: dict[str, Any] = {name: given[name] for name in ROLES if name in given}
    if given.get("y_as") in ("logarithm", "difference"):
        options["y_as"] = given["y_as"]
    if select:
        options["select"] = select
    return WantedFigure(runs, given.get("campaign", ""), given.get("kind", ""), options)


def _label(text: str) -> Any:
    """Return a place along a dimension: a whole number where it is one, as files write it."""
    try:
        return int(text)
    except ValueError:
        return text


def source_of(store: "Store", of: WantedFigure) -> RecordedCampaign:
    """Return the campaign that an address names, or its marked runs as one.

    Raises
    ------
    StoreError : no such run or campaign
    """
    return recorded.campaign_of(store, of.campaign) if of.campaign else recorded.together(store, of.runs)


def question_of(store: "Store", of: WantedFigure) -> tuple[Question, "xr.Dataset"]:
    """Return the question, and the runs it is asked of as one grid.

    Raises
    ------
    FigureError : no such kind or option
    StoreError : no such run or campaign
    """
    source = source_of(store, of)
    grid = store.open(source)  # type: ignore[arg-type]
    kind = of.kind or next(iter(possible(grid)), "line")
    return asked(source, kind, {**_told_apart(kind, of, grid), **of.options}), grid


def _told_apart(kind: str, of: WantedFigure, grid: "xr.Dataset") -> dict[str, str]:
    """Return as the colour what differs between marked runs, where a kind draws curves of each."""
    known, (dim, *_) = kinds.KINDS.get(kind), (*map(str, grid.run_id.dims), "")
    curves = known is not None and known.dims and not known.over_sweeps and known.joined is None
    return {"hue": dim} if curves and dim and len(of.runs) > 1 and of.options.get("select") else {}


def asked(source: RecordedCampaign, kind: str, options: Mapping[str, Any]) -> Question:
    """Return what a kind of figure asks of a campaign, with options as of ``[[figure]]``.

    Raises
    ------
    FigureError : no such kind or option
    """
    spec = drawing.specified({"kind": kind, **options})
    given = {key: getattr(spec, key, None) for key in KEYS}
    table = {
        key: list(v) if isinstance(v, tuple) else v for key, v in given.items() if v not in (None, {}, (), "")
    }
    return Question(1, table, None, source)


def of_figures(source: RecordedCampaign) -> list[Question]:
    """Return what the figures of a campaign ask."""
    return [
        Question(number, {key: value for key, value in vars(spec).items() if key in KEYS}, None, source)
        for number, spec in enumerate(source.figures, 1)
    ]


def seen(store: "Store", asked: Question, grid: "xr.Dataset") -> plot.Plot:
    """Return the figure as data.

    Raises
    ------
    FigureError : it cannot be drawn
    """
    return drawing.seen(asked, grid, store)[0]


def possible(grid: "xr.Dataset") -> list[str]:
    """Return the kinds of figures that runs have the variables for, the most telling first."""
    of_runs = {name: kind.needs for name, kind in kinds.KINDS.items() if kind.of == "runs" and name != "line"}
    able = (name for name, needs in of_runs.items() if all(need in grid.variables for need in needs))
    return [*put_first(OF_CAMPAIGN, able), "line"]


def of_one_run(grid: "xr.Dataset") -> list[str]:
    """Return the kinds of figures that are shown of one run over its wear states."""
    able = possible(grid)
    faces = [name for name, kind in kinds.KINDS.items() if "face" in "|".join(kind.dims).split("|")]
    return [name for name in (*OF_RUN, *faces) if name in able]


def numbers(grid: "xr.Dataset") -> list[tuple[str, str]]:
    """Return name and meaning of results that a sweep can be drawn of: a number a state, or a run."""
    inner = {"update", "flank", "mesh", "member"}
    dims = {str(dim) for dim in grid.run_id.dims}
    found = [
        str(name)
        for name, values in grid.variables.items()
        if name in VARIABLES and values.dtype.kind in "fiu" and set(map(str, values.dims)) <= dims | inner
        and not str(name).startswith(("count_", "run_time_", "residual_", "error_estimate_"))
    ]  # fmt: skip
    ordered = put_first(FIRST_NUMBERS, (name for name in VARIABLES if name in found))
    return [(name, VARIABLES[name].long_name) for name in ordered]


def over_axes(source: RecordedCampaign, grid: "xr.Dataset") -> list[Question]:
    """Return what shows a campaign without figures of its own: a result over its longest axis, if any.

    A curve of each state of each case would be a panel of its own.
    """
    axes = sorted((axis for axis in source.axes if len(axis.values) > 1), key=lambda axis: -len(axis.values))
    results = [name for name, _ in numbers(grid)]
    if not axes or not results or len(grid.run_id.dims) > len(axes) + 1:
        return []
    y = results[0]
    options: dict[str, Any] = {"y": y, "x": axes[0].name, **({"hue": axes[1].name} if axes[1:] else {})}
    return [asked(source, "line", options | ({"select": AT["last"]} if "update" in grid[y].dims else {}))]


def beside_axes(grid: "xr.Dataset") -> list[str]:
    """Return the keys that advance along an axis of a grid, over which a sweep can be drawn as well."""
    from wearlab.figures import runs

    return [name for name in runs.along_axes(grid) if name not in grid.run_id.dims]
