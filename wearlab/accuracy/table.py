"""What a study says in rows: who is how fast at which error, and which setting is cheapest."""

from collections.abc import Sequence

import numpy as np

from wearlab.accuracy.pages import DEFAULT
from wearlab.accuracy.study import TARGETS, Study, cheapest_setting, comparison, knob_settings

Rows = list[tuple[str, ...]]


CURVE_HEADS = (
    "case", "quantity", "curve", "knob", "order", "to 1e-3", "to 1e-6", "warm to 1e-6", "work to 1e-3",
)  # fmt: skip
PEER_HEADS = ("case", "error", "ours", "fastest peer, called from Python", "its time")
LIFE_HEADS = ("case", "quantity", "error", "adaptive", "Euler", "ratio")
CHEAPEST_HEADS = ("case", "quantity", "asked for", "cheapest", "error", "time", "enough of each knob")
REFERENCE_HEADS = ("case", "largest |multiplier|", "reference against second method")


def curve_rows(studies: Sequence[Study]) -> Rows:
    """Return a row for every curve of every case."""
    return [
        (
            study.label,
            curve.quantity,
            curve.name,
            curve.knob,
            _number(curve.order(study.uncertainty(curve.quantity)), ".2f"),
            *(_milliseconds(curve.seconds_to(error)) for error in TARGETS),
            _milliseconds(curve.seconds_to(TARGETS[-1], warm=True)),
            _number(curve.work_to(TARGETS[0]), ".0f"),
        )
        for study in studies
        for curve in study.curves
    ]


def peer_rows(studies: Sequence[Study]) -> Rows:
    """Return ours beside the fastest peer as users call it; no ratio: peers at their best are faster."""
    return [
        (study.label, f"{error:.0e}", _milliseconds(c.ours), c.name, _milliseconds(c.peer))
        for error in TARGETS
        for study in studies
        if (c := comparison(study, error)) is not None
    ]


def life_rows(studies: Sequence[Study]) -> Rows:
    """Return the contact analyses of a life by adaptive steps and by Euler's, at equal errors."""
    rows: Rows = []
    for study in studies:
        for quantity in ("life", "wear_depth"):
            curves = {c.name: c for c in study.curves if c.quantity == quantity}
            if not {"adaptive", "Euler"} <= set(curves):
                continue
            ours, euler = curves["adaptive"], curves["Euler"]
            targets = [(f"{error:.0e}", error, ours.work_to(error)) for error in (1e-2, 1e-3, 1e-4)]
            targets += [
                (f"{r.error:.1e} (cycle_tolerance {r.setting:g})", r.error, r.work)
                for r in ours.rungs
                if np.isclose(r.setting, DEFAULT)
            ]
            for text, error, mine in targets:
                theirs = euler.work_to(error)
                row = (text, _number(mine, ".0f"), _number(theirs, ".0f"), _times(theirs / mine))
                rows.append((study.label, quantity, *row))
    return rows


def cheapest_rows(studies: Sequence[Study], error: float | None) -> Rows:
    """Return the cheapest setting for an error, by default each scene's ``numerics.tolerance``."""
    rows: Rows = []
    for study in studies:
        asked = error or study.scene.numerics.tolerance
        for quantity in dict.fromkeys(curve.quantity for curve in study.curves):
            best = cheapest_setting(study, quantity, asked)
            knobs = knob_settings(study, quantity, asked)
            if best is None and not knobs:
                rows.append((study.label, quantity, f"{asked:.0e}", "none reaches it", "", "", ""))
                continue
            chosen = ("", "", "")
            if best is not None:
                curve, rung = best
                chosen = (
                    f"{curve.name}, {curve.knob} = {rung.setting:.4g}",
                    f"{rung.error:.1e}",
                    _milliseconds(rung.seconds),
                )
            settings = ", ".join(f"{knob} {value:g}" for knob, value in knobs.items())
            rows.append((study.label, quantity, f"{asked:.0e}", *chosen, settings))
    return rows


def reference_rows(studies: Sequence[Study]) -> Rows:
    """Return how well the second method agrees with each reference."""
    return [
        (
            study.label,
            _number(study.multiplier, ".4f"),
            ", ".join(f"{quantity} {apart:.1e}" for quantity, apart in study.disagreement.items()),
        )
        for study in studies
    ]


def _number(value: float, form: str) -> str:
    return format(value, form) if np.isfinite(value) else ""


def _milliseconds(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms" if np.isfinite(seconds) else ""


def _times(ratio: float) -> str:
    return f"{ratio:.1f}×" if np.isfinite(ratio) else ""
