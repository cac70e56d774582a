"""Series find their panels and pens: what varies becomes hue, columns or rows.

Nothing is left over.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations, product
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.figures import curves, plot, runs
from wearlab.figures.kind import FigureRequest, Kind, no_axis, spread
from wearlab.figures.plot import BESIDE, INK, WEAR, Pen, Plot, Series
from wearlab.figures.wording import Label, axis_label, power_of_ten, within
from wearlab.store.grid import key_text

ROLES: tuple[str, ...] = ("cols", "rows", "hue")
MOST_PANELS = 24
Varied = Mapping[str, list[Label]]
"""Dimension → its labels in order, of those that have more than one."""
Powers = Mapping[tuple[str, str, str], int]
Reach = tuple[float, float]
Keys = Mapping[str, str]
Pens = Mapping[Label, Pen]
Drawn = Sequence[tuple[Series, Pen]]
Legend = tuple[plot.LegendEntry, ...]


class Layout(NamedTuple):
    """Series with their roles.

    Parameters
    ----------
    series : each place of a role is a label in its key
    varied : the labels of its dimensions
    roles : role → dimension
    notes : what was left out, and how to have it
    """

    series: Sequence[Series]
    varied: Varied
    roles: Mapping[str, str]
    notes: tuple[str, ...] = ()

    def labels(self, role: str) -> list[Label | None]:
        """Return the labels of a role, or one None."""
        return list(self.varied[self.roles[role]]) if role in self.roles else [None]


def laid_out(
    series: Sequence[Series],
    request: FigureRequest,
    kind: Kind,
    grid_dims: Mapping[str, str],
) -> Layout:
    """Return the series with a role for everything that varies.

    Raises
    ------
    FigureError : a role names what these series do not have
    """
    varied = _varied(series)
    roles = _roles(varied, series, request, kind, grid_dims)
    if "update" in varied and roles.get("hue") != "update":
        series = curves.states_in_common(series, grid_dims)
        varied = _varied(series)
        roles = {role: name for role, name in roles.items() if name in varied}
    return _thinned(
        _combined(Layout(series, varied, roles), _redundant(series, varied))
    )


def _varied(series: Sequence[Series]) -> dict[str, list[Label]]:
    """Return the labels along every dimension that has more than one: numbers by size, words as they come."""
    varied: dict[str, dict[Label, None]] = {}
    for curve in series:
        for name, label in curve.key.items():
            varied.setdefault(name, {})[label] = None
    parted = {
        name: plot.numbers_and_names(some)
        for name, some in varied.items()
        if len(some) > 1
    }
    return {
        name: [*sorted(numbers), *names] for name, (numbers, names) in parted.items()
    }


def _roles(
    varied: Varied,
    series: Sequence[Series],
    request: FigureRequest,
    kind: Kind,
    grid_dims: Keys,
) -> dict[str, str]:
    """Return role → dimension: what was asked for, then the kind's preference, then whatever is free."""
    known = {name for curve in series for name in curve.key}
    asked = {role: name for role in ROLES if (name := getattr(request, role))}
    for role, name in asked.items():
        if name not in known:
            said = no_axis(
                name,
                {axis: key for axis, key in grid_dims.items() if axis in known},
                known,
            )
            raise request.error(f"{role} = {name!r} does not vary here; {said}")
    for one, other in combinations(asked, 2):
        if asked[one] == asked[other]:
            raise request.error(
                f"{other} and {one} both are {asked[one]!r}: leave one of them out"
            )
    roles = {role: name for role, name in asked.items() if name in varied}
    redundant = _redundant(series, varied)
    sizes = {name: len(labels) for name, labels in varied.items()}
    if "update" in varied:  # as many as they are side by side
        sizes["update"] = len(
            _varied(curves.states_in_common(series, grid_dims)).get("update", [0])
        )
    preferred: list[tuple[str, str]] = [*kind.roles, *((role, "*") for role in ROLES)]
    preferred += [(role, name) for name in varied for role in ROLES]
    if any(curve.level is not None for curve in series):  # one map would lie on another
        preferred = [(role, name) for role, name in preferred if role != "hue"]
    for most in (
        12,
        None,
    ):  # what has more places takes panels only when nothing else is free
        for role, wished in preferred:
            left = _left(varied, roles, redundant)
            names = [
                name
                for name in (grid_dims if wished == "*" else [wished])
                if name in left
            ]
            if role != "hue" and most is not None:
                names = [name for name in names if sizes[name] <= most]
            if names and role not in roles and role not in asked:
                roles[role] = names[0]
        if most is not None:
            # what has too many places for panels has the hue, if what has it can take
            # panels
            large = [
                name for name in _left(varied, roles, redundant) if sizes[name] > most
            ]
            free = [
                role
                for role in ("cols", "rows")
                if role not in roles and role not in asked
            ]
            if (
                large
                and free
                and "hue" not in asked
                and sizes.get(roles.get("hue", ""), most + 1) <= most
            ):
                roles[free[0]] = roles["hue"]
                roles["hue"] = large[0]
    if (
        "rows" in roles
        and "cols" not in roles
        and "rows" not in asked
        and roles["rows"] != "variable"
    ):
        roles["cols"] = roles.pop("rows")
    return roles


