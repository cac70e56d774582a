"""What a drifting wear rate is worth: ``python tests/benchmarks/update_laws.py
[docs/update.md] [sets] [first seed]``.

Sets of eight readings of wear by other laws than the model's (`laws.py`),
the sd of their error known and unknown: how often the 90 % interval holds the life, how
wide it is, the ranked probability score beside three baselines, how often a misfit is
said. The table is printed, and written between its marks into a file that is named.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "updating"))

from laws import (
    BASELINES,
    ERRORS,
    LAWS,
    Law,
    f_test,
    misfit_of,
    posteriors,
    told,
)
from page_tables import write_between

from wearlab.updating.misfit import ALARM

SETS = 200
F_ALARM = 0.02  # false alarms of the F test
BEGIN, END = "<!-- made by tests/benchmarks/update_laws.py -->", "<!-- laws end -->"
HEADS = (
    "law",
    "sd",
    "steady: held",
    "drifting: held",
    "times as wide",
    "score over the best baseline's, steady",
    "drifting",
    "misfit said",
    "F test of 2 %",
)


def row(name: str, law: Law, known: str, sets: int, first: int = 0) -> str:
    """Return the row of a law with one error model, of seeds from ``first`` on."""
    held = []
    width = []
    scores = []
    alarms = []
    for seed in range(first, first + sets):
        value = law.drawn(seed)
        steady, drifting = posteriors(value, ERRORS[known])
        answers = [told(steady), told(drifting)]
        held.append([answer.holds for answer in answers])
        width.append(answers[1].width / answers[0].width)
        baselines = [baseline(value).crps for baseline in BASELINES]
        scores.append([answers[0].crps, answers[1].crps, *baselines])
        alarms.append([misfit_of(steady) < ALARM, f_test(value) < F_ALARM])
    shares = 100.0 * np.mean(held, axis=0)
    of_steady, of_drifting, *of_baselines = np.mean(scores, axis=0)
    said = 100.0 * np.mean(alarms, axis=0)
    cells = [
        name,
        known,
        *(f"{share:.0f} %" for share in shares),
        f"{np.median(width):.2f}",
        f"{of_steady / min(of_baselines):.2f}",
        f"{of_drifting / min(of_baselines):.2f}",
        *(f"{share:.0f} %" for share in said),
    ]
    return f"| {' | '.join(cells)} |"


def main(file: Path | None, sets: int, first: int) -> None:
    """Print the table of seeds from ``first`` on; write it between its marks."""
    lines = [f"| {' | '.join(HEADS)} |", "|" + "---|" * len(HEADS)]
    for name, law in LAWS.items():
        for known in ERRORS:
            lines.append(row(name, law, known, sets, first))
            print(lines[-1], flush=True)
    if file is not None:
        write_between(file, BEGIN, END, lines)


if __name__ == "__main__":
    main(
        Path(sys.argv[1]) if len(sys.argv) > 1 and sys.argv[1] != "-" else None,
        int(sys.argv[2]) if len(sys.argv) > 2 else SETS,
        int(sys.argv[3]) if len(sys.argv) > 3 else 0,
    )
