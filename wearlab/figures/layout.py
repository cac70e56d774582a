"""Series find their panels and pens: what varies becomes hue, columns or rows.

Nothing is left over.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, pairwise, product
from typing import Any, Literal, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.figures import curves, plot, runs
from wearlab.figures.kind import FigureRequest, Kind, no_axis, spread
from wearlab.figures.plot import BESIDE, INK, WEAR, Pen, Plot, Scale, Series
from wearlab.figures.wording import Label, axis_label, power_of_ten, within
from wearlab.store.grid import key_text

ROLES: tuple[str, ...] = ("cols", "rows", "hue")
MAX_PANELS = 24
MANY_PLACES = 12
"""A dimension of more places takes panels only when no other dimension is free."""
MAX_COLUMNS = 3
COLOURED = ("line", "line-points", "dots", "area", "horizontal", "stem")
WITHOUT_HUE = "#0072B2"
"""Colour of a curve that has no hue."""
NOT_OURS = (*BESIDE, "published")

HEADS = {"face": "position across the face"}
"""What the numbers of a dimension tell, where its name does not say it."""

Varied = Mapping[str, list[Label]]
"""Dimension → its labels in order, of those that have more than one."""
AxisPowers = Mapping[tuple[str, Scale], int]
"""(x or y, what the axis shows) → power of ten that its label tells."""
Reach = tuple[float, float]
Keys = Mapping[str, str]
Pens = Mapping[Label, Pen]
Cell = tuple[Label | None, Label | None]
"""Label of the row and label of the column of a panel."""


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

    @property
    def hues(self) -> list[Label]:
        """The labels that colours tell apart, none where there is no hue."""
        return [label for label in self.labels("hue") if label]


def laid_out(
    series: Sequence[Series],
    request: FigureRequest,
    kind: Kind,
    grid_dims: Keys,
) -> Layout:
    """Return the series with a role for everything that varies.

    Parameters
    ----------
    series : all curves of the figure
    request : what the figure asks for
    kind : its kind, which prefers some roles
    grid_dims : dimension of the grid → dotted key that is swept along it

    Raises
    ------
    FigureError : a role names what these series do not have
    """
    varied = _varied(series)
    roles = _roles(varied, series, request, kind, grid_dims)
    _refuse_flanks_apart(series, roles, request)

    if "update" in varied and roles.get("hue") != "update":
        series = curves.states_in_common(series, grid_dims)
        varied = _varied(series)
        roles = {role: name for role, name in roles.items() if name in varied}

    redundant = _redundant(series, varied)
    return _thinned(_combined(Layout(series, varied, roles), redundant))


def _varied(series: Sequence[Series]) -> dict[str, list[Label]]:
    """Return the labels along every dimension that has more than one.

    Numbers are in order of their size, words as they come.
    """
    labels: dict[str, dict[Label, None]] = {}
    for curve in series:
        for name, label in curve.key.items():
            labels.setdefault(name, {})[label] = None

    varied = {}
    for name, distinct in labels.items():
        if len(distinct) > 1:
            numbers, names = plot.numbers_and_names(distinct)
            varied[name] = [*sorted(numbers), *names]
    return varied


@dataclass
class _Roles:
    """Roles as they are given out, one after another.

    Parameters
    ----------
    varied : dimensions that need a role
    redundant : dimensions that are told by others
    requested : role → dimension, of those that the figure names
    sizes : dimension → number of its places
    taken : role → dimension, so far
    """

    varied: Varied
    redundant: set[str]
    requested: Mapping[str, str]
    sizes: Mapping[str, int]
    taken: dict[str, str] = field(default_factory=dict)

    @property
    def left(self) -> list[str]:
        """Dimensions that have no role yet."""
        return _without_role(self.varied, self.taken, self.redundant)

    def is_free(self, role: str) -> bool:
        """Say whether a role is neither taken nor named by the figure."""
        return role not in self.taken and role not in self.requested

    def give(
        self, role: str, candidates: Iterable[str], max_places: int | None
    ) -> None:
        """Give a free role to the first candidate with few enough places."""
        left = self.left
        names = [name for name in candidates if name in left]
        if role != "hue" and max_places is not None:
            names = [name for name in names if self.sizes[name] <= max_places]
        if names and self.is_free(role):
            self.taken[role] = names[0]

    def swap_hue(self, max_places: int) -> None:
        """Exchange the hue with a dimension that has too many places for panels."""
        large = [name for name in self.left if self.sizes[name] > max_places]
        free = [role for role in ("cols", "rows") if self.is_free(role)]
        hue_size = self.sizes.get(self.taken.get("hue", ""), max_places + 1)

        if large and free and "hue" not in self.requested and hue_size <= max_places:
            self.taken[free[0]] = self.taken["hue"]
            self.taken["hue"] = large[0]


def _roles(
    varied: Varied,
    series: Sequence[Series],
    request: FigureRequest,
    kind: Kind,
    grid_dims: Keys,
) -> dict[str, str]:
    """Return role → dimension.

    First what was asked for, then the kind's preference, then whatever is free.
    """
    requested = _requested_roles(series, request, grid_dims)
    sizes = {name: len(labels) for name, labels in varied.items()}
    if "update" in varied:  # as many as they are side by side
        side_by_side = _varied(curves.states_in_common(series, grid_dims))
        sizes["update"] = len(side_by_side.get("update", [0]))

    preferred: list[tuple[str, str]] = [*kind.roles, *((role, "*") for role in ROLES)]
    preferred += [(role, name) for name in varied for role in ROLES]
    if any(curve.level is not None for curve in series):  # one map would hide another
        preferred = [(role, name) for role, name in preferred if role != "hue"]

    roles = _Roles(
        varied,
        _redundant(series, varied),
        requested,
        sizes,
        {role: name for role, name in requested.items() if name in varied},
    )
    for role, name in preferred:
        roles.give(role, grid_dims if name == "*" else [name], MANY_PLACES)
    roles.swap_hue(MANY_PLACES)
    for role, name in preferred:
        roles.give(role, grid_dims if name == "*" else [name], None)

    taken = roles.taken
    only_rows = "rows" in taken and "cols" not in taken and "rows" not in requested
    if only_rows and taken["rows"] != "variable":
        taken["cols"] = taken.pop("rows")
    return taken


def _requested_roles(
    series: Sequence[Series], request: FigureRequest, grid_dims: Keys
) -> dict[str, str]:
    """Return role → dimension as the figure names them.

    Raises
    ------
    FigureError : a dimension that does not vary, or one in two roles
    """
    dims = {name for curve in series for name in curve.key}
    requested = {role: name for role in ROLES if (name := getattr(request, role))}

    for role, name in requested.items():
        if name not in dims:
            keys = {axis: key for axis, key in grid_dims.items() if axis in dims}
            hint = no_axis(name, keys, dims)
            raise request.error(f"{role} = {name!r} does not vary here; {hint}")

    for first, second in combinations(requested, 2):
        if requested[first] == requested[second]:
            raise request.error(
                f"{second} and {first} both are {requested[first]!r}: leave one of "
                "them out"
            )
    return requested


def _refuse_flanks_apart(
    series: Sequence[Series], roles: Mapping[str, str], request: FigureRequest
) -> None:
    """Refuse an axis of one panel that is squeezed by flanks with no place in common.

    So are the diameters of a small and a large gear.
    """
    if roles.get("hue") != "flank":
        return

    along: dict[Label, Reach] = {}
    for curve in series:
        flank = curve.key.get("flank")
        finite = curve.x[np.isfinite(curve.x)]
        if flank is None or curve.style in NOT_OURS or not len(finite):
            continue
        ends = float(finite.min()), float(finite.max())
        low, high = along.get(flank, ends)
        along[flank] = min(low, ends[0]), max(high, ends[1])

    in_order = sorted(along.items(), key=lambda flank: flank[1])
    gaps = [
        (lower, upper)
        for lower, upper in pairwise(in_order)
        if lower[1][1] < upper[1][0] and lower[1][0] < lower[1][1]
    ]
    if not gaps:
        return

    units = series[0].x_scale.units
    places = ", ".join(
        f"{flank.text} {low:.4g} to {high:.4g} {units}"
        for flank, (low, high) in in_order
    )
    free = next((role for role in ("cols", "rows") if not getattr(request, role)), None)
    remedy = f"{free} = 'flank' instead of hue" if free else "one of them in select"
    raise request.error(
        f"hue = 'flank' squeezes flanks that have no place in common into one axis "
        f"({places}): write {remedy}"
    )


def _without_role(
    varied: Iterable[str], roles: Mapping[str, str], redundant: set[str]
) -> list[str]:
    """Return what varies and has no role yet."""
    return [
        name for name in varied if name not in roles.values() and name not in redundant
    ]


def _redundant(series: Sequence[Series], varied: Varied) -> set[str]:
    """Return "case" where every case but the base is broadcast along the axes."""
    if "case" not in varied:
        return set()
    axes = [name for name in varied if name != "case"]
    of_cases = [s for s in series if "case" in s.key and s.key["case"].value != "base"]
    is_told = any(
        all(curve.key.get(axis) == curve.key["case"] for curve in of_cases)
        for axis in axes
    )
    return {"case"} if is_told else set()


def _combined(layout: Layout, redundant: set[str]) -> Layout:
    """Give what found no role a place in that of the columns.

    The product of these dimensions becomes one dimension.
    """
    roles = layout.roles
    dims = _without_role(layout.varied, roles, redundant)
    if not dims:
        return layout

    role = next(
        (r for r in ("cols", "rows") if r in roles and roles[r] != "variable"), "cols"
    )
    dims = [roles[role], *dims] if role in roles else dims
    name = " × ".join(dims)
    labels = _product_labels(layout, dims)

    series = list(layout.series)
    for i, curve in enumerate(series):
        if curve.key.keys() >= set(dims):
            place = tuple(curve.key[dim] for dim in dims)
            key = plot.without(curve.key, *dims)
            series[i] = replace(curve, key={**key, name: labels[place]})

    varied = {key: some for key, some in layout.varied.items() if key not in dims}
    varied[name] = list(labels.values())
    return Layout(series, varied, {**roles, role: name})


def _product_labels(
    layout: Layout, dims: Sequence[str]
) -> dict[tuple[Label, ...], Label]:
    """Return the label of every place along several dimensions at once, in order."""
    places = {
        tuple(curve.key[dim] for dim in dims)
        for curve in layout.series
        if curve.key.keys() >= set(dims)
    }
    ranks = [
        {label: rank for rank, label in enumerate(layout.varied[dim])} for dim in dims
    ]

    def order(place: tuple[Label, ...]) -> list[int]:
        return [rank[label] for rank, label in zip(ranks, place, strict=True)]

    labels = {}
    for number, place in enumerate(sorted(places, key=order)):
        text = " · ".join(dict.fromkeys(label.text for label in place))
        labels[place] = Label(float(number), text)
    return labels


def _thinned(layout: Layout) -> Layout:
    """Return no more panels than can be seen.

    Of the longer direction evenly spread places are kept, and a note says so, and of
    how many published points there is no panel.
    """
    while True:
        counts = {role: len(layout.labels(role)) for role in ("rows", "cols")}
        longer, shorter = sorted(counts, key=lambda role: -counts[role])
        room = max(MAX_PANELS // counts[shorter], 2)
        if counts["rows"] * counts["cols"] <= MAX_PANELS or room >= counts[longer]:
            return layout

        name = layout.roles[longer]
        labels = layout.varied[name]
        chosen = [labels[i] for i in spread(len(labels), room)]
        series = [s for s in layout.series if s.key.get(name, chosen[0]) in chosen]
        message = f"{name.replace('_', ' ')}: {room} of {len(labels)} places shown"
        note = f"{message}; the others by select, or as hue"
        points_left_out = _count_of_points(layout.series) - _count_of_points(series)
        if points_left_out:
            note += f"; {points_left_out} published points of others are left out"
        layout = Layout(
            series,
            {**layout.varied, name: chosen},
            layout.roles,
            (*layout.notes, note),
        )


def _count_of_points(series: Sequence[Series]) -> int:
    """Return how many published points stand among series."""
    return sum(len(curve.x) for curve in series if curve.style == "published")


def compose(
    series: Sequence[Series],
    request: FigureRequest,
    kind: Kind,
    grid_dims: Keys,
    notes: Sequence[str],
) -> Plot:
    """Return the figure of these series.

    Parameters
    ----------
    series : all curves
    request : what the figure asks for
    kind : its kind
    grid_dims : dimension of the grid → dotted key that is swept along it
    notes : lines below the axes

    Raises
    ------
    FigureError : a role names what these series do not have
    """
    layout = laid_out(series, request, kind, grid_dims)
    notes = [*notes, *layout.notes]
    if request.y_as == "difference":
        differences, note = curves.differences_from_first(
            layout.series, layout.roles, request
        )
        layout = layout._replace(series=differences)
        notes += note
    elif request.y_as == "logarithm":
        curves.require_positive(layout.series, request)

    series = layout.series
    roles = layout.roles
    hues = layout.hues
    hue = roles.get("hue")
    pens = plot.pens(hues, hue)
    reach = _reach_of_maps(series)

    panels = _panels(layout, request, pens, reach)
    rows = sorted({panel.row for panel in panels})
    columns = sorted({panel.column for panel in panels})

    head = key_text(grid_dims.get(hue) or HEADS.get(hue, hue)) if hue else ""
    bar = _bar_of_maps(series, hue, request, reach) or plot.bar_of(hues, hue, head)
    numbers, names = plot.numbers_and_names(hues)
    in_legend = hues if bar is None else names if numbers else []
    starts_with_digit = bool(hues) and hues[0].text[:1].isdigit()
    needs_head = bar is None and hue != "update" and starts_with_digit

    title = request.title
    return Plot(
        _title(layout, request, kind) if title is None else title,
        _closed(panels, rows, columns),
        rows=len(rows),
        columns=len(columns),
        share_y=_shared_y(series, roles),
        legend=_legend(series, in_legend, pens, hue, request),
        notes=tuple(notes),
        shape=kind.shape,
        ranks=kind.ranks,
        logarithmic=request.y_as == "logarithm",
        bar=bar,
        head=head if needs_head else "",
    )


def _shared_y(
    series: Sequence[Series], roles: Mapping[str, str]
) -> Literal["all", "row", "none"]:
    """Return which panels share their y axis."""
    if len({curve.y_scale.label for curve in series}) == 1:
        return "all"
    return "row" if roles.get("rows") == "variable" else "none"


def _panels(
    layout: Layout, request: FigureRequest, pens: Pens, reach: Reach
) -> list[plot.Panel]:
    """Return the panels in which a curve stands, each at its place."""
    roles = layout.roles
    powers = _powers(layout.series)
    # the y label tells these places already
    on_axis = {
        label
        for name in roles.values()
        if name in ("variable", "part")
        for label in layout.varied.get(name, [])
    }

    panels = []
    for (row, column), place in _cells(layout, request).items():
        wanted = {roles["rows"]: row} if row else {}
        wanted |= {roles["cols"]: column} if column else {}
        inside = [
            curve
            for curve in layout.series
            if all(curve.key.get(dim, label) == label for dim, label in wanted.items())
        ]
        if not inside:
            continue

        inside.sort(key=lambda curve: curve.style == "published")
        named = [label for label in (column, row) if label and label not in on_axis]
        title = ", ".join(dict.fromkeys(label.text for label in named))
        pen_of = [_pen(curve, roles.get("hue"), pens) for curve in inside]
        panels.append(_panel(inside, pen_of, place, title, powers, reach))
    return panels


def _bar_of_maps(
    series: Sequence[Series], hue: str | None, request: FigureRequest, reach: Reach
) -> plot.Bar | None:
    """Return the bar that tells what the colours of maps mean, None without maps.

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
    """Return the range of the colours of all maps, from zero where nothing is below."""
    levels = np.concatenate(
        [np.zeros(1), *(s.level for s in series if s.level is not None)]
    )
    low = float(np.nanmin(levels))
    high = float(np.nanmax(levels))
    return low, high if high > low else low + 1.0


