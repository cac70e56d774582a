"""The stored force along the path is the mean normal force that wears: over the path it carries the load."""

from pathlib import Path

import numpy as np
import pytest

from wearlab.campaign import load
from wearlab.scene.build import build
from wearlab.simulation import simulate

CAMPAIGNS = Path(__file__).parents[2] / "campaigns"


@pytest.mark.parametrize(
    ("file", "label", "changes", "parts"),
    [
        ("spur_speeds.toml", "base", {"operation.speed": "1860 rpm", "operation.torque": "60 N*m"}, True),
        ("base/internal_40_100.toml", "base", {}, False),
        ("base/planetary_ngw11_coupled.toml", "base", {}, False),
    ],
)
def test_the_force_along_the_path_carries_the_load(
    file: str, label: str, changes: dict[str, str], parts: bool
) -> None:
    scene = next(case.scene for case in load(CAMPAIGNS / file).cases if case.label == label)
    scene = scene.replace({"wear.until": None, "wear.snapshots": None, **changes})
    run, gears = simulate(scene), build(scene).gears
    assert (float(run.separation_fraction.max()) > 0.0) == parts
    for kind in gears.kinds:
        for flank in kind.flanks:
            force = run.tooth_force.isel(update=0).sel(flank=flank).values
            s = run.path_position.sel(flank=flank).values
            known = np.isfinite(force) & np.isfinite(s)
            mean = np.trapezoid(force[known], s[known]) / kind.pair.base_pitch
            own = float(run.error_estimate_mesh_force_max.isel(update=0).max())
            assert mean == pytest.approx(kind.load, abs=max(own, 1e-3 * kind.load)), flank
