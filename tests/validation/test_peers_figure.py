"""Beside the fastest peer that gets there."""

import numpy as np
import pytest
from peers_figure import comparison

from wearlab.accuracy.ladder import Rung, WorkPrecision
from wearlab.accuracy.study import Study


def curve(name, knob, role, *rungs):
    return WorkPrecision(name, knob, "mesh_force", role, tuple(Rung(*rung, work=np.nan) for rung in rungs))


OURS = curve("periodic", "steps_per_period", "wearlab", (50, 1e-2, 1e-4), (200, 1e-4, 4e-4))
PEERS = (
    curve("never gets there", "relative", "peer", (1e-2, 0.1, 1e-5), (1e-3, 1e-2, 1e-4)),
    curve("marches", "relative", "peer", (1e-3, 1e-2, 1e-2), (1e-5, 1e-4, 4e-2)),
    curve("balances", "harmonics", "peer", (40, 9e-4, 3e-3)),
)


def test_ours_is_compared_with_the_fastest_peer_that_gets_there():
    told = comparison(Study("800 rpm", None, (OURS, *PEERS), {}, 0.6, ()), 1e-3)
    assert (told.name, told.peer) == ("balances", 3e-3)
    assert told.ours == pytest.approx(2e-4)  # halfway in logarithms
    assert comparison(Study("alone", None, (OURS,), {}, 0.6, ()), 1e-3) is None
