"""An update as text, read from its tree, so that a kept one says the same.

Words: `case.txt`, `fleet.txt`.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.schema import VARIABLES
from wearlab.units import HOUR, convert, shown_unit
from wearlab.updating.calendar import (
    DAYS_A_YEAR,
    LAST_DAY,
    NEVER,
    Calendar,
    day_number,
    day_text,
)
from wearlab.updating.layout import P, digits, rendered
from wearlab.updating.sampling import ALARM

DERIVED = ("wear_coefficient", "life", "remaining_useful_life")
WITHOUT = "remaining_without_"
BELIEVED = tuple(
    (Path(__file__).parent / "believed.txt").read_text(encoding="utf-8").splitlines()
)
MOST_LISTED = 24  # inspections of a block whose checks are listed
FIRST = 2  # units that are named as those to open first
FAST, MUCH = (
    1.25,
    0.6,
)  # times the others' pace, and share of the limit, that are a reason to open a unit
PASSED = "passed"
MAYBE, SURE = (
    0.05,
    0.95,
)  # probabilities from which the limit may have, and has, been passed
OVER = 0.5  # probability from which the limit is said to have been passed
HEADS: tuple[str, ...] = (
    "unit",
    "hours",
    "worn",
    "limit reached",
    "90 % between",
    "pace",
)
IF_WRONG = "if the readings marked ! are wrong"
ABOUT = (
    "worn: how much of it at the last inspection; pace: how many times as fast as the "
    "middle unit"
)
SHARED = ("median", "spread", "straying", "power")


def text_of(tree: xr.DataTree) -> list[str]:
    """Return an update line by line."""
    if "unit" in tree["predictions"].dims:
        return rendered("fleet.txt", _fleet(tree))
    lines = [str(tree.attrs.get("title", ""))]
    for label, groups in cases_of(tree).items():
        lines += ["", f"case {label}"] if label else []
        prefix = (
            f"  ! case {label}: " if label else "  ! "
        )  # a warning is read alone, too
        case_lines = [f"  {line}" for line in rendered("case.txt", _case(groups))]
        lines += [
            prefix + line[4:] if line.startswith("  ! ") else line
            for line in case_lines
        ]
    if "comparison" in tree.children:
        lines += ["", *text_of_models(tree["comparison"].to_dataset())]
    return lines


def answers(tree: xr.DataTree) -> list[str]:
    """Return a sentence a case or unit: when the limit is reached, as far as the measurements tell."""
    if "unit" in tree["predictions"].dims:
        rows = _rows(tree["predictions"].to_dataset())
        return [
            *units_to_open(tree),
            *rendered("answers.txt", {"rows": rows, "passed": PASSED}),
        ]
    lines = []
    for label, predictions in (
        (label, groups["predictions"]) for label, groups in cases_of(tree).items()
    ):
        rest = float(predictions["seconds_per_cycle"]) * _last(
            predictions["remaining_useful_life_quantile"]
        )
        days = (
            _days(predictions)[::2] if "end_of_life_quantile" in predictions else None
        )
        values = {
            "label": label,
            "wear": _limit(predictions),
            "times": rest[::2],
            "days": days,
        }
        lines += rendered("answers.txt", values)
    return lines


def _limit(predictions: xr.Dataset) -> str:
    """Return the wear that ends the life, and where."""
    limit = predictions["limit"]
    declared = VARIABLES[str(limit.attrs["quantity"])]
    value = convert(float(limit), declared.units, declared.display_units)
    where = f" on the {limit.attrs['where']}" if limit.attrs["where"] else ""
    return f"{value:.4g} {shown_unit(declared.display_units)} of wear{where}"


def _days(predictions: xr.Dataset) -> list[str]:
    """Return the days on which the limit is reached.

    Of what has passed, that it was before the last look.
    """
    days = predictions["end_of_life_quantile"].values
    pairs = zip(days, _last(predictions["remaining_useful_life_quantile"]), strict=True)
    return [f"{'before ' if left <= 0.0 else ''}{day}" for day, left in pairs]


def text_of_models(comparison: xr.Dataset) -> list[str]:
    """Return the models beside each other as a table and one sentence."""
    names = ("model", "log_evidence", "left_out_difference", "left_out_error")
    model, gain, off, error = (comparison[name].values for name in names)
    labels = (name.ljust(max(map(len, model))) for name in model)
    return rendered(
        "models.txt",
        {"rows": list(zip(labels, gain - gain[0], off, error, strict=True))},
    )


def cases_of(tree: xr.DataTree) -> dict[str, dict[str, xr.Dataset]]:
    """Return the groups of each case under its label, "" where there is one case."""
    groups = {name: node.to_dataset() for name, node in tree.children.items()}
    by_label = {}
    for label in (
        groups["predictions"].coords.get("case", xr.DataArray([""], dims="case")).values
    ):
        selected = (
            (name, dataset.sel(case=label) if "case" in dataset.dims else dataset)
            for name, dataset in groups.items()
        )
        by_label[str(label)] = dict(selected)
    return by_label


def latest(values: xr.DataArray) -> xr.DataArray:
    """Return quantiles after the last inspection of a case.

    Others may have been inspected later.
    """
    if "inspection" not in values.dims:
        return values
    filled = np.flatnonzero(values.notnull().any("quantile").values)
    return values.isel(inspection=int(filled[-1]) if len(filled) else -1)


def _last(values: xr.DataArray) -> Array:
    return np.asarray(latest(values).values)


def _numbers(data: xr.Dataset) -> dict[str, Any]:
    """Return the single values of a group."""
    return {
        str(name): variable.values.item()
        for name, variable in data.data_vars.items()
        if not variable.dims
    }


def _case(groups: Mapping[str, xr.Dataset]) -> dict[str, Any]:
    """Return what the text of a case is made from."""
    predictions = groups["predictions"]
    stats = groups["sample_stats"]
    sample = groups["posterior"]
    ahead = groups.get("virtual_inspection", xr.Dataset())
    costs = groups.get("decision", xr.Dataset())
    hours = float(predictions["seconds_per_cycle"]) / HOUR
    calendar = calendar_of(predictions)
    life, rest = (_last(predictions[f"{name}_quantile"]) for name in DERIVED[1:])
    values: dict[str, Any] = {
        "life": life,
        "rest": rest,
        "now": float(predictions["now"]),
    }
    values |= {
        "hours": hours if np.isfinite(hours) else None,
        "alarm": ALARM,
        "most": MOST_LISTED,
    }
    values["at"] = partial(_at, hours=hours, calendar=calendar)
    values["foreseen"] = partial(_foreseen, calendar=calendar)
    values |= {"notes": _listed(stats), "checks": list(_checks(stats))}
    values["sources"] = _sources(stats, rest, hours)
    values |= {
        "stats": _numbers(stats),
        "ahead": _numbers(ahead),
        "costs": _numbers(costs),
    }
    values["coefficient"] = np.quantile(sample["wear_coefficient"], P)
    values["unknowns"] = list(_unknowns(groups["prior"], sample, predictions))
    if "end_of_life_quantile" in predictions:
        about = str(predictions["end_of_life_quantile"].attrs["long_name"])
        values |= {"days": _days(predictions), "days_about": about.rpartition(", ")[2]}
    if predictions.sizes.get("inspection"):
        columns = ("inspection", "remaining_useful_life_quantile", "check_p_forward")
        columns_of = zip(*(predictions[name].values for name in columns), strict=True)
        values["replay"] = [row for row in columns_of if np.isfinite(row[1]).any()]
    if np.isfinite(best := values["ahead"].get("recommended", np.nan)):
        width = (
            ahead["expected_width"].sel(instrument=1.0).sel(look=best, method="nearest")
        )
        values["ahead"]["width"] = float(width)
    if "best_rate" in costs:
        values |= {
            n: _numbers(costs.sel(failure_times=t))
            for n, t in (("cheaper", 0.5), ("dearer", 2.0))
        }
    if "rate_with_look" in costs:
        values["costs"]["rate_with_look"] = float(costs["rate_with_look"].min())
    if "calibration" in groups:
        values["twins"] = _twins(groups["calibration"])
    return values


def _listed(stats: xr.Dataset) -> list[str]:
    """Return the notes, one by one."""
    return [*filter(None, str(stats["notes"].values).split(" | "))]


def calendar_of(predictions: xr.Dataset) -> Calendar | None:
    """Return the calendar over cycles, None where an update has none."""
    if "calendar_date" not in predictions:
        return None
    # places are whole seconds, so that midnight may come out a second early
    day = np.round(
        day_number([text for text in predictions["calendar_date"].values if text]), 4
    )
    cycle = predictions["calendar_cycle"].values[: len(day)]
    if len(cycle) < 2 or not cycle[-1] > cycle[-2]:
        return None
    return Calendar(
        day, cycle, DAYS_A_YEAR * float((cycle[-1] - cycle[-2]) / (day[-1] - day[-2]))
    )


def _at(cycle: float, hours: float, calendar: Calendar | None) -> str:
    """Return when that was: its day where there is a calendar, its hours, its cycles."""
    if not np.isfinite(hours):
        return f"{cycle:>12.6g} cycles"
    day = None if calendar is None else float(calendar.days(cycle))
    if day is None or not abs(day) < LAST_DAY:
        return f"{cycle:>12.6g} cycles = {hours * cycle:.6g} h"
    return f"{day_text(day)} = {hours * cycle:.6g} h = {cycle:.6g} cycles"


def _foreseen(cycle: float, rest: Array, calendar: Calendar | None) -> str:
    """Return what was foreseen after an inspection: the day of the limit, without a calendar the cycles."""
    low, middle, high = rest[::2]
    if calendar is None:
        return f"{digits(middle)} cycles, 90 %: {digits(low)} to {digits(high)}"
    dates = calendar.texts(cycle + rest[::2])
    return f"limit on {dates[1]}, 90 %: {dates[0]} to {dates[2]}"


def _unknowns(
    prior: xr.Dataset, sample: xr.Dataset, predictions: xr.Dataset
) -> Iterator[dict[str, Any]]:
    """Yield what is known of every unknown, after and before."""
    for name in map(str, sample.data_vars):
        if name in DERIVED or not np.isfinite(sample[name]).any():
            continue
        unit = sample[name].attrs.get("units", "1")
        shown = sample[name].attrs.get("display_units", "1")
        scale = convert(1.0, unit, shown) if shown not in ("1", unit) else 1.0
        after_q = scale * np.quantile(sample[name], P)
        before_q = scale * np.quantile(prior[name], P)
        if name == "factor":
            after_q, before_q = (
                _last(predictions[f"{p}factor_quantile"]) for p in ("", "prior_")
            )
        if not before_q[4] > before_q[0]:
            continue
        wide, narrow = (
            np.log([before_q, after_q])
            if before_q[0] > 0.0 < after_q[0]
            else (before_q, after_q)
        )
        described = {
            "name": name.replace("_", " "),
            "unit": "" if shown == "1" else shown_unit(shown),
        }
        narrowed = np.ptp(wide) / max(np.ptp(narrow), 1e-300)
        yield {**described, "after": after_q, "before": before_q, "narrowed": narrowed}


def _checks(stats: xr.Dataset) -> Iterator[tuple[str, list[tuple[float, float, str]]]]:
    """Yield the name of each checked block, and cycle, p and words of its inspections."""
    for name in map(str, stats.data_vars):
        if name.startswith("check_p_") and np.isfinite(stats[name]).any():
            block = name.removeprefix("check_p_")
            columns = (
                stats[key].values for key in (f"cycle_{block}", name, f"check_{block}")
            )
            yield (
                block.replace("_", " "),
                [r for r in zip(*columns, strict=True) if np.isfinite(r[1])],
            )


def _sources(stats: xr.Dataset, rest: Array, hours: float) -> list[tuple[Any, ...]]:
    """Return the answer with all sources and without each."""
    scale = hours if np.isfinite(hours) else 1.0
    named = [
        n
        for n in map(str, stats.data_vars)
        if n.startswith(WITHOUT) and np.isfinite(stats[n]).any()
    ]
    shown = (f"  without {n.removeprefix(WITHOUT).replace('_', ' ')}" for n in named)
    rows = [
        (name, *scale * stats[n].values) for n, name in zip(named, shown, strict=True)
    ]
    return (
        [("remaining life with all sources", *scale * rest[::2]), *rows] if rows else []
    )


def _twins(data: xr.Dataset) -> dict[str, Any]:
    """Return how often intervals of twins hold the truth, and whether that is as it should."""
    n = data.sizes["twin"]
    shares = []
    for name in (
        quantity for quantity in ("factor", "life") if f"{quantity}_rank" in data
    ):
        held = [(w, float(data[f"{name}_coverage_{w}"])) for w in (50, 90)]
        off = (
            abs(s - w / 100) > 3.0 * np.sqrt(w / 100 * (1.0 - w / 100) / n)
            for w, s in held
        )
        shares.append(
            (name, [(*share, wrong) for share, wrong in zip(held, off, strict=True)])
        )
    return {
        "count": n,
        "shares": shares,
        **_numbers(data),
        "true_model": "true_model" in data.attrs,
    }


def _fleet(tree: xr.DataTree) -> dict[str, Any]:
    """Return what the text of a fleet is made from."""
    predictions = tree["predictions"].to_dataset()
    rows = tree["observed_data"].to_dataset()
    stats = tree["sample_stats"].to_dataset()
    sample = tree["posterior"].to_dataset()
    hour = dict(
        zip(
            predictions["unit"].values,
            predictions["seconds_per_cycle"].values / HOUR,
            strict=True,
        )
    )
    p = predictions["p_like_the_others"].values
    pace = predictions["pace"].values
    unlike = np.flatnonzero(p < ALARM / max(np.isfinite(p).sum(), 1))
    keys = ("unit_name", "cycle", "higher", "first", "check_p", "what", "against")
    flagged = zip(
        *(rows[key].values[rows["flagged"].values] for key in keys if rows), strict=True
    )
    shown, scale = _shown(rows["value"].attrs["units"] if rows else "1")
    (_, heads, rows_told), *without = fleet_tables(tree)
    values: dict[str, Any] = {
        "title": str(tree.attrs.get("title", "")),
        "notes": _listed(stats),
    }
    flagged_rows = [dict(zip(keys, row, strict=True)) for row in flagged]
    values["flagged"] = [
        row | {"hours": hour[row["unit_name"]] * row["cycle"]} for row in flagged_rows
    ]
    values["unlike"] = [
        {"unit": predictions["unit"].values[k], "pace": pace[k], "p": p[k]}
        for k in unlike
    ]
    values |= {
        "table": _table([heads, *rows_told]),
        "about": fleet_about(tree),
        "first": _units_to_open(predictions),
    }
    values |= {
        "shared": list(_shared(sample)),
        "stats": _numbers(stats),
        "shown": shown,
        "scale": scale,
    }
    for _, heads, rest in without:
        first_lines = _units_to_open(tree["predictions_without"].to_dataset())
        values["without"] = [
            *_table([heads, *(row for row in rest if row not in rows_told)]),
            *first_lines,
        ]
    return values


def fleet_tables(
    tree: xr.DataTree,
) -> list[tuple[str, tuple[str, ...], list[tuple[str, ...]]]]:
    """Return when each table of a fleet holds, its headings, a row a unit.

    Nothing of one gear set.
    """
    tables = []
    for name, condition in (
        ("predictions", ""),
        ("predictions_without", f"{IF_WRONG}:"),
    ):
        if name in tree.children and "unit" in tree[name].dims:
            predictions = tree[name].to_dataset()
            heads = (
                (*HEADS, "change at least cost")
                if "best_change" in predictions
                else HEADS
            )
            tables.append((condition, heads, _rows(predictions)))
    return tables


def fleet_about(tree: xr.DataTree) -> str:
    """Return what the headings of that table mean."""
    return f"limit: {_limit(tree['predictions'].to_dataset())}; {ABOUT}"


def alerts(text: Sequence[str]) -> list[str]:
    """Return those lines of an answer's text that speak against its own numbers."""
    return [line.strip()[2:] for line in text if line.strip().startswith("! ")]


