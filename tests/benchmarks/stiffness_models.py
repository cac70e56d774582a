"""Stiffness models of a campaign against its first case: errors in single and double
contact, and run time.

``python tests/benchmarks/stiffness_models.py FILE [WEAR]`` prints one table for each
kind of mesh, healthy or with WEAR µm off both flanks.
"""

import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.assembly.mesh import build_analyses
from wearlab.assembly.sets import build_set
from wearlab.campaign import load
from wearlab.gears.gear import Gear, GearPair
from wearlab.mesh.contact import ContactAnalysis
from wearlab.mesh.finite_element.compliance import (
    GearCompliance,
    pair_compliance,
    solve_gear,
)
from wearlab.mesh.finite_element.elements import Options
from wearlab.mesh.finite_element.outline import Wear
from wearlab.mesh.gear_set import PairOfSet
from wearlab.mesh.series import InSeries, plane_of
from wearlab.scene import Scene

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
    seconds : to build the model and solve the sharing over one mesh period, elements
        from scratch [s]
    """

    label: str
    mean_stiffness: float
    zones: tuple[Zone, ...]
    seconds: float


def judge(
    cases: Sequence[tuple[str, Scene]], kind: int = 0, wear: float = 0.0
) -> Iterator[Judgement]:
    """Judge the stiffness models of scenes of one gear set by the first of them.

    Parameters
    ----------
    cases : label and scene, the reference first
    kind : which kind of mesh of the set
    wear : uniform depth worn off both flanks; the elements then see the worn outline
        [m]
    """
    reference: Array | None = None
    for label, scene in cases:
        one = build_set(scene).kinds[kind]
        begun = time.perf_counter()
        elements = _elements(scene, one, wear)
        seconds = time.perf_counter() - begun
        analysis = build_analyses(scene, [one])[0]
        begun = time.perf_counter()
        analysis = build_analyses(scene, [one])[0]
        if elements is not None and wear > 0.0:
            analysis = replace(analysis, stiffness=_worn(analysis, one.pair, elements))
        stiffness = secant_stiffness(analysis, wear)
        seconds += time.perf_counter() - begun
        reference = stiffness if reference is None else reference
        mean = (
            float(np.sum(analysis.grid.phase_nodes[1] * stiffness))
            / one.pair.face_width
        )
        yield Judgement(
            label, mean, zones(analysis, stiffness / reference - 1.0), seconds
        )


def secant_stiffness(analysis: ContactAnalysis, wear: float = 0.0) -> Array:
    """Return F/(δ − e) of evenly worn flanks at the phase nodes,
    (n_phase_nodes,) [N/m].
    """
    nodes = analysis.nodes(np.full((2, len(analysis.grid.position)), wear))
    state = analysis.quasistatic(nodes, analysis.at_nodes)
    stiffness: Array = analysis.load / (state.deflection - state.unloaded)
    return stiffness


def zones(analysis: ContactAnalysis, error: Array) -> tuple[Zone, ...]:
    """Return mean and largest of errors at the phase nodes, for each
    number of pairs in the path.
    """
    present = np.sum(analysis.grid.pairs_at_phase_nodes >= 0, axis=1)
    weight = analysis.grid.phase_nodes[1]
    return tuple(
        Zone(
            int(pairs),
            float(
                np.average(error[present == pairs], weights=weight[present == pairs])
            ),
            float(np.abs(error[present == pairs]).max()),
        )
        for pairs in np.unique(present)
    )


def _elements(
    scene: Scene, one: PairOfSet, wear: float
) -> tuple[GearCompliance, GearCompliance] | None:
    """Solve both gears as if nothing were remembered.

    None for a model without elements.
    """
    asked: Any = scene.mesh.of(one.section).stiffness
    if asked.model != "finite-element":
        return None
    first, second = (
        solve_gear(gear, Options(plane_of(asked.plane, one.pair)), _even(gear, wear))
        for gear in one.pair.gears
    )
    return first, second


def _even(gear: Gear, depth: float) -> Wear | None:
    ends = np.sort([gear.form_radius, gear.tip_radius])
    return Wear(ends, np.full(2, depth)) if depth > 0.0 else None


def _worn(
    analysis: ContactAnalysis,
    pair: GearPair,
    solved: tuple[GearCompliance, GearCompliance],
) -> InSeries:
    assert isinstance(analysis.stiffness, InSeries)
    own, shared = pair_compliance(
        pair, analysis.grid.position, analysis.grid.n_pairs, solved=solved
    )
    return replace(analysis.stiffness, rest=own[None], shared=shared, teeth=())


def report(title: str, judged: Sequence[Judgement]) -> str:
    """Return the table of judgements as text."""
    counts = [zone.pairs for zone in judged[0].zones]
    heads = "".join(f"{f'{n} pair' + 's' * (n > 1):>12}{'largest':>9}" for n in counts)
    lines = [title, f"{'model':32}{'N/(mm um)':>10}{heads}{'ms':>9}"]
    for one in judged:
        errors = "".join(
            f"{100 * z.mean:+11.1f}%{100 * z.largest:8.1f}%" for z in one.zones
        )
        lines.append(
            f"{one.label:32}{1e-9 * one.mean_stiffness:10.2f}"
            f"{errors}{1e3 * one.seconds:9.1f}"
        )
    return "\n".join(lines)


def main(words: Sequence[str]) -> None:
    """Print the tables of a campaign file, for flanks worn evenly by a depth in µm when
    one is given.
    """
    file = words[0]
    wear = 1e-6 * float(words[1]) if len(words) > 1 else 0.0
    campaign = load(file)
    cases = [(case.label, case.scene) for case in campaign.cases]
    for kind, one in enumerate(build_set(cases[0][1]).kinds):
        judged = list(judge(cases, kind, wear))
        worn = f", {1e6 * wear:g} um worn off both flanks" if wear > 0.0 else ""
        print(
            report(f"{campaign.title}: {' and '.join(one.flanks)}{worn}", judged),
            end="\n\n",
        )


if __name__ == "__main__":
    main(sys.argv[1:])
