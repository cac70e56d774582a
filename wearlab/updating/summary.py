"""An update in words, read from its tree, so that a kept one says the same."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.schema import VARIABLES
from wearlab.store.outcome import hours_text
from wearlab.units import HOUR, convert
from wearlab.updating.checks import ALARM
from wearlab.updating.comparison import in_words
from wearlab.updating.fleet_words import fleet_answers, told_fleet

DERIVED = ("wear_coefficient", "life", "remaining_useful_life")
WITHOUT = "remaining_without_"
EVIDENCE = ((1.0, "cannot tell, if anything they prefer"), (3.0, "lean towards"), (5.0, "clearly prefer"))
BELIEVED = (
    "Believe it while",
    "  load and speed stay as they are in the campaign: measurements tell k times the load;",
    "  wear goes on as it did: nothing here sees pitting, scuffing, a new oil, particles or running-in "
    "that is not in the measurements;",
    "  the errors are those that the campaign gives, that of an inspection's datum included;",
    "  the checks of the inspections are quiet: one that is flagged means that the rate has changed.",
)


def told(tree: xr.DataTree) -> list[str]:
    """Return an update line by line."""
    if "unit" in tree["predictions"].dims:
        return told_fleet(tree)
    labels = _labels(tree)
    lines = [str(tree.attrs.get("title", ""))]
    for label in labels:
        lines += [] if label is None else ["", f"case {label}"]
        lines += [f"  {line}" for line in _case(tree, label)]
    if "comparison" in tree.children:
        lines += ["", *in_words(tree["comparison"].to_dataset())]
    return lines


def answers(tree: xr.DataTree) -> list[str]:
    """Return a sentence a case: when the limit is reached, as far as the measurements tell."""
    if "unit" in tree["predictions"].dims:
        return fleet_answers(tree)
    lines = []
    for label in _labels(tree):
        predictions = group(tree, "predictions", label)
        limit = predictions["limit"]
        declared = VARIABLES[str(limit.attrs["quantity"])]
        value = convert(float(limit), declared.units, declared.display_units)
        wear = f"{value:.4g} {declared.display_units.replace('um', 'µm')} of wear"
        where = f" on the {limit.attrs['where']}" if limit.attrs["where"] else ""
        times = float(predictions["seconds_per_cycle"]) * _last(predictions["remaining_useful_life_quantile"])
        low, middle, high = (
            (hours_text(float(t)) or "0 h") if np.isfinite(t) else "never" for t in times[::2]
        )
        day = ""
        if "end_of_life_quantile" in predictions:
            first, likely, latest_day = predictions["end_of_life_quantile"].values[::2]
            day = f" on {likely}, with 90 % between {first} and {latest_day}:"
        text = f"{wear}{where} is reached{day} {middle} after the last inspection (90 %: {low} to {high})."
        lines.append(text if label is None else f"{label}: {text}")
    return lines


def _labels(tree: xr.DataTree) -> list[str | None]:
    predictions = tree["predictions"].to_dataset()
    return [str(case) for case in predictions["case"].to_numpy()] if "case" in predictions.dims else [None]


def group(tree: xr.DataTree, name: str, label: str | None) -> xr.Dataset:
    """Return a group of one case; an empty dataset where the update has no such group."""
    if name not in tree.children:
        return xr.Dataset()
    dataset = tree[name].to_dataset()
    return dataset.sel(case=label) if label is not None and "case" in dataset.dims else dataset


def latest(values: xr.DataArray) -> xr.DataArray:
    """Return quantiles after the last inspection of a case; others may have been inspected later."""
    if "inspection" not in values.dims:
        return values
    told = np.flatnonzero(values.notnull().any("quantile").values)
    return values.isel(inspection=int(told[-1]) if len(told) else -1)


def _last(values: xr.DataArray) -> Array:
    return np.asarray(latest(values).values)


def _case(tree: xr.DataTree, label: str | None) -> Iterator[str]:
    names = ("predictions", "sample_stats", "posterior", "prior", "virtual_inspection", "calibration")
    predictions, stats, sample, prior, ahead, twins = (group(tree, name, label) for name in names)
    yield from (f"! {note}" for note in filter(None, str(stats["notes"].values).split(" | ")))
    hours, now = float(predictions["seconds_per_cycle"]) / HOUR, float(predictions["now"])
    life, rest = (_last(predictions[f"{name}_quantile"]) for name in DERIVED[1:])
    yield from _flagged(stats, hours)
    yield _line("wear coefficient", _quantiles(sample["wear_coefficient"]), "m²/N")
    yield from _unknowns(prior, sample, predictions)
    yield _line("life", life, "cycles", hours)
    yield _line(f"remaining life at {now:.6g} cycles", rest, "cycles", hours)
    if "end_of_life_quantile" in predictions:
        ends = predictions["end_of_life_quantile"]
        yield f"reached on {_spread(ends.values)}, {str(ends.attrs['long_name']).rpartition(', ')[2]}"
    if "inspection" in predictions.dims:
        yield from _replay(predictions, hours)
    if "replay_inspections" in stats and np.isfinite(stats["replay_inspections"]):
        yield _scores(stats)
    for block, rows in _rows(stats):
        yield f"check of {block}, each inspection beside what all of them lead to expect:"
        yield from (f"  {_when(cycle, hours)}: {words} (p = {p:.2g})" for cycle, p, words in rows)
    yield from _sources(stats, rest, hours)
    if "recommended" in ahead and np.isfinite(ahead["recommended"]):
        best = float(ahead["recommended"])
        width = float(ahead["expected_width"].sel(instrument=1.0).sel(look=best, method="nearest"))
        day = f" on {ahead['recommended_day'].item()}," if "recommended_day" in ahead else ""
        yield (
            f"next inspection:{day} at {_when(best, hours).strip()}: the 90 % interval is then expected to "
            f"be {width:.2g} of that now; until then 19 lives in 20 have not ended"
        )
    yield from _decision(group(tree, "decision", label), hours)
    if "log_evidence_of_drift" in stats:
        yield _evidence(float(stats["log_evidence_of_drift"]))
    if "log_evidence_of_change" in stats:
        gain, *parts = (float(stats[f"change_{n}_{p}"]) for n in ("ratio", "cycle") for p in (50, 5, 95))
        weight = float(stats["log_evidence_of_change"])
        said = f"{_weight(weight)} {'a change' if weight > 0.0 else 'none'}"
        yield f"did k change? ln of the evidence of a change over none {weight:.3g}; the data {said}"
        yield (
            f"  if it did, it became {gain:.3g} times what it was (90 %: {parts[0]:.3g} to {parts[1]:.3g}), "
            f"between {_when(parts[3], hours).strip()} and {_when(parts[4], hours).strip()}"
        )
    runs, effective = (f"{float(stats[name]):.0f}" for name in ("runs", "effective_runs"))
    many = f"effective {effective} (k and errors are integrated out within each)"
    one = "k and errors integrated out on a grid: no sampling error"
    yield f"runs: {runs}, {one if runs == '1' else many}"
    if twins:
        yield from _calibration(twins)


def _quantiles(values: xr.DataArray) -> Array:
    return np.quantile(values.values, [0.05, 0.25, 0.5, 0.75, 0.95])


def _spread(five: Array, unit: str = "") -> str:
    """Return a median with its 50 and 90 % interval, from five quantiles."""
    low, quarter, middle, three, high = (each if isinstance(each, str) else f"{each:.4g}" for each in five)
    return f"{middle}{f' {unit}' if unit else ''} (50 %: {quarter} to {three}; 90 %: {low} to {high})"


def _line(name: str, five: Array, unit: str, hours: float = float("nan")) -> str:
    also = f"\n    = {_spread(hours * five, 'h')}" if np.isfinite(hours) else ""
    return f"{name}: {_spread(five, unit)}{also}"


def _unknowns(prior: xr.Dataset, sample: xr.Dataset, predictions: xr.Dataset) -> Iterator[str]:
    """Yield what is known of every unknown, after and before."""
    for name in map(str, sample.data_vars):
        if name in DERIVED or not np.isfinite(sample[name]).any():
            continue
        unit, shown = (sample[name].attrs.get(key, "1") for key in ("units", "display_units"))
        scale = convert(1.0, unit, shown) if shown not in ("1", unit) else 1.0
        after, before = (scale * _quantiles(each[name]) for each in (sample, prior))
        if name == "factor":
            after, before = (_last(predictions[f"{p}factor_quantile"]) for p in ("", "prior_"))
        if not before[4] > before[0]:
            continue
        yield _line(name.replace("_", " "), after, "" if shown == "1" else shown.replace("um", "µm"))
        wide, narrow = np.log([before, after]) if before[0] > 0.0 < after[0] else (before, after)
        narrowed = np.ptp(wide) / max(np.ptp(narrow), 1e-300)
        moved = f"moved by a factor of {after[2] / before[2]:.3g}, narrowed {narrowed:.3g} times"
        yield f"    before: {before[2]:.4g} (90 %: {before[0]:.4g} to {before[4]:.4g}); {moved}"


def _sources(stats: xr.Dataset, rest: Array, hours: float) -> Iterator[str]:
    """Yield the answer without each source."""
    scale, unit = (hours, "h") if np.isfinite(hours) else (1.0, "cycles")
    named = [str(n) for n in stats.data_vars if str(n).startswith(WITHOUT) and np.isfinite(stats[n]).any()]
    rows = {f"  without {n.removeprefix(WITHOUT).replace('_', ' ')}": scale * stats[n].values for n in named}
    if rows:
        rows = {"remaining life with all sources": scale * rest[::2]} | rows
    for name, (low, middle, high) in rows.items():
        yield f"{name}: {middle:.4g} {unit} (90 %: {low:.4g} to {high:.4g})"


def _decision(costs: xr.Dataset, hours: float) -> Iterator[str]:
    """Yield when to change at the least cost per hour, and whether to look first."""
    if "best_rate" not in costs or not np.isfinite(costs["best_rate"]):
        return

    def when(name: str, times: float | None = None) -> str:
        here = costs if times is None else costs.sel(failure_times=times)
        day = f"on {here[f'{name}_day'].item()}, " if f"{name}_day" in here else ""
        return f"{day}at {hours * float(here[name]):,.0f} h"

    best, failure = float(costs["best_rate"]), float(costs["rate_to_failure"])
    yield f"least cost: change {when('best_change')}: {best:.4g} an hour (run to failure: {failure:.4g})"
    cheaper, dearer = (when("best_change_if", times) for times in (0.5, 2.0))
    yield f"  were a failure half as dear: change {cheaper}; twice as dear: {dearer}"
    if "horizon_cost" in costs:
        cost, none = float(costs["horizon_cost"]), float(costs["horizon_to_failure"])
        until = f"change {when('horizon_change')}" if np.isfinite(costs["horizon_change"]) else "no change"
        yield f"  until the horizon: {until}: {cost:,.0f} in all (no planned change of this one: {none:,.0f})"
    if "rate_with_look" in costs:
        rate = float(costs["rate_with_look"].min())
        if np.isfinite(costs["best_look"]):
            yield f"  look first, {when('best_look')}, and change by what is seen then: {rate:.4g} an hour"
        else:
            yield f"  looking first is not worth its cost: {rate:.4g} an hour at best"


def _replay(predictions: xr.Dataset, hours: float) -> Iterator[str]:
    yield "as it would have been after every inspection:"
    before = "the prior"
    names = ("inspection", "remaining_useful_life_quantile", "check_p_forward")
    for cycle, q, p in zip(*(predictions[name].values for name in names), strict=True):
        if np.isfinite(q).any():
            odd = f", an inspection that {before} did not lead to expect (p = {p:.2g})" if p < 0.05 else ""
            yield f"  {_when(cycle, hours)}: {q[2]:.4g} cycles, 90 %: {q[0]:.4g} to {q[4]:.4g}{odd}"
            before = "those before it"


def _scores(stats: xr.Dataset) -> str:
    inside = " and ".join(f"{float(stats[f'replay_in_{w}']):.0f} in the {w} % interval" for w in (90, 50))
    words = {
        "by_the_ratio": "the ratio of wear to cycles",
        "by_the_last_three": "a line through the last three",
        "by_the_prior": "the median before",
    }
    off = {text: 100 * float(stats[f"replay_error_{rule}"]) for rule, text in words.items()}
    rules = ", ".join(f"{value:.3g} % ({text})" for text, value in off.items() if np.isfinite(value))
    return (
        f"against the end that was measured: {float(stats['replay_inspections']):.0f} inspections before it, "
        f"their medians off by {100 * float(stats['replay_mean_error']):.3g} % of what then came on average, "
        f"{inside}; scores over what came: {float(stats['replay_crps']):.3g} (ranked probability), "
        f"{float(stats['replay_interval_score']):.3g} (90 % interval); simple rules are off by {rules}"
    )


def _when(cycle: float, hours: float) -> str:
    """Return a number of cycles, and the operating hours that it takes where they are known."""
    return f"{cycle:>12.6g} cycles{f' = {hours * cycle:.6g} h' if np.isfinite(hours) else ''}"


def _rows(stats: xr.Dataset) -> Iterator[tuple[str, list[tuple[float, float, str]]]]:
    """Yield the name of each checked block, and cycle, p and words of its inspections."""
    for name in map(str, stats.data_vars):
        if name.startswith("check_p_") and np.isfinite(stats[name]).any():
            block = name.removeprefix("check_p_")
            columns = (stats[key].values for key in (f"cycle_{block}", name, f"check_{block}"))
            yield block.replace("_", " "), [r for r in zip(*columns, strict=True) if np.isfinite(r[1])]


def _flagged(stats: xr.Dataset, hours: float) -> Iterator[str]:
    for block, rows in _rows(stats):
        for cycle, p, words in rows:
            if p < ALARM / len(rows):
                yield (
                    f"! the inspection at {_when(cycle, hours).strip()} is {words} of {block} (p = {p:.2g}): "
                    "look at its values, whether they are totals or differences, whether wear has changed"
                )
    for name in map(str, stats.data_vars):
        if name.startswith("course_p_") and float(stats[name]) < ALARM:
            yield (
                f"! the course of {name.removeprefix('course_p_').replace('_', ' ')} is not the model's "
                f"(p = {float(stats[name]):.2g}): values stay above or below it for long, or are farther off "
                "than their errors; the interval is too narrow whatever the error"
            )


def _weight(gain: float) -> str:
    return next((words for most, words in EVIDENCE if abs(gain) < most), "strongly prefer")


def _evidence(gain: float) -> str:
    side = "accumulating noise" if gain > 0.0 else "independent errors alone"
    said = f"{_weight(gain)} {side}"
    about = "evidence of accumulating noise against independent errors alone: ln of the ratio"
    return f"{about} {gain:.3g}; the data {said}"


def _calibration(dataset: xr.Dataset) -> Iterator[str]:
    n = dataset.sizes["twin"]
    whose = "with the errors of update.check" if "true_model" in dataset.attrs else "of this study"
    yield f"check by {n} synthetic twins {whose}:"
    for name in ("factor", "life"):
        parts = []
        for width in (50, 90) if f"{name}_rank" in dataset else ():
            share, p = float(dataset[f"{name}_coverage_{width}"]), width / 100
            off = abs(share - p) > 3.0 * np.sqrt(p * (1.0 - p) / n)
            verdict = "NOT AS IT SHOULD" if off else "as it should"
            parts.append(f"{width} % intervals hold the truth in {100 * share:.1f} %, {verdict}")
        if parts:
            yield f"  {name}: {'; '.join(parts)}"
    if "life_skill" in dataset:
        share = 100 * float(dataset["life_skill"])
        yield f"  the measurements take {share:.0f} % off the prior's ranked probability score of the life"
