import numpy as np
import pytest

from wearlab.gears.specification import Modification, Relief

L = 0.0155


def test_reliefs_fade_from_the_ends():
    item = Modification(
        tip_relief=Relief(20e-6, 0.004), root_relief=Relief(10e-6, 0.002, "parabolic")
    )
    x = np.array([0.0, 0.001, 0.002, L / 2, L - 0.004, L - 0.002, L])
    assert item.removed(x, L) == pytest.approx(
        [10e-6, 2.5e-6, 0, 0, 0, 10e-6, 20e-6], abs=1e-18
    )


def test_crowning_and_slope():
    item = Modification(profile_crowning=8e-6, profile_slope=6e-6)
    x = np.array([0.0, L / 4, L / 2, L])
    assert item.removed(x, L) == pytest.approx([11e-6, 3.5e-6, 0.0, 5e-6], abs=1e-18)


def test_each_flank_counts_from_its_own_root(pair_of):
    relieved = {"tip_relief": Relief(20e-6, 0.003)}
    pair = pair_of(relieved, relieved)
    ends = np.array([pair.path.A, 0.0, pair.path.E])
    assert pair.modification(0, ends) == pytest.approx([0.0, 0.0, 20e-6], abs=1e-18)
    assert pair.modification(1, ends) == pytest.approx([20e-6, 0.0, 0.0], abs=1e-18)
    assert np.all(pair_of().modification(0, ends) == 0.0)
    assert pair_of().driving.modification is None
