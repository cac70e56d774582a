"""The stored force along the path is the mean normal force that wears: over the path it
carries the load.
"""

import numpy as np
import pytest
from scenes import CAMPAIGNS

from wearlab.assembly import build
from wearlab.campaign import load
from wearlab.simulation import simulate

pytestmark = pytest.mark.usefixtures("alone")


@pytest.mark.parametrize(
    ("file", "changes", "parts"),
    [
        ("spur_1dof.toml", {"operation.speed": "3720 rpm"}, True),
        ("internal_wear_life.toml", {}, False),
        ("base/planetary_ngw11_coupled.toml", {}, False),
    ],
)
def test_the_force_along_the_path_carries_the_load(
    file: str, changes: dict[str, str], parts: bool
) -> None:
    """From A to E alone: what tip corners carry beyond is not on the nodes."""
    scene = load(CAMPAIGNS / file).cases[0].scene
    wear = scene.wear
    assert wear is not None
    given = {
        f"wear.{key}": None
        for key in ("until", "snapshots")
        if getattr(wear, key) is not None
    }
    scene = scene.replace({**given, "mesh.extended_contact": False, **changes})
    run = simulate(scene)
    gears = build(scene).gears
    apart = (
        float(run.separation_fraction.max()) if "separation_fraction" in run else 0.0
    )
    assert (apart > 0.0) == parts
    for kind in gears.kinds:
        for flank in kind.flanks:
            force = run.tooth_force.isel(update=0).sel(flank=flank).values
            s = run.path_position.sel(flank=flank).values
            known = np.isfinite(force) & np.isfinite(s)
            mean = np.trapezoid(force[known], s[known]) / kind.pair.base_pitch
            told = "error_estimate_mesh_force_max"
            own = float(run[told].isel(update=0).max()) if told in run else 0.0
            assert mean == pytest.approx(kind.load, abs=max(own, 1e-3 * kind.load)), (
                flank
            )
