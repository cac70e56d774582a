"""How good the answers of `wearlab update` are: ``python tests/benchmarks/updates.py
[docs/update.md]``.

Quantiles against quadrature, coverage and false alarms of 200 twins, power against what
is wrong: all of it drawn and integrated outside of the update's own code
(`tests/updating/outside.py`). The tables are printed, and written between their marks
into a file that is named.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy import stats

sys.path.insert(0, str(Path(__file__).parents[1] / "updating"))

import test_decision
import test_population
from made import RATE, ErrorModel, blocks, history, observed, study
from outside import (
    CASES,
    PRIOR,
    TIMES,
    Case,
    P,
    answer_to,
    coverage,
    lognormal,
    measured,
    own_time,
    quantiles_of,
    wear,
)
from page_tables import write_between

from wearlab.campaign.update_options import TrueModel
from wearlab.updating.answers import answer_of, outcome_of
from wearlab.updating.calibration import calibrated
from wearlab.updating.decision import virtual_inspection
from wearlab.updating.report_text import _twins
from wearlab.updating.sampling import ALARM, checks, draw

TWINS, SETS, POWERED = 200, 20, 50
BEGIN, END = "<!-- made by tests/benchmarks/updates.py -->", "<!-- end -->"
WIDE = {"lognormal": {"median": 1.0, "cov": 14.0}}


def quantile_error(case: Case) -> float:
    """Return the largest relative difference of five quantiles of the
    factor, over some twins.
    """
    worst = 0.0
    for seed in range(SETS):
        rng = np.random.default_rng([3, seed])
        value = measured(
            case,
            float(np.exp(0.5 * rng.standard_normal())),
            case.sd[0],
            case.drift[0],
            rng,
        )
        worst = max(
            worst,
            float(
                np.abs(
                    answer_to(case, value).factor(P) / quantiles_of(case, value) - 1.0
                ).max()
            ),
        )
    return worst


def answers() -> list[str]:
    """Return the table of error models."""
    heads = "factor in 50 %, 90 % | life in 50 %, 90 % | false alarms"
    lines = [
        f"| error model | quantiles, {SETS} sets | {heads} |",
        "|---|---|---|---|---|",
    ]
    for name, case in CASES.items():
        held, called = coverage(case, TWINS)
        shares = {
            what: ", ".join(
                f"{100 * held[what, width] / TWINS:.1f} %" for width in (50, 90)
            )
            for what in ("factor", "life")
        }
        alarms = f"{100 * called / TWINS:.1f} %"
        row = (
            name,
            f"{quantile_error(case):.0e}",
            shares["factor"],
            shares["life"],
            alarms,
        )
        lines.append(f"| {' | '.join(row)} |")
        print(lines[-1], flush=True)
    return lines


def called(cycles: np.ndarray, values: np.ndarray, error: ErrorModel) -> bool:
    """Return whether an inspection or the course of all is called."""
    seen = (observed(cycles, values, error),)
    answer = answer_of(study(WIDE, seen), [history(seen, end=4e6)], blocks(seen))
    each, courses = checks(draw(answer, 300, np.random.default_rng(0)))
    return (
        any(check.p < ALARM / len(each) for check in each)
        or min(courses.values(), default=1.0) < ALARM
    )


def another_law(seed: int) -> bool:
    """Say whether wear that goes as cycles to 0.6 is called, its error unknown."""
    cycles = np.linspace(5e4, 1.15e6, 23)
    noise = 5e-5 * np.random.default_rng(seed).standard_normal(23)
    values = RATE * 1.15e6 * (cycles / 1.15e6) ** 0.6 + noise
    return called(cycles, values, ErrorModel(lognormal(5e-5, 1.0)))


def another_rate(seed: int) -> bool:
    """Say whether a rate that quadruples midway among 3,000 values is called."""
    cycles = np.linspace(1e3, 1e6, 3000)
    values = RATE * np.where(cycles < 5e5, cycles, 5e5 + 4.0 * (cycles - 5e5))
    return called(
        cycles,
        values + 4e-4 * np.random.default_rng(seed).standard_normal(3000),
        ErrorModel(4e-4),
    )


def larger_errors(seed: int) -> bool:
    """Say whether errors three times those told are called, of twelve weighings."""
    cycles = np.linspace(1e5, 1.2e6, 12)
    values = RATE * cycles + 1.2e-3 * np.random.default_rng(seed).standard_normal(12)
    return called(cycles, values, ErrorModel(4e-4))


def contradicting_files(seed: int) -> bool:
    """Say whether two weighings that differ by a fifth, of one per
    cent each, are said to contradict.
    """
    rng = np.random.default_rng(seed)
    cycle = np.array([5e5])
    ones = [
        observed(
            cycle,
            RATE * f * cycle + 1e-4 * rng.standard_normal(1),
            ErrorModel(1e-4),
            number=n,
        )
        for n, f in ((1, 1.0), (2, 1.2))
    ]
    found = outcome_of(study(WIDE, ones, draws=50), (history(ones),))
    return any("contradict" in note for note in found.notes)


def check_fails(true: TrueModel, seed: int) -> bool:
    """Say whether ``--check 100`` says that intervals hold less than they should."""
    cycles = np.repeat(TIMES, 4)
    seen = (observed(cycles, np.zeros(24), ErrorModel(2e-4)),)
    asked = study(PRIOR, seen, seed=seed)
    asked = replace(asked, spec=asked.spec.model_copy(update={"check": true}))
    answer = answer_of(asked, [history(seen)], blocks(seen))
    return any(
        off
        for _, shares in _twins(calibrated(asked, answer.posterior, 100))["shares"]
        for *_, off in shares
    )


def offset_left_out(seed: int) -> bool:
    """Say whether --check sees that a common offset was left out."""
    return check_fails(TrueModel((ErrorModel(2e-4, 0.0, 1e-3),), 1.0), seed)


def law_left_out(seed: int) -> bool:
    """Say whether --check sees that wear goes as cycles to 0.7."""
    return check_fails(TrueModel(None, 0.7), seed)


def power() -> list[str]:
    """Return the table of what is wrong and how often it is said."""
    lines = ["| what is wrong | sets | said in |", "|---|---|---|"]
    for words, wrong, n in (
        (
            "wear goes as cycles to 0.6, error unknown, 23 weighings",
            another_law,
            POWERED,
        ),
        ("the rate quadruples midway, 3,000 depths", another_rate, POWERED),
        ("errors three times those told, 12 weighings", larger_errors, POWERED),
        ("two files 20 % apart, 1 % each", contradicting_files, POWERED),
        ("`--check` 100, a common offset left out", offset_left_out, 10),
        ("`--check` 100, wear as cycles to 0.7", law_left_out, 10),
    ):
        lines.append(
            f"| {words} | {n} | "
            f"{100 * np.mean([wrong(seed) for seed in range(n)]):.0f} % |"
        )
        print(lines[-1], flush=True)
    return lines


def looks() -> list[str]:
    """Return the table of expected widths after one more look, beside
    nested simulation.
    """
    lines = [
        "| one more look, errors | widths promised | nested simulation | largest "
        "difference |",
        "|---|---|---|---|",
    ]
    for name in ("known", "offset"):
        case = replace(CASES[name], many=1)
        value = measured(case, 1.3, case.sd[0], 0.0, np.random.default_rng(2))
        asked = answer_to(case, value).posterior
        one = outcome_of(
            study(PRIOR, (asked.blocks[0].observed,), draws=4000), asked.histories
        )
        found = virtual_inspection(one, np.random.default_rng(0))
        mine = found["expected_width"].values[1]
        theirs = [nested_width(case, value, look) for look in found["look"].values]
        early = found["look"].values < one.answer.life(np.array([0.01]))[0]
        off = np.abs(mine - theirs)[early].max()
        each = [
            ", ".join(f"{w:.2f}" for w in np.asarray(widths)[early])
            for widths in (mine, theirs)
        ]
        lines.append(f"| {name} | {each[0]} | {each[1]} | {off:.3f} |")
        print(lines[-1], flush=True)
    return lines


def others() -> list[str]:
    """Return the table of decisions beside simulated ones, and of a
    fleet beside a sampler.
    """
    import emcee

    lines = ["| what | beside | largest difference |", "|---|---|---|"]
    found = test_decision.advice()
    changes = np.abs(test_decision.of_changes(*found))
    looks = np.abs(test_decision.of_looks(*found))
    emcees, together = test_population.beside_emcee(emcee)
    factors = max(
        off for name, off in emcees.items() if name not in test_population.PRIORS
    )
    shared = max(off for name, off in emcees.items() if name in test_population.PRIORS)
    for what, beside, off in (
        (
            "cost per hour of a planned change, 5 times and the least",
            "400,000 lives",
            f"{changes.max():.1%}",
        ),
        (
            "cost per hour with a look first, 3 times",
            "nested simulation, 1,500 truths",
            f"{looks.max():.1%}",
        ),
        (
            "factors of five liners, five quantiles",
            "emcee, 60 walkers, 6,000 steps",
            f"{factors:.2f} sd",
        ),
        ("what the five liners share, five quantiles", "the same", f"{shared:.2f} sd"),
        ("correlations of all of these", "the same", f"{together:.2f}"),
    ):
        lines.append(f"| {what} | {beside} | {off.replace('%', ' %')} |")
        print(lines[-1], flush=True)
    return lines


def nested_width(
    case: Case, value: np.ndarray, look: float, truths: int = 4000
) -> float:
    """Return the mean width of the remaining life's 90 % interval
    after a look, over that now.
    """
    rng = np.random.default_rng(7)
    u = np.linspace(-1.0, 1.5, 4001)
    factor = np.exp(u)
    error = case.error
    sd = np.hypot(case.sd[0], error.offset_sd)
    prior = stats.norm.logpdf(u, 0.0, np.sqrt(np.log1p(0.36)))
    logs = prior + stats.norm.logpdf(
        value[:, None], wear(factor * case.cycle[:, None]), sd
    ).sum(axis=0)
    mass = np.exp(logs - logs.max())
    rest = own_time(0.03) / factor
    worn = wear(factor * look)

    def width(weight: np.ndarray) -> float:
        below = np.cumsum(weight) / weight.sum()
        low, high = np.interp(
            [0.05, 0.95], below, rest[::-1][np.argsort(rest[::-1])][::-1]
        )
        return float(abs(high - low))

    now = width(mass)
    each = []
    for k in rng.choice(len(u), truths, p=mass / mass.sum()):
        seen = worn[k] + sd * rng.standard_normal()
        each.append(width(mass * np.exp(-0.5 * ((seen - worn) / sd) ** 2)))
    return float(np.mean(each)) / now


def main(file: Path | None) -> None:
    """Print the tables; write them between their marks."""
    lines = [*answers(), "", *power(), "", *looks(), "", *others()]
    if file is not None:
        write_between(file, BEGIN, END, lines)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
