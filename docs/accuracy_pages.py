"""Error against run time, figures of each campaign of ``campaigns/accuracy``: ``python docs/accuracy_pages.py [NAME ...]``.

Runs ``wearlab accuracy`` on the campaigns named, on all with ``all``; keeps the figures,
small, in ``docs/images/accuracy``, the curves and how they were measured in
``docs/accuracy.json``, and writes ``docs/accuracy.md`` of all that is kept, also without
a name. No number of the page stands here: each is read off the curves.

``--methods NAME [CASE ...]`` measures the curves of our default method and of the
fastest others alone, which the tables need: minutes instead of a quarter of an hour.
"""

import json
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pictures
import xarray as xr

from wearlab.accuracy import life, life_curves, study
from wearlab.accuracy.ladder import interpolated
from wearlab.accuracy.life import has_life
from wearlab.accuracy.peer_curves import peer_curves
from wearlab.accuracy.reference import reference
from wearlab.accuracy.steady import steady
from wearlab.accuracy.steady_curves import steps_curve
from wearlab.campaign import load
from wearlab.cli.app import status_of
from wearlab.cli.commands.compare import case_labels
from wearlab.life import adaptive
from wearlab.scene import Scene

TOP = Path(__file__).parents[1]
CAMPAIGNS = TOP / "campaigns" / "accuracy"
IMAGES = TOP / "docs" / "images" / "accuracy"
KEPT = TOP / "docs" / "accuracy.json"
KINDS = {
    "work-precision": "Error of the steady mesh force over the run time",
    "life-time": "Error of life and wear depth over the run time",
    "life": "Error of life and wear depth over contact analyses, which are the same "
    "on every machine",
    "knobs": "Error over each setting alone",
}
PROVENANCE = ("date_created", "model_version", "machine", "packages")
STEPPING = ("steps_per_period", "cycle_tolerance", "threshold", "relative")
"""Settings of a method; other curves turn a setting below it."""
READING = {
    "work-precision": "Below and to the left is better: each point is a setting, blue "
    "is our default method.",
    "life-time": "Below and to the left is better; the ring is the default tolerance.",
    "life": "The same points over contact analyses, which are the same on every "
    "machine.",
    "knobs": "Each panel turns one setting alone: how fine is fine enough.",
}
"""How to read each kind of figure."""
DEFAULTS = ("periodic", "adaptive")
"""Names of the curves of our default methods."""
DIGITS = range(2, 9)
"""Digits of accuracy of the summary: an error of 1e-2 has two."""
QUANTITIES = {"mesh_force": "mesh force", "life": "life", "wear_depth": "wear depth"}
SETTINGS = {
    "steps_per_period": "the steps of a period",
    "profile_points": "the points of a flank",
    "tolerance": "the tolerance",
    "phase_points": "the phases",
    "stiffness_harmonics": "the harmonics",
}

HEAD = """# What an error costs, campaign by campaign

Every scene of `campaigns/accuracy` is solved at ever finer settings. The errors are those against a reference that a second method
has confirmed. Other integrators and outside solvers (the extra `[peers]`) solve the same scene. Times are those of the
processor: that others wait for it does not count. Curves beside each other come from one run, so that their
ratio says more than the times. `python docs/accuracy_pages.py all` makes this page; `wearlab accuracy FILE` does the same for
your own scenes, with tables."""

SUMMARY = """## In two tables

Steady states, from [the races](evidence/races.md), which were run on a quiet machine. The ratio is the time of the other over ours:
above 1 we are faster. The marching peer is the fastest of CyRK's four integrators, told for free how long to march. The last column
is the faster of Newton's method around a period and harmonic balance, compiled for the one scene. An empty cell:
the other does not reach the error, or is not for such a scene."""

LIVES = """Lives, from the fastest to the slowest scene of a campaign where it has several, measured while other work ran on the
machine: ratios say more than times. No outside solver is known for them: the other method is Euler's, in steps of a wear threshold, as the papers take them. A campaign that is missing was not measured for
this table; its figures are below."""

ORDER = """## Orders, and why RK4 has a lower one on a table

The number at the end of a curve is its observed order: the power of the step with which the error falls, the median of the three finest
pairs of points. RK4 and our default method are of order four where the stiffness is smooth within each step. Steps end at every known
jump, so that jumps cost no order. A stiffness from a table (`mesh.stiffness.model = "tabulated"`) is less smooth: a cubic joins its rows,
whose second derivative jumps at each row, and steps do not end at rows. The order is then three in the mean. From one halving of the step to the
next it scatters, because a row lies in another part of its step each time; the median of three such slopes is easily 2.2.
It is the table's, not the method's: where a step ends at each row, four is back. RK4 on one coordinate with the same stiffness:"""

