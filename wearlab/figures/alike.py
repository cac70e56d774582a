"""Meshes and bearings that show the same are drawn once, and it is said."""

from collections.abc import Sequence

import numpy as np

from wearlab.arrays import Array
from wearlab.figures.ask import Ask
from wearlab.figures.plot import Scale, Series
from wearlab.figures.wording import Label

SYMMETRIC = ("mesh", "bearing")  # dimensions along which planets repeat themselves
SEEN = 1e-3  # of the range of all curves on an axis: smaller differences are not to be seen


def drawn_once(series: Sequence[Series], ask: Ask) -> tuple[list[Series], list[str]]:
    """Return the series without those that repeat another's along a symmetric dimension, and notes.

    A label is left out where every one of its curves is that of one other label; dimensions that the figure
    itself names are left alone.
    """
    kept, notes = list(series), []
    told = {*ask.select, ask.hue, ask.rows, ask.cols}
    for dim in SYMMETRIC:
        if dim not in told:
            kept, more = _along(kept, dim)
            notes += more
    return kept, notes


def _along(series: list[Series], dim: str) -> tuple[list[Series], list[str]]:
    groups: dict[Label, dict[object, list[Series]]] = {}
    for curve in series:
        if dim in curve.key:
            rest = tuple((name, label) for name, label in curve.key.items() if name != dim)
            groups.setdefault(curve.key[dim], {}).setdefault((rest, curve.look, curve.text), []).append(curve)
    if len(groups) < 2:
        return series, []
    spans = _spans(series)
    same: dict[Label, list[Label]] = {}
    for label, curves in groups.items():
        first = next((known for known in same if _alike(groups[known], curves, spans)), label)
        same.setdefault(first, []).append(label)
    dropped = {label for first, labels in same.items() for label in labels if label != first}
    notes = [
        f"The same, drawn once as {first.text}: {', '.join(other_label.text for other_label in labels[1:])}."
        for first, labels in same.items()
        if len(labels) > 1
    ]
    return [curve for curve in series if curve.key.get(dim) not in dropped], notes


def _spans(series: Sequence[Series]) -> dict[Scale, float]:
    """Return the range of all values of each scale."""
    ends: dict[Scale, list[float]] = {}
    for curve in series:
        for scale, values in ((curve.across, curve.x), (curve.up, curve.y)):
            held = values[np.isfinite(values)]
            if len(held):
                ends.setdefault(scale, []).extend((float(held.min()), float(held.max())))
    return {scale: max(all_) - min(all_) for scale, all_ in ends.items()}


def _alike(a: dict[object, list[Series]], b: dict[object, list[Series]], spans: dict[Scale, float]) -> bool:
    return a.keys() == b.keys() and all(
        len(a[key]) == len(b[key])
        and all(
            first.across == two.across
            and first.up == two.up
            and _close(first.x, two.x, spans.get(first.across, 0.0))
            and _close(first.y, two.y, spans.get(first.up, 0.0))
            for first, two in zip(a[key], b[key], strict=True)
        )
        for key in a
    )


def _close(a: Array, b: Array, span: float) -> bool:
    return a.shape == b.shape and np.allclose(a, b, rtol=0.0, atol=SEEN * span, equal_nan=True)
