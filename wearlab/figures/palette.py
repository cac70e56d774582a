"""Colours that colour-blind readers can tell apart: a set for names, maps for what is ordered."""

import re
from collections.abc import Sequence

import numpy as np

from wearlab.figures.plot import Bar, Pen
from wearlab.figures.wording import Label

NAMES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")  # Okabe and Ito
WEAR = ("#2b2d42", "#3b5b92", "#3a8fb7", "#59b78f", "#d8b13c", "#d9622b")  # unworn to worn, dark to warm
SWEEP = ("#2d1160", "#721f81", "#b73779", "#f1605d", "#f39a3d")  # magma without its palest end
INK, GREY = "#222222", "#7a7a7a"
BESIDE = {
    "reference": Pen(GREY, ":"),
    "level": Pen(INK),
    "dashed": Pen(INK, "--"),
    "dash-dot": Pen(INK, "-."),
}
"""Looks of thin lines that stand beside curves and take no hue."""
WIDEST = 1.6  # the unworn state, so that it shows below what falls on it
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
DASHES = ("-", "--", "-.", ":")


MOST_ENTRIES = 8
"""Numbers in a legend: more become a bar of colours."""
MOST_NAMES = 16
LOGARITHMIC = 50.0
"""Largest over smallest of numbers that are told apart by their logarithms."""
BY_NAME = ("quantity", "harmonic", "pair", "mode", "influence", "variable")
LEADING_NUMBER = re.compile(r"[-+]?[\d.,]+(?:e[-+]?\d+)?\s*(.*)")


def pens(labels: Sequence[Label], facet: str | None) -> dict[Label, Pen]:
    """Return a pen for each label of a hue: from a map where the labels are numbers, else from a set.

    Names among numbers (a static case among speeds) are drawn in ink, dashed. Many numbers take their colours
    from a bar by their size, many names by their order.
    """
    numbers, names = _parted(labels)
    bar = bar_of(labels, facet)
    if bar is not None and not numbers:
        return {label: Pen(along(bar.anchors, i / (len(names) - 1))) for i, label in enumerate(names)}
    if not numbers or facet in BY_NAME:
        return {label: _named(i) for i, label in enumerate(labels)}
    anchors, widest = (WEAR, WIDEST) if facet == "update" else (SWEEP, 1.0)
    if bar is not None:
        coloured = {label: Pen(along(anchors, bar.share(float(label.value)))) for label in numbers}
    else:
        places = [i / max(1, len(numbers) - 1) for i in range(len(numbers))]
        coloured = {
            label: Pen(along(anchors, at), "-", MARKERS[i % len(MARKERS)], 1.0 + (widest - 1.0) * (1.0 - at))
            for i, (label, at) in enumerate(zip(numbers, places, strict=True))
        }
    return coloured | {label: Pen(INK, DASHES[1 + i % 3], "o") for i, label in enumerate(names)}


def bar_of(labels: Sequence[Label], facet: str | None) -> Bar | None:
    """Return the bar that tells what colours mean where there are too many for a legend, else None."""
    numbers, names = _parted(labels)
    if facet is None:
        return None
    if not numbers and len(names) > MOST_NAMES:
        words = f"{facet.replace('_', ' ')}, in order: {names[0].text} … {names[-1].text}"
        return Bar(words, 1.0, float(len(names)), SWEEP)
    if len(numbers) <= MOST_ENTRIES or facet in BY_NAME:
        return None
    values = np.array([float(label.value) for label in numbers])
    low, high = float(values.min()), float(values.max())
    logarithmic = low > 0.0 and high > LOGARITHMIC * low
    return Bar(_said(numbers, facet), low, high, WEAR if facet == "update" else SWEEP, logarithmic)


def _said(numbers: Sequence[Label], facet: str) -> str:
    """Return what a bar shows, with the unit that its labels bear."""
    if facet == "update":
        return "wear cycles"
    numeral = LEADING_NUMBER.fullmatch(numbers[-1].text)
    words = facet.replace("_", " ")
    return f"{words} ({numeral[1]})" if numeral and numeral[1] else words


def beside_bar(labels: Sequence[Label | None]) -> list[Label | None]:
    """Return the labels that the bar does not tell: names among numbers."""
    numbers, names = _parted([label for label in labels if label is not None])
    return list(names) if numbers else []


def _parted(labels: Sequence[Label]) -> tuple[list[Label], list[Label]]:
    """Return labels that are numbers, and those that are names."""
    return (
        [label for label in labels if not isinstance(label.value, str)],
        [label for label in labels if isinstance(label.value, str)],
    )


def _named(index: int) -> Pen:
    turn = index // len(NAMES)
    return Pen(NAMES[index % len(NAMES)], DASHES[turn % len(DASHES)], MARKERS[index % len(MARKERS)])


def along(anchors: Sequence[str], fraction: float) -> str:
    """Return the colour at a fraction of a map given by evenly spaced anchors."""
    at = fraction * (len(anchors) - 1)
    low = min(int(at), len(anchors) - 2)
    pairs = zip(_rgb(anchors[low]), _rgb(anchors[low + 1]), strict=True)
    return "#" + "".join(f"{round(a + (b - a) * (at - low)):02x}" for a, b in pairs)


def _rgb(colour: str) -> tuple[int, ...]:
    return tuple(int(colour[i : i + 2], 16) for i in (1, 3, 5))
