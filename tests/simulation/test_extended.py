"""campaigns/extended_contact.toml: what a jump at A does to forces, and so to wear."""

from functools import cache

import numpy as np
from scenes import CAMPAIGNS

from wearlab.campaign import load
from wearlab.simulation import simulate
from wearlab.wear.patches.none import NoPatch

CAMPAIGN = CAMPAIGNS / "extended_contact.toml"
COARSE = {"profile_points": 81, "phase_points": 128}


@cache
def unworn(label):
    scene = next(case.scene for case in load(CAMPAIGN).cases if case.label == label)
    wear = scene.wear.model_copy(
        update={"until": None, "snapshots": None, "contact_patch": NoPatch()}
    )
    numerics = scene.numerics.model_copy(update=COARSE)
    return simulate(scene.with_sections(wear=wear, numerics=numerics))


def at(run, letter, name):
    node = int(
        np.flatnonzero(np.atleast_2d(run.characteristic_point.values)[0] == letter)[0]
    )
    return float(run[name].values[0, 0, node])


def test_the_jump_overstates_the_force_and_the_wear_at_a_when_it_vibrates():
    jump = unworn("jump, vibrating")
    corners = unworn("tip corners, vibrating")
    for name in ("tooth_force", "wear_rate"):
        assert 1.4 < at(jump, "A", name) / at(corners, "A", name) < 1.8
    assert float(corners.dynamic_factor.max()) < float(jump.dynamic_factor.max()) - 0.3


def test_under_static_load_the_share_at_a_itself_stays():
    """At A the gap of the entering pair is closed either way: what
    differs is before A.
    """
    jump = unworn("jump")
    corners = unworn("tip corners")
    np.testing.assert_allclose(
        at(corners, "A", "tooth_force"), at(jump, "A", "tooth_force"), rtol=1e-6
    )
    entering = corners.load_share.values[0, 0, -1]
    assert entering[-1] > 0.35 and np.all(entering[: len(entering) // 2] == 0.0)
    assert np.all(jump.load_share.values[0, 0, -1] == 0.0)
