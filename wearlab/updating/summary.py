"""An update in words, read from its tree, so that a kept one says the same."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from wearlab.schema import VARIABLES
from wearlab.store.headline import hours_text
from wearlab.units import HOUR, convert
from wearlab.updating.checks import ALARM

DERIVED = ("wear_coefficient", "life", "remaining_useful_life")
WITHOUT = "remaining_without_"
EVIDENCE = ((1.0, "cannot tell"), (3.0, "leans towards"), (5.0, "clearly prefers"))


def told(tree: xr.DataTree) -> list[str]:
    """Return an update line by line."""
    labels = _labels(tree)
    lines = [str(tree.attrs.get("title", ""))]
    for label in labels:
        if label is not None:
            lines += ["", f"case {label}"]
        lines += [f"  {line}" for line in _case(tree, label)]
    if len(labels) > 1 and tree.attrs.get("same_measurements"):
        lines += ["", *_between(tree, [label for label in labels if label is not None])]
    return lines


def answers(tree: xr.DataTree) -> list[str]:
    """Return a sentence a case: when the limit is reached, as far as the measurements tell."""
    labels = _labels(tree)
    lines = []
    for label in labels:
        predictions = group(tree, "predictions", label)
        limit = predictions["limit"]
        declared = VARIABLES[str(limit.attrs["quantity"])]
        value = convert(float(limit), declared.units, declared.display_units)
        wear = f"{value:.4g} {declared.display_units.replace('um', 'µm')} of wear"
        where = f" on the {limit.attrs['where']}" if limit.attrs["where"] else ""
        second = float(predictions["seconds_per_cycle"])
        rest = _last(predictions["remaining_useful_life_quantile"])
        low, _, middle, _, high = (_time(second * float(name)) for name in rest)
        day = ""
        if "end_of_life_quantile" in predictions:
            first, _, likely, _, latest_day = map(str, predictions["end_of_life_quantile"].values)
            day = f" on {likely}, with 90 % between {first} and {latest_day}:"
        text = f"{wear}{where} is reached{day} {middle} after the last inspection (90 %: {low} to {high})."
        lines.append(text if label is None else f"{label}: {text}")
    return lines


def believed(tree: xr.DataTree) -> list[str]:
    """Return when the answer may be believed, in lines; docs/update.md says more."""
    return [
        "Believe it while",
        "  load and speed stay as they are in the campaign: measurements tell k times the load;",
        "  wear goes on as it did: nothing here sees pitting, scuffing, a new oil, particles or running-in "
        "that is not in the measurements;",
        "  the errors are those that the campaign gives, that of an inspection's datum included;",
        "  the checks of the inspections are quiet: one that is flagged means that the rate has changed.",
    ]


def _time(seconds: float) -> str:
    return (hours_text(seconds) or "0 h") if np.isfinite(seconds) else "never"


def _labels(tree: xr.DataTree) -> list[str | None]:
    predictions = tree["predictions"].to_dataset()
    return [str(case) for case in predictions["case"].to_numpy()] if "case" in predictions.dims else [None]


def group(tree: xr.DataTree, name: str, label: str | None) -> xr.Dataset:
    """Return a group of one case; an empty dataset where the update has no such group."""
    if name not in tree.children:
        return xr.Dataset()
    dataset = tree[name].to_dataset()
    return dataset.sel(case=label) if label is not None and "case" in dataset.dims else dataset


def _case(tree: xr.DataTree, label: str | None) -> Iterator[str]:
    predictions, stats = group(tree, "predictions", label), group(tree, "sample_stats", label)
    sample = group(tree, "posterior", label)
    for note in filter(None, str(stats["notes"].values).split(" | ")):
        yield f"! {note}"
    hours = float(predictions["seconds_per_cycle"]) / HOUR
    yield from _flagged(stats, hours)
    now = float(predictions["now"])
    yield _line("wear coefficient", _quantiles(sample["wear_coefficient"]), "m²/N")
    yield from _unknowns(group(tree, "prior", label), sample, predictions)
    life = _last(predictions["life_quantile"])
    rest = _last(predictions["remaining_useful_life_quantile"])
    yield _line("life", life, "cycles", hours)
    yield _line(f"remaining life at {now:.6g} cycles", rest, "cycles", hours)
    if "end_of_life_quantile" in predictions:
        yield _day(predictions["end_of_life_quantile"])
    if "inspection" in predictions.dims:
        yield from _replay(predictions, hours)
    if "replay_inspections" in stats and np.isfinite(stats["replay_inspections"]):
        yield _scores(stats)
    yield from _checks(stats, hours)
    yield from _sources(stats, rest, hours)
    yield from _next_inspection(group(tree, "virtual_inspection", label), hours)
    if "log_evidence_of_drift" in stats:
        yield _evidence(float(stats["log_evidence_of_drift"]))
    if float(stats["runs"]) > 1:
        yield (
            f"runs: {float(stats['runs']):.0f}, effective {float(stats['effective_runs']):.0f} "
            "(k and errors are integrated out within each)"
        )
    else:
        yield "runs: 1, k and errors integrated out on a grid: no sampling error"
    calibration = group(tree, "calibration", label)
    if calibration:
        yield from _calibration(calibration)


def latest(values: xr.DataArray) -> xr.DataArray:
    """Return quantiles after the last inspection of a case; others may have been inspected later."""
    if "inspection" not in values.dims:
        return values
    told = np.flatnonzero(values.notnull().any("quantile").values)
    return values.isel(inspection=int(told[-1]) if len(told) else -1)


def _last(values: xr.DataArray) -> np.ndarray:
    return np.asarray(latest(values).values)


def _quantiles(values: xr.DataArray) -> np.ndarray:
    return np.quantile(values.values, [0.05, 0.25, 0.5, 0.75, 0.95])


def _line(name: str, q: np.ndarray, unit: str, hours: float = float("nan")) -> str:
    def text(scale: float, unit: str) -> str:
        low, quarter, middle, three, high = (f"{scale * value:.4g}" for value in q)
        end = f" {unit}" if unit else ""
        return f"{middle}{end} (50 %: {quarter} to {three}; 90 %: {low} to {high})"

    also = f"\n    = {text(hours, 'h')}" if np.isfinite(hours) else ""
    return f"{name}: {text(1.0, unit)}{also}"


def _day(ends: xr.DataArray) -> str:
    low, quarter, middle, three, high = map(str, ends.values)
    rate = str(ends.attrs["long_name"]).rpartition(", ")[2]
    return f"reached on {middle} (50 %: {quarter} to {three}; 90 %: {low} to {high}), {rate}"


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
        unit = "" if shown == "1" else shown.replace("um", "µm")
        yield _line(name.replace("_", " "), after, unit)
        spread = f"{before[2]:.4g} (90 %: {before[0]:.4g} to {before[4]:.4g})"
        narrowed = (before[4] - before[0]) / max(after[4] - after[0], 1e-300)
        logs = np.log([before, after]) if before[0] > 0.0 and after[0] > 0.0 else None
        if logs is not None:
            narrowed = np.ptp(logs[0]) / max(np.ptp(logs[1]), 1e-300)
        moved = f"moved by a factor of {after[2] / before[2]:.3g}, narrowed {narrowed:.3g} times"
        yield f"    before: {spread}; {moved}"


def _sources(stats: xr.Dataset, rest: np.ndarray, hours: float) -> Iterator[str]:
    """Yield the answer without each source."""
    scale, unit = (hours, "h") if np.isfinite(hours) else (1.0, "cycles")
    names = [str(n) for n in stats.data_vars if str(n).startswith(WITHOUT) and np.isfinite(stats[n]).any()]
    if names:
        yield f"remaining life with all sources: {_interval(scale * rest[[0, 2, 4]], unit)}"
    for name in names:
        source = name.removeprefix(WITHOUT).replace("_", " ")
        yield f"  without {source}: {_interval(scale * stats[name].values, unit)}"


def _interval(ends: np.ndarray, unit: str) -> str:
    low, middle, high = (f"{value:.4g}" for value in ends)
    return f"{middle} {unit} (90 %: {low} to {high})"


def _next_inspection(ahead: xr.Dataset, hours: float) -> Iterator[str]:
    if "recommended" not in ahead or not np.isfinite(ahead["recommended"]):
        return
    best = float(ahead["recommended"])
    width = float(ahead["expected_width"].sel(instrument=1.0).sel(look=best, method="nearest"))
    day = f" on {ahead['recommended_day'].item()}," if "recommended_day" in ahead else ""
    yield (
        f"next inspection:{day} at {_when(best, hours).strip()}: the 90 % interval is then expected to be "
        f"{width:.2g} of that now; until then 19 lives in 20 have not ended"
    )


def _replay(predictions: xr.Dataset, hours: float) -> Iterator[str]:
    yield "as it would have been after every inspection:"
    rest = predictions["remaining_useful_life_quantile"]
    before = "the prior"
    for cycle, q, p in zip(
        predictions["inspection"].values, rest.values, predictions["check_p_forward"].values, strict=True
    ):
        if not np.isfinite(q).any():
            continue
        odd = f", an inspection that {before} did not lead to expect (p = {p:.2g})" if p < 0.05 else ""
        yield f"  {_when(cycle, hours)}: {q[2]:.4g} cycles, 90 %: {q[0]:.4g} to {q[4]:.4g}{odd}"
        before = "those before it"


def _scores(stats: xr.Dataset) -> str:
    count = float(stats["replay_inspections"])
    inside = " and ".join(f"{float(stats[f'replay_in_{w}']):.0f} in the {w} % interval" for w in (90, 50))
    return (
        f"against the end that was measured: {count:.0f} inspections before it, their medians off by "
        f"{100 * float(stats['replay_mean_error']):.3g} % of what then came on average, {inside}"
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
            rows = [row for row in zip(*columns, strict=True) if np.isfinite(row[1])]
            yield block.replace("_", " "), rows


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


def _checks(stats: xr.Dataset, hours: float) -> Iterator[str]:
    for block, rows in _rows(stats):
        yield f"check of {block}, each inspection beside what all of them lead to expect:"
        for cycle, p, words in rows:
            yield f"  {_when(cycle, hours)}: {words} (p = {p:.2g})"


def _evidence(gain: float) -> str:
    weight = next((words for most, words in EVIDENCE if abs(gain) < most), "strongly prefers")
    side = "accumulating noise" if gain > 0.0 else "independent errors alone"
    said = f"{weight} between them" if weight == "cannot tell" else f"{weight} {side}"
    return (
        f"evidence of accumulating noise against independent errors alone: ln of the ratio {gain:.3g}; "
        f"the data {said}"
    )


def _calibration(dataset: xr.Dataset) -> Iterator[str]:
    n = dataset.sizes["twin"]
    whose = "with the errors of update.check" if "true_model" in dataset.attrs else "of this study"
    yield f"check by {n} synthetic twins {whose}:"
    for name in ("factor", "life"):
        if f"{name}_rank" not in dataset:
            continue
        parts = []
        for width in (50, 90):
            share = float(dataset[f"{name}_coverage_{width}"])
            sigma = np.sqrt(width / 100 * (1 - width / 100) / n)
            verdict = "as it should" if abs(share - width / 100) <= 3.0 * sigma else "NOT AS IT SHOULD"
            parts.append(f"{width} % intervals hold the truth in {100 * share:.1f} %, {verdict}")
        yield f"  {name}: {'; '.join(parts)}"


def _between(tree: xr.DataTree, labels: list[str]) -> Iterator[str]:
    """Yield how probable the data are under each case."""
    evidence = {label: float(group(tree, "sample_stats", label)["log_evidence"]) for label in labels}
    best = max(evidence.values())
    yield "how probable the data are under each case (ln of the ratio to the best):"
    for label, value in evidence.items():
        yield f"  {label}: {value - best:.3g}"
