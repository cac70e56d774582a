"""Stiffness models of a campaign against its first case: errors in single and double contact, and run time.

``python -m wearlab.accuracy.stiffness_models FILE`` prints one table for each kind of mesh.
"""

import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wearlab.campaign import load
from wearlab.gears.pair import GearPair
from wearlab.mesh.contact import ContactAnalysis
from wearlab.mesh.finite_element import Options, solve_gear
from wearlab.scene import Scene
from wearlab.scene.build.mesh import build_analysis
from wearlab.scene.build.sets import PairOfSet, build_set

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Zone:
    """How far a model is off where a given number of pairs is in the path.

    Parameters
    ----------
    pairs : their number
    mean : of the relative error of the secant mesh stiffness, over phase [1]
    largest : of its absolute values [1]
    """

    pairs: int
    mean: float
    largest: float


@dataclass(frozen=True)
class Judgement:
    """One model of one kind of mesh against the reference.

    Parameters
    ----------
    label : of the case
    mean_stiffness : secant mesh stiffness over face width, mean over phase [N/m per m]
    zones : errors, most pairs last
    seconds : to build the model and solve the sharing over one mesh period, elements from scratch [s]
    """

    label: str
    mean_stiffness: float
    zones: tuple[Zone, ...]
    seconds: float


def judge(cases: Sequence[tuple[str, Scene]], kind: int = 0, wear: float = 0.0) -> Iterator[Judgement]:
    """Judge the stiffness models of scenes of one gear set by the first of them.

    Parameters
    ----------
    cases : label and scene, the reference first
    kind : which kind of mesh of the set
    wear : uniform depth worn off both flanks; the elements then see the worn outline [m]
    """
    reference: Array | None = None
    for label, scene in cases:
        one = build_set(scene).kinds[kind]
        begun = time.perf_counter()
        if _elements(scene, one):
            _from_scratch(one.pair, Options(plane=scene.mesh.of(one.section).stiffness.plane))
        analysis = build_analysis(scene, one)
        stiffness = secant_stiffness(analysis)
        seconds = time.perf_counter() - begun
        reference = stiffness if reference is None else reference
        mean = float(np.sum(analysis.grid.phase_nodes[1] * stiffness)) / one.pair.face_width
        yield Judgement(label, mean, zones(analysis, stiffness / reference - 1.0), seconds)


def secant_stiffness(analysis: ContactAnalysis) -> Array:
    """Return F/(δ − e) of unworn flanks at the phase nodes, (n_phase_nodes,) [N/m]."""
    nodes = analysis.nodes(np.zeros((2, len(analysis.grid.position))))
    state = analysis.quasistatic(nodes, analysis.at_nodes)
    return analysis.load / (state.deflection - state.unloaded)


def zones(analysis: ContactAnalysis, error: Array) -> tuple[Zone, ...]:
    """Return mean and largest of errors at the phase nodes, for each number of pairs in the path."""
    present = np.sum(analysis.grid.pairs_at_phase_nodes >= 0, axis=1)
    weight = analysis.grid.phase_nodes[1]
    return tuple(
        Zone(
            int(pairs),
            float(np.average(error[present == pairs], weights=weight[present == pairs])),
            float(np.abs(error[present == pairs]).max()),
        )
        for pairs in np.unique(present)
    )


def _elements(scene: Scene, one: PairOfSet) -> bool:
    return scene.mesh.of(one.section).stiffness.model == "finite-element"


def _from_scratch(pair: GearPair, options: Options) -> None:
    """Solve both gears as if nothing were remembered, for the run time."""
    for gear in pair.gears:
        solve_gear(gear, options)


def report(title: str, judged: Sequence[Judgement]) -> str:
    """Return the table of judgements as text."""
    counts = [zone.pairs for zone in judged[0].zones]
    heads = "".join(f"{f'{n} pair' + 's' * (n > 1):>12}{'largest':>9}" for n in counts)
    lines = [title, f"{'model':32}{'N/(mm um)':>10}{heads}{'ms':>9}"]
    for one in judged:
        errors = "".join(f"{100 * z.mean:+11.1f}%{100 * z.largest:8.1f}%" for z in one.zones)
        lines.append(f"{one.label:32}{1e-9 * one.mean_stiffness:10.2f}{errors}{1e3 * one.seconds:9.1f}")
    return "\n".join(lines)


def main(files: Sequence[str]) -> None:
    """Print the tables of campaign files."""
    for file in files:
        campaign = load(file)
        cases = [(case.label, case.scene) for case in campaign.cases]
        for kind, one in enumerate(build_set(cases[0][1]).kinds):
            for _ in judge(cases, kind):  # compile and read everything once: the table times the models
                pass
            judged = list(judge(cases, kind))
            print(report(f"{campaign.title}: {' and '.join(one.flanks)}", judged), end="\n\n")


if __name__ == "__main__":
    main(sys.argv[1:])
