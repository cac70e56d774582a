"""What is compiled ahead: one scene of every kind, not one of every run."""

from pathlib import Path

from wearlab.campaign import load
from wearlab.simulation.warm import kinds_of

CAMPAIGNS = Path(__file__).parents[2] / "campaigns"


def test_numbers_make_no_kind_but_choices_do():
    """Was a kind for each of a thousand drawn coefficients, a wear state of each before the first run."""
    thousand = [case.scene for case in load(CAMPAIGNS / "planetary_life_distribution.toml").cases]
    assert len(thousand) == 1000 and len(kinds_of(thousand)) == 1
    scene = thousand[0]
    others = [
        scene.replace("dynamics.method", "newmark"),
        scene.replace("wear.coefficient", {"model": "constant", "value": "1e-18 m^2/N", "film": False}),
        scene.replace("wear.coefficient", {"model": "constant", "value": "2e-18 m^2/N", "film": False}),
    ]
    assert len(kinds_of([scene, *others])) == 3
