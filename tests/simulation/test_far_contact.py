"""A ring with few teeth more than its pinion: tip corners touch half a base pitch
beyond A and E.
"""

import numpy as np
from scenes import internal_pair

from wearlab.scene import Scene
from wearlab.simulation import simulate

CLOSE = {
    "gears": internal_pair(
        {"teeth": 58, "profile_shift_coefficient": 0.184},
        {
            "teeth": 72,
            "profile_shift_coefficient": 0.184,
            "rim_diameter": "79.2 mm",
        },
        module="1 mm",
        face_width="15 mm",
    ),
    "operation": {"torque": "57.9 N*m", "speed": "1000 rpm"},
    "mesh": {"stiffness": "potential-energy", "extended_contact": True},
}


def test_pairs_enter_and_leave_without_a_jump():
    """Was cut off 0.45 base pitches beyond A and E, where a pair took up 4.5 % of the
    load at once.
    """
    run = simulate(Scene.from_mapping(CLOSE)).isel(update=0, mesh=0)
    share = run.load_share.values
    assert np.abs(np.diff(share, axis=-1)).max() < 0.012
    np.testing.assert_allclose(share.sum(axis=0), 1.0, rtol=1e-12)
