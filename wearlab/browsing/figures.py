"""Figures on pages: what an address asks, for screen and print.

Thumbnails, and what follows a slider.
"""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from html import escape
from typing import Any
from urllib.parse import urlencode

import numpy as np
import xarray as xr
from bokeh.document import Document
from bokeh.embed import components
from bokeh.layouts import column
from bokeh.models import Button, Div, Row, Slider
from markupsafe import Markup

from wearlab.browsing import interactive, recorded
from wearlab.browsing.interactive import WIDE
from wearlab.campaign.campaign import RecordedCampaign
from wearlab.figures import (
    KINDS,
    FigureError,
    doubt,
    drawing,
    render,
    runs,
    single,
    wording,
)
from wearlab.figures.plot import Plot, narrow
from wearlab.figures.question import KEYS, Question, table_of
from wearlab.schema import VARIABLES
from wearlab.store import Store, StoreError
from wearlab.tables.points import Points

ROLES = ("x", "hue", "rows", "cols", "y")
ASKED = ("run", "campaign", "kind", "select", "state", "y_as", *ROLES)
MAX_RUNS = 200
Files = tuple[tuple[str, str], ...]
"""Name and address of the files of a figure for print."""
WHOLE = re.compile(r"[+-]?\d+")
MAX_AT_ONCE = 2  # figures of a campaign that are drawn at once
FOR_MACHINES = ("count_", "run_time_", "residual_", "error_estimate_")
AT = {"first": {"update": 0}, "last": {"update": -1}, "all": {}}
OF_RUN = ("wear-profile", "tvms", "ste", "mesh-force", "orders")
"""Kinds that tell of one run at its wear states, before those of a flank with a
width."""
OF_CAMPAIGN = ("wear-profile", "max-wear", "tvms", "mesh-force", "scatter", "cases")
"""Kinds that a campaign without figures of its own is shown by, the first that can be
drawn."""
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


def first(arguments: Mapping[str, Sequence[str]]) -> dict[str, str]:
    """Return the first value of every argument of an address.

    Parameters
    ----------
    arguments : name → values
    """
    return {name: values[0] for name, values in arguments.items() if values}


def put_first(preferred: Sequence[str], names: Iterable[str]) -> list[str]:
    """Return names with some of them before the others.

    >>> put_first(("b", "c"), "abd")
    ['b', 'a', 'd']
    """
    return sorted(
        names,
        key=lambda name: preferred.index(name) if name in preferred else len(preferred),
    )


def wanted(arguments: Mapping[str, Sequence[str]]) -> WantedFigure:
    """Return what the arguments of an address ask for.

    Raises
    ------
    FigureError : too many runs
    """
    runs = tuple(dict.fromkeys(run for run in arguments.get("run", ()) if run))
    if len(runs) > MAX_RUNS:
        raise FigureError(
            f"{len(runs)} runs are more than the {MAX_RUNS} that one figure shows"
        )
    values = {name: value for name, value in first(arguments).items() if value}
    chosen = (pair.partition("=") for pair in arguments.get("select", ()))
    select: dict[str, Any] = {
        d: int(v) if WHOLE.fullmatch(v) else v for d, sign, v in chosen if sign and d
    }
    select |= AT.get(values.get("state", ""), {})
    options: dict[str, Any] = {name: values[name] for name in ROLES if name in values}
    if values.get("y_as") in ("logarithm", "difference"):
        options["y_as"] = values["y_as"]
    if select:
        options["select"] = select
    return WantedFigure(
        runs, values.get("campaign", ""), values.get("kind", ""), options
    )


def address(arguments: Mapping[str, Sequence[str]]) -> str:
    """Return the arguments of the address of a figure, from those of its page.

    Parameters
    ----------
    arguments : of the page
    """
    return urlencode(
        [(name, v) for name, vs in arguments.items() if name in ASKED for v in vs if v]
    )