ORDER_END = """A row that stands twice in a table is a known jump: steps end there, and the order is four
([jumps of the mesh stiffness](evidence/extremes.md#jumps-of-the-mesh-stiffness)). `python tests/benchmarks/tabulated_order.py
docs/evidence/tabulated_order.json` measures the orders above."""
TABULATED = TOP / "docs" / "evidence" / "tabulated_order.json"


class Curve(NamedTuple):
    """A kept work–precision curve.

    Parameters
    ----------
    case, name, knob, quantity, role : what it is of
    order : observed, None where there is none
    setting, error, seconds, work : along the rungs
    """

    case: str
    name: str
    knob: str
    quantity: str
    role: str
    order: float | None
    setting: list[float]
    error: list[float]
    seconds: list[float]
    work: list[float | None]

    @property
    def is_ours(self) -> bool:
        """Whether it is of our default method."""
        return self.name in DEFAULTS

    @property
    def is_other(self) -> bool:
        """Whether it is of another method."""
        return self.role != "wearlab"

    def time_to(self, error: float) -> float:
        """Return the processor time to an error, NaN where it is not reached [s]."""
        return interpolated(self.error, self.seconds, error)

    def work_to(self, error: float) -> float:
        """Return the work to an error, NaN where it is not reached."""
        work = [np.nan if value is None else value for value in self.work]
        return interpolated(self.error, work, error)


class Race(NamedTuple):
    """Ours beside the fastest other method, to one error of one case.

    Parameters
    ----------
    ours, other : processor times [s]
    name : of the other method, empty where none reaches the error
    """

    ours: float
    other: float
    name: str

    @property
    def ratio(self) -> float:
        """Time of the other over ours [1]."""
        return self.other / self.ours


def measure(name: str) -> None:
    """Run one campaign's study, and keep what it gives."""
    begun = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        if status_of(["accuracy", str(CAMPAIGNS / f"{name}.toml"), "--out", folder]):
            sys.exit(f"{name}: no curve was measured")
        keep(name, Path(folder), time.process_time() - begun)


def keep(name: str, folder: Path, seconds: float) -> None:
    """Keep figures, curves and how they were measured.

    Parameters
    ----------
    name : of the campaign
    folder : what `wearlab accuracy` wrote
    seconds : processor time of it [s]
    """
    for image in sorted(folder.glob("*.png")):
        pictures.write_small(image.read_bytes(), IMAGES / f"{name}-{image.name}")

    with xr.open_dataset(folder / "accuracy.nc") as studies:
        measured: dict[str, Any] = {key: studies.attrs[key] for key in PROVENANCE}
        measured["minutes"] = round(seconds / 60.0, 1)
        measured["disagreement"] = _disagreements(studies)
        measured["curves"] = [curve._asdict() for curve in _curves_of(studies)]

    everything = kept() | {name: measured}
    KEPT.write_text(_one_line_per_curve(everything))


def measure_methods(name: str, labels: Sequence[str]) -> None:
    """Measure our default method and the fastest others, and keep their curves.

    Parameters
    ----------
    name : of the campaign
    labels : of the cases that are measured; none: all
    """
    campaign = load(CAMPAIGNS / f"{name}.toml")
    names = case_labels(campaign)
    for label, case in zip(names, campaign.cases, strict=True):
        if labels and label not in labels:
            continue
        begun = time.time()
        studied = methods_study(label, case.scene)
        studies = study.dataset(campaign.title, [studied], begun)
        everything = kept()
        measured = everything[name]
        curves = [one for one in measured.get("curves", []) if one["case"] != label]
        curves += [curve._asdict() for curve in _curves_of(studies)]
        measured["curves"] = sorted(curves, key=lambda one: names.index(one["case"]))
        measured["disagreement"] = measured.get("disagreement", {})
        measured["disagreement"] |= _disagreements(studies)
        measured["methods_date"] = studies.attrs["date_created"][:10]
        KEPT.write_text(_one_line_per_curve(everything))


