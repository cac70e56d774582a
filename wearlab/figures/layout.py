"""Series find their panels and pens: what varies becomes hue, columns or rows; nothing is left over."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from wearlab.arrays import Array
from wearlab.figures import curves, plot, runs
from wearlab.figures.kind import Ask, FigureError, Kind, no_axis
from wearlab.figures.plot import BESIDE, INK, WEAR, Pen, Series
from wearlab.figures.wording import Label, axis_label, power_of_ten, within
from wearlab.store.grid import key_text

ROLES: tuple[str, ...] = ("cols", "rows", "hue")
MOST_A_ROLE = 12
"""Panels in one direction: what has more places becomes the hue."""
MOST_PANELS = 24
TOGETHER = " · "


@dataclass(frozen=True)
class Layout:
    """Series with their roles.

    Parameters
    ----------
    series : each place of a role is a label in its key
    varied : dimension → its labels in order, of those that have more than one
    roles : role → dimension
    notes : what was left out, and how to have it
    """

    series: Sequence[Series]
    varied: Mapping[str, list[Label]]
    roles: Mapping[str, str]
    notes: tuple[str, ...] = ()

    def labels(self, role: str) -> list[Label | None]:
        """Return the labels of a role, or one None."""
        return list(self.varied[self.roles[role]]) if role in self.roles else [None]


def laid_out(series: Sequence[Series], ask: Ask, kind: Kind, grid_dims: Mapping[str, str]) -> Layout:
    """Return the series with a role for everything that varies.

    Raises
    ------
    FigureError : a role names what these series do not have
    """
    varied = _varied(series)
    roles = _roles(varied, series, ask, kind, grid_dims)
    if "update" in varied and roles.get("hue") != "update":
        series = curves.states_in_common(series, grid_dims)
        varied = _varied(series)
        roles = {role: name for role, name in roles.items() if name in varied}
    return _thinned(Layout(*_combined(series, varied, roles, _redundant(series, varied))))


def _varied(series: Sequence[Series]) -> dict[str, list[Label]]:
    """Return the labels along every dimension that has more than one, in order."""
    varied: dict[str, dict[Label, None]] = {}
    for curve in series:
        for name, label in curve.key.items():
            varied.setdefault(name, {})[label] = None
    ordered = {name: _in_order(list(labels)) for name, labels in varied.items()}
    return {name: labels for name, labels in ordered.items() if len(labels) > 1}


def _in_order(labels: list[Label]) -> list[Label]:
    numbers = [label for label in labels if not isinstance(label.value, str)]
    return sorted(numbers) + [label for label in labels if isinstance(label.value, str)]


def _roles(
    varied: Mapping[str, list[Label]],
    series: Sequence[Series],
    ask: Ask,
    kind: Kind,
    grid_dims: Mapping[str, str],
) -> dict[str, str]:
    """Return role → dimension: what was asked for, then the kind's preference, then whatever is free."""
    known = {name for curve in series for name in curve.key}
    keys = {name: key for name, key in grid_dims.items() if name in known}
    asked = {role: name for role in ROLES if (name := getattr(ask, role))}
    for role, name in asked.items():
        if name not in known:
            said = no_axis(name, keys, known)
            raise FigureError(f"{ask.name}: {role} = {name!r} does not vary here; {said}")
    for role, name in asked.items():
        if first := [other for other, same in asked.items() if same == name and other != role]:
            raise FigureError(f"{ask.name}: {first[0]} and {role} both are {name!r}: leave one of them out")
    roles = {role: name for role, name in asked.items() if name in varied}
    redundant = _redundant(series, varied)
    sizes = {name: len(labels) for name, labels in varied.items()}
    if "update" in varied:  # as many as they are side by side
        sizes["update"] = len(_varied(curves.states_in_common(series, grid_dims)).get("update", [0]))
    preferred: list[tuple[str, str]] = [
        *kind.roles,
        *((role, "*") for role in ROLES),
        *((role, name) for name in varied for role in ROLES),
    ]
    if any(curve.level is not None for curve in series):  # one map would lie on another
        preferred = [(role, name) for role, name in preferred if role != "hue"]
    for most in (MOST_A_ROLE, None):  # what has many places takes panels only when nothing else is free
        for role, wished in preferred:
            left = [n for n in varied if n not in roles.values() and n not in redundant]
            names = [n for n in (grid_dims if wished == "*" else [wished]) if n in left]
            if role != "hue" and most is not None:
                names = [n for n in names if sizes[n] <= most]
            if names and role not in roles and role not in asked:
                roles[role] = names[0]
        if most is not None:
            _make_room(roles, asked, sizes, redundant)
    if "rows" in roles and "cols" not in roles and "rows" not in asked and roles["rows"] != "variable":
        roles["cols"] = roles.pop("rows")
    return roles