class Source:
    """Runs of a store as one campaign and as one grid, of which figures are asked.

    Parameters
    ----------
    store : where the runs are
    campaign : recorded there, or some runs as one

    Raises
    ------
    StoreError : none of its runs is there
    """

    def __init__(self, store: Store, campaign: RecordedCampaign) -> None:
        self.store, self.campaign = store, campaign
        self.grid: xr.Dataset = store.open(campaign)  # type: ignore[arg-type]

    def question(self, kind: str, options: Mapping[str, Any] | None = None) -> Question:
        """Return what a kind of figure asks, with options as of ``[[figure]]``.

        Raises
        ------
        FigureError : no such kind or option
        """
        table = table_of(single.specified({"kind": kind, **(options or {})}))
        return Question(1, table, None, self.campaign)

    def ask_for(self, of: WantedFigure) -> Question:
        """Return what an address asks.

        Curves of several marked runs are told apart by colour.

        Raises
        ------
        FigureError : no such kind or option
        """
        kind = of.kind or self.possible()[0]
        definition = KINDS.get(kind)
        (dim, *_) = (*map(str, self.grid.run_id.dims), "")
        curves = (
            definition is not None
            and definition.dims
            and not definition.over_sweeps
            and definition.joined is None
        )
        hue = (
            {"hue": dim}
            if curves and dim and len(of.runs) > 1 and of.options.get("select")
            else {}
        )
        return self.question(kind, {**hue, **of.options})

    def of_campaign(self) -> list[Question]:
        """Return what the figures of its campaign ask."""
        return [
            Question(number, *_recorded(vars(spec)), self.campaign)
            for number, spec in enumerate(self.campaign.figures, 1)
        ]

    def asked(self) -> list[Question]:
        """Return what the figures of its campaign ask.

        Of one without any, some that its runs can answer.
        """
        if self.campaign.figures:
            return self.of_campaign()
        swept = self.over_axes()
        kinds = [
            kind for kind in self.possible() if not swept or kind != "wear-profile"
        ]
        return [*swept, *map(self.question, kinds[: MAX_AT_ONCE - len(swept)])]

    def possible(self) -> list[str]:
        """Return the kinds of figures that the runs have the variables for."""
        of_runs = {
            name: kind.needs
            for name, kind in KINDS.items()
            if kind.of == "runs" and name != "line"
        }
        able = (
            name
            for name, needs in of_runs.items()
            if all(need in self.grid.variables for need in needs)
        )
        return [*put_first(OF_CAMPAIGN, able), "line"]

    def of_one_run(self) -> list[str]:
        """Return the kinds of figures of one run over its wear states."""
        able = self.possible()
        faces = [
            name
            for name, kind in KINDS.items()
            if "face" in "|".join(kind.dims).split("|")
        ]
        return [name for name in (*OF_RUN, *faces) if name in able]

    def numbers(self) -> list[tuple[str, str]]:
        """Return name and meaning of results with a number for each state or run."""
        dims = {*map(str, self.grid.run_id.dims), "update", "flank", "mesh", "member"}
        numeric = {
            name: v for name, v in self.grid.variables.items() if v.dtype.kind in "fiu"
        }
        declared = (
            name
            for name in VARIABLES
            if name in numeric and not name.startswith(FOR_MACHINES)
        )
        names = [name for name in declared if dims.issuperset(numeric[name].dims)]
        return [
            (name, VARIABLES[name].long_name)
            for name in put_first(FIRST_NUMBERS, names)
        ]

    def abscissae(self) -> list[str]:
        """Return the axes of the runs and what advances with them."""
        return runs.along_axes(self.grid)

    def over_axes(self) -> list[Question]:
        """Return a figure of a result over the longest axis of a campaign, if any.

        A curve of each state of each case would be a panel of its own.
        """
        axes = [axis for axis in self.campaign.axes if len(axis.values) > 1]
        axes.sort(key=lambda axis: -len(axis.values))
        results = self.numbers()
        if not axes or not results or len(self.grid.run_id.dims) > len(axes) + 1:
            return []
        y = results[0][0]
        select = {"select": AT["last"]} if "update" in self.grid[y].dims else {}
        roles = {
            role: axis.name for role, axis in zip(("x", "hue"), axes, strict=False)
        }
        return [self.question("line", {"y": y, **roles, **select})]

    def plot(self, question: Question) -> Plot:
        """Return a figure as data.

        Raises
        ------
        FigureError : it cannot be drawn
        """
        return drawing.plot_of(question, self.grid, self.store)[0]

    def shown(self, question: Question, files: Files = ()) -> "ShownFigure":
        """Return a figure for a page with its files for print, or why there is none."""
        try:
            return of_plot(self.plot(question), files)
        except Exception as error:  # a fault of ours in one figure stops no page
            problem = (
                str(error)
                if isinstance(error, PROBLEMS)
                else drawing.fault_message(question.name, error)
            )
        return ShownFigure(name_of(question), problem=problem)


