"""Figures on pages: what an address asks, for screen and print; thumbnails, and what follows a slider."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from typing import TYPE_CHECKING, Any
from urllib.parse import urlencode

import numpy as np
from bokeh.document import Document
from bokeh.embed import components
from bokeh.layouts import column
from bokeh.models import Button, Div, Row, Slider
from markupsafe import Markup

from wearlab.browsing import interactive, recorded
from wearlab.browsing.interactive import WIDE
from wearlab.campaign.campaign import RecordedCampaign
from wearlab.figures import FigureError, doubt, drawing, render, runs, wording
from wearlab.figures.kinds import KINDS
from wearlab.figures.plot import Plot, narrow
from wearlab.figures.question import KEYS, Question, table_of
from wearlab.schema import VARIABLES
from wearlab.store import Store, StoreError

if TYPE_CHECKING:
    import xarray as xr

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


def source_of(store: Store, of: WantedFigure) -> RecordedCampaign:
    """Return the campaign that an address names, or its marked runs as one.

    Raises
    ------
    StoreError : no such run or campaign
    """
    return recorded.campaign_of(store, of.campaign) if of.campaign else recorded.together(store, of.runs)


def question_of(store: Store, of: WantedFigure) -> tuple[Question, "xr.Dataset"]:
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
    known, (dim, *_) = KINDS.get(kind), (*map(str, grid.run_id.dims), "")
    curves = known is not None and known.dims and not known.over_sweeps and known.joined is None
    return {"hue": dim} if curves and dim and len(of.runs) > 1 and of.options.get("select") else {}


def asked(source: RecordedCampaign, kind: str, options: Mapping[str, Any]) -> Question:
    """Return what a kind of figure asks of a campaign, with options as of ``[[figure]]``.

    Raises
    ------
    FigureError : no such kind or option
    """
    return Question(1, table_of(drawing.specified({"kind": kind, **options})), None, source)


def of_figures(source: RecordedCampaign) -> list[Question]:
    """Return what the figures of a campaign ask."""
    return [
        Question(number, {key: value for key, value in vars(spec).items() if key in KEYS}, None, source)
        for number, spec in enumerate(source.figures, 1)
    ]


def possible(grid: "xr.Dataset") -> list[str]:
    """Return the kinds of figures that runs have the variables for, the most telling first."""
    of_runs = {name: kind.needs for name, kind in KINDS.items() if kind.of == "runs" and name != "line"}
    able = (name for name, needs in of_runs.items() if all(need in grid.variables for need in needs))
    return [*put_first(OF_CAMPAIGN, able), "line"]


def of_one_run(grid: "xr.Dataset") -> list[str]:
    """Return the kinds of figures that are shown of one run over its wear states."""
    able = possible(grid)
    faces = [name for name, kind in KINDS.items() if "face" in "|".join(kind.dims).split("|")]
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


PAUSE = 100  # ms between two states that are made ahead
MOST_AHEAD = 24
PROBLEMS = (FigureError, StoreError, OSError, ValueError, KeyError)


@dataclass(frozen=True)
class ShownFigure:
    """A figure on a page.

    Parameters
    ----------
    title : above it
    html : where it is drawn
    script : what draws it
    words : what it shows, in sentences
    files : name and address of its files for print
    problem : why there is none
    """

    title: str
    html: str = ""
    script: str = ""
    words: tuple[str, ...] = ()
    files: tuple[tuple[str, str], ...] = ()
    problem: str = ""


def shown(
    store: Store, asked: Question, grid: "xr.Dataset", files: tuple[tuple[str, str], ...] = ()
) -> ShownFigure:
    """Return a figure for a page, or why there is none.

    Parameters
    ----------
    store, asked, grid : the question, and the runs that it is asked of
    files : of the same question for print
    """
    try:
        return of_plot(drawing.seen(asked, grid, store)[0], files)
    except Exception as error:  # a fault of ours in one figure stops no page
        problem = str(error) if isinstance(error, PROBLEMS) else drawing.fault(asked.name, error)
    return ShownFigure(str(asked.table.get("title") or asked.table["kind"]), problem=problem)


def of_plot(plot: Plot, files: tuple[tuple[str, str], ...] = ()) -> ShownFigure:
    """Return a figure that is known as data for a page."""
    script, div = components(column(*interactive.drawn(plot, titled=False).parts, **WIDE), wrap_script=False)
    return ShownFigure(plot.title, Markup(div), script, tuple(interactive.summary(plot)), files)


def thumbnail(store: Store, key: str) -> bytes:
    """Return a small picture of the first figure of a campaign that can be drawn.

    Raises
    ------
    FigureError : none can
    """
    source = recorded.campaign_of(store, key)
    grid = store.open(source)  # type: ignore[arg-type]
    questions = of_figures(source)[:3]
    questions += [asked(source, kind, {}) for kind in possible(grid)[:3]]
    for each in questions:
        try:
            seen = narrow(drawing.seen(each, grid, store)[0])
        except PROBLEMS:
            continue
        bare = replace(seen, notes=(), title="", panels=seen.panels[:1], rows=1, legend=(), bar=None)
        return render.lightened(render.rendered(bare, {}))
    raise FigureError("none of its figures can be drawn")


class Follower:
    """Figures of one run that follow a slider over its wear states: unworn, chosen, last.

    Parameters
    ----------
    store, run_id : the run, of which all that the figures need is read once
    """

    def __init__(self, store: Store, run_id: str) -> None:
        source = recorded.together(store, [run_id])
        self.store, self.grid = store, store.open(source)  # type: ignore[arg-type]
        kinds = of_one_run(self.grid)
        names = [name for kind in kinds for name in (*KINDS[kind].needs, *KINDS[kind].also)]
        needed = {*names, *doubt.read_for(names), *runs.COORDINATES} & set(self.grid.variables)
        self.grid[list(needed)].load(scheduler="synchronous")
        self.asked = [asked(source, kind, {}) for kind in kinds]
        self.drawn: list[interactive.DrawnFigure | None] = [None for _ in kinds]
        self.places = [column(**WIDE) for _ in kinds]
        self.said = Div(**WIDE)
        self.made: dict[int, list[Plot | str]] = {}

    def add_to(self, document: Document) -> None:
        """Put slider, figures and their words into a document."""
        states = self.labels()
        last = len(states) - 1
        self._show(states, last)
        controls = self._controls(document, states) if last > 0 else []
        document.add_root(column(*controls, self.said, *self.places, **WIDE))

    def _controls(self, document: Document, states: list[str]) -> list[Any]:
        last = len(states) - 1
        named = {"role": "group", "aria-label": f"Wear state, 0 unworn to {last}"}
        ends: Any = {"start": 0, "end": last, "step": 1, "value": last}
        slider = Slider(title="Wear state", html_attributes=named, **ends, **WIDE)
        before, after = (Button(label=text) for text in ("Less worn", "More worn"))
        before.on_click(lambda: setattr(slider, "value", max(0, slider.value - 1)))
        after.on_click(lambda: setattr(slider, "value", min(last, slider.value + 1)))
        slider.on_change("value", lambda name, old, new: self.follow(document, states, int(new)))
        document.add_timeout_callback(lambda: self.ahead(document, last - 1), PAUSE)
        return [slider, Row(before, after)]

    def at(self, state: int) -> list[Plot | str]:
        """Return the figures at a wear state, made once."""
        if state not in self.made:
            self.made[state] = [self.plot(asked, state) for asked in self.asked]
        return self.made[state]

    def ahead(self, document: Document, state: int) -> None:
        """Make the figures of a state that may be asked for next, and then those before it, one at a time."""
        if state >= 0 and len(self.made) < MOST_AHEAD:
            self.at(state)
            document.add_timeout_callback(lambda: self.ahead(document, state - 1), PAUSE)

    def labels(self) -> list[str]:
        """Return what the wear states are called."""
        if "cycle" not in self.grid.variables or "update" not in self.grid.dims:
            return ["the only wear state"]
        depth = self.grid.get("max_wear_depth")
        told = []
        for number, count in enumerate(np.atleast_1d(self.grid["cycle"].values)):
            told.append(wording.cycles(float(count)).text)
            if depth is not None:
                told[-1] += f", {1e6 * float(np.nanmax(depth.isel(update=number).values)):.3g} µm worn"
        return told

    def plot(self, asked: Question, state: int) -> Plot | str:
        """Return one figure with the unworn state, the chosen and the last one; or why there is none."""
        last = self.grid.sizes.get("update", 1) - 1
        select = {"select": {"update": [0, min(state, last), last]}} if last else {}
        try:
            return drawing.seen(replace(asked, table={**asked.table, **select}), self.grid, self.store)[0]
        except PROBLEMS as error:
            return str(error)

    def summary(self, plots: Sequence[Plot | str], states: list[str], state: int) -> str:
        """Return what is seen, for readers who do not see it."""
        lines = [line for plot in plots if not isinstance(plot, str) for line in interactive.summary(plot)]
        inside = "".join(f"<li>{escape(line)}</li>" for line in lines)
        return (
            f'<p role="status" aria-live="polite"><b>State {state} of {len(states) - 1}: '
            f"{escape(states[state])}</b>, beside the first and the last.</p>"
            f"<details><summary>In words</summary><ul>{inside}</ul></details>"
        )

    def follow(self, document: Document, states: list[str], state: int) -> None:
        """Show another wear state: new data in what is drawn, or a new drawing of another form."""
        document.hold("combine")
        self._show(states, state)
        document.unhold()

    def _show(self, states: list[str], state: int) -> None:
        plots = self.at(state)
        for number, plot in enumerate(plots):
            drawn = self.drawn[number]
            if isinstance(plot, str):
                self.drawn[number], self.places[number].children = None, [Div(text=escape(plot))]
            elif drawn is None or not drawn.follow(plot):
                self.drawn[number] = drawn = interactive.drawn(plot)
                self.places[number].children = drawn.parts
        self.said.text = self.summary(plots, states, state)


def follow(store: Store) -> Callable[[Document], None]:
    """Return what fills a document of Bokeh with the figures of the run that its address names."""

    def fill(document: Document) -> None:
        arguments = document.session_context.request.arguments
        run_id = (arguments.get("id") or [b""])[0].decode("utf-8", "replace")
        try:
            Follower(store, store.find(run_id).id).add_to(document)
        except PROBLEMS as error:
            document.add_root(Div(text=f'<p role="alert">{escape(str(error))}</p>', **WIDE))

    return fill
