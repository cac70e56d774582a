"""A fleet in words, read from its tree: a line a unit, which to open first and why, what contradicts what."""

from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

from wearlab.units import HOUR, convert
from wearlab.updating.checks import ALARM

FIRST = 2  # units that are named as those to open first
FAST, MUCH = 1.25, 0.6  # times the others' pace, and share of the limit, that are a reason to open a unit
OVER = 0.5  # probability from which the limit is said to have been passed
HEADS = ("unit", "hours", "worn", "limit reached", "90 % between", "pace")


def told_fleet(tree: xr.DataTree) -> list[str]:
    """Return a fleet line by line."""
    predictions, stats = tree["predictions"].to_dataset(), tree["sample_stats"].to_dataset()
    lines = [str(tree.attrs.get("title", ""))]
    lines += [f"  ! {note}" for note in filter(None, str(stats["notes"].values).split(" | "))]
    lines += [f"  ! {text}" for text in _contradictions(tree)]
    lines += ["", *(f"  {line}" for line in _table([_heads(predictions), *_rows(predictions)])), ""]
    if "predictions_without" in tree.children:
        without = tree["predictions_without"].to_dataset()
        both = [row for row, old in zip(_rows(without), _rows(predictions), strict=True) if row != old]
        lines += [
            "  leaving out the inspections above that are marked !",
            *map("  ".__add__, _table([_heads(without), *both])),
        ]
        lines += [*map("  ".__add__, _first(without)), ""]
    lines += [f"  {line}" for line in (*_first(predictions), *_shared(tree), *_replay(tree))]
    return lines


def fleet_answers(tree: xr.DataTree) -> list[str]:
    """Return a sentence a unit: when the limit is reached, as far as the measurements tell."""
    rows = _rows(tree["predictions"].to_dataset())
    each = [f"{row[0]}: the limit is reached {_on(row[3])}, with 90 % between {row[4]}." for row in rows]
    return [*each, *_first(tree["predictions"].to_dataset())]


def _on(when: str) -> str:
    return f"on {when}" if when[:4].isdigit() and when[4:5] == "-" else f"after {when}"


