"""Figures on pages: interactive ones, their words, files for print, thumbnails, and what follows a slider."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
from bokeh.document import Document
from bokeh.embed import components
from bokeh.layouts import column
from bokeh.models import Button, Div, Row, Slider
from markupsafe import Markup

from wearlab.browsing import interactive, question, words
from wearlab.figures import drawing
from wearlab.figures.doubt import read_for
from wearlab.figures.kind import KINDS, FigureError
from wearlab.figures.runs import COORDINATES
from wearlab.figures.wording import cycles
from wearlab.store import StoreError

if TYPE_CHECKING:
    import xarray as xr

    from wearlab.figures.plot import Plot
    from wearlab.figures.question import Question
    from wearlab.store import Store

PAUSE = 100  # ms between two states that are made ahead
MOST_AHEAD = 24
WIDE = {"sizing_mode": "stretch_width"}
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
    store: "Store", asked: "Question", grid: "xr.Dataset", files: tuple[tuple[str, str], ...] = ()
) -> ShownFigure:
    """Return a figure for a page, or why there is none.

    Parameters
    ----------
    store, asked, grid : the question, and the runs that it is asked of
    files : of the same question for print
    """
    title = str(asked.table.get("title") or "")
    try:
        plot = question.seen(store, asked, grid)
    except PROBLEMS as error:
        return ShownFigure(title or str(asked.table["kind"]), problem=str(error))
    except Exception as error:  # a fault of ours in one figure stops no page
        return ShownFigure(title or str(asked.table["kind"]), problem=drawing.fault(asked.name, error))
    return of_plot(plot, files)


def of_plot(plot: "Plot", files: tuple[tuple[str, str], ...] = ()) -> ShownFigure:
    """Return a figure that is known as data for a page."""
    script, div = components(column(*interactive.drawn(plot, titled=False).parts, **WIDE), wrap_script=False)
    return ShownFigure(plot.title, Markup(div), script, tuple(words.summary(plot)), files)


def printed(store: "Store", asked: "Question", grid: "xr.Dataset", ending: str) -> bytes:
    """Return the file of a figure for print, which carries its question; or its numbers.

    Raises
    ------
    FigureError : it cannot be drawn, or no such format
    """
    if ending == "csv":
        return words.table(question.seen(store, asked, grid)).encode()
    drawing.check_format(ending)
    return drawing.answer(asked, grid, store, ending)[0]


def thumbnail(store: "Store", key: str) -> bytes:
    """Return a small picture of the first figure of a campaign that can be drawn.

    Raises
    ------
    FigureError : none can
    """
    from wearlab.browsing.recorded import campaign_of
    from wearlab.figures.plot import narrow
    from wearlab.figures.render import lightened, rendered

    source = campaign_of(store, key)
    grid = store.open(source)  # type: ignore[arg-type]
    asked = [
        question.question_of_figure(source, number) for number in range(1, min(len(source.figures), 3) + 1)
    ]
    asked += [question.asked(source, kind, {}) for kind in question.possible(grid)[:3]]
    for each in asked:
        try:
            plot = question.seen(store, each, grid)
        except PROBLEMS:
            continue
        bare = replace(
            narrow(plot), notes=(), title="", panels=narrow(plot).panels[:1], rows=1, legend=(), bar=None
        )
        return lightened(rendered(bare, {}))
    raise FigureError("none of its figures can be drawn")


@dataclass
class Follower:
    """Figures of one run that follow a slider over its wear states: unworn, chosen, last.

    Parameters
    ----------
    store, run_id : the run
    """

    store: "Store"
    run_id: str
    grid: Any = None
    asked: list["Question"] = field(default_factory=list)
    drawn: list[interactive.DrawnFigure | None] = field(default_factory=list)
    places: list[Any] = field(default_factory=list)
    said: Any = None
    made: "dict[int, list[Plot | str]]" = field(default_factory=dict)

    def add_to(self, document: Document) -> None:
        """Put slider, figures and their words into a document."""
        source = question.recorded.together(self.store, [self.run_id])
        self.grid = self.store.open(source)  # type: ignore[arg-type]
        kinds = question.of_one_run(self.grid)
        self.asked = [question.asked(source, kind, {}) for kind in kinds]
        self._load(kinds)
        states = self.labels()
        last = len(states) - 1
        plots = self.at(last)
        self.drawn = [None if isinstance(plot, str) else interactive.drawn(plot) for plot in plots]
        self.places = [column(*self._parts(n, plot), **WIDE) for n, plot in enumerate(plots)]
        self.said = Div(text=self.summary(plots, states, last), **WIDE)
        shown = [self.said, *self.places]
        if last > 0:
            shown = [*self._controls(document, states), *shown]
        document.add_root(column(*shown, **WIDE))

    def _load(self, kinds: Sequence[str]) -> None:
        """Read once what the figures need of the run."""
        names = [name for kind in kinds for name in (*KINDS[kind].needs, *KINDS[kind].also)]
        for name in {*names, *read_for(names), *COORDINATES}:
            if name in self.grid.variables:
                self.grid[name].load(scheduler="synchronous")

    def _controls(self, document: Document, states: list[str]) -> list[Any]:
        last = len(states) - 1
        named = {"role": "group", "aria-label": f"Wear state, 0 unworn to {last}"}
        slider = Slider(
            start=0, end=last, step=1, value=last, title="Wear state", html_attributes=named, **WIDE
        )
        before, after = (Button(label=text) for text in ("Less worn", "More worn"))
        before.on_click(lambda: setattr(slider, "value", max(0, slider.value - 1)))
        after.on_click(lambda: setattr(slider, "value", min(last, slider.value + 1)))
        slider.on_change("value", lambda name, old, new: self.follow(document, states, int(new)))
        document.add_timeout_callback(lambda: self.ahead(document, last - 1), PAUSE)
        return [slider, Row(before, after)]

    def at(self, state: int) -> "list[Plot | str]":
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
            deep = (
                ""
                if depth is None
                else f", {1e6 * float(np.nanmax(depth.isel(update=number).values)):.3g} µm worn"
            )
            told.append(f"{cycles(float(count)).text}{deep}")
        return told

    def plot(self, asked: "Question", state: int) -> "Plot | str":
        """Return one figure with the unworn state, the chosen and the last one; or why there is none."""
        count = self.grid.sizes.get("update", 1)
        table = asked.table
        if count > 1:
            table = {**table, "select": {"update": [0, min(state, count - 1), count - 1]}}
        try:
            return question.seen(self.store, replace(asked, table=table), self.grid)
        except PROBLEMS as error:
            return str(error)

    def _parts(self, number: int, plot: "Plot | str") -> list[Any]:
        drawn = self.drawn[number]
        return [Div(text=escape(str(plot)))] if drawn is None else drawn.parts

    def summary(self, plots: "Sequence[Plot | str]", states: list[str], state: int) -> str:
        """Return what is seen, for readers who do not see it."""
        lines = [line for plot in plots if not isinstance(plot, str) for line in words.summary(plot)]
        inside = "".join(f"<li>{escape(line)}</li>" for line in lines)
        return (
            f'<p role="status" aria-live="polite"><b>State {state} of {len(states) - 1}: '
            f"{escape(states[state])}</b>, beside the first and the last.</p>"
            f"<details><summary>In words</summary><ul>{inside}</ul></details>"
        )

    def follow(self, document: Document, states: list[str], state: int) -> None:
        """Show another wear state: new data in what is drawn, or a new drawing of another form."""
        document.hold("combine")
        plots = self.at(state)
        for number, plot in enumerate(plots):
            drawn = self.drawn[number]
            if isinstance(plot, str) or drawn is None or not drawn.follow(plot):
                self.drawn[number] = None if isinstance(plot, str) else interactive.drawn(plot)
                self.places[number].children = self._parts(number, plot)
        self.said.text = self.summary(plots, states, state)
        document.unhold()


def follow(store: "Store") -> Callable[[Document], None]:
    """Return what fills a document of Bokeh with the figures of the run that its address names."""

    def fill(document: Document) -> None:
        arguments = document.session_context.request.arguments
        run_id = (arguments.get("id") or [b""])[0].decode("utf-8", "replace")
        try:
            Follower(store, store.find(run_id).id).add_to(document)
        except PROBLEMS as error:
            document.add_root(Div(text=f'<p role="alert">{escape(str(error))}</p>', **WIDE))

    return fill