def _make_room(
    roles: dict[str, str], asked: Mapping[str, str], sizes: Mapping[str, int], redundant: set[str]
) -> None:
    """Let what has too many places for panels have the hue, if what has it can take panels."""
    left = [n for n in sizes if n not in roles.values() and n not in redundant]
    large = [n for n in left if sizes[n] > MOST_A_ROLE]
    free = next((role for role in ("cols", "rows") if role not in roles and role not in asked), None)
    if large and free and "hue" in roles and "hue" not in asked and sizes[roles["hue"]] <= MOST_A_ROLE:
        roles[free], roles["hue"] = roles["hue"], large[0]


def _redundant(series: Sequence[Series], varied: Mapping[str, list[Label]]) -> set[str]:
    """Return "case" where every case but the base is broadcast, and so told by the axes already."""
    axes = [name for name in varied if name != "case"]
    others = [s for s in series if "case" in s.key and s.key["case"].value != "base"]
    twin = "case" in varied and any(all(s.key.get(axis) == s.key["case"] for s in others) for axis in axes)
    return {"case"} if twin else set()


def _combined(
    series: Sequence[Series],
    varied: Mapping[str, list[Label]],
    roles: Mapping[str, str],
    redundant: set[str],
) -> tuple[Sequence[Series], Mapping[str, list[Label]], Mapping[str, str]]:
    """Give what found no role a place in that of the columns: their product becomes one dimension."""
    left = [name for name in varied if name not in roles.values() and name not in redundant]
    if not left:
        return series, varied, roles
    role = next((r for r in ("cols", "rows") if r in roles and roles[r] != "variable"), "cols")
    dims = [roles[role], *left] if role in roles else left
    name = " × ".join(dims)

    def place_of(curve: Series) -> tuple[Label, ...]:
        return tuple(curve.key[dim] for dim in dims if dim in curve.key)

    places = dict.fromkeys(place for curve in series if len(place := place_of(curve)) == len(dims))
    order = {dim: {label: i for i, label in enumerate(varied[dim])} for dim in dims}
    ranked = sorted(places, key=lambda place: [order[d][x] for d, x in zip(dims, place, strict=True)])
    labels = {
        place: Label(float(i), TOGETHER.join(dict.fromkeys(x.text for x in place)))
        for i, place in enumerate(ranked)
    }

    def combined(curve: Series) -> Series:
        if (place := place_of(curve)) not in labels:
            return curve
        rest = {key: label for key, label in curve.key.items() if key not in dims}
        return replace(curve, key={**rest, name: labels[place]})

    new = [combined(curve) for curve in series]
    kept = {key: some for key, some in varied.items() if key not in dims}
    return new, {**kept, name: list(labels.values())}, {**roles, role: name}


