"""One number a run: beside its name, over inputs, ranked by influence.

Cases named ``what: value`` differ in this ``what`` alone from the case without a colon in its name; other
cases stand each for themselves. A sweep is an influence: the mean result at each of its places over all
others. So is a sampled input: the mean result in bins of equally many runs.
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from wearlab.arrays import Array
from wearlab.figures import FigureError, runs, wording
from wearlab.figures.kind import Ask, Run, Slice, companion, kind, lone, shown, slices
from wearlab.figures.plot import Look, Mark, Scale, Series, flat, gathered, grouped, merged, without
from wearlab.nearest import choices

MOST = 80
"""Names that can be read one below the other."""
DEPTH = "max_wear_depth"
PLACE = Scale("run", "1")


def _numbers(run: Run, ask: Ask) -> Iterator[Series]:
    """One number of every run, at its last wear state, beside the run's name.

    Yield a run's number, at its last wear state where none is selected, named by its place in the grid.
    """
    called = ", ".join(dict.fromkeys(label.text for label in run.place.values())) or "run"
    for piece in slices(run.last_state(), ask.y[0], ask):
        named = without(piece.key, *run.place, "update") | {"run": wording.Label(called, called)}
        values = np.atleast_1d(piece.values)
        yield Series(named, values, np.zeros(1), piece.scale, PLACE, "points", x_error=piece.error)


def listed(series: list[Series]) -> list[Series]:
    """Join the numbers of what is not the run, one below the other in the order of the file.

    Raises
    ------
    FigureError : more names than can be read
    """
    names = tuple(dict.fromkeys(curve.key["run"].text for curve in series))
    if len(names) > MOST:
        said = f"cases: {len(names)} runs cannot be told by name (at most {MOST})"
        raise FigureError(f"{said}: narrow them with select, or take histogram or scatter")
    places = [np.array([1.0 + names.index(curve.key["run"].text)]) for curve in series]
    apart = [without(curve.key, "run") for curve in series]
    told = [replace(c, key=k, y=y, names=names) for c, k, y in zip(series, apart, places, strict=True)]
    rows = [merged(group) for group in grouped(told).values()]
    if len(rows) == 1 and len(names) > 1:
        first = rows[0]
        level = flat((0.5, len(names) + 0.5), first.x[0])[::-1]
        rows.append(Series({}, *level, first.across, first.up, "reference", names[0], names=names))
    return rows


CASES = kind(
    "cases", "", (DEPTH,), roles=(("hue", "*"),), all_cases=True, ranks=True, y=DEPTH, titled="{}",
    joined=listed, along_x=True,
)(_numbers)  # fmt: skip


MANY = 60  # points, from which on they are drawn small
NUMBERED = ("sample", "scene")  # axes that only count runs
SHARE = Scale("share of each range", "1")


def _points(run: Run, ask: Ask) -> Iterator[Series]:
    """One point a run: a result y (at the last wear state) over an input or another result x."""
    for piece in _results(run, ask):
        x, across, own = _abscissa(run, ask, piece)
        roles = {n: run.along[n] for n in (ask.hue, ask.rows, ask.cols) if n is not None and n in run.along}
        key = without(piece.key, *run.place) | roles
        yield piece._replace(key=key).over(x, across, "points", own=own)


def _results(run: Run, ask: Ask) -> Iterator[Slice]:
    """Yield the result at each place along its dimensions, at the last wear state when none is selected."""
    for piece in slices(run.last_state(), ask.y[0], ask):
        yield piece._replace(key=without(piece.key, "update"))


def _inputs(run: Run) -> list[str]:
    """Return the axes, and what advances with them, those that only count runs apart."""
    names = [name for name in run.along if name != "case"]
    return [name for name in names if name not in NUMBERED] or names


def _abscissa(run: Run, ask: Ask, piece: Slice) -> tuple[Array, Scale, float | None]:
    inputs = _inputs(run)
    name = ask.x or next(iter(inputs), None)
    if name is None:
        raise ask.wrong(f"x must name an axis or a result; {choices('', run.data.data_vars)}")
    if name in run.along:
        x, own = run.abscissa(name)
        return np.array([x]), run.scales[name], own
    if name not in run.data.variables:
        raise ask.wrong(f"x = {name!r} is not there; {choices(name, [*inputs, *run.data])}")
    return *lone(*companion(run.last_state(), name, piece.place, ask), name, ask), None


def _gathered(series: list[Series]) -> list[Series]:
    """Join the points that nothing tells apart; a case without a place on x becomes a level."""
    look: Look = "dots" if len(series) > MANY else "points"
    return [replace(c, look=look) if c.look == "points" else c for c in gathered(series)]


def _polyline(run: Run, ask: Ask) -> Iterator[Series]:
    """One line a run across all inputs and the result y, coloured by the result.

    Yield a run's inputs and its result as they are; `_ranged` puts them on their ranges.
    """
    names = _inputs(run)
    if any(isinstance(run.along[name].value, str) for name in names):
        return  # a case beside the axes
    for piece in _results(run, ask):
        result = np.atleast_1d(piece.values)
        if not np.isfinite(result).all():
            continue
        values = np.array([*(float(run.along[name].value) for name in names), float(result[0])])
        scales = [*(run.scales[name] for name in names), piece.scale]
        marks = [Mark(float(at), "|".join(scale)) for at, scale in enumerate(scales)]
        key = without(piece.key, *run.place)
        text = f"{result[0]:.4g} {wording.typeset(piece.scale.units)}".strip()
        key |= {"result": wording.Label(float(result[0]), text)}
        places = np.arange(len(values), dtype=float)
        yield Series(key, places, values, Scale("", "1"), piece.scale, "hairline", marks=tuple(marks))


def _ranged(series: list[Series]) -> list[Series]:
    """Put every axis on its own range; its words and its ends stand above it."""
    table = np.array([curve.y for curve in series])
    low, high = table.min(axis=0), table.max(axis=0)
    width = np.where(high > low, high - low, 1.0)
    marks = tuple(
        Mark(mark.x, f"{words}\n{a:.3g} … {b:.3g} {wording.typeset(units)}".rstrip())
        for mark, a, b in zip(series[0].marks, low, high, strict=True)
        for words, _, units in [mark.text.partition("|")]
    )
    return [replace(curve, y=(curve.y - low) / width, up=SHARE, marks=marks) for curve in series]


SCATTER = kind(
    "scatter", "", ("life",), roles=(("hue", "flank"), ("hue", "member"), ("cols", "mesh")), all_cases=True,
    over_sweeps=True, joined=_gathered, y="life",
)(_points)  # fmt: skip
PARALLEL = kind(
    "parallel-coordinates", "Inputs and result of every run", ("life",),
    roles=(("hue", "result"), ("cols", "flank"), ("cols", "mesh")), all_cases=True, one_flank=True,
    joined=_ranged, y="life",
)(_polyline)  # fmt: skip


BETWEEN = ": "
RANK = Scale("order of influence", "1")
MOST_BINS = 8
LEAST_IN_BIN = 4
MOST_PLACES = 20
"""Places of a sweep shown one by one; of more, bins."""


def _case(run: Run, ask: Ask) -> Iterator[Series]:
    """Yield a run's value as one point; `ranked` puts the points of one influence on one line."""
    name = ask.y[0]
    values, scale = lone(*shown(run.data[name], name, ask), name, ask)
    if not np.isfinite(values).all():
        return
    case = run.place.get("case")
    label = runs.BASE if case is None else str(case.value)
    what, between, _ = label.partition(BETWEEN)
    what = what if between else "" if label == runs.BASE else label
    # a case that is broadcast stands nowhere along the axes; keys that advance with an axis stand for it
    axes = {} if what else {run.scales[n].label: x for n, x in without(run.along, "case").items()}
    key = {**axes, "influence": wording.Label(what, what)}
    yield Series(key, values.reshape(1), np.zeros(1), scale, RANK, "line-points")


