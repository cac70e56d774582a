"""Are the error estimates honest? Varied scenes, each against a tight reference."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from wearlab.accuracy.drawn_sets import PAIR_MOTION, SET_MOTION, internal_pair, planetary_set
from wearlab.mesh.profile import ProfileGrid
from wearlab.scene import Scene
from wearlab.scene.build import build
from wearlab.simulation import Refused, simulate
from wearlab.simulation.twins import carried

TIGHTER = 0.01
SHORT, REPEATS = 0.5, 4
"""A run that takes less [s] is timed so often: a busy machine may stretch either part of it."""
KINDS = ("external-pair", "internal-pair", "planetary")


def draw_any(seed: int, number: int) -> Scene:
    """Return scene ``number`` of a seed: of ten, one is an internal pair and one a planetary set."""
    kinds = {4: internal_pair, 9: planetary_set}
    if number % 10 not in kinds:
        return draw(seed, number)
    return Scene.from_mapping(kinds[number % 10](np.random.default_rng([seed, number])))


def small_scenes() -> list[Scene]:
    """Return short scenes that between them need everything that scenes may need compiled.

    Under a hundredth of the load teeth part, and the orbit is found another way.
    """
    tables = [internal_pair(np.random.default_rng(1), motion) for motion in PAIR_MOTION]
    tables += [planetary_set(np.random.default_rng(1), motion) for motion in SET_MOTION]
    loaded = [Scene.from_mapping(table).replace("wear.snapshots", None) for table in tables]
    light = [
        one.replace("wear.until", None).replace("operation.torque", f"{0.01 * one.operation.torque} N*m")
        for one in loaded
        if one.dynamics is not None
    ]
    return [one.replace("wear.until.depth", "0.3 um") for one in loaded] + light


def draw(seed: int, number: int) -> Scene:
    """Return an external pair: teeth, module, load, speed, damping, errors and tolerance vary."""
    rng = np.random.default_rng([seed, number])
    module = float(rng.choice([2.0, 3.0, 4.0, 6.0]))
    teeth = rng.integers(20, 61, size=2)
    width = float(rng.uniform(5.0, 10.0)) * module
    torque = float(rng.uniform(20.0, 90.0)) * 1e-3 * module**2 * width * teeth[0] / 2.0
    dynamics = rng.choice(["none", "torsional", "spur-3dof"], p=[0.2, 0.3, 0.5])
    speed = float(np.exp(rng.uniform(np.log(300.0), np.log(4000.0)))) * 150.0 / (module * teeth[0])
    depth = float(np.exp(rng.uniform(np.log(1.0), np.log(40.0))))
    table: dict[str, Any] = {
        "gears": {
            "kind": "external-pair",
            "module": f"{module} mm",
            "face_width": f"{width} mm",
            "pinion": {"teeth": int(teeth[0])},
            "gear": {"teeth": int(teeth[1])},
        },
        "operation": {"torque": f"{torque} N*m", "speed": f"{speed} rpm"},
        "mesh": {"damping_ratio": float(rng.uniform(0.04, 0.12)), "normal_backlash": "100 um"},
        "wear": {
            "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
            "until": {"depth": f"{depth} um", "flank": "pinion"},
            "snapshots": {"depth": [f"{depth / 3.0} um"], "flank": "pinion"},
        },
        "numerics": {"tolerance": float(rng.choice([3e-3, 1e-3, 3e-4]))},
    }
    if rng.random() < 0.3:
        for member in ("pinion", "gear"):
            table["gears"][member]["tip_relief"] = {
                "amount": f"{float(rng.uniform(3.0, 15.0))} um",
                "length": f"{0.8 * module} mm",
                "shape": str(rng.choice(["linear", "parabolic"])),
            }
    if rng.random() < 0.3:
        table["mesh"]["stiffness"] = {"model": "potential-energy", "coupling": "shared"}
    if dynamics != "none":
        table["dynamics"] = {"model": str(dynamics)}
        if dynamics == "spur-3dof":
            support = {"radial_stiffness": f"{float(rng.uniform(300, 1500))} N/um", "damping_ratio": 0.06}
            table["dynamics"]["supports"] = {"pinion": support, "gear": support}
        if rng.random() < 0.4:
            table["errors"] = {
                "harmonic": [
                    {"mesh": "pinion-gear", "order": 1, "amplitude": f"{float(rng.uniform(1.0, 5.0))} um"}
                ]
            }
    return Scene.from_mapping(table)


def reference(scene: Scene, cycles: Sequence[float]) -> Scene:
    """Return the scene with a hundredth of its tolerance, to the same cycles whatever the depth."""
    tight = scene.replace("numerics.tolerance", TIGHTER * scene.numerics.tolerance)
    tight = tight.replace("wear.snapshots", None).replace("wear.until.cycles", cycles[-1])
    tight = tight.replace("wear.until.flank", None).replace("wear.until.depth", None)
    return tight.replace("wear.snapshots", {"cycles": list(cycles[1:-1])}) if cycles[1:-1] else tight


class Score(NamedTuple):
    """True and estimated errors of one scene, at the end of its life.

    Parameters
    ----------
    wear_depth, life, mesh_force, mesh_force_max : (true error, estimate) [m], [1], [N]; None: not comparable
    cost : time spent on the estimates over the time of everything else in the run [1]
    """

    wear_depth: tuple[float, float] | None
    life: tuple[float, float] | None
    mesh_force: tuple[float, float] | None
    cost: float
    mesh_force_max: tuple[float, float] | None = None


QUANTITIES = ("wear_depth", "life", "mesh_force", "mesh_force_max")


class Apart(Exception):
    """Why a scene has no score: it is aperiodic, its life is not reached, or it is refused."""


def score(scene: Scene, told: Callable[[str], None] = lambda stage: None) -> Score:
    """Compare the estimates of a scene with its errors against a tight reference.

    Parameters
    ----------
    scene : the scene
    told : told "reference" when its own run is done and the reference begins

    Raises
    ------
    Apart
        When there is nothing to compare, with the reason.
    """
    data = _simulated(scene)
    if _aperiodic(data):
        raise Apart("aperiodic")
    if str(data.end_reason.values) != "depth":
        raise Apart(f"life not reached: {data.end_reason.item()}")
    told("reference")
    cycles = [float(cycle) for cycle in data.cycle.values]
    tight = reference(scene, cycles)
    truth = _simulated(tight)
    if _aperiodic(truth):
        raise Apart("aperiodic reference")
    if truth.sizes["update"] != data.sizes["update"]:
        raise Apart("reference ends early")
    worn, truly = data.wear_depth.values[-1], truth.wear_depth.values[-1]
    missed = max(
        float(
            np.abs(
                carried(fine, truly[rows, : len(fine.position)], own) - worn[rows, : len(own.position)]
            ).max()
        )
        for rows, fine, own in zip(_pairs(len(worn)), _grids(tight), _grids(scene), strict=True)
    )
    at = int(np.nanargmax(truly[0]))
    speed = float(truth.wear_rate.values[-1, 0, at])
    limit = float(np.asarray(data.max_wear_depth.values)[-1, 0])
    life = None  # where the deepest place wears no more, no rate says what its depth is worth in cycles
    if speed > 0.0:
        life = (abs(limit - float(truly[0, at])) / speed, float(data.error_estimate_life))
    force = largest = None
    if "dynamic_mesh_force" in data and (data.response_period.values == truth.response_period.values).all():
        difference = np.abs(data.dynamic_mesh_force.values[-1] - truth.dynamic_mesh_force.values[-1])
        force = (float(np.nanmax(difference)), float(data.error_estimate_mesh_force[-1]))
        off = np.abs(data.mesh_force_max.values[-1] - truth.mesh_force_max.values[-1])
        largest = (float(off.max()), float(data.error_estimate_mesh_force_max[-1]))
    return Score(
        (missed, float(data.error_estimate_wear_depth[-1])),
        life,
        force,
        _cost(scene, data),
        largest,
    )


def _cost(scene: Scene, data: xr.Dataset) -> float:
    """Return the time of the estimates over that of the rest, each the shortest of several short runs."""
    times = [_times(data)]
    if sum(times[0]) < SHORT:
        times += [_times(_simulated(scene)) for _ in range(REPEATS - 1)]
    spent, rest = (min(each) for each in zip(*times, strict=True))
    return spent / rest


def _times(data: xr.Dataset) -> tuple[float, float]:
    spent = float(data.run_time_estimates)
    return spent, float(data.run_time_total) - spent


def _simulated(scene: Scene) -> xr.Dataset:
    try:
        return simulate(scene)
    except Refused as refusal:
        raise Apart(f"refused: {refusal}") from refusal


def _grids(scene: Scene) -> list[ProfileGrid]:
    return [kind.analysis.grid for kind in build(scene).kinds]


def _pairs(flanks: int) -> list[slice]:
    """Return which flanks belong to each kind of mesh."""
    return [slice(first, first + 2) for first in range(0, flanks, 2)]


def _aperiodic(data: xr.Dataset) -> bool:
    return "response_period" in data and bool((data.response_period == 0).any())


def summary(scores: Sequence[Score]) -> dict[str, tuple[int, float, float]]:
    """Return for each quantity: scenes, share with error below estimate, median of estimate over error.

    An estimate that is missing (NaN) counts as one that the error exceeds.
    """
    found = {}
    for name in QUANTITIES:
        values = np.array([getattr(one, name) for one in scores if getattr(one, name) is not None])
        if len(values):
            true, estimate = values.T
            known = np.isfinite(estimate)
            ratio = np.median(estimate[known] / np.maximum(true[known], 1e-300)) if known.any() else np.nan
            found[name] = (len(values), float(np.mean(true <= estimate)), float(ratio))
    return found