def _thinned(layout: Layout) -> Layout:
    """Return no more panels than can be seen: evenly spread places along the longer direction, and say so."""
    notes: list[str] = []
    while True:
        counts = {role: len(layout.labels(role)) for role in ("rows", "cols")}
        if counts["rows"] * counts["cols"] <= MOST_PANELS:
            return replace(layout, notes=tuple(notes))
        role = max(counts, key=lambda panel_role: counts[panel_role])
        other = min(counts.values())
        name, labels = layout.roles[role], layout.labels(role)
        most = max(MOST_PANELS // other, 2)
        if most >= len(labels):
            return replace(layout, notes=tuple(notes))
        chosen = spread(labels, most)
        notes.append(
            f"{name.replace('_', ' ')}: {most} of {len(labels)} places shown; "
            "the others by select, or as hue"
        )  # fmt: skip
        kept = [s for s in layout.series if s.key.get(name, chosen[0]) in chosen]
        layout = replace(layout, series=kept, varied={**layout.varied, name: chosen})


def spread(places: Iterable[Label | None], most: int) -> list[Label]:
    """Return evenly spread places, the first and the last among them."""
    some = [place for place in places if place is not None]
    return [some[round(i * (len(some) - 1) / (most - 1))] for i in range(most)]


MOST_COLUMNS = 3
SHOWS_ITSELF = ("variable", "part")  # what the y label tells
COLOURED = ("line", "line-points", "dots", "area", "horizontal", "stem")
ALONE = "#0072B2"  # a curve without a hue
OURS = "computed"
"""A curve without a hue, beside published points."""


def compose(
    series: Sequence[Series], ask: Ask, kind: Kind, grid_dims: Mapping[str, str], notes: Sequence[str]
) -> plot.Plot:
    """Return the figure of these series.

    Raises
    ------
    FigureError : a role names what these series do not have
    """
    layout = laid_out(series, ask, kind, grid_dims)
    series, varied, roles = layout.series, layout.varied, layout.roles
    rows, columns, hues = (layout.labels(role) for role in ("rows", "cols", "hue"))
    hue = roles.get("hue")
    said = list(layout.notes)
    if ask.y_as == "difference":
        series, told = curves.from_first(series, roles, ask)
        said += told
    elif ask.y_as == "logarithm":
        curves.require_positive(series, ask)
    pen = plot.pens([label for label in hues if label], hue)
    head = key_text(grid_dims.get(hue) or hue) if hue else ""
    turned = (
        len(columns) > MOST_COLUMNS >= len(rows) > 1
        and not (ask.rows or ask.cols)
        and roles.get("rows") != "variable"
    )
    cells = _cells(rows, columns, turned)
    powers = _powers(series)
    panels = []
    for (row, column), (r, c) in cells.items():
        inside = [s for s in series if _fits(s, roles, row, column)]
        if inside:
            named = [x.text for x in (column, row) if x and not _tells_itself(roles, x, varied)]
            title = ", ".join(dict.fromkeys(named))
            panels.append(_panel(inside, (r, c), title, lambda curve: _pen(curve, hue, pen), powers, series))
    panels, shape = _close(panels)
    bar = _bar_of_maps(series, hue, ask) or plot.bar_of([h for h in hues if h is not None], hue, head)
    ups = {s.up.label for s in series}
    return plot.Plot(
        title=_title(series, varied, ask, kind) if ask.title is None else ask.title,
        panels=_lettered(panels),
        rows=shape[0],
        columns=shape[1],
        share_y="all" if len(ups) == 1 else "row" if roles.get("rows") == "variable" else "none",
        legend=_legend(series, hues if bar is None else plot.beside_bar(hues), pen, hue, _alone(series, ask)),
        head=head if hue != "update" and bar is None and _is_bare(hues) else "",
        notes=(*notes, *said),
        shape=kind.shape,
        ranks=kind.ranks,
        logarithmic=ask.y_as == "logarithm",
        bar=bar,
    )


def _bar_of_maps(series: Sequence[Series], hue: str | None, ask: Ask) -> plot.Bar | None:
    """Return the bar that tells what the colours of maps mean, None where there is no map.

    Raises
    ------
    FigureError : maps would lie one on another
    """
    maps = [s for s in series if s.level is not None]
    if not maps:
        return None
    if hue is not None:
        raise FigureError(f"{ask.name}: one map hides another; choose one place of {hue!r} in select")
    colours = maps[0].colours
    assert colours is not None
    low, high = _reach_of_maps(series)
    return plot.Bar(axis_label(*colours, 0), low, high, WEAR)


def _reach_of_maps(series: Sequence[Series]) -> tuple[float, float]:
    """Return what the colours of all maps reach over, from zero on where nothing is below."""
    levels = np.concatenate([s.level for s in series if s.level is not None])
    high = float(np.nanmax(levels, initial=0.0))
    low = min(0.0, float(np.nanmin(levels, initial=0.0)))
    return low, high if high > low else low + 1.0


def _title(series: Sequence[Series], varied: Mapping[str, list[Label]], ask: Ask, kind: Kind) -> str:
    """Return the kind's title, and the places that were selected."""
    key = next((s.key for s in series if s.look not in (*BESIDE, "published")), {})
    asked = {"update" if name in runs.STATE_COORDINATES else name for name in ask.select}
    fixed = [key[name].text for name in key if name in asked and name not in varied]
    other = bool(ask.y and kind.titled and ask.y[0] != kind.y)
    label = kind.titled.format(_subject(series, kind)) if other else kind.title
    label = axis_label(label or (series[0].across if kind.along_x else series[0].up).label, "", 0)
    return ", ".join(dict.fromkeys([label, *fixed]))


def _subject(series: Sequence[Series], kind: Kind) -> str:
    """Return what the curves show in words, as they stand within a sentence."""
    first = next((s for s in series if s.look not in (*BESIDE, "published")), series[0])
    label = (first.across if kind.along_x else first.up).label
    return within(label)


def _cells(
    rows: list[Label | None], columns: list[Label | None], turned: bool
) -> dict[tuple[Label | None, Label | None], tuple[int, int]]:
    """Return the place of every panel; rows of many columns are turned into columns, or combined."""
    if turned:
        return {(row, col): (c, r) for c, col in enumerate(columns) for r, row in enumerate(rows)}
    if len(columns) <= MOST_COLUMNS:
        return {(row, col): (r, c) for r, row in enumerate(rows) for c, col in enumerate(columns)}
    width = 2 if len(columns) == 4 else MOST_COLUMNS
    lines = -(-len(columns) // width)
    return {
        (row, col): (r * lines + i // width, i % width)
        for r, row in enumerate(rows)
        for i, col in enumerate(columns)
    }


def _close(panels: Sequence[plot.Panel]) -> tuple[list[plot.Panel], tuple[int, int]]:
    """Return panels without the rows and columns that none of them stands in, and how many there are."""
    rows, columns = (sorted({getattr(panel, side) for panel in panels}) for side in ("row", "column"))
    moved = [replace(p, row=rows.index(p.row), column=columns.index(p.column)) for p in panels]
    return moved, (len(rows), len(columns))


def _fits(curve: Series, roles: Mapping[str, str], row: Label | None, column: Label | None) -> bool:
    """Say whether a series belongs into a panel; what lacks the panel's dimension belongs into all."""
    return all(
        wanted is None or curve.key.get(roles[role], wanted) == wanted
        for role, wanted in (("rows", row), ("cols", column))
    )


def _tells_itself(roles: Mapping[str, str], label: Label, varied: Mapping[str, list[Label]]) -> bool:
    return any(name in SHOWS_ITSELF and label in varied.get(name, []) for name in roles.values())


def _powers(series: Sequence[Series]) -> dict[tuple[str, str, str], int]:
    """Return the power of ten of each thing that axes show, the same in every panel."""
    held: dict[tuple[str, str, str], list[Array]] = {}
    for curve in series:
        held.setdefault(("x", *curve.across), []).append(curve.x)
        held.setdefault(("y", *curve.up), []).append(curve.y)
    return {key: 0 if key[2] == plot.DAYS else power_of_ten(arrays, key[2]) for key, arrays in held.items()}


def _panel(
    inside: Sequence[Series],
    place: tuple[int, int],
    title: str,
    pen: Callable[[Series], Pen],
    powers: Mapping[tuple[str, str, str], int],
    all_series: Sequence[Series],
) -> plot.Panel:
    first = next((s for s in inside if s.look not in BESIDE), inside[0])
    dates = first.across.units == plot.DAYS
    across, up = powers[("x", *first.across)], powers[("y", *first.up)]
    drawn = []
    for s in sorted(inside, key=lambda s: s.look == "published"):
        sides = (("x_error", s.x_error, across), ("y_error", s.y_error, up))
        beside = {name: None if error is None else error / 10.0**power for name, error, power in sides}
        beside |= {"doubtful": s.doubtful, "runs": s.runs, "level": s.level}
        reach = (0.0, 1.0) if s.level is None else _reach_of_maps(all_series)
        x, y = s.x / 10.0**across, s.y / 10.0**up
        drawn.append(plot.Curve(x, y, pen(s), s.look, "", reach, **beside))
    marks = {mark: None for s in inside for mark in s.marks}
    return plot.Panel(
        *place,
        title,
        axis_label(first.across.label, "" if dates else first.across.units, across),
        axis_label(*first.up, up),
        tuple(drawn),
        tuple(mark._replace(x=mark.x / 10.0**across) for mark in marks),
        _hours(inside, across),
        next((s.names for s in inside if s.names), ()),
        dates,
    )


def _hours(inside: Sequence[Series], power: int) -> float | None:
    """Return the operating hours of one unit of x, where all curves agree on it."""
    told = {f"{s.hours:.9g}" if s.hours else "" for s in inside if s.look not in (*BESIDE, "published")}
    return float(told.pop()) * 10.0**power if len(told) == 1 and "" not in told else None


def _pen(curve: Series, hue: str | None, pen: Mapping[Label, Pen]) -> Pen:
    if curve.look in BESIDE:
        return BESIDE[curve.look]
    if hue is not None and hue in curve.key and curve.key[hue] in pen:
        return pen[curve.key[hue]]
    return Pen(INK if curve.look == "published" or (hue and curve.look != "points") else ALONE, "-", "o")


def _is_bare(hues: Sequence[Label | None]) -> bool:
    """Say whether labels begin with a number, of which they do not say what it is."""
    return any(label is not None and label.text[:1].isdigit() for label in hues[:1])


def _lettered(panels: list[plot.Panel]) -> tuple[plot.Panel, ...]:
    if len(panels) == 1:
        return tuple(panels)
    return tuple(
        replace(panel, title=f"({chr(ord('a') + i)}) {panel.title}".rstrip()) if i < 26 else panel
        for i, panel in enumerate(panels)
    )


def _alone(series: Sequence[Series], ask: Ask) -> str | None:
    """Return the name of the only case that is drawn, where cases were to be told apart; None otherwise."""
    ours = {s.key["case"].text for s in series if "case" in s.key and s.look not in (*BESIDE, "published")}
    return next(iter(ours)) if ask.hue == "case" and len(ours) == 1 else None


def _legend(
    series: Sequence[Series],
    hues: list[Label | None],
    pen: Mapping[Label, Pen],
    hue: str | None,
    alone: str | None = None,
) -> tuple[plot.LegendEntry, ...]:
    coloured = [s for s in reversed(series) if s.look in COLOURED]
    looks = {s.key[hue]: s.look for s in coloured if hue is not None and hue in s.key}
    entries = [plot.LegendEntry(h.text, pen[h], looks.get(h, "line")) for h in hues if h is not None]
    if not entries and coloured and (alone or any(s.look == "published" for s in series)):
        entries = [plot.LegendEntry(alone or OURS, Pen(ALONE, "-", "o"), coloured[-1].look)]
    extra = {s.text: s for s in reversed(series) if s.text}
    own = BESIDE | {
        "area": Pen(ALONE),
        "line": Pen(ALONE),
        "line-points": Pen(ALONE, "-", "o"),
    }
    for text, curve in sorted(reversed(extra.items()), key=lambda item: item[1].look):
        entries.append(plot.LegendEntry(text, own.get(curve.look, Pen(INK, "", "o")), curve.look))
    return tuple(entries)