def _left(
    varied: Iterable[str], roles: Mapping[str, str], redundant: set[str]
) -> list[str]:
    """Return what varies and has no role yet."""
    return [
        name for name in varied if name not in roles.values() and name not in redundant
    ]


def _redundant(series: Sequence[Series], varied: Varied) -> set[str]:
    """Return "case" where every case but the base is broadcast, and so told by the axes already."""
    axes = [name for name in varied if name != "case"]
    others = [s for s in series if "case" in s.key and s.key["case"].value != "base"]
    twin = "case" in varied and any(
        all(s.key.get(axis) == s.key["case"] for s in others) for axis in axes
    )
    return {"case"} if twin else set()


def _combined(layout: Layout, redundant: set[str]) -> Layout:
    """Give what found no role a place in that of the columns: their product becomes one dimension."""
    varied = layout.varied
    roles = layout.roles
    dims = _left(varied, roles, redundant)
    if not dims:
        return layout
    role = next(
        (r for r in ("cols", "rows") if r in roles and roles[r] != "variable"), "cols"
    )
    dims = [roles[role], *dims] if role in roles else dims
    whole = set(dims)
    name = " × ".join(dims)
    places = {
        tuple(s.key[dim] for dim in dims)
        for s in layout.series
        if s.key.keys() >= whole
    }
    order = [{label: rank for rank, label in enumerate(varied[dim])} for dim in dims]
    ranked = sorted(
        places,
        key=lambda place: [rank[x] for rank, x in zip(order, place, strict=True)],
    )
    texts = [
        " · ".join(dict.fromkeys(label.text for label in place)) for place in ranked
    ]
    labels = {
        place: Label(float(i), text)
        for i, (place, text) in enumerate(zip(ranked, texts, strict=True))
    }
    series = list(layout.series)
    for i, curve in enumerate(series):
        if curve.key.keys() >= whole:
            rest = {key: label for key, label in curve.key.items() if key not in whole}
            series[i] = replace(
                curve, key={**rest, name: labels[tuple(curve.key[dim] for dim in dims)]}
            )
    kept = {key: some for key, some in varied.items() if key not in dims}
    return Layout(series, {**kept, name: list(labels.values())}, {**roles, role: name})


