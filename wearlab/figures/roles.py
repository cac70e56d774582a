"""What varies becomes hue, columns or rows of panels, by how much of it there is; nothing is left over."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from wearlab.figures.ask import Ask
from wearlab.figures.bands import states_in_common
from wearlab.figures.errors import FigureError, choices
from wearlab.figures.kind import Kind
from wearlab.figures.plot import Series
from wearlab.figures.wording import Label

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


def laid_out(series: Sequence[Series], ask: Ask, kind: Kind, grid_dims: Sequence[str]) -> Layout:
    """Return the series with a role for everything that varies.

    Raises
    ------
    FigureError : a role names what these series do not have
    """
    varied = _varied(series)
    roles = _roles(varied, series, ask, kind, grid_dims)
    if "update" in varied and roles.get("hue") != "update":
        series = states_in_common(series, grid_dims)
        varied = _varied(series)
        roles = {role: name for role, name in roles.items() if name in varied}
    return _thinned(Layout(*_folded(series, varied, roles, _redundant(series, varied))))


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
    grid_dims: Sequence[str],
) -> dict[str, str]:
    """Return role → dimension: what was asked for, then the kind's preference, then whatever is free."""
    known = {name for curve in series for name in curve.key}
    asked = {role: name for role in ROLES if (name := getattr(ask, role))}
    for role, name in asked.items():
        if name not in known:
            raise FigureError(
                f"{ask.name}: {role} = {name!r} does not vary here; {choices(name, sorted(known))}"
            )
    roles = {role: name for role, name in asked.items() if name in varied}
    redundant = _redundant(series, varied)
    sizes = {name: len(labels) for name, labels in varied.items()}
    if "update" in varied:  # as many as they are side by side
        sizes["update"] = len(_varied(states_in_common(series, grid_dims)).get("update", [0]))
    preferred: list[tuple[str, str]] = [
        *kind.roles,
        *((role, "*") for role in ROLES),
        *((role, name) for name in varied for role in ROLES),
    ]
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


def _folded(
    series: Sequence[Series], varied: Mapping[str, list[Label]], roles: Mapping[str, str], redundant: set[str]
) -> tuple[Sequence[Series], Mapping[str, list[Label]], Mapping[str, str]]:
    """Give what found no role a place in that of the columns: their product becomes one dimension."""
    left = [name for name in varied if name not in roles.values() and name not in redundant]
    if not left:
        return series, varied, roles
    role = next((r for r in ("cols", "rows") if r in roles and roles[r] != "variable"), "cols")
    dims = [roles[role], *left] if role in roles else left
    name = " × ".join(dims)
    places: dict[tuple[Label, ...], None] = {}
    for curve in series:
        if all(dim in curve.key for dim in dims):
            places[tuple(curve.key[dim] for dim in dims)] = None
    order = {dim: {label: i for i, label in enumerate(varied[dim])} for dim in dims}
    ranked = sorted(places, key=lambda place: [order[d][x] for d, x in zip(dims, place, strict=True)])
    labels = {
        place: Label(float(i), TOGETHER.join(dict.fromkeys(x.text for x in place)))
        for i, place in enumerate(ranked)
    }

    def folded(curve: Series) -> Series:
        if not all(dim in curve.key for dim in dims):
            return curve
        rest = {key: label for key, label in curve.key.items() if key not in dims}
        return replace(curve, key={**rest, name: labels[tuple(curve.key[dim] for dim in dims)]})

    new = [folded(curve) for curve in series]
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
