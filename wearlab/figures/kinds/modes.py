"""Natural frequencies against the mesh frequency and its harmonics: a Campbell diagram."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from wearlab.figures.ask import Ask
from wearlab.figures.kind import Kind
from wearlab.figures.plot import Scale, Series
from wearlab.figures.runs import Run
from wearlab.figures.slices import companion, slices
from wearlab.figures.wording import Label, ordinal

ORDERS = 4
MARGIN = 1.12
STILL = 1e-6  # of the highest natural frequency
ALIKE = 1e-3  # relative, of natural frequencies that one panel shows for all runs
MOST_APART = 12
NATURAL = "natural frequency"


def _campbell(run: Run, ask: Ask) -> Iterator[Series]:
    """Yield mesh harmonics over speed, natural frequencies, and the point at which the run works."""
    for piece in slices(run, "natural_frequency", ask, "mode"):
        critical, across = companion(run, "critical_speed", piece.place, ask)
        mesh = float(companion(run, "mesh_frequency", piece.place, ask)[0].ravel()[0])
        moving = piece.values > STILL * piece.values.max()  # a free set turns as a whole at 0 Hz
        natural, critical = piece.values[moving], critical[moving]
        if not len(natural):
            continue
        per_speed = float(natural[0] / critical[0])  # mesh frequency over speed: mesh periods per turn
        top = MARGIN * max(float(critical.max()), mesh / per_speed)
        up = Scale("frequency", piece.scale.units)
        across = Scale("speed of the input member", across.units)
        yield from _harmonics(piece.key, per_speed, top, float(natural.max()), across, up)
        for frequency in natural:
            ends = np.array([0.0, top]), np.full(2, frequency)
            yield Series(piece.key, *ends, across, up, "reference", NATURAL)
        meets = mesh * np.arange(1.0, ORDERS + 1)
        meets = meets[meets <= MARGIN * float(natural.max())]
        at = np.full(len(meets), mesh / per_speed)
        yield Series(piece.key, at, meets, across, up, "points", "speeds of the runs")


def _harmonics(
    key: Mapping[str, Label], per_speed: float, top: float, highest: float, across: Scale, up: Scale
) -> Iterator[Series]:
    """Yield the mesh frequency and its harmonics over speed, as far as natural frequencies reach."""
    for order in range(1, ORDERS + 1):
        name = Label(float(order), "mesh frequency" if order == 1 else f"{ordinal(order)} harmonic")
        x = np.array([0.0, min(top, MARGIN * highest / (order * per_speed))])
        yield Series({**key, "order": name}, x, order * per_speed * x, across, up)


def _together(series: list[Series]) -> list[Series]:
    """Return the series of runs without their places where all have the same natural frequencies."""
    frequencies: dict[tuple[object, ...], list[float]] = {}
    for curve in series:
        if curve.text == NATURAL:
            place = tuple(sorted(item for item in curve.key.items() if item[0] != "order"))
            frequencies.setdefault(place, []).append(float(curve.y[0]))
    some = list(frequencies.values())
    alike = all(len(curve) == len(some[0]) and np.allclose(curve, some[0], rtol=ALIKE) for curve in some)
    if not alike and len(some) <= MOST_APART:
        return series
    by_mode: dict[object, Series] = {}
    longest = sorted(series, key=lambda curve: -float(curve.x[-1]))
    for curve in longest:
        key = {name: label for name, label in curve.key.items() if name == "order"}
        same = (tuple(key), tuple(key.values()), curve.text, *(f"{x:.6g}" for x in curve.y))
        by_mode.setdefault(same if curve.look != "points" else id(curve), replace(curve, key=key))
    lines: dict[Label, Series] = {}
    for curve in by_mode.values():
        if "order" in curve.key:
            lines.setdefault(curve.key["order"], curve)
    others = [curve for curve in by_mode.values() if "order" not in curve.key]
    return [*(lines[order] for order in sorted(lines)), *others]


NATURAL_MODES = Kind(
    name="natural-modes",
    title="Natural frequencies and mesh harmonics",
    shows="natural frequencies, and the mesh frequency with its harmonics over speed",
    needs=("natural_frequency", "critical_speed", "mesh_frequency"),
    dims=("mode",),
    series=_campbell,
    roles=(("hue", "order"), ("cols", "*"), ("rows", "*")),
    joined=_together,
)
