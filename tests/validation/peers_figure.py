"""One scene's steady state by wearlab and its peers at their best, over all errors: dataset and figure.

Of the peers that march, and of those that close the orbit, the fastest to 1e-3 and to 1e-6 are shown.

``python tests/validation/peers_figure.py FILE OUT`` takes the first case of a campaign file; two minutes.
"""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from peer_ladders import peer_curves

from wearlab.accuracy.ladder import WorkPrecision
from wearlab.accuracy.pages import pages
from wearlab.accuracy.steady import reference, steady
from wearlab.accuracy.steady_curves import steps_curve
from wearlab.accuracy.study import TARGETS, Study, dataset, netcdf
from wearlab.campaign import load
from wearlab.cli.output import write_all
from wearlab.figures.render import rendered

NOTE = (
    "Numbers: observed order over the knob. Wearlab: cold, tables included. Peers: told how long to march, "
    "from the static equilibrium, compiled into one piece with their right-hand side."
)


def closes(curve: WorkPrecision) -> bool:
    """Whether a peer closes the orbit instead of marching until it has come about."""
    return curve.knob == "harmonics" or curve.name.endswith("Newton")


def fastest(rivals: list[WorkPrecision]) -> list[WorkPrecision]:
    """Return of those that march, and of those that close the orbit, the fastest to 1e-3 and to 1e-6."""
    chosen = []
    for sort in (False, True):
        mine = [curve for curve in rivals if closes(curve) == sort]
        for error in TARGETS:
            reached = [curve for curve in mine if np.isfinite(curve.seconds_to(error))]
            chosen += [min(reached, key=lambda curve: curve.seconds_to(error))] if reached else []
    return [curve for curve in rivals if curve in chosen]


def main(file: str, out: str) -> None:
    """Study the first case, write dataset and figure."""
    campaign, begun = load(file), time.time()
    case = campaign.cases[0]
    problem = steady(case.scene)
    known = reference(problem)
    rivals = list(peer_curves(problem, known, lambda text: print(text, flush=True)))
    curves = steps_curve(problem, known), *fastest(rivals)
    study = Study(case.label, case.scene, curves, {"mesh_force": known.disagreement}, known.multiplier, ())
    made = dataset(campaign.title, [study], begun)
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    plot = replace(pages(made)["work-precision"], notes=(NOTE,))
    image = rendered(plot, {"Title": campaign.title})
    for path in write_all({"peers.nc": netcdf(made), "peers.png": image}, folder):
        print(path)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        print("usage: python tests/validation/peers_figure.py FILE OUT", file=sys.stderr)
        sys.exit(2)
    main(*sys.argv[1:])
