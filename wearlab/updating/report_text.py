"""An update as text, read from its tree, so that a kept one says the same.

Words: `case.txt`, `fleet.txt`.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from wearlab.arrays import Array, Index
from wearlab.schema import VARIABLES
from wearlab.units import HOUR, convert, shown_unit
from wearlab.updating import misfit, scenario_text
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
from wearlab.updating.sheet_text import sheet_lines

DERIVED = ("wear_coefficient", "life", "remaining_useful_life")
WITHOUT = "remaining_without_"
DOUBTFUL_SOURCE = 0.1  # probability of a scale of its own, from which it is said
BELIEVED = tuple(
    (Path(__file__).parent / "believed.txt").read_text(encoding="utf-8").splitlines()
)
TODAY = ("today", "today_cycle", "passed_today")
MAX_LISTED = 24  # inspections of a block whose checks are listed
FIRST = 2  # units that are named as those to open first
MAX_OPENED = 6  # units that are named where more may have passed the limit today
# times the others' pace, and share of the limit, that are a reason to open a unit
FAST = 1.25
MUCH = 0.6
PASSED = "passed"
OVERDUE = "overdue"
# probabilities from which the limit may have, and has, been passed
MAYBE = 0.05
SURE = 0.95
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
    """Return an update line by line.

    Parameters
    ----------
    tree : as `update` returns it
    """
    if "unit" in tree["predictions"].dims:
        return rendered("fleet.txt", _fleet(tree))
    lines = [str(tree.attrs.get("title", ""))]
    for label, groups in cases_of(tree).items():
        lines += ["", f"case {label}"] if label else []
        # a warning is read alone, too
        warning = f"  ! case {label}: " if label else "  ! "
        for line in rendered("case.txt", _case(groups)):
            is_warning = line.startswith("! ")
            lines.append(warning + line[2:] if is_warning else f"  {line}")
    if "comparison" in tree.children:
        lines += ["", *text_of_models(tree["comparison"].to_dataset())]
    return lines


def answers(tree: xr.DataTree) -> list[str]:
    """Return a sentence a case or unit: when the limit is reached, as far as is known.

    Parameters
    ----------
    tree : as `update` returns it
    """
    if "unit" in tree["predictions"].dims:
        rows = _rows(tree["predictions"].to_dataset())
        sentences = rendered(
            "answers.txt", {"rows": rows, "passed": PASSED, "overdue": OVERDUE}
        )
        return [*units_to_open(tree), *sentences]

    lines = []
    for label, groups in cases_of(tree).items():
        predictions = groups["predictions"]
        seconds = float(predictions["seconds_per_cycle"])
        rest = seconds * _last(predictions["remaining_useful_life_quantile"])
        has_days = "end_of_life_quantile" in predictions
        values = {
            "label": label,
            "wear": _limit(predictions),
            "times": rest[::2],
            "days": _days(predictions)[::2] if has_days else None,
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
    """Return the models beside each other as a table and one sentence.

    Parameters
    ----------
    comparison : group of an update's tree
    """
    model = comparison["model"].values
    evidence = comparison["log_evidence"].values
    off = comparison["left_out_difference"].values
    error = comparison["left_out_error"].values
    width = max(map(len, model))
    labels = [name.ljust(width) for name in model]
    rows = list(zip(labels, evidence - evidence[0], off, error, strict=True))
    return rendered("models.txt", {"rows": rows})


def cases_of(tree: xr.DataTree) -> dict[str, dict[str, xr.Dataset]]:
    """Return the groups of each case under its label, "" where there is one case.

    Parameters
    ----------
    tree : as `update` returns it
    """
    groups = {name: node.to_dataset() for name, node in tree.children.items()}
    single = xr.DataArray([""], dims="case")
    labels = groups["predictions"].coords.get("case", single).values
    by_label = {}
    for label in labels:
        by_label[str(label)] = {
            name: dataset.sel(case=label) if "case" in dataset.dims else dataset
            for name, dataset in groups.items()
        }
    return by_label


def latest(values: xr.DataArray) -> xr.DataArray:
    """Return quantiles after the last inspection of a case.

    Others may have been inspected later.

    Parameters
    ----------
    values : quantiles, with or without a dimension inspection
    """
    if "inspection" not in values.dims:
        return values
    filled = np.flatnonzero(values.notnull().any("quantile").values)
    return values.isel(inspection=int(filled[-1]) if len(filled) else -1)


def _last(values: xr.DataArray) -> Array:
    """Return quantiles after the last inspection as an array."""
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
    hours = float(predictions["seconds_per_cycle"]) / HOUR
    calendar = calendar_of(predictions)
    rest = _last(predictions["remaining_useful_life_quantile"])
    values: dict[str, Any] = {
        "life": _last(predictions["life_quantile"]),
        "rest": rest,
        "now": float(predictions["now"]),
        "hours": hours if np.isfinite(hours) else None,
        "alarm": ALARM,
        "misfit_alarm": misfit.ALARM,
        "doubtful": DOUBTFUL_SOURCE,
        "most": MAX_LISTED,
        "at": partial(_at, hours=hours, calendar=calendar),
        "on": partial(_on, hours=hours, calendar=calendar),
        "foreseen": partial(_foreseen, calendar=calendar),
        "notes": _listed(stats),
        "checks": list(_checks(stats)),
        "sources": _sources(stats, rest, float(predictions["now"]), hours, calendar),
        "stats": _numbers(stats),
        "coefficient": np.quantile(sample["wear_coefficient"], P),
        "unknowns": list(_unknowns(groups["prior"], sample, predictions)),
        "ahead": _next_inspection(groups.get("virtual_inspection", xr.Dataset())),
    }
    values["what_if"] = scenario_text.scenario_lines(predictions)
    values |= _costs(groups.get("decision", xr.Dataset()))
    values["readings"] = list(_readings(stats))
    if "robust_life" in stats and np.isfinite(stats["robust_life"]).all():
        freedom = float(stats["robust_freedom"])
        doubts = [stats[name] for name in stats if str(name).startswith("doubted_p_")]
        values["robust"] = {
            "life": stats["robust_life"].values,
            "freedom": freedom,
            "takes_sheets_as_sound": any(float(chance) > 0.0 for chance in doubts),
        }
    values["drifts"] = stats.attrs.get("discrepancy") == "drifting-rate"
    if "end_of_life_quantile" in predictions:
        about = str(predictions["end_of_life_quantile"].attrs["long_name"])
        values["days"] = _days(predictions)
        values["days_about"] = about.rpartition(", ")[2]
    if "passed_today" in predictions and np.isfinite(predictions["passed_today"]):
        values |= {name: predictions[name].item() for name in TODAY}
    if predictions.sizes.get("inspection"):
        values["replay"] = _replay_rows(predictions)
    if "calibration" in groups:
        values["twins"] = _twins(groups["calibration"])
    return values


def _readings(stats: xr.Dataset) -> Iterator[dict[str, Any]]:
    """Yield what each course of the wear rate makes of them, the likeliest first.

    Cases that stand together have their courses in the order of the alphabet.
    """
    if "reading" not in stats:
        return
    probabilities = stats["reading_probability"].values
    for n in np.argsort(-probabilities, kind="stable"):
        kind = stats["reading"].values[n]
        probability = float(probabilities[n])
        if np.isfinite(probability):
            yield {
                "kind": str(kind),
                "probability": probability,
                "life": stats["reading_life"].values[n],
                "size": stats["reading_size"].values[n],
            }


def _next_inspection(ahead: xr.Dataset) -> dict[str, Any]:
    """Return the numbers about the next inspection, with the width that it leads to."""
    values = _numbers(ahead)
    best = values.get("recommended", np.nan)
    if np.isfinite(best):
        widths = ahead["expected_width"].sel(instrument=1.0)
        values["width"] = float(widths.sel(look=best, method="nearest"))
    return values


def _costs(costs: xr.Dataset) -> dict[str, Any]:
    """Return the numbers about changes, also for failures that cost half and double."""
    values: dict[str, Any] = {"costs": _numbers(costs)}
    if "best_rate" in costs:
        values["cheaper"] = _numbers(costs.sel(failure_times=0.5))
        values["dearer"] = _numbers(costs.sel(failure_times=2.0))
    if "rate_with_look" in costs:
        values["costs"]["rate_with_look"] = float(costs["rate_with_look"].min())
    return values


def _replay_rows(predictions: xr.Dataset) -> list[tuple[Any, ...]]:
    """Return cycle, remaining life and check of each inspection that has an answer."""
    names = ("inspection", "remaining_useful_life_quantile", "check_p_forward")
    columns = [predictions[name].values for name in names]
    rows = zip(*columns, strict=True)
    return [row for row in rows if np.isfinite(row[1]).any()]


def _listed(stats: xr.Dataset) -> list[str]:
    """Return the notes, one by one."""
    return [*filter(None, str(stats["notes"].values).split(" | "))]


def calendar_of(predictions: xr.Dataset) -> Calendar | None:
    """Return the calendar over cycles, None where an update has none.

    Parameters
    ----------
    predictions : group of an update's tree
    """
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
    """Return when that was: its day if there is a calendar, its hours, its cycles."""
    if not np.isfinite(hours):
        return f"{cycle:>12.6g} cycles"
    day = None if calendar is None else float(calendar.days(cycle))
    if day is None or not abs(day) < LAST_DAY:
        return f"{cycle:>12.6g} cycles = {hours * cycle:.6g} h"
    return f"{day_text(day)} = {hours * cycle:.6g} h = {cycle:.6g} cycles"


def _on(cycle: float, hours: float, calendar: Calendar | None) -> str:
    """Return when that is, in one word: its day, else its hours, else its cycles."""
    if calendar is not None:
        return str(calendar.texts(np.array([cycle]))[0])
    if not np.isfinite(cycle):
        return NEVER
    return f"{hours * cycle:.4g} h" if np.isfinite(hours) else f"{cycle:.4g} cycles"


def _foreseen(cycle: float, rest: Array, calendar: Calendar | None) -> str:
    """Return what was foreseen after an inspection: the day of the limit.

    Without a calendar the cycles.
    """
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
        posterior_q = scale * np.quantile(sample[name], P)
        prior_q = scale * np.quantile(prior[name], P)
        if name == "factor":
            posterior_q = _last(predictions["factor_quantile"])
            prior_q = _last(predictions["prior_factor_quantile"])
        if not prior_q[4] > prior_q[0]:
            continue
        yield {
            "name": name.replace("_", " "),
            "unit": "" if shown == "1" else shown_unit(shown),
            "after": posterior_q,
            "before": prior_q,
            "narrowed": _narrowed(prior_q, posterior_q),
        }


def _narrowed(prior_q: Array, posterior_q: Array) -> float:
    """Return how many times narrower quantiles became, in logs if all are positive."""
    wide = prior_q
    narrow = posterior_q
    if prior_q[0] > 0.0 and posterior_q[0] > 0.0:
        wide, narrow = np.log([prior_q, posterior_q])
    return float(np.ptp(wide) / max(np.ptp(narrow), 1e-300))


def _checks(stats: xr.Dataset) -> Iterator[tuple[str, list[tuple[float, float, str]]]]:
    """Yield each checked block with cycle, p and verdict of its inspections."""
    for name in map(str, stats.data_vars):
        if not name.startswith("check_p_") or not np.isfinite(stats[name]).any():
            continue
        block = name.removeprefix("check_p_")
        keys = (f"cycle_{block}", name, f"check_{block}")
        rows = zip(*(stats[key].values for key in keys), strict=True)
        yield block.replace("_", " "), [row for row in rows if np.isfinite(row[1])]


def _sources(
    stats: xr.Dataset, rest: Array, now: float, hours: float, calendar: Calendar | None
) -> list[dict[str, Any]]:
    """Return the answer with all sources and without each, with days if there are."""
    scale = hours if np.isfinite(hours) else 1.0

    def row(name: str, left: Array, doubted: float) -> dict[str, Any]:
        days = None if calendar is None else calendar.texts(now + left)
        return {"name": name, "left": scale * left, "days": days, "doubted": doubted}

    rows = []
    for name in map(str, stats.data_vars):
        if name.startswith(WITHOUT) and np.isfinite(stats[name]).any():
            block = name.removeprefix(WITHOUT)
            doubted = float(stats.get(f"doubted_p_{block}", 0.0))
            label = f"  without {block.replace('_', ' ')}"
            rows.append(row(label, stats[name].values, doubted))
    if not rows:
        return []
    return [row("remaining life with all sources", rest[::2], 0.0), *rows]


def _twins(data: xr.Dataset) -> dict[str, Any]:
    """Return how often intervals of twins hold the truth, and if that is far off."""
    n = data.sizes["twin"]
    shares = []
    for name in ("factor", "life"):
        if f"{name}_rank" not in data:
            continue
        rows = []
        for width in (50, 90):
            share = float(data[f"{name}_coverage_{width}"])
            stated = width / 100
            chance = np.sqrt(stated * (1.0 - stated) / n)
            rows.append((width, share, abs(share - stated) > 3.0 * chance))
        shares.append((name, rows))
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
    shown, scale = _shown(rows["value"].attrs["units"] if rows else "1")
    (_, heads, unit_rows), *without = fleet_tables(tree)
    values: dict[str, Any] = {
        "title": str(tree.attrs.get("title", "")),
        "notes": _listed(stats),
        "flagged": _flagged(predictions, rows),
        "sheets": sheet_lines(tree),
        "unlike": _unlike_the_others(predictions),
        "table": _table([heads, *unit_rows]),
        "about": fleet_about(tree),
        "first": _units_to_open(predictions),
        "what_if": [
            (condition, _table([heads, *rows]))
            for condition, heads, rows in what_if_tables(tree)
        ],
        "shared": list(_shared(tree["posterior"].to_dataset())),
        "stats": _numbers(stats),
        "shown": shown,
        "scale": scale,
    }
    if "predictions_robust" in tree.children:
        odd = {row["unit_name"] for row in values["flagged"]}
        robust = _rows(tree["predictions_robust"].to_dataset())
        values["robust"] = _table([heads, *(row for row in robust if row[0] in odd)])
    for _, heads, rows_without in without:
        changed = [row for row in rows_without if row not in unit_rows]
        first = _units_to_open(tree["predictions_without"].to_dataset())
        values["without"] = [*_table([heads, *changed]), *first]
    return values


def _flagged(predictions: xr.Dataset, rows: xr.Dataset) -> list[dict[str, Any]]:
    """Return the inspections that contradict the others, with their hours."""
    if not rows:
        return []
    hours_per_cycle = predictions["seconds_per_cycle"].values / HOUR
    hour = dict(zip(predictions["unit"].values, hours_per_cycle, strict=True))
    keys = ("unit_name", "cycle", "higher", "first", "check_p", "what", "against")
    columns = [rows[key].values[rows["flagged"].values] for key in keys]
    flagged = [dict(zip(keys, row, strict=True)) for row in zip(*columns, strict=True)]
    for row in flagged:
        row["hours"] = hour[row["unit_name"]] * row["cycle"]
    return [row for row in flagged if not _is_told_before(row, flagged)]


def _is_told_before(row: dict[str, Any], flagged: Sequence[dict[str, Any]]) -> bool:
    """Whether another reading tells more clearly that the same two sheets disagree."""
    if not row["against"]:
        return False
    sheets = {row["what"], row["against"]}
    for other in flagged:
        same_unit = other["unit_name"] == row["unit_name"]
        if same_unit and {other["what"], other["against"]} == sheets:
            if other["check_p"] < row["check_p"]:
                return True
    return False


def _unlike_the_others(predictions: xr.Dataset) -> list[dict[str, Any]]:
    """Return the units that are not like the others, with their pace."""
    p = predictions["p_like_the_others"].values
    pace = predictions["pace"].values
    unit = predictions["unit"].values
    unlike = np.flatnonzero(p < ALARM / max(np.isfinite(p).sum(), 1))
    return [{"unit": unit[k], "pace": pace[k], "p": p[k]} for k in unlike]


FleetTable = tuple[str, tuple[str, ...], list[tuple[str, ...]]]
"""When a table of a fleet holds, its headings, a row a unit."""


def fleet_tables(tree: xr.DataTree) -> list[FleetTable]:
    """Return the tables of a fleet, nothing of one gear set.

    Parameters
    ----------
    tree : as `update` returns it
    """
    tables = []
    conditions = {"predictions": "", "predictions_without": f"{IF_WRONG}:"}
    for name, condition in conditions.items():
        if name not in tree.children or "unit" not in tree[name].dims:
            continue
        predictions = tree[name].to_dataset()
        heads = HEADS
        if "best_change" in predictions:
            heads = (*HEADS, "change at least cost")
        tables.append((condition, heads, _rows(predictions)))
    return tables


def what_if_tables(tree: xr.DataTree) -> list[FleetTable]:
    """Return a table of a fleet for each scenario, nothing of one gear set.

    Parameters
    ----------
    tree : as `update` returns it
    """
    return _of_scenarios(tree, scenario_text.scenario_tables)


def what_if_ends(
    tree: xr.DataTree,
) -> list[tuple[str, list[scenario_text.UnitEnds]]]:
    """Return of each scenario when the units of a fleet reach the limit.

    Parameters
    ----------
    tree : as `update` returns it
    """
    return _of_scenarios(tree, scenario_text.scenario_ends)


def _of_scenarios(tree: xr.DataTree, read: Callable[..., list[Any]]) -> list[Any]:
    """Return what is read of the scenarios of a fleet, nothing of one gear set."""
    predictions = tree["predictions"].to_dataset()
    if "unit" not in predictions.dims:
        return []
    ends, *_ = ends_of(predictions)
    return read(predictions, urgency(predictions), ends)


def fleet_about(tree: xr.DataTree) -> str:
    """Return what the headings of that table mean.

    Parameters
    ----------
    tree : as `update` returns it
    """
    predictions = tree["predictions"].to_dataset()
    today = predictions.get("today")
    hours = "" if today is None else f"hours: on {today.item()}; "
    return f"limit: {_limit(predictions)}; {hours}{ABOUT}"


def alerts(text: Sequence[str]) -> list[str]:
    """Return those lines of an answer's text that speak against its own numbers.

    Parameters
    ----------
    text : lines, as `text_of` returns them
    """
    return [line.strip()[2:] for line in text if line.strip().startswith("! ")]


def units_to_open(tree: xr.DataTree) -> list[str]:
    """Return which units of a fleet to open first.

    Also where what contradicts the others is wrong.

    Parameters
    ----------
    tree : as `update` returns it
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
    """Return when each unit reaches the limit: texts, numbers, and whether by date.

    Both are (units, quantiles). The numbers are days since 1970 where all units have a
    calendar, else hours from the last inspection.

    Parameters
    ----------
    predictions : group of a fleet's tree
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
    is_worn = predictions["worn"].values[:, None] >= 1.0
    texts[(texts == NEVER) & is_worn] = "not known"
    if not dated.all():
        return texts, rest, False
    on = np.where(days == NEVER, "NaT", days).astype("datetime64[D]")
    return texts, np.where(np.isnat(on), np.inf, on.astype(float)), True


def passed_by_today(predictions: xr.Dataset) -> Array:
    """Return how probably each unit has passed the limit by today.

    By its last inspection where it has no calendar.

    Parameters
    ----------
    predictions : group of an update's tree
    """
    left = latest(predictions["remaining_useful_life_quantile"])
    is_over = (left.sel(quantile=0.5) <= 0.0).astype(float)
    by_inspection = predictions.get("end_passed", is_over)
    if "passed_today" not in predictions:
        return np.asarray(by_inspection.values, float)
    today = predictions["passed_today"].fillna(by_inspection)
    return np.asarray(today.values, float)


def hours_of(predictions: xr.Dataset) -> Array:
    """Return the operating hours of each unit today.

    Those at its last inspection where it has no calendar.

    Parameters
    ----------
    predictions : group of an update's tree
    """
    cycle = predictions["now"]
    if "today_cycle" in predictions:
        cycle = predictions["today_cycle"].fillna(cycle)
    return np.asarray((cycle * predictions["seconds_per_cycle"]).values) / HOUR


def urgency(predictions: xr.Dataset) -> Index:
    """Return the order of units: what is overdue first, then by the lower end.

    Parameters
    ----------
    predictions : group of a fleet's tree
    """
    _, ends, _ = ends_of(predictions)
    in_time = passed_by_today(predictions) <= OVER
    return np.lexsort((ends[:, 0], in_time))


def _rows(predictions: xr.Dataset) -> list[tuple[str, ...]]:
    """Return a row a unit, what is overdue first."""
    texts, *_ = ends_of(predictions)
    order = urgency(predictions)
    return [_row(predictions.isel(unit=k), texts[k]) for k in order]


def _row(unit: xr.Dataset, ends: np.ndarray) -> tuple[str, ...]:
    """Return the row of a unit; ``ends`` is when it reaches the limit, by quantile."""
    values = {
        str(name): variable.values[()] for name, variable in unit.variables.items()
    }
    seconds = values["seconds_per_cycle"]
    inspected = values["now"] * seconds / HOUR
    today = values.get("today_cycle", np.nan) * seconds / HOUR
    hours = today if np.isfinite(today) else inspected
    low, _, middle, _, high = ends
    end = middle
    if values["end_passed"] > OVER:
        end = PASSED
    elif values.get("passed_today", 0.0) > OVER:
        end = f"{middle}, {OVERDUE}"
    worn = f"{100.0 * values['worn']:.0f} %" if inspected > 0.0 else "not measured"
    between = low if low == high else f"{low} and {high}"
    pace = f"{values['pace']:.2f}"
    row = (str(values["unit"]), f"{hours:,.0f}", worn, end, between, pace)
    if "best_change" not in values:
        return row

    change_hours = values["best_change"] * values["seconds_per_cycle"] / HOUR
    left = change_hours - inspected
    fallback = "now" if end == PASSED else "not known"
    remaining = f"{left:,.0f} h more" if np.isfinite(left) else fallback
    return (*row, str(values.get("best_change_day", "")) or remaining)


def _units_to_open(predictions: xr.Dataset) -> list[str]:
    """Return which units to open first, and why.

    They are those of which 1 in 20 has reached the limit soonest; all that may have
    passed it today are named or counted.
    """
    texts, *_ = ends_of(predictions)
    order = urgency(predictions)
    passed = passed_by_today(predictions)
    due = int(np.sum(passed > MAYBE))
    count = min(max(due, FIRST), MAX_OPENED)
    keys = ("unit", "worn", "pace", "p_like_the_others", "now")
    units = [
        {name: predictions[name].values[k] for name in keys}
        | {"lasts": texts[k, 0], "passed": passed[k]}
        for k in order[:count]
    ]
    today = predictions.get("today")
    about = {"today": None if today is None else today.item(), "more": due - count}
    bounds = {"maybe": MAYBE, "sure": SURE, "much": MUCH, "fast": FAST, "alarm": ALARM}
    return rendered("open.txt", {"units": units, **about, **bounds})


def _shown(unit: str) -> tuple[str, float]:
    """Return the unit in which values of fleets are shown, and the factor from SI."""
    shown = {"m": "um", "kg": "g"}.get(unit, unit)
    return ("" if shown == "1" else shown_unit(shown)), (
        1.0 if shown == unit else convert(1.0, unit, shown)
    )


def _shared(sample: xr.Dataset) -> Iterator[tuple[str, str, Array]]:
    """Yield name, unit and quantiles of what the units share.

    And of a unit that was not measured.
    """
    errors = (str(n) for n in sample.data_vars if str(n).startswith("sd_"))
    for name in (*SHARED, *errors, "factor_of_another"):
        if name in sample:
            shown, scale = _shown(sample[name].attrs["units"])
            q = scale * np.quantile(sample[name].values, [0.05, 0.5, 0.95])
            yield name, shown, np.exp(q) if name == "spread" else q
