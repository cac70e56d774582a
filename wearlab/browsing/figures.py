"""Figures on pages: interactive ones, their words, files for print, thumbnails, and what follows a slider."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np
from bokeh.document import Document
from bokeh.embed import components
from bokeh.layouts import column
from bokeh.models import Button, Div, Row, Slider
from markupsafe import Markup

from wearlab.browsing import interactive, question, recorded, words
from wearlab.figures import doubt, drawing, render, runs, wording
from wearlab.figures.kind import KINDS, FigureError
from wearlab.figures.plot import Plot, narrow
from wearlab.store import Store, StoreError

if TYPE_CHECKING:
    import xarray as xr

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
    store: Store, asked: question.Question, grid: "xr.Dataset", files: tuple[tuple[str, str], ...] = ()
) -> ShownFigure:
    """Return a figure for a page, or why there is none.

    Parameters
    ----------
    store, asked, grid : the question, and the runs that it is asked of
    files : of the same question for print
    """
    try:
        return of_plot(question.seen(store, asked, grid), files)
    except Exception as error:  # a fault of ours in one figure stops no page
        problem = str(error) if isinstance(error, PROBLEMS) else drawing.fault(asked.name, error)
    return ShownFigure(str(asked.table.get("title") or asked.table["kind"]), problem=problem)


def of_plot(plot: Plot, files: tuple[tuple[str, str], ...] = ()) -> ShownFigure:
    """Return a figure that is known as data for a page."""
    script, div = components(column(*interactive.drawn(plot, titled=False).parts, **WIDE), wrap_script=False)
    return ShownFigure(plot.title, Markup(div), script, tuple(words.summary(plot)), files)


def printed(store: Store, asked: question.Question, grid: "xr.Dataset", ending: str) -> bytes:
    """Return the file of a figure for print, which carries its question; or its numbers.

    Raises
    ------
    FigureError : it cannot be drawn, or no such format
    """
    if ending == "csv":
        return words.table(question.seen(store, asked, grid)).encode()
    drawing.check_format(ending)
    return drawing.answer(asked, grid, store, ending)[0]


def thumbnail(store: Store, key: str) -> bytes:
    """Return a small picture of the first figure of a campaign that can be drawn.

    Raises
    ------
    FigureError : none can
    """
    source = recorded.campaign_of(store, key)
    grid = store.open(source)  # type: ignore[arg-type]
    asked = question.of_figures(source)[:3]
    asked += [question.asked(source, kind, {}) for kind in question.possible(grid)[:3]]
    for each in asked:
        try:
            seen = narrow(question.seen(store, each, grid))
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
        kinds = question.of_one_run(self.grid)
        names = [name for kind in kinds for name in (*KINDS[kind].needs, *KINDS[kind].also)]
        for name in {*names, *doubt.read_for(names), *runs.COORDINATES}:
            if name in self.grid.variables:
                self.grid[name].load(scheduler="synchronous")
        self.asked = [question.asked(source, kind, {}) for kind in kinds]
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
        slider = Slider(
            start=0, end=last, step=1, value=last, title="Wear state", html_attributes=named, **WIDE
        )
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

    def plot(self, asked: question.Question, state: int) -> Plot | str:
        """Return one figure with the unworn state, the chosen and the last one; or why there is none."""
        count = self.grid.sizes.get("update", 1)
        table = asked.table
        if count > 1:
            table = {**table, "select": {"update": [0, min(state, count - 1), count - 1]}}
        try:
            return question.seen(self.store, replace(asked, table=table), self.grid)
        except PROBLEMS as error:
            return str(error)

    def summary(self, plots: Sequence[Plot | str], states: list[str], state: int) -> str:
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
