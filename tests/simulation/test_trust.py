"""What a run says of its own limits."""

from types import SimpleNamespace

import numpy as np

from wearlab.life.history import History
from wearlab.life.integrate import integrate
from wearlab.life.limits import Limits
from wearlab.simulation.dataset.validity import scene_validity
from wearlab.simulation.estimates import CompanionErrors, _doubts

STILL = SimpleNamespace(
    scene=SimpleNamespace(thermal=None, rating=None),
    coupling=None,
    kinds=(),
    vibration=None,
    meshes=(),
    face=None,
    gears=SimpleNamespace(sections=(), kinds=()),
)


def swinging(growth):
    """A life in which two nodes swing against each other and grow."""
    J = growth * np.array([[1.0, -2.0], [2.0, 1.0]])
    life = integrate(
        lambda h: 1e-10 + np.clip(J @ (h - 1.0001 * h.mean()), -5e-11, 5e-11),
        np.zeros(2),
        limits=Limits(depth=100e-6),
    )
    return History(life.cycle, (), life, sampled=History(life.cycle[:0], ()))


def validity(growth):
    return scene_validity(STILL, swinging(growth))


def test_flanks_that_corrugate_are_called_so():
    (flag,) = validity(2e-5)
    assert flag.startswith(
        "the flanks corrugate: waves of wear grow e-fold every 5 um of wear"
    )
    assert validity(-2e-5) == ()


def test_no_estimate_is_sure_where_any_error_grows():
    stage = SimpleNamespace(parts=())
    assert _doubts(CompanionErrors(stage, swinging(2e-5), []), None) == (
        "waves of wear grow from any error",
    )
    assert _doubts(CompanionErrors(stage, swinging(-2e-5), []), None) == ()
