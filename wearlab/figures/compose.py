"""Series find their panels and pens: what varies becomes hue, columns or rows."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import groupby

from wearlab.figures.ask import Ask
from wearlab.figures.errors import FigureError, choices
from wearlab.figures.kind import Kind
from wearlab.figures.palette import GREY, INK, pens
from wearlab.figures.plot import Curve, Entry, Panel, Pen, Plot, Series
from wearlab.figures.select import STATE_COORDINATES
from wearlab.figures.wording import Label, axis_label, power_of_ten

ROLES = ("cols", "rows", "hue")
MOST_COLUMNS = 3
SHOWS_ITSELF = ("variable", "part")  # what the y label tells
ALONE = "#0072B2"  # a curve without a hue
REFERENCE = Pen(GREY, ":")
OURS = "computed"
"""A curve without a hue, beside published points."""


def compose(
    series: Sequence[Series], ask: Ask, kind: Kind, grid_dims: Sequence[str], notes: Sequence[str]
) -> Plot:
    """Return the figure of these series.

    Raises
    ------
    FigureError : a role names what these series do not have, or more varies than there are roles
    """
    varied = _varied(series)
    roles = _roles(varied, series, ask, kind, grid_dims)
    rows = _labels(varied, roles, "rows")
    columns = _labels(varied, roles, "cols")
    hues = _labels(varied, roles, "hue")
    pen = pens([label for label in hues if label], roles.get("hue"))
    cells = _cells(rows, columns)
    shape = (max(r for r, _ in cells.values()) + 1, max(c for _, c in cells.values()) + 1)
    powers = _powers(series)
    panels = []
    for (row, column), (r, c) in cells.items():
        inside = [s for s in series if _fits(s, roles, row, column)]
        if inside:
            named = [x.text for x in (column, row) if x and not _tells_itself(roles, x, varied)]
            panels.append(
                _panel(inside, r, c, ", ".join(dict.fromkeys(named)), roles.get("hue"), pen, powers)
            )
    legend = _legend(series, hues, pen, roles.get("hue"))
    ups = {s.up.words for s in series}
    return Plot(
        title=ask.title or _title(series, varied, ask, kind),
        panels=_lettered(panels),
        rows=shape[0],
        columns=shape[1],
        share_y="all" if len(ups) == 1 else "row" if roles.get("rows") == "variable" else "none",
        legend=legend,
        notes=tuple(notes),
        shape=kind.shape,
        ranks=kind.ranks,
    )


def _title(series: Sequence[Series], varied: Mapping[str, list[Label]], ask: Ask, kind: Kind) -> str:
    """Return the kind's title, and the places that were selected."""
    key = next((s.key for s in series if s.look not in ("reference", "published")), {})
    asked = {"update" if name in STATE_COORDINATES else name for name in ask.select}
    fixed = [key[name].text for name in key if name in asked and name not in varied]
    words = kind.title or axis_label(series[0].up.words, "", 0)
    return ", ".join(dict.fromkeys([words, *fixed]))


def hue_of(series: Sequence[Series], ask: Ask, kind: Kind, grid_dims: Sequence[str]) -> str | None:
    """Return the dimension that becomes the hue, None when none does."""
    return _roles(_varied(series), series, ask, kind, grid_dims).get("hue")


def _varied(series: Sequence[Series]) -> dict[str, list[Label]]:
    """Return the labels along every dimension that has more than one, in order."""
    found: dict[str, dict[Label, None]] = {}
    for one in series:
        for name, label in one.key.items():
            found.setdefault(name, {})[label] = None
    ordered = {name: _in_order(list(labels)) for name, labels in found.items()}
    return {name: labels for name, labels in ordered.items() if len(labels) > 1}


def _in_order(labels: list[Label]) -> list[Label]:
    numbers = [label for label in labels if not isinstance(label.value, str)]
    return sorted(numbers) + [label for label in labels if isinstance(label.value, str)]


def _roles(
    varied: Mapping[str, list[Label]],
    series: Sequence[Series],
    ask: Ask,
    kind: Kind,
    grid_dims: Sequence[str],
) -> dict[str, str]:
    """Return role → dimension: what was asked for, then the kind's preference, then whatever is free."""
    known = {name for one in series for name in one.key}
    asked = {role: name for role in ROLES if (name := getattr(ask, role))}
    for role, name in asked.items():
        if name not in known:
            raise FigureError(
                f"{ask.name}: {role} = {name!r} does not vary here; {choices(name, sorted(known))}"
            )
    roles = {role: name for role, name in asked.items() if name in varied}
    preferred = [
        *kind.roles,
        *((role, "*") for role in ROLES),
        *((role, name) for name in varied for role in ROLES),
    ]
    redundant = _broadcast_twin(series, varied)
    for role, wished in preferred:
        left = [n for n in varied if n not in roles.values() and n not in redundant]
        names = [n for n in grid_dims if n in left] if wished == "*" else [wished] if wished in left else []
        if names and role not in roles and role not in asked:
            roles[role] = names[0]
    left = [n for n in varied if n not in roles.values() and n not in redundant]
    if left:
        raise FigureError(
            f"{ask.name}: {', '.join(left)} still vary beside {', '.join(roles.values())}; "
            "choose one place along each in select"
        )
    if "rows" in roles and "cols" not in roles and "rows" not in asked and roles["rows"] != "variable":
        roles["cols"] = roles.pop("rows")
    return roles