def _recorded(figure: Mapping[str, Any]) -> tuple[dict[str, Any], Points | None]:
    """Return options and points of a figure, as a store recorded it.

    The note says it where the points were not kept.
    """
    table = {key: value for key, value in figure.items() if key in KEYS}
    points = figure.get("points") or []
    if isinstance(points, list) and len(points) == 1:
        absent = f"The points of {points[0]} are not in this store, and not drawn."
        table["note"] = " ".join([*filter(None, [table.get("note")]), absent])
        return table, None
    try:
        return table, Points.recorded(points) if points else None
    except ValueError as error:
        table["note"] = f"Not drawn: {error}."
        return table, None


def name_of(question: Question) -> str:
    """Return what a figure is called: its title, or its kind.

    Parameters
    ----------
    question : that the figure asks
    """
    return str(question.table.get("title") or question.table["kind"])


def source_of(store: Store, of: WantedFigure) -> Source:
    """Return the campaign that an address names, or its marked runs as one.

    Raises
    ------
    StoreError : no such run or campaign
    """
    campaign = (
        recorded.campaign_of(store, of.campaign)
        if of.campaign
        else recorded.together(store, of.runs)
    )
    return Source(store, campaign)


PAUSE = 100  # ms between two states that are made ahead

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
    files: Files = ()
    problem: str = ""


def of_plot(plot: Plot, files: Files = ()) -> ShownFigure:
    """Return a figure that is known as data for a page."""
    script, div = components(
        column(*interactive.drawn(plot, titled=False).parts, **WIDE), wrap_script=False
    )
    return ShownFigure(
        plot.title, Markup(div), script, tuple(interactive.summary(plot)), files
    )


def thumbnail(store: Store, key: str) -> bytes:
    """Return a small picture of the first figure of a campaign that can be drawn.

    Raises
    ------
    FigureError : none can
    """
    source = Source(store, recorded.campaign_of(store, key))
    for question in (
        *source.of_campaign()[:3],
        *map(source.question, source.possible()[:3]),
    ):
        try:
            plot = narrow(source.plot(question))
        except PROBLEMS:
            continue
        bare = plot._replace(
            notes=(), title="", panels=plot.panels[:1], rows=1, legend=(), bar=None
        )
        return render.lightened(render.rendered(bare, {}))
    raise FigureError("none of its figures can be drawn")