def methods_study(label: str, scene: Scene) -> study.Study:
    """Return the study of a scene with the curves of the fastest methods alone."""
    if has_life(scene):
        problem = life.wear_problem(scene)
        answer = life.integrated_life(
            problem, adaptive.Adaptive(), life_curves.REFERENCE_TOLERANCE
        )
        second = life.second_life(problem, answer.cycle)
        difference = max(life.errors(second, answer))
        curves = life_curves.method_curves(problem, answer, print)
        known = {"life": difference, "wear_depth": difference}
        return study.Study(label, scene, tuple(curves), known, np.nan, ())

    problem = steady(scene)
    answer = reference(problem)
    curves = (steps_curve(problem, answer), *peer_curves(problem, answer, print))
    known = {"mesh_force": answer.disagreement}
    return study.Study(label, scene, curves, known, answer.multiplier, ())


def _disagreements(studies: xr.Dataset) -> dict[str, dict[str, float]]:
    """Return how far the second method is from the reference, by case and quantity."""
    return {
        str(case): {
            str(quantity): float(f"{value:.2g}")
            for quantity, value in zip(
                studies.quantity_compared.values,
                studies.reference_disagreement.sel(case=case).values,
                strict=True,
            )
            if np.isfinite(value)
        }
        for case in studies["case"].values
    }


def _curves_of(studies: xr.Dataset) -> Iterator[Curve]:
    """Yield the curves of a dataset of studies."""
    for case in studies["case"].values:
        for place in range(studies.sizes["curve"]):
            values = studies.sel(case=case).isel(curve=place)
            rungs = values.isel(rung=np.isfinite(values.error.values))
            if not rungs.sizes["rung"]:
                continue
            order = float(values.observed_order)
            yield Curve(
                case=str(case),
                name=values["name"].item(),
                knob=values.knob.item(),
                quantity=values["quantity"].item(),
                role=values.role.item(),
                order=round(order, 2) if np.isfinite(order) else None,
                setting=_rounded(rungs.setting.values),
                error=_rounded(rungs.error.values),
                seconds=_rounded(rungs.run_time.values),
                work=_rounded(rungs.work.values),
            )


def _rounded(values: Any) -> list[Any]:
    """Return values to four digits, None for those that are not finite."""
    return [
        float(f"{value:.4g}") if np.isfinite(value) else None
        for value in values.tolist()
    ]


def _one_line_per_curve(everything: dict[str, Any]) -> str:
    """Return what is kept as JSON, a line for each curve."""
    campaigns = []
    for name, measured in sorted(everything.items()):
        facts = {key: value for key, value in measured.items() if key != "curves"}
        lines = [
            f"  {json.dumps(key)}: {json.dumps(facts[key])}" for key in sorted(facts)
        ]
        curves = ",\n".join(
            f"   {json.dumps(one)}" for one in measured.get("curves", [])
        )
        lines.append(f'  "curves": [\n{curves}\n  ]')
        campaigns.append(f" {json.dumps(name)}: {{\n" + ",\n".join(lines) + "\n }")
    return "{\n" + ",\n".join(campaigns) + "\n}\n"


def kept() -> dict[str, Any]:
    """Return what is kept of each campaign, by name."""
    return json.loads(KEPT.read_text()) if KEPT.exists() else {}


def kept_curves(measured: dict[str, Any], quantity: str) -> list[Curve]:
    """Return the curves of methods, not of settings below them, of one quantity."""
    curves = [Curve(**one) for one in measured.get("curves", [])]
    return [
        curve
        for curve in curves
        if curve.quantity == quantity
        and curve.knob in STEPPING
        and (curve.is_ours or curve.is_other)
    ]


def campaigns() -> dict[str, str]:
    """Return what each campaign is of, by name."""
    titles = {
        file.stem: tomllib.loads(file.read_text())["title"]
        for file in sorted(CAMPAIGNS.glob("*.toml"))
    }
    short = {
        name: title.removeprefix("Error against run time: ")
        for name, title in titles.items()
    }
    return {name: title[0].upper() + title[1:] for name, title in short.items()}


def images(name: str) -> list[str]:
    """Return the kinds of figures that are kept of a campaign, those over the run time first."""
    return [kind for kind in KINDS if (IMAGES / f"{name}-{kind}.png").exists()]


def page() -> str:
    """Return the page of all that is kept."""
    everything = kept()
    parts = [
        HEAD,
        SUMMARY,
        raced(),
        LIVES,
        summary(everything),
        ORDER,
        tabulated_orders(),
        ORDER_END,
    ]
    for name, title in campaigns().items():
        measured = everything.get(name)
        parts += [f"## {title}"]
        parts += [
            f"`wearlab accuracy campaigns/accuracy/{name}.toml`, " + _measured(measured)
        ]
        for kind in images(name):
            parts += [
                f"![{KINDS[kind]}, {title}](images/accuracy/{name}-{kind}.png)",
                *sentences(kind, measured or {}),
            ]
    return "\n\n".join(parts) + "\n"