def _broadcast_twin(series: Sequence[Series], varied: Mapping[str, list[Label]]) -> set[str]:
    """Return "case" where every case but the base is broadcast, and so told by the axes already."""
    axes = [name for name in varied if name != "case"]
    others = [s for s in series if "case" in s.key and s.key["case"].value != "base"]
    twin = "case" in varied and any(all(s.key.get(axis) == s.key["case"] for s in others) for axis in axes)
    return {"case"} if twin else set()


def _labels(varied: Mapping[str, list[Label]], roles: Mapping[str, str], role: str) -> list[Label | None]:
    return list(varied[roles[role]]) if role in roles else [None]


def _cells(
    rows: list[Label | None], columns: list[Label | None]
) -> dict[tuple[Label | None, Label | None], tuple[int, int]]:
    """Return the place of every panel; a single row of many columns is wrapped."""
    if len(rows) > 1 or len(columns) <= MOST_COLUMNS:
        return {(row, col): (r, c) for r, row in enumerate(rows) for c, col in enumerate(columns)}
    width = 2 if len(columns) == 4 else MOST_COLUMNS
    return {(rows[0], col): divmod(i, width) for i, col in enumerate(columns)}


def _fits(one: Series, roles: Mapping[str, str], row: Label | None, column: Label | None) -> bool:
    """Say whether a series belongs into a panel; what lacks the panel's dimension belongs into all."""
    return all(
        wanted is None or one.key.get(roles[role], wanted) == wanted
        for role, wanted in (("rows", row), ("cols", column))
    )


def _tells_itself(roles: Mapping[str, str], label: Label, varied: Mapping[str, list[Label]]) -> bool:
    return any(name in SHOWS_ITSELF and label in varied.get(name, []) for name in roles.values())


def _powers(series: Sequence[Series]) -> dict[tuple[str, str, str], int]:
    """Return the power of ten of each thing that axes show, the same in every panel."""
    powers = {}
    for side in ("x", "y"):
        for scale, group in groupby(
            sorted(series, key=lambda s: _scale(s, side)), key=lambda s: _scale(s, side)
        ):
            powers[(side, *scale)] = power_of_ten([getattr(s, side) for s in group], scale[1])
    return powers


def _scale(one: Series, side: str) -> tuple[str, str]:
    scale = one.across if side == "x" else one.up
    return scale.words, scale.units


def _panel(
    inside: Sequence[Series],
    row: int,
    column: int,
    title: str,
    hue: str | None,
    pen: Mapping[Label, Pen],
    powers: Mapping[tuple[str, str, str], int],
) -> Panel:
    first = next((s for s in inside if s.look != "reference"), inside[0])
    across, up = powers[("x", *_scale(first, "x"))], powers[("y", *_scale(first, "y"))]
    curves = [
        Curve(s.x / 10.0**across, s.y / 10.0**up, _pen(s, hue, pen), s.look)
        for s in sorted(inside, key=lambda s: s.look == "published")
    ]
    marks = {mark: None for s in inside for mark in s.marks}
    return Panel(
        row,
        column,
        title,
        axis_label(*first.across, across),
        axis_label(*first.up, up),
        tuple(curves),
        tuple(mark._replace(x=mark.x / 10.0**across) for mark in marks),
    )


def _pen(one: Series, hue: str | None, pen: Mapping[Label, Pen]) -> Pen:
    if one.look == "reference":
        return REFERENCE
    if hue is not None and hue in one.key and one.key[hue] in pen:
        return pen[one.key[hue]]
    return Pen(INK if one.look == "published" or (hue and one.look != "points") else ALONE, "-", "o")


def _lettered(panels: list[Panel]) -> tuple[Panel, ...]:
    if len(panels) == 1:
        return tuple(panels)
    return tuple(
        replace(panel, title=f"({chr(ord('a') + i)}) {panel.title}".rstrip()) if i < 26 else panel
        for i, panel in enumerate(panels)
    )


def _legend(
    series: Sequence[Series], hues: list[Label | None], pen: Mapping[Label, Pen], hue: str | None
) -> tuple[Entry, ...]:
    coloured = [s for s in reversed(series) if s.look in ("line", "line-points", "dots", "area")]
    looks = {s.key[hue]: s.look for s in coloured if hue is not None and hue in s.key}
    entries = [Entry(h.text, pen[h], looks.get(h, "line")) for h in hues if h is not None]
    if not entries and coloured and any(s.look == "published" for s in series):
        entries = [Entry(OURS, Pen(ALONE, "-", "o"), coloured[-1].look)]
    extra = {s.text: s for s in reversed(series) if s.text}
    own = {"reference": REFERENCE, "area": Pen(ALONE)}
    for text, one in sorted(reversed(extra.items()), key=lambda item: item[1].look):
        entries.append(Entry(text, own.get(one.look, Pen(INK, "", "o")), one.look))
    return tuple(entries)
