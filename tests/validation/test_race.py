"""The race: everybody reaches the error, ours included, and ratios
are taken within a round.
"""

import numpy as np
import pytest
import race as races
from race import BALANCE, CLOSING, LANDING, OURS, WARM, Contestant, Ranked, race, timed


def test_every_contestant_reaches_the_error(problem, monkeypatch) -> None:
    cyrk = pytest.importorskip("CyRK")
    assert cyrk
    monkeypatch.setattr("best_peers.METHODS", ("VERN7",))
    monkeypatch.setattr(races, "BATCH", 0.0)
    entries = race(problem, (1e-2, 1e-4), rounds=2)
    for target, found in entries.items():
        roles = [one.contestant.role for one in found]
        assert roles[:4] == [OURS, WARM, LANDING, CLOSING] and set(roles[4:]) <= {
            BALANCE
        }
        for one in found:
            assert 0.0 < one.contestant.error <= target and one.seconds.shape == (2,)
    steps = [
        int(entries[target][0].contestant.name.split()[0]) for target in (1e-2, 1e-4)
    ]
    assert steps[0] <= steps[1]


def test_a_part_of_a_march_is_scaled_to_all_of_it(monkeypatch) -> None:
    monkeypatch.setattr(races, "seconds_of", lambda action, times=1: 1.0)
    monkeypatch.setattr(races, "_batch", lambda action, count: 2.0)
    whole, part = timed(
        [Contestant(OURS, "", 0.0, int), Contestant(LANDING, "", 0.0, int, 0.25)], 3
    )
    np.testing.assert_array_equal(whole.seconds, np.full(3, 2.0))
    np.testing.assert_array_equal(part.over(whole), np.full(3, 4.0))
    assert isinstance(whole, Ranked)