def ranked(series: list[Series]) -> list[Series]:
    """Join the points of every influence, the one with the widest range first; the base becomes a line.

    Raises
    ------
    FigureError : nothing varies
    """
    cases: dict[str, list[float]] = defaultdict(list)
    for curve in series:
        cases[curve.key["influence"].text].append(float(curve.x[0]))
    base = cases.pop("", [])
    if len(base) == 0 and len(cases) > 1 and any(len(v) > 1 for v in cases.values()):
        # one case without a colon in its name is the base of the others
        alone = [name for name, values in cases.items() if len(values) == 1]
        base = cases.pop(alone[0]) if alone else []
    level = [float(np.mean(base))] if base else []
    groups = {what: np.array(values + level) for what, values in cases.items()}
    groups |= _of_axes([curve for curve in series if not curve.key["influence"].text])
    groups = {what: np.sort(values) for what, values in groups.items() if len(values) > 1}
    if not groups:
        raise FigureError(
            "nothing varies in this result: sweeps, samples or cases are needed, such as [[case]] with "
            'label = "torque: 300 N·m"; or none of the runs has a finite result'
        )
    order = sorted(groups, key=lambda what: np.ptp(groups[what]), reverse=True)
    names, scales = tuple(what.replace("_", " ") for what in order), (series[0].across, RANK)
    ranks = []
    for rank, what in enumerate(order, 1):
        places = np.full(len(groups[what]), float(rank))
        ranks.append(Series({}, groups[what], places, *scales, "line-points", names=names))
    if level:
        words = "base" if len(base) == 1 else "mean of the base runs"
        line = flat((0.5, len(order) + 0.5), level[0])[::-1]
        ranks.append(Series({}, *line, *scales, "reference", words))
    return ranks


def _of_axes(outcomes: Sequence[Series]) -> dict[str, Array]:
    """Return the mean results along every axis and every key that advances with one."""
    values = np.array([float(outcome.x[0]) for outcome in outcomes])
    spread = {}
    for name in dict.fromkeys(name for outcome in outcomes for name in without(outcome.key, "influence")):
        at = [outcome.key[name].value if name in outcome.key else None for outcome in outcomes]
        distinct = list(dict.fromkeys(at))
        if len(distinct) < 2 or (len(distinct) == len(at) and name in ("seed", "sample", "run")):
            continue
        if len(distinct) <= MOST_PLACES or any(isinstance(x, str) for x in distinct):
            means = [values[[x == place for x in at]].mean() for place in distinct]
        else:
            bins = min(MOST_BINS, len(values) // LEAST_IN_BIN)
            means = [values[some].mean() for some in np.array_split(np.argsort(np.array(at, float)), bins)]
        spread[name] = np.array(means, float)
    return spread


SENSITIVITY = kind(
    "sensitivity", "Order of influence", ("life",), roles=(), all_cases=True, ranks=True, joined=ranked,
    titled="What moves the {}", along_x=True,
    shows="the range of one result over cases named 'what: value', over sweeps and over sampled inputs "
    "(means over all else), one line for each, widest first",
)(_case)  # fmt: skip
