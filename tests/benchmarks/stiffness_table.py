"""Stiffness of the default and of every option against converged finite elements, on
eighteen meshes.

For the six meshes of the four papers and drawn ones, the largest relative error of the
secant mesh stiffness over single and double contact: unworn and with 50 µm off both
flanks, at 0.1, 1 and 3 times the torque. The judge is an element solution of its own
for each wear, on the worn outline, refined until it no longer counts: refinement 6
moves no compliance of 4 by 0.05 %. :mod:`.defaults_table` prints the table.
"""

import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from stiffness_models import secant_stiffness, zones

from wearlab.assembly.mesh import build_analyses
from wearlab.assembly.sets import PairOfSet, build_set
from wearlab.campaign import load
from wearlab.gears.specification import GearError
from wearlab.mesh.contact import ContactAnalysis
from wearlab.mesh.finite_element.compliance import pair_compliance, solve_gear
from wearlab.mesh.finite_element.elements import Options
from wearlab.mesh.finite_element.outline import Wear
from wearlab.mesh.series import plane_of
from wearlab.scene import Scene

CAMPAIGNS = Path(__file__).parents[2] / "campaigns" / "base"
PAPERS = {
    "L16": "spur_50_50.toml",
    "Y23": "internal_40_100.toml",
    "W23": "planetary_ngw11.toml",
    "B23": "planetary_friction.toml",
}
MODELS: dict[str, Any] = {
    "default": "finite-element",
    "elements, constant contact": {"model": "finite-element", "hertz": "yang-sun"},
    "potential energy": {"model": "potential-energy", "coupling": "shared"},
    "papers: complete pairs": {"model": "potential-energy", "coupling": "none"},
    "annulus, Weber, strain": {
        "model": "potential-energy",
        "coupling": "shared",
        "foundation": "annulus",
        "hertz": "weber",
        "plane": "strain",
    },
}
TORQUES = (0.1, 1.0, 3.0)
DEPTHS = (0.0, 50e-6)
JUDGE = 4


class Score(NamedTuple):
    """One model on one mesh: largest error in single and in double contact [1], and the
    time it takes [s].
    """

    model: str
    depth: float
    torque: float
    single: float
    double: float
    seconds: float


def meshes(count: int) -> Iterator[tuple[str, Scene, PairOfSet]]:
    """Return the papers' meshes and drawn ones, none of which helped
    to choose anything.
    """
    for paper, file in PAPERS.items():
        scene = load(CAMPAIGNS / file).cases[0].scene
        for one in build_set(scene).kinds:
            yield f"{paper} {'–'.join(one.flanks)}", scene, one
    rng = np.random.default_rng(20)
    found = 0
    while found < count:
        table = drawn(rng, internal=found % 3 == 2)
        try:
            scene = Scene.from_mapping(table)
            one = build_set(scene).kinds[0]
        except GearError:
            continue
        found += 1
        first, second = one.pair.gears
        size = f"m {1e3 * first.module:g} b {1e3 * one.pair.face_width:.3g}"
        yield f"{found}: {first.teeth}/{second.teeth} {size}", scene, one


def drawn(rng: np.random.Generator, internal: bool) -> dict[str, Any]:
    """Draw a pair: 18 to 60 teeth, modules 1 to 10 mm, faces of 4 to 16 modules,
    shifts, bores and rims.
    """
    module = float(rng.choice([1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0]))
    width = module * rng.uniform(4.0, 16.0)
    teeth = int(rng.integers(18, 61))
    mate = int(rng.integers(70, 121)) if internal else int(rng.integers(18, 61))
    shift = float(rng.uniform(0.0, 0.4))
    torque = (
        1e9
        * module
        * 1e-3
        * teeth
        / 2.0
        * module
        * width
        * 1e-6
        * rng.uniform(0.03, 0.15)
    )
    second: dict[str, Any] = {
        "teeth": mate,
        "profile_shift_coefficient": shift if internal else 0.0,
    }
    if internal:
        second |= {"rim_diameter": f"{module * (mate + rng.uniform(7.0, 14.0))} mm"}
    return {
        "gears": {
            "kind": "internal-pair" if internal else "external-pair",
            "module": f"{module} mm",
            "face_width": f"{width} mm",
            "pinion": {"teeth": teeth, "profile_shift_coefficient": shift},
            "ring" if internal else "gear": second,
        },
        "operation": {"torque": f"{torque} N*m", "speed": "1000 rpm"},
    }


def judge(analysis: ContactAnalysis, one: PairOfSet, depth: float) -> ContactAnalysis:
    """Return the same contact with elements of its own for this wear."""
    pair = one.pair
    grid = analysis.grid
    options = Options(plane_of("by-width", pair), refinement=JUDGE)
    solved = [
        solve_gear(gear, options, _even(gear.form_radius, gear.tip_radius, depth))
        for gear in pair.gears
    ]
    own, shared = pair_compliance(
        pair, grid.position, grid.n_pairs, options, (solved[0], solved[1])
    )
    return replace(
        analysis,
        stiffness=replace(analysis.stiffness, own=own, shared=shared, teeth=None),
    )


def _even(form: float, tip: float, depth: float) -> Wear | None:
    return Wear(np.sort([form, tip]), np.full(2, depth)) if depth > 0.0 else None


def scores(scene: Scene, one: PairOfSet) -> Iterator[Score]:
    """Judge every model on one mesh."""
    section = (
        f"mesh.{one.section}."
        if one.section and scene.mesh.sun_planet is not None
        else "mesh."
    )
    plain = scene.replace(f"{section}extended_contact", False)
    analyses = {}
    seconds = {}
    for name, model in MODELS.items():
        asked = plain.replace(f"{section}stiffness", model)
        analyses[name] = build_analyses(asked, [one])[0]
        unworn = np.zeros((2, len(analyses[name].grid.position)))
        analyses[name].nodes(unworn)
        begun = time.process_time()
        for _ in range(5):
            nodes = analyses[name].nodes(unworn)
            analyses[name].quasistatic(nodes, analyses[name].at_nodes)
        seconds[name] = (time.process_time() - begun) / 5
    for depth in DEPTHS:
        reference = judge(analyses["default"], one, depth)
        for factor in TORQUES:
            exact = secant_stiffness(replace(reference, load=factor * one.load), depth)
            for name, analysis in analyses.items():
                found = secant_stiffness(
                    replace(analysis, load=factor * one.load), depth
                )
                each = {
                    zone.pairs: zone.largest
                    for zone in zones(analysis, found / exact - 1.0)
                }
                low = min(each)
                high = max(each)
                yield Score(name, depth, factor, each[low], each[high], seconds[name])