class Follower:
    """Figures of one run that follow a slider over its wear states.

    They show the unworn, the chosen and the last state.

    Parameters
    ----------
    store, run_id : the run, of which all that the figures need is read once
    document : of Bokeh, which is filled with slider, figures and their words
    """

    def __init__(self, store: Store, run_id: str, document: Document) -> None:
        self.source = Source(store, recorded.together(store, [run_id]))
        self.document = document
        self.grid = self.source.grid
        kinds = self.source.of_one_run()
        names = [
            name for kind in kinds for name in (*KINDS[kind].needs, *KINDS[kind].also)
        ]
        needed = {*names, *doubt.variables_for(names), *runs.COORDINATES} & set(
            self.grid.variables
        )
        self.grid[list(needed)].load(scheduler="synchronous")
        self.asked = [self.source.question(kind) for kind in kinds]
        self.drawn: list[interactive.DrawnFigure | None] = [None for _ in kinds]
        self.places = [column(**WIDE) for _ in kinds]
        self.said = Div(**WIDE)
        self.made: dict[int, list[Plot | str]] = {}
        self.states = self._labels()
        self.last = len(self.states) - 1
        self._show(self.last)
        controls = self._controls() if self.last > 0 else []
        document.add_root(column(*controls, self.said, *self.places, **WIDE))

    def _controls(self) -> list[Any]:
        named = {"role": "group", "aria-label": f"Wear state, 0 unworn to {self.last}"}
        ends: Any = {"start": 0, "end": self.last, "step": 1, "value": self.last}
        slider = Slider(title="Wear state", html_attributes=named, **ends, **WIDE)
        slider.on_change("value", lambda name, old, new: self.follow(int(new)))

        def step(by: int) -> None:
            slider.value = min(max(0, slider.value + by), self.last)

        buttons = [Button(label=text) for text in ("Less worn", "More worn")]
        for button, by in zip(buttons, (-1, 1), strict=True):
            button.on_click(partial(step, by))
        self.document.add_timeout_callback(lambda: self.ahead(self.last - 1), PAUSE)
        return [slider, Row(*buttons)]

    def _labels(self) -> list[str]:
        """Return what the wear states are called."""
        if "cycle" not in self.grid.variables or "update" not in self.grid.dims:
            return ["the only wear state"]
        labels = [
            wording.cycles(float(count)).text
            for count in np.atleast_1d(self.grid["cycle"].values)
        ]
        if (depth := self.grid.get("max_wear_depth")) is None:
            return labels
        deepest = (
            float(np.nanmax(depth.isel(update=number).values))
            for number in range(len(labels))
        )
        return [
            f"{text}, {1e6 * worn:.3g} µm worn"
            for text, worn in zip(labels, deepest, strict=True)
        ]

    def at(self, state: int) -> list[Plot | str]:
        """Return the figures at a wear state, made once."""
        if state not in self.made:
            self.made[state] = [self._plot(question, state) for question in self.asked]
        return self.made[state]

    def ahead(self, state: int) -> None:
        """Make the figures of a state and of those before it, one state at a time.

        Parameters
        ----------
        state : that may be chosen next
        """
        if state >= 0 and len(self.made) < 24:
            self.at(state)
            self.document.add_timeout_callback(lambda: self.ahead(state - 1), PAUSE)

    def _plot(self, question: Question, state: int) -> Plot | str:
        """Return one figure with the unworn state, the chosen and the last one.

        Or why there is none.
        """
        last = self.grid.sizes.get("update", 1) - 1
        select = {"select": {"update": [0, min(state, last), last]}} if last else {}
        try:
            return self.source.plot(
                question._replace(table={**question.table, **select})
            )
        except PROBLEMS as error:
            return str(error)

    def follow(self, state: int) -> None:
        """Show another wear state, with new data or a new drawing.

        Parameters
        ----------
        state : its number
        """
        self.document.hold("combine")
        self._show(state)
        self.document.unhold()

    def _show(self, state: int) -> None:
        lines: list[str] = []
        for number, plot in enumerate(self.at(state)):
            drawn = self.drawn[number]
            if isinstance(plot, str):
                self.drawn[number] = None
                self.places[number].children = [Div(text=escape(plot))]
                continue
            lines += interactive.summary(plot)
            if drawn is None or not drawn.follow(plot):
                self.drawn[number] = drawn = interactive.drawn(plot)
                self.places[number].children = [*drawn.parts]
        # what is seen, for readers who do not see it
        where = f"<b>State {state} of {self.last}: {escape(self.states[state])}</b>"
        words = f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in lines)}</ul>"
        status = (
            f'<p role="status" aria-live="polite">{where}, beside the first and the '
            "last.</p>"
        )
        self.said.text = (
            f"{status}<details><summary>In words</summary>{words}</details>"
        )


def follow(store: Store) -> Callable[[Document], None]:
    """Return what fills a document of Bokeh with the figures of a run.

    Parameters
    ----------
    store : that has the run, which the address of the document names
    """

    def fill(document: Document) -> None:
        run_id = (document.session_context.request.arguments.get("id") or [b""])[
            0
        ].decode("utf-8", "replace")
        try:
            Follower(store, store.archive.find(run_id).id, document)
        except PROBLEMS as error:
            document.add_root(
                Div(text=f'<p role="alert">{escape(str(error))}</p>', **WIDE)
            )

    return fill
