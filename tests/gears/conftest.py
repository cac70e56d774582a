"""Pairs that the tests of gears share."""

import pytest
from shaped import shaped

from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import GearSpec


@pytest.fixture
def pair_of():
    """Build a pair from changes to a standard 50/50, module 3 mm pair, 20 mm wide."""

    def build(pinion=None, gear=None, **keywords):
        first = GearSpec(**{"name": "pinion", "teeth": 50, **(pinion or {})})
        second = GearSpec(**{"name": "gear", "teeth": 50, **(gear or {})})
        return shaped(
            gear_pair,
            first,
            second,
            **{"module": 0.003, "face_width": 0.02, **keywords},
        )

    return build