def _table(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows as lines, columns one under the other."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return ["  ".join(text.ljust(n) for text, n in zip(row, widths, strict=True)).rstrip() for row in rows]


def _ends(predictions: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Return when each unit reaches the limit, (units, quantiles), as texts and to be ordered by."""
    hour = predictions["seconds_per_cycle"].values[:, None] / HOUR
    rest = hour * predictions["remaining_useful_life_quantile"].values
    texts = np.array([[f"{value:,.0f} h more" for value in row] for row in rest], dtype=object)
    if "end_of_life_quantile" not in predictions:
        return texts, rest
    days = predictions["end_of_life_quantile"].values.astype(str)
    dated = (days != "").all(axis=1)
    texts[dated] = days[dated]
    if not dated.all():
        return texts, rest
    far = np.where(days == "never", "9999-12-31", days)
    return texts, far.astype("datetime64[D]").astype(float)


def _heads(predictions: xr.Dataset) -> tuple[str, ...]:
    return (*HEADS, "change at least cost") if "best_change" in predictions else HEADS


def _rows(predictions: xr.Dataset) -> list[tuple[str, ...]]:
    texts, _ = _ends(predictions)
    hours = predictions["now"].values * predictions["seconds_per_cycle"].values / HOUR
    rows: list[tuple[str, ...]] = []
    for k, name in enumerate(map(str, predictions["unit"].values)):
        worn, pace = float(predictions["worn"][k]), float(predictions["pace"][k])
        end = "passed" if float(predictions["end_passed"][k]) > OVER else texts[k, 2]
        measured = f"{100.0 * worn:.0f} %" if hours[k] > 0.0 else "not measured"
        between = f"{texts[k, 0]} and {texts[k, 4]}"
        rows.append((name, f"{hours[k]:,.0f}", measured, end, between, f"{pace:.2f}"))
        if "best_change" in predictions:
            at = float(predictions["best_change"][k] * predictions["seconds_per_cycle"][k]) / HOUR
            day = str(predictions["best_change_day"].values[k])
            rows[-1] += (day or f"{at - hours[k]:,.0f} h more",)
    return rows


def _first(predictions: xr.Dataset) -> list[str]:
    """Return which units to open first, and why: those of which 1 in 20 has reached the limit soonest."""
    texts, order = _ends(predictions)
    lines: list[str] = []
    for k in np.argsort(order[:, 0], kind="stable")[:FIRST]:
        name = str(predictions["unit"].values[k])
        worn, pace, p = (float(predictions[n][k]) for n in ("worn", "pace", "p_like_the_others"))
        why = [f"{100.0 * worn:.0f} % of the limit is worn"] if worn > MUCH else []
        why += [f"it wears {pace:.2g} times as fast as the others"] if pace > FAST else []
        why += ["what was measured is unlike the other units"] if p < ALARM else []
        if not float(predictions["now"][k]) > 0.0:
            why += ["it was never measured"]
        why = why or ["it comes first of all that are like it"]
        when = (
            "the limit may have been passed"
            if order[k, 0] <= 0.0 or _passed(predictions, k)
            else (f"19 chances in 20 that it lasts until {texts[k, 0]}")
        )
        lines.append(f"open {name} {'first' if not lines else 'next'}: {when}; {', and '.join(why)}")
    return lines


def _passed(predictions: xr.Dataset, k: int) -> bool:
    return float(predictions["end_passed"][k]) > 0.05


def _contradictions(tree: xr.DataTree) -> Iterator[str]:
    """Yield which inspections and units do not go with the others, in plain words."""
    rows, predictions = tree["observed_data"].to_dataset(), tree["predictions"].to_dataset()
    hour = dict(zip(predictions["unit"].values, predictions["seconds_per_cycle"].values / HOUR, strict=True))
    for i in np.flatnonzero(rows["flagged"].values):
        name, side = str(rows["unit_name"].values[i]), "more" if rows["higher"].values[i] else "less"
        whose = (
            "the other units" if rows["first"].values[i] else "its earlier inspections and the other units"
        )
        yield (
            f"{name} at {hour[name] * float(rows['cycle'][i]):,.0f} h: much {side} wear than {whose} lead to "
            f"expect (p = {float(rows['check_p'][i]):.1g}); look at the reading, its unit and its hours; if "
            "they are right, something has changed in this unit"
        )
    p = predictions["p_like_the_others"].values
    for k in np.flatnonzero(p < ALARM / max(np.isfinite(p).sum(), 1)):
        pace = float(predictions["pace"][k])
        yield (
            f"{predictions['unit'].values[k]} wears {pace:.2g} times as fast as the middle unit, which the "
            f"others do not lead to expect (p = {p[k]:.1g}); look whether load, oil and hours are its own"
        )


def _shared(tree: xr.DataTree) -> Iterator[str]:
    """Yield what the units share, and how long one lasts that was not measured."""
    sample = tree["posterior"].to_dataset()
    words = {
        "median": "middle unit's factor on the wear coefficient",
        "spread": "units differ in ln k by a standard deviation of",
        "straying": "wear strays from its mean course, over the wear, by",
        "power": "wear goes with the hours to the power",
    }
    for name in (*words, *(str(n) for n in sample.data_vars if str(n).startswith("sd_"))):
        if name not in sample:
            continue
        unit = sample[name].attrs["units"]
        shown = {"m": "um", "kg": "g"}.get(unit, unit)
        low, middle, high = np.quantile(sample[name].values, [0.05, 0.5, 0.95]) * (
            convert(1.0, unit, shown) if shown != unit else 1.0
        )
        text = words.get(name, f"standard error of {name.removeprefix('sd_').replace('_', ' ')}")
        tail = "" if shown == "1" else f" {shown.replace('um', 'µm')}"
        yield f"{text}: {middle:.3g}{tail} (90 %: {low:.3g} to {high:.3g})"
    low, middle, high = np.quantile(sample["factor_of_another"].values, [0.05, 0.5, 0.95])
    yield f"factor of another unit, not yet measured: {middle:.3g} (90 %: {low:.3g} to {high:.3g})"


def _replay(tree: xr.DataTree) -> Iterator[str]:
    stats = tree["sample_stats"].to_dataset()
    if "replay_count" not in stats:
        return
    rows = tree["observed_data"]["value"].attrs
    shown = {"m": "mm", "kg": "g"}.get(rows["units"], rows["units"])
    scale = convert(1.0, rows["units"], shown) if shown != rows["units"] else 1.0
    n = float(stats["replay_count"])
    error, crps, rate, line = (
        scale * float(stats[f"replay_{name}"])
        for name in ("mean_error", "crps", "error_of_rate", "error_of_line")
    )
    inside = " and ".join(f"{float(stats[f'replay_in_{w}']):.0f} in the {w} % interval" for w in (90, 50))
    yield (
        f"{n:.0f} inspections foreseen from those before: off by {error:.3g} {shown} on average (ranked "
        f"probability score {crps:.3g}), {inside}; the median rate of the others is off by {rate:.3g} "
        f"{shown}, a line through the origin by {line:.3g} {shown}"
    )
