"""What eight readings can give at once: ``python tests/benchmarks/update_frontier.py
[docs/update.md] [sets] [first seed]``.

Sets of wear by the laws of `laws.py`, with several priors of the drift, by the own
dense quadrature of `dense.py`, with which the package agrees: the least share of lives
that a 90 % interval holds, in any law; how wide intervals of clean sets are, over those
of a steady rate; the ranked probability score over that of the best of three baselines.
The table is printed, and written between its marks into a page that is named, and the
figure beside it.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

sys.path.insert(0, str(Path(__file__).parents[1] / "updating"))

from dense import Drifts, Quadrature, least_mean_width
from laws import BASELINES, ERRORS, LAST, LAWS, Told
from page_tables import write_between

from wearlab.updating.rate_drift import SCALE, SHARE

SETS = 200
ENOUGH = 80.0  # % of lives to be held
CLOSE = 1.1  # of the best baseline's score
CLEAN = "cycles, as the model"
LIVES = np.linspace(0.6, 2.5, 1500)
NO_SCATTER = {0.0: 1.0}
BEGIN = "<!-- made by tests/benchmarks/update_frontier.py -->"
END = "<!-- frontier end -->"
HEADS = (
    "before",
    "least held",
    "below 80 %",
    "clean, times as wide",
    "largest score over the best baseline's",
    "above 1.10",
)


def with_steady(share: float) -> Drifts:
    """Return the package's prior with another probability of a steady rate."""
    others = (1.0 - share) / (1.0 - SHARE["steady"])
    shares = {kind: others * old for kind, old in SHARE.items()}
    return Drifts(shares={**shares, "steady": share})


# of the list: courses over the share of the time inspected, errors of one law grow
LAWS_ALONE = Drifts(
    laws=(
        *(("power", float(np.log(b)), 1.0) for b in (0.6, 0.8, 0.9, 1.1, 1.2, 1.5)),
        ("power", 0.0, 1.0),
        ("running-in", float(np.log(1.0 + 0.25 / 0.06 / 0.75)), 0.06 / LAST),
        ("change", float(np.log(2.0)), 0.4 / LAST),
        ("change", float(np.log(0.5)), 0.4 / LAST),
        ("change", float(np.log(1.3)), 0.3 / LAST),
    ),
    scatter={0.0: 0.9, 0.045: 0.1},
)
PRIORS = {
    "steady to 95 %": with_steady(0.95),
    "to 75 %": with_steady(0.75),
    "to 50 %": with_steady(0.5),
    "to 20 %, **the package's**": Drifts(),
    "to 5 %": with_steady(0.05),
    "half its scale": Drifts(scale=0.5 * SCALE),
    "twice its scale": Drifts(scale=2.0 * SCALE),
    "no scatter": Drifts(scatter=NO_SCATTER),
    "these very laws, all alike, and no other": LAWS_ALONE,
}
STEADY = Drifts(laws=(("power", 0.0, 1.0),), scatter=NO_SCATTER)


@dataclass(frozen=True)
class Frontier:
    """What a prior comes to, each (laws, 2) of a known and an unknown sd.

    Parameters
    ----------
    held : share of lives in the 90 % interval [%]
    width : median width over that of a steady rate
    score : ranked probability score over that of the best baseline
    """

    held: np.ndarray
    width: np.ndarray
    score: np.ndarray

    @property
    def clean_width(self) -> np.ndarray:
        """Width of intervals of clean sets, of a known and an unknown sd, (2,)."""
        return self.width[list(LAWS).index(CLEAN)]

    def row(self, label: str) -> str:
        """Return the row of the table."""
        cells = [
            label,
            f"{self.held.min():.0f} %",
            f"{np.sum(self.held < ENOUGH)} of {self.held.size}",
            " / ".join(f"{width:.2f}" for width in self.clean_width),
            f"{self.score.max():.2f}",
            f"{np.sum(self.score > CLOSE)} of {self.score.size}",
        ]
        return f"| {' | '.join(cells)} |"