def _thinned(layout: Layout) -> Layout:
    """Return no more panels than can be seen: evenly spread places along the longer direction, and say so."""
    while True:
        counts = {role: len(layout.labels(role)) for role in ("rows", "cols")}
        role, other = sorted(counts, key=lambda each: -counts[each])
        most = max(MOST_PANELS // counts[other], 2)
        if counts["rows"] * counts["cols"] <= MOST_PANELS or most >= counts[role]:
            return layout
        name = layout.roles[role]
        labels = layout.varied[layout.roles[role]]
        chosen = [labels[i] for i in spread(len(labels), most)]
        words = f"{name.replace('_', ' ')}: {most} of {len(labels)} places shown"
        notes = (*layout.notes, f"{words}; the others by select, or as hue")
        kept = [s for s in layout.series if s.key.get(name, chosen[0]) in chosen]
        layout = Layout(kept, {**layout.varied, name: chosen}, layout.roles, notes)


MOST_COLUMNS = 3
COLOURED = ("line", "line-points", "dots", "area", "horizontal", "stem")
ALONE = "#0072B2"  # a curve without a hue
NOT_OURS = (*BESIDE, "published")


def compose(
    series: Sequence[Series],
    request: FigureRequest,
    kind: Kind,
    grid_dims: Keys,
    notes: Sequence[str],
) -> Plot:
    """Return the figure of these series.

    Raises
    ------
    FigureError : a role names what these series do not have
    """
    layout = laid_out(series, request, kind, grid_dims)
    series = layout.series
    varied = layout.varied
    roles = layout.roles
    said = list(layout.notes)
    if request.y_as == "difference":
        series, told = curves.from_first(series, roles, request)
        said += told
    elif request.y_as == "logarithm":
        curves.require_positive(series, request)
    hue = roles.get("hue")
    hues = [label for label in layout.labels("hue") if label]
    pen = plot.pens(hues, hue)
    powers = _powers(series)
    reach = _reach_of_maps(series)
    of_label = [
        name for name in roles.values() if name in ("variable", "part")
    ]  # what the y label tells
    itself = {label for name in of_label for label in varied.get(name, [])}
    panels = []
    for (row, column), place in _cells(layout, request).items():
        wanted = {
            roles[role]: label
            for role, label in (("rows", row), ("cols", column))
            if label
        }
        inside = [
            s
            for s in series
            if all(s.key.get(dim, at) == at for dim, at in wanted.items())
        ]
        if inside:
            title = ", ".join(
                dict.fromkeys(x.text for x in (column, row) if x and x not in itself)
            )
            drawn = [
                (s, _pen(s, hue, pen))
                for s in sorted(inside, key=lambda s: s.style == "published")
            ]
            panels.append(_panel(drawn, place, title, powers, reach))
    head = key_text(grid_dims.get(hue) or hue) if hue else ""
    bar = _bar_of_maps(series, hue, request, reach) or plot.bar_of(hues, hue, head)
    numbers, names = plot.numbers_and_names(hues)
    in_legend = hues if bar is None else names if numbers else []
    bare = bar is None and hue != "update" and bool(hues) and hues[0].text[:1].isdigit()
    rows = sorted({panel.row for panel in panels})
    columns = sorted({panel.column for panel in panels})
    one_up = len({s.y_scale.label for s in series}) == 1
    share: Any = (
        "all" if one_up else "row" if roles.get("rows") == "variable" else "none"
    )
    title = (
        _title(series, varied, request, kind)
        if request.title is None
        else request.title
    )
    grid = _closed(panels, rows, columns), len(rows), len(columns), share
    words = _legend(series, in_legend, pen, hue, request), (*notes, *said)
    more: Any = {
        "logarithmic": request.y_as == "logarithm",
        "bar": bar,
        "head": head if bare else "",
    }
    return Plot(title, *grid, *words, kind.shape, kind.ranks, **more)


def _bar_of_maps(
    series: Sequence[Series], hue: str | None, request: FigureRequest, reach: Reach
) -> plot.Bar | None:
    """Return the bar that tells what the colours of maps mean, None where there is no map.

    Raises
    ------
    FigureError : maps would lie one on another
    """
    colours = next((s.colours for s in series if s.level is not None), None)
    if colours is None:
        return None
    if hue is not None:
        raise request.error(
            f"one map hides another; choose one place of {hue!r} in select"
        )
    return plot.Bar(axis_label(*colours, 0), *reach, WEAR)


def _reach_of_maps(series: Sequence[Series]) -> Reach:
    """Return what the colours of all maps reach over, from zero on where nothing is below."""
    levels = np.concatenate(
        [np.zeros(1), *(s.level for s in series if s.level is not None)]
    )
    low = float(np.nanmin(levels))
    high = float(np.nanmax(levels))
    return low, high if high > low else low + 1.0


def _title(
    series: Sequence[Series], varied: Varied, request: FigureRequest, kind: Kind
) -> str:
    """Return the kind's title, and the places that were selected."""
    ours = next((s for s in series if s.style not in NOT_OURS), None)
    key = {} if ours is None else ours.key
    asked = {
        "update" if name in runs.STATE_COORDINATES else name for name in request.select
    }
    fixed = [key[name].text for name in key if name in asked and name not in varied]
    shown, first = (
        (s.x_scale if kind.along_x else s.y_scale).label
        for s in (ours or series[0], series[0])
    )
    other = bool(request.y and kind.titled and request.y[0] != kind.y)
    label = kind.titled.format(within(shown)) if other else kind.title
    return ", ".join(dict.fromkeys([axis_label(label or first, "", 0), *fixed]))


def _cells(
    layout: Layout, request: FigureRequest
) -> dict[tuple[Label | None, Label | None], tuple[int, int]]:
    """Return the place of every panel.

    Rows of many columns are turned into columns, or combined.
    """
    rows = layout.labels("rows")
    columns = layout.labels("cols")
    free = not (request.rows or request.cols) and layout.roles.get("rows") != "variable"
    if free and len(columns) > MOST_COLUMNS >= len(rows) > 1:
        return {
            (row, col): (c, r)
            for c, col in enumerate(columns)
            for r, row in enumerate(rows)
        }
    width = (
        len(columns)
        if len(columns) <= MOST_COLUMNS
        else 2
        if len(columns) == 4
        else MOST_COLUMNS
    )
    lines = -(-len(columns) // width)
    places = product(enumerate(rows), enumerate(columns))
    return {
        (row, col): (r * lines + i // width, i % width) for (r, row), (i, col) in places
    }


def _powers(series: Sequence[Series]) -> Powers:
    """Return the power of ten of each thing that axes show, the same in every panel."""
    held: dict[tuple[str, str, str], list[Array]] = {}
    for curve in series:
        held.setdefault(("x", *curve.x_scale), []).append(curve.x)
        held.setdefault(("y", *curve.y_scale), []).append(curve.y)
    return {
        key: 0 if key[2] == plot.DAYS else power_of_ten(arrays, key[2])
        for key, arrays in held.items()
    }


def _panel(
    drawn: Drawn, place: tuple[int, int], title: str, powers: Powers, reach: Reach
) -> plot.Panel:
    inside = [s for s, _ in drawn]
    first = next((s for s in inside if s.style not in BESIDE), inside[0])
    dates = first.x_scale.units == plot.DAYS
    x_scale = powers[("x", *first.x_scale)]
    y_scale = powers[("y", *first.y_scale)]
    tens = {"x": x_scale, "x_error": x_scale, "y": y_scale, "y_error": y_scale}
    shown = []
    for s, pen in drawn:
        points: dict[str, Any] = {
            name: v for name in plot.POINTS if (v := getattr(s, name)) is not None
        }
        points |= {
            name: points[name] / 10.0**power
            for name, power in tens.items()
            if name in points
        }
        shown.append(plot.Curve(pen=pen, style=s.style, reach=reach, **points))
    named = dict.fromkeys(mark for s in inside for mark in s.marks)
    marks = tuple(mark._replace(x=mark.x / 10.0**x_scale) for mark in named)
    told = {
        f"{s.hours:.9g}" if s.hours else "" for s in inside if s.style not in NOT_OURS
    }
    hours = (
        float(told.pop()) * 10.0**x_scale if len(told) == 1 and "" not in told else None
    )
    names = next((s.names for s in inside if s.names), ())
    x_label = axis_label(
        first.x_scale.label, "" if dates else first.x_scale.units, x_scale
    )
    labels = title, x_label, axis_label(*first.y_scale, y_scale)
    return plot.Panel(*place, *labels, tuple(shown), marks, hours, names, dates)


def _pen(curve: Series, hue: str | None, pen: Mapping[Label, Pen]) -> Pen:
    alone = Pen(
        INK
        if curve.style == "published" or (hue and curve.style != "points")
        else ALONE,
        "-",
        "o",
    )
    label = curve.key.get(hue) if hue else None
    return (
        BESIDE[curve.style]
        if curve.style in BESIDE
        else pen.get(label, alone)
        if label
        else alone
    )


def _closed(
    panels: list[plot.Panel], rows: list[int], columns: list[int]
) -> tuple[plot.Panel, ...]:
    """Return panels without rows and columns in which none stands, with letters where they are several."""
    closed = []
    for i, panel in enumerate(panels):
        letter = f"({chr(ord('a') + i)}) " if len(panels) > 1 and i < 26 else ""
        place: Any = {
            "row": rows.index(panel.row),
            "column": columns.index(panel.column),
        }
        closed.append(panel._replace(title=f"{letter}{panel.title}".rstrip(), **place))
    return tuple(closed)


def _legend(
    series: Sequence[Series],
    hues: list[Label],
    pen: Pens,
    hue: str | None,
    request: FigureRequest,
) -> Legend:
    coloured = [s for s in reversed(series) if s.style in COLOURED]
    looks = {s.key[hue]: s.style for s in coloured if hue is not None and hue in s.key}
    entries = [plot.LegendEntry(h.text, pen[h], looks.get(h, "line")) for h in hues]
    cases = {
        s.key["case"].text
        for s in series
        if "case" in s.key and s.style not in NOT_OURS
    }
    alone = (
        cases.pop() if request.hue == "case" and len(cases) == 1 else ""
    )  # to be told from others
    if (
        not entries
        and coloured
        and (alone or any(s.style == "published" for s in series))
    ):
        entries = [
            plot.LegendEntry(
                alone or "computed", Pen(ALONE, "-", "o"), coloured[-1].style
            )
        ]
    extra = {s.text: s for s in reversed(series) if s.text}
    own = BESIDE | {
        "area": Pen(ALONE),
        "line": Pen(ALONE),
        "line-points": Pen(ALONE, "-", "o"),
    }
    for text, curve in sorted(reversed(extra.items()), key=lambda item: item[1].style):
        entries.append(
            plot.LegendEntry(text, own.get(curve.style, Pen(INK, "", "o")), curve.style)
        )
    return tuple(entries)
