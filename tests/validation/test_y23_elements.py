"""What Y23 says of its stiffness against elements, by ours (Fig. 19)."""

import pytest
from y23_elements import PRINTED, differences


@pytest.mark.parametrize("level", ["0.1 um", "100 um"])
def test_stiffness_is_as_near_to_elements_as_the_paper_says_where_bodies_are_shared(
    level,
):
    whole = differences("by load", level)
    shared = differences("shared bodies", level)
    assert max(whole[1], shared[1]) < 3.6  # Y23: 3.2 and 4.6
    assert (
        shared[2] < PRINTED[level, 2] < whole[2]
    )  # two whole pairs count the wheel bodies twice