def units_to_open(tree: xr.DataTree) -> list[str]:
    """Return which units of a fleet to open first.

    Also where what contradicts the others is wrong.
    """
    without = tree.get("predictions_without")
    wrong = [] if without is None else _units_to_open(without.to_dataset())
    return [
        *_units_to_open(tree["predictions"].to_dataset()),
        *(f"{IF_WRONG}: {line}" for line in wrong),
    ]


def _table(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows as lines, columns one under the other."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(text.ljust(n) for text, n in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def ends_of(predictions: xr.Dataset) -> tuple[np.ndarray, Array, bool]:
    """Return when each unit reaches the limit, (units, quantiles): as texts and numbers, and whether by date.

    The numbers are days since 1970 where all units have a calendar, else hours from the
    last inspection.
    """
    hour = predictions["seconds_per_cycle"].values[:, None] / HOUR
    rest = hour * predictions["remaining_useful_life_quantile"].values
    over = (rest <= 0.0) & (predictions["now"].values[:, None] > 0.0)
    hour_texts = [
        [f"{h:,.0f} h more" if np.isfinite(h) else NEVER for h in row] for row in rest
    ]
    texts = np.array(hour_texts, dtype=object)
    days = np.full(rest.shape, "")
    if "end_of_life_quantile" in predictions:
        days = predictions["end_of_life_quantile"].values.astype(str)
    dated = (days != "").all(axis=1)
    texts[dated] = days[dated]
    texts[over] = PASSED
    texts[(texts == NEVER) & (predictions["worn"].values[:, None] >= 1.0)] = "not known"
    if not dated.all():
        return texts, rest, False
    on = np.where(days == NEVER, "NaT", days).astype("datetime64[D]")
    return texts, np.where(np.isnat(on), np.inf, on.astype(float)), True


def _rows(predictions: xr.Dataset) -> list[tuple[str, ...]]:
    (texts, *_) = ends_of(predictions)
    rows = list[tuple[str, ...]]()
    for k in np.argsort(predictions["end_passed"].values <= MAYBE, kind="stable"):
        unit_values = {
            str(name): variable.values[()]
            for name, variable in predictions.isel(unit=k).variables.items()
        }
        hours = unit_values["now"] * unit_values["seconds_per_cycle"] / HOUR
        (low, _, middle, _, high) = texts[k]
        end = PASSED if unit_values["end_passed"] > OVER else middle
        measured = (
            f"{100.0 * unit_values['worn']:.0f} %" if hours > 0.0 else "not measured"
        )
        between = low if low == high else f"{low} and {high}"
        rows.append(
            (
                str(unit_values["unit"]),
                f"{hours:,.0f}",
                measured,
                end,
                between,
                f"{unit_values['pace']:.2f}",
            )
        )
        if "best_change" in unit_values:
            left = (
                unit_values["best_change"] * unit_values["seconds_per_cycle"] / HOUR
                - hours
            )
            fallback = "now" if end == PASSED else "not known"
            remaining = f"{left:,.0f} h more" if np.isfinite(left) else fallback
            rows[-1] += (str(unit_values.get("best_change_day", "")) or remaining,)
    return rows


def _units_to_open(predictions: xr.Dataset) -> list[str]:
    """Return which units to open first, and why: those of which 1 in 20 has reached the limit soonest."""
    texts, ends, _ = ends_of(predictions)
    sure = predictions["end_passed"].values <= MAYBE
    order = np.lexsort((ends[:, 0], np.where(sure, 0.0, -predictions["worn"].values)))[
        :FIRST
    ]
    keys = ("unit", "worn", "pace", "p_like_the_others", "end_passed", "now")
    units = [
        {name: predictions[name].values[k] for name in keys} | {"lasts": texts[k, 0]}
        for k in order
    ]
    bounds = {"maybe": MAYBE, "sure": SURE, "much": MUCH, "fast": FAST, "alarm": ALARM}
    return rendered("open.txt", {"units": units, **bounds})


def _shown(unit: str) -> tuple[str, float]:
    """Return the unit in which values of fleets are shown, and the factor from SI."""
    shown = {"m": "um", "kg": "g"}.get(unit, unit)
    return ("" if shown == "1" else shown_unit(shown)), (
        1.0 if shown == unit else convert(1.0, unit, shown)
    )


def _shared(sample: xr.Dataset) -> Iterator[tuple[str, str, Array]]:
    """Yield name, unit and quantiles of what the units share, and of a unit that was not measured."""
    errors = (str(n) for n in sample.data_vars if str(n).startswith("sd_"))
    for name in (*SHARED, *errors, "factor_of_another"):
        if name in sample:
            shown, scale = _shown(sample[name].attrs["units"])
            q = scale * np.quantile(sample[name].values, [0.05, 0.5, 0.95])
            yield name, shown, np.exp(q) if name == "spread" else q