def told(prior: Drifts, sets: dict, known: str) -> dict[str, list[Told]]:
    """Return what a prior tells of all sets of each law."""
    quadrature = Quadrature(prior)
    return {
        name: [Told(quadrature.lives(value, known)) for value in values]
        for name, values in sets.items()
    }


def frontier(prior: Drifts, sets: dict, steady: dict, best: dict) -> Frontier:
    """Return what a prior comes to."""
    held = []
    width = []
    score = []
    for known in ERRORS:
        answers = told(prior, sets, known)
        held.append([np.mean([one.holds for one in answers[n]]) for n in LAWS])
        ratios = [
            np.median([a.width / b.width for a, b in pairs])
            for pairs in (zip(answers[n], steady[known][n], strict=True) for n in LAWS)
        ]
        width.append(ratios)
        means = [np.mean([one.crps for one in answers[n]]) / best[n] for n in LAWS]
        score.append(means)
    return Frontier(100.0 * np.array(held).T, np.array(width).T, np.array(score).T)


def figure(results: dict[str, Frontier], bound: float, file: Path) -> None:
    """Draw shares held and scores over widths of clean sets."""
    with matplotlib.rc_context(matplotlib.rcParamsDefault):
        whole = Figure((8.4, 3.4), layout="constrained")
        left, right = whole.subplots(1, 2)
        for label, one in results.items():
            is_default = "**" in label
            name = "the package's" if is_default else label.partition(",")[0]
            at = float(one.clean_width.mean())
            for axes, value in ((left, one.held.min()), (right, one.score.max())):
                axes.plot(at, value, "D" if is_default else "o", ms=5)
                offset = (4, -10) if is_default else (4, 4)
                axes.annotate(
                    name, (at, value), offset, textcoords="offset points", fontsize=7
                )
        left.axhline(ENOUGH, color="0.7", lw=0.8)
        right.axhline(CLOSE, color="0.7", lw=0.8)
        for axes in (left, right):
            axes.axvline(1.15, color="0.7", lw=0.8, ls=":")
            axes.axvline(bound, color="C3", lw=0.8, ls="--")
            axes.set_xlabel("width of clean intervals over those of a steady rate")
            axes.margins(x=0.25, y=0.1)
        left.set_ylabel("least share of lives in 90 % [%]")
        right.set_ylabel("largest score over the best baseline's")
        whole.savefig(file, dpi=110)


def main(page: Path | None, count: int, first: int) -> None:
    """Print the table of seeds from ``first`` on; write it and the figure."""
    seeds = range(first, first + count)
    sets = {name: [law.drawn(seed) for seed in seeds] for name, law in LAWS.items()}
    best = {
        name: min(np.mean([base(value).crps for value in values]) for base in BASELINES)
        for name, values in sets.items()
    }
    steady = {known: told(STEADY, sets, known) for known in ERRORS}
    bounds = [least_mean_width(share, LIVES) for share in (0.8, 0.9)]
    print("least mean widths to hold 80 %, 90 %:", bounds, flush=True)

    lines = [f"| {' | '.join(HEADS)} |", "|" + "---|" * len(HEADS)]
    results = {}
    for label, prior in PRIORS.items():
        results[label] = frontier(prior, sets, steady, best)
        lines.append(results[label].row(label))
        print(lines[-1], flush=True)
    if page is not None:
        write_between(page, BEGIN, END, lines)
        image = page.parent / "images" / "update_frontier.png"
        figure(results, bounds[0], image)


if __name__ == "__main__":
    main(
        Path(sys.argv[1]) if len(sys.argv) > 1 and sys.argv[1] != "-" else None,
        int(sys.argv[2]) if len(sys.argv) > 2 else SETS,
        int(sys.argv[3]) if len(sys.argv) > 3 else 0,
    )
