"""The convergence table of the finite elements, on its coarse rungs."""

import math

from element_convergence import element_convergence

from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import Basics, GearSpec
from wearlab.mesh.finite_element.elements import Options


def test_errors_fall_at_second_order():
    pair = gear_pair(
        *(
            GearSpec(name=name, teeth=30, bore_diameter=0.03)
            for name in ("pinion", "gear")
        ),
        Basics(0.003, face_width=0.02),
    )
    coarse, fine = element_convergence(pair, (1, 2), 3, Options(samples=9))
    (same,) = element_convergence(pair, (1,), 1, Options(samples=9))
    assert math.isnan(coarse.order) and fine.order > 1.5
    assert coarse.own < 0.03 and fine.own < 0.005 and fine.shared < fine.own
    assert same.own == same.shared == 0.0