def _measured(measured: dict[str, Any] | None) -> str:
    if measured is None:
        return "not measured yet."
    text = (
        f"figures measured on {measured['date_created'][:10]} in "
        f"{measured['minutes']:g} minutes of a core, model version "
        f"{measured['model_version']}, "
        f"{measured['machine']}, {measured['packages'].split(', xarray')[0]}"
    )
    if "share" in measured:
        text += f", by the clock with {100 * measured['share']:.0f} % of a core"
    if "methods_date" in measured:
        text += f"; the times in the text on {measured['methods_date']}"
    return text + "."


def races(measured: dict[str, Any], quantity: str, error: float) -> list[Race]:
    """Return ours beside the fastest other method, for each case that ours solves.

    Parameters
    ----------
    measured : what is kept of a campaign
    quantity : whose error counts
    error : to be reached [1]; no case whose reference is less well known counts
    """
    curves = kept_curves(measured, quantity)
    found = []
    for case in dict.fromkeys(curve.case for curve in curves):
        disagreement = measured["disagreement"].get(case, {}).get(quantity, 0.0)
        ours = [
            curve.time_to(error)
            for curve in curves
            if curve.case == case and curve.is_ours
        ]
        if not ours or not np.isfinite(ours[0]) or disagreement > error:
            continue
        others = [
            (curve.time_to(error), curve.name)
            for curve in curves
            if curve.case == case and curve.is_other
        ]
        reached = [other for other in others if np.isfinite(other[0])]
        fastest, name = min(reached, default=(np.nan, ""))
        found.append(Race(ours[0], fastest, name))
    return found


def summary(everything: dict[str, Any]) -> str:
    """Return the table of the times to each digit of accuracy."""
    lines = [
        "| campaign | error | ours | best other | ratio |",
        "|---|---|---|---|---|",
    ]
    for name, title in campaigns().items():
        measured = everything.get(name, {})
        for quantity in ("life", "wear_depth"):
            label = QUANTITIES[quantity]
            subject = f"[{title}](#{_anchor(title)}), {label}"
            for digits in DIGITS:
                found = races(measured, quantity, 10.0**-digits)
                if found:
                    cells = (subject, f"1e-{digits}", *_cells(found))
                    lines.append("| " + " | ".join(cells) + " |")
                    subject = ""
    return "\n".join(lines)


def _anchor(title: str) -> str:
    """Return the anchor of a heading, as GitHub makes it."""
    kept_signs = (sign for sign in title.lower() if sign.isalnum() or sign in " -")
    return "".join(kept_signs).replace(" ", "-")


def _cells(found: Sequence[Race]) -> tuple[str, str, str]:
    """Return ours, the best other and the ratio of races as texts."""
    reached = [race for race in found if race.name]
    ours = _times([race.ours for race in found])
    if not reached:
        return ours, "", ""
    names = list(dict.fromkeys(_method(race.name) for race in reached))
    other = f"{', '.join(names)}: {_times([race.other for race in reached])}"
    return ours, other, _ratios([race.ratio for race in reached])


def _method(name: str) -> str:
    """Return the name of another method as people know it."""
    known = {"rk4": "RK4", "rk45": "RK45", "newmark": "Newmark", "Euler": "Euler"}
    return known.get(name, name.removesuffix(", landing"))


def _times(seconds: Sequence[float]) -> str:
    """Return the range of times."""
    unit, factor = ("s", 1.0) if min(seconds) >= 1.0 else ("ms", 1e3)
    return f"{_range([factor * value for value in seconds], '{:.2g}')} {unit}"


def _ratios(values: Sequence[float]) -> str:
    """Return the range of ratios, in bold where others are faster."""
    text = _range(values, "{:.1f}")
    return f"**{text}**" if min(values) < 1.0 else text


def _range(values: Sequence[float], form: str) -> str:
    """Return the least and the largest of values, one where both read the same."""
    least, largest = (_plain(form, value) for value in (min(values), max(values)))
    return least if least == largest else f"{least} to {largest}"


def _plain(form: str, value: float) -> str:
    """Return a number without exponent where it is large."""
    return f"{value:.0f}" if value >= 100.0 else form.format(value)


def sentences(kind: str, measured: dict[str, Any]) -> list[str]:
    """Return how to read a figure, and its numbers where its curves are kept."""
    told: list[str] = []
    if not measured.get("curves"):
        pass
    elif kind == "work-precision":
        told = [*_race_sentences(measured, ("mesh_force",)), *_order_sentence(measured)]
    elif kind == "life-time":
        told = _race_sentences(measured, ("life", "wear_depth"))
    elif kind == "life":
        told = _work_sentences(measured)
    else:
        told = _setting_sentences(measured)
    return [" ".join([READING[kind], *told])]