def _title(layout: Layout, request: FigureRequest, kind: Kind) -> str:
    """Return the kind's title, and the places that were selected."""
    series = layout.series
    computed = next((s for s in series if s.style not in NOT_OURS), None)
    selected = {_dimension_selected(name) for name in request.select}
    key = {} if computed is None else computed.key
    fixed = [
        key[name].text for name in key if name in selected and name not in layout.varied
    ]

    def result_label(curve: Series) -> str:
        return (curve.x_scale if kind.along_x else curve.y_scale).label

    if request.y and kind.titled and request.y[0] != kind.y:
        label = kind.titled.format(within(result_label(computed or series[0])))
    else:
        label = kind.title
    label = axis_label(label or result_label(series[0]), "", 0)
    return ", ".join(dict.fromkeys([label, *fixed]))


def _dimension_selected(name: str) -> str:
    """Return the dimension along which a name of ``select`` chooses places."""
    if name in runs.STATE_COORDINATES:
        return "update"
    return "face" if name == runs.FACE_COORDINATE else name


def _cells(layout: Layout, request: FigureRequest) -> dict[Cell, tuple[int, int]]:
    """Return the place of every panel.

    Rows of many columns are turned into columns, or combined.
    """
    rows = layout.labels("rows")
    columns = layout.labels("cols")

    may_turn = not (request.rows or request.cols)
    may_turn = may_turn and layout.roles.get("rows") != "variable"
    if may_turn and len(columns) > MAX_COLUMNS >= len(rows) > 1:
        return {
            (row, column): (c, r)
            for c, column in enumerate(columns)
            for r, row in enumerate(rows)
        }

    width = min(len(columns), MAX_COLUMNS)
    if len(columns) == 4:
        width = 2
    lines = -(-len(columns) // width)
    return {
        (row, column): (r * lines + c // width, c % width)
        for (r, row), (c, column) in product(enumerate(rows), enumerate(columns))
    }


def _powers(series: Sequence[Series]) -> AxisPowers:
    """Return the power of ten of each thing that axes show, the same in every panel."""
    values: dict[tuple[str, Scale], list[Array]] = {}
    for curve in series:
        values.setdefault(("x", curve.x_scale), []).append(curve.x)
        values.setdefault(("y", curve.y_scale), []).append(curve.y)
    return {
        (axis, scale): (
            0 if scale.units == plot.DAYS else power_of_ten(arrays, scale.units)
        )
        for (axis, scale), arrays in values.items()
    }


def _panel(
    inside: Sequence[Series],
    pens: Sequence[Pen],
    place: tuple[int, int],
    title: str,
    powers: AxisPowers,
    reach: Reach,
) -> plot.Panel:
    """Return a panel with its curves, their values over the axes' powers of ten."""
    first = next((s for s in inside if s.style not in BESIDE), inside[0])
    x_power = powers["x", first.x_scale]
    y_power = powers["y", first.y_scale]
    drawn = [
        _curve(series, pen, x_power, y_power, reach)
        for series, pen in zip(inside, pens, strict=True)
    ]

    distinct = dict.fromkeys(mark for series in inside for mark in series.marks)
    marks = tuple(mark._replace(x=mark.x / 10.0**x_power) for mark in distinct)
    is_dated = first.x_scale.units == plot.DAYS
    x_units = "" if is_dated else first.x_scale.units
    row, column = place
    return plot.Panel(
        row,
        column,
        title,
        axis_label(first.x_scale.label, x_units, x_power),
        axis_label(*first.y_scale, y_power),
        tuple(drawn),
        marks,
        _common_hours(inside, x_power),
        next((series.names for series in inside if series.names), ()),
        is_dated,
    )


def _curve(
    series: Series, pen: Pen, x_power: int, y_power: int, reach: Reach
) -> plot.Curve:
    """Return a series as a curve with its pen, its values over powers of ten."""
    powers = {"x": x_power, "x_error": x_power, "y": y_power, "y_error": y_power}
    points: dict[str, Any] = {}
    for name in plot.POINTS:
        values = getattr(series, name)
        if values is not None:
            points[name] = values / 10.0 ** powers[name] if name in powers else values
    return plot.Curve(pen=pen, style=series.style, reach=reach, **points)


def _common_hours(inside: Sequence[Series], x_power: int) -> float | None:
    """Return the hours of one unit of x where all curves agree on them, else None."""
    texts = {
        f"{series.hours:.9g}" if series.hours else ""
        for series in inside
        if series.style not in NOT_OURS
    }
    if len(texts) != 1 or "" in texts:
        return None
    return float(texts.pop()) * 10.0**x_power


def _pen(curve: Series, hue: str | None, pens: Pens) -> Pen:
    """Return the pen of a curve: of its style, of its hue, or that without a hue."""
    if curve.style in BESIDE:
        return BESIDE[curve.style]
    in_ink = curve.style == "published" or (hue and curve.style != "points")
    without_hue = Pen(INK if in_ink else WITHOUT_HUE, "-", "o")
    label = curve.key.get(hue) if hue else None
    return pens.get(label, without_hue) if label else without_hue


def _closed(
    panels: list[plot.Panel], rows: list[int], columns: list[int]
) -> tuple[plot.Panel, ...]:
    """Return panels without rows and columns in which none stands.

    Several panels have letters in their titles.
    """
    closed = []
    for i, panel in enumerate(panels):
        letter = f"({chr(ord('a') + i)}) " if len(panels) > 1 and i < 26 else ""
        closed.append(
            panel._replace(
                row=rows.index(panel.row),
                column=columns.index(panel.column),
                title=f"{letter}{panel.title}".rstrip(),
            )
        )
    return tuple(closed)


def _legend(
    series: Sequence[Series],
    hues: list[Label],
    pens: Pens,
    hue: str | None,
    request: FigureRequest,
) -> tuple[plot.LegendEntry, ...]:
    """Return the lines of the legend: hues, then what belongs to none."""
    coloured = [s for s in reversed(series) if s.style in COLOURED]
    styles = {s.key[hue]: s.style for s in coloured if hue is not None and hue in s.key}
    entries = [
        plot.LegendEntry(label.text, pens[label], styles.get(label, "line"))
        for label in hues
    ]

    # one case may have to be told from others, and ours from published points
    cases = {
        s.key["case"].text
        for s in series
        if "case" in s.key and s.style not in NOT_OURS
    }
    only_case = cases.pop() if request.hue == "case" and len(cases) == 1 else ""
    is_compared = only_case or any(s.style == "published" for s in series)
    if not entries and coloured and is_compared:
        pen = Pen(WITHOUT_HUE, "-", "o")
        text = only_case or "computed"
        entries = [plot.LegendEntry(text, pen, coloured[-1].style)]

    return (*entries, *_extra_entries(series))


def _extra_entries(series: Sequence[Series]) -> list[plot.LegendEntry]:
    """Return the lines of the legend of curves that have a text of their own."""
    pens = BESIDE | {
        "area": Pen(WITHOUT_HUE),
        "line": Pen(WITHOUT_HUE),
        "line-points": Pen(WITHOUT_HUE, "-", "o"),
        "hairline": Pen(WITHOUT_HUE),
    }
    first_of_text = {s.text: s for s in reversed(series) if s.text}
    by_style = sorted(reversed(first_of_text.items()), key=lambda item: item[1].style)
    return [
        plot.LegendEntry(text, pens.get(curve.style, Pen(INK, "", "o")), curve.style)
        for text, curve in by_style
    ]
