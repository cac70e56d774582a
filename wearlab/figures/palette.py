"""Colours that colour-blind readers can tell apart: a set for names, maps for what is ordered."""

from collections.abc import Sequence

from wearlab.figures.plot import Pen
from wearlab.figures.wording import Label

NAMES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")  # Okabe and Ito
WEAR = ("#2b2d42", "#3b5b92", "#3a8fb7", "#59b78f", "#d8b13c", "#d9622b")  # unworn to worn, dark to warm
SWEEP = ("#2d1160", "#721f81", "#b73779", "#f1605d", "#f39a3d")  # magma without its palest end
INK, GREY, PALE = "#222222", "#7a7a7a", "#d9d9d9"
WIDEST = 1.6  # the unworn state, so that it shows below what falls on it
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
DASHES = ("-", "--", "-.", ":")


def pens(labels: Sequence[Label], facet: str | None) -> dict[Label, Pen]:
    """Return a pen for each label of a hue: from a map where the labels are numbers, else from a set.

    Names among numbers (a static case among speeds) are drawn in ink, dashed.
    """
    numbers = [label for label in labels if not isinstance(label.value, str)]
    names = [label for label in labels if isinstance(label.value, str)]
    if not numbers or facet in ("quantity", "harmonic", "pair", "mode"):
        return {label: _named(i) for i, label in enumerate(labels)}
    anchors, widest = (WEAR, WIDEST) if facet == "update" else (SWEEP, 1.0)
    places = [i / max(1, len(numbers) - 1) for i in range(len(numbers))]
    coloured = {
        label: Pen(along(anchors, at), "-", MARKERS[i % len(MARKERS)], 1.0 + (widest - 1.0) * (1.0 - at))
        for i, (label, at) in enumerate(zip(numbers, places, strict=True))
    }
    return coloured | {label: Pen(INK, DASHES[1 + i % 3], "o") for i, label in enumerate(names)}


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