def _race_sentences(measured: dict[str, Any], quantities: Sequence[str]) -> list[str]:
    """Return the times to two errors, ours and those of the best other method."""
    told = []
    for quantity in quantities:
        for error in (1e-3, 1e-6):
            found = races(measured, quantity, error)
            if not found:
                continue
            ours, _, _ = _cells(found)
            text = f"To {error:.0e} of the {QUANTITIES[quantity]} we take {ours}"
            reached = [race for race in found if race.name]
            if reached:
                ratio = _range([race.ratio for race in reached], "{:.1f}")
                names = ", ".join(dict.fromkeys(_method(one.name) for one in reached))
                text += f", the best other method ({names}) {ratio} times as long"
            told.append(text + ".")
    return told


def _order_sentence(measured: dict[str, Any]) -> list[str]:
    """Return the observed orders of the methods with fixed steps."""
    told = []
    for name, label in (("periodic", "ours"), ("rk4", "RK4"), ("newmark", "Newmark")):
        found = [
            curve.order
            for curve in kept_curves(measured, "mesh_force")
            if curve.name == name and curve.order is not None
        ]
        if found:
            told.append(f"{label} {_range(found, '{:.1f}')}")
    return [f"Observed orders over the steps: {', '.join(told)}."] if told else []


def _work_sentences(measured: dict[str, Any]) -> list[str]:
    """Return the contact analyses to an error of a life."""
    told = []
    for quantity in ("life", "wear_depth"):
        counts: dict[str, list[float]] = {"adaptive": [], "Euler": []}
        for curve in kept_curves(measured, quantity):
            work = curve.work_to(1e-3)
            if np.isfinite(work):
                counts[curve.name].append(work)
        if counts["adaptive"]:
            text = (
                f"To 1e-3 of the {QUANTITIES[quantity]} adaptive steps need "
                f"{_range(counts['adaptive'], '{:.0f}')} analyses"
            )
            if counts["Euler"]:
                text += f", Euler's {_range(counts['Euler'], '{:.0f}')}"
            told.append(text + ".")
    return told


def _setting_sentences(measured: dict[str, Any]) -> list[str]:
    """Return the order of the error over each setting."""
    orders: dict[str, list[float]] = {}
    for one in measured["curves"]:
        curve = Curve(**one)
        if curve.role == "wearlab" and curve.knob in SETTINGS and curve.order:
            orders.setdefault(curve.knob, []).append(curve.order)
    told = [
        f"{SETTINGS[knob]} {_range(found, '{:.1f}')}" for knob, found in orders.items()
    ]
    return [f"Observed orders: over {', '.join(told)}."] if told else []


def tabulated_orders() -> str:
    """Return the table of RK4's orders on a stiffness from tables."""
    lines = [
        "| stiffness | mean order | from halving to halving | error with fewest, most steps |",
        "|---|---|---|---|",
    ]
    for name, measured in json.loads(TABULATED.read_text()).items():
        orders = _range(measured["orders"], "{:.1f}")
        fewest, *_, most = measured["errors"]
        ends = f"{fewest:.0e}, {most:.0e}"
        lines.append(f"| {name} | {measured['mean_order']} | {orders} | {ends} |")
    return "\n".join(lines)


RACES_PAGE = TOP / "docs" / "evidence" / "races.md"
RACE_HEADS = ("case", "error", "wearlab", "× marching peer", "× Newton or balance")


def raced() -> str:
    """Return the races of other solvers, of the table that their script wrote."""
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in RACES_PAGE.read_text().splitlines()
        if line.startswith("| ")
    ]
    heads = next(row for row in rows if tuple(row[:5]) == RACE_HEADS)
    first = rows.index(heads) + 2
    lines = [
        "| case | error | ours | marching peer, ratio | Newton or balance, ratio |",
        "|---|---|---|---|---|",
    ]
    for cells in rows[first:]:
        if len(cells) != len(heads):
            break
        lines.append("| " + " | ".join(cells[:5]) + " |")
    return "\n".join(lines)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--methods"]:
        measure_methods(sys.argv[2], sys.argv[3:])
        sys.argv[1:] = []
    for chosen in campaigns() if sys.argv[1:] == ["all"] else sys.argv[1:]:
        measure(chosen)
    (TOP / "docs" / "accuracy.md").write_text(page())
