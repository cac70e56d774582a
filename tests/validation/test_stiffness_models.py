"""The judgement of stiffness models: what it compares, and the
verdict on L16's gears.
"""

import numpy as np
import pytest
from scenes import CAMPAIGNS
from stiffness_models import judge, report

from wearlab.assembly.mesh import build_analyses
from wearlab.assembly.sets import build_set
from wearlab.campaign import load

PLANES = ("stress", "strain")
FILES = sorted(CAMPAIGNS.glob("stiffness_models*.toml"))


@pytest.fixture(scope="module")
def cases():
    chosen = (
        "finite elements",
        "potential energy (defaults)",
        "complete pairs (papers)",
        "rigid body",
    )
    known = {
        case.label: case.scene
        for case in load(CAMPAIGNS / "stiffness_models.toml").cases
    }
    coarse = {"numerics.profile_points": 41}
    scenes = {}
    for label in chosen:
        scene = known[label]
        for key, value in coarse.items():
            scene = scene.replace(key, value)
        scenes[label] = scene
    return scenes


def test_l16_shared_bodies_are_within_five_per_cent(cases):
    """Complete pairs are some 23 per cent too stiff together.

    In single contact there is nothing to share.
    """
    judged = {one.label: one for one in judge(list(cases.items()))}
    reference, default, complete, rigid = (judged[label].zones for label in cases)
    assert [zone.pairs for zone in reference] == [1, 2]
    assert all(zone.mean == zone.largest == 0.0 for zone in reference)
    assert all(zone.largest < 0.05 for zone in default)
    assert (
        complete[0] == default[0]
        and 0.15 < complete[1].mean <= complete[1].largest < 0.3
    )
    assert all(zone.mean > 1.0 for zone in rigid)
    table = report("title", list(judged.values()))
    assert (
        len(table.splitlines()) == 2 + len(cases)
        and f"{100 * complete[1].mean:+.1f}%" in table
    )


def test_a_model_against_itself_in_series_and_parallel(cases):
    """Twice the stiffness is 100 per cent too stiff, in every zone, worn or not."""
    first = cases["finite elements"]
    pair = [("once", first), ("twice", first.replace("mesh.stiffness.scale", 2.0))]
    for wear in (0.0, 5e-5):
        one, two = judge(pair, wear=wear)
        assert [zone.mean for zone in two.zones] == pytest.approx([1.0, 1.0], rel=1e-9)
        assert two.mean_stiffness == pytest.approx(2.0 * one.mean_stiffness, rel=1e-9)


def test_wear_softens_the_elements(cases):
    healthy = next(judge(list(cases.items())[:1], wear=0.0)).mean_stiffness
    worn = next(judge(list(cases.items())[:1], wear=0.0001)).mean_stiffness
    assert -0.02 < worn / healthy - 1.0 < -0.005


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_every_gear_set_is_judged_by_the_same_choices(file):
    labels = [case.label for case in load(file).cases]
    assert labels[0] == "finite elements" and len(labels) == 13
    assert len(np.unique(labels)) == 13


def test_plane_strain_stiffens_what_bends_and_not_what_shears(cases):
    """Bending, compression and the body by 1 − ν².

    The shear modulus and the contact stay.
    """
    base = cases["potential energy (defaults)"]
    one = build_set(base).kinds[0]

    def compliance(**options):
        given = {"model": "potential-energy", "foundation": "none", **options}
        nodes = build_analyses(base.replace("mesh.stiffness", given), [one])[0]
        return nodes.stiffness.body(
            np.zeros((2, len(nodes.grid.position)))
        ), nodes.stiffness.contact(None)

    (stress, contact), (strain, still) = (
        compliance(plane=plane, shear_factor=1e-12) for plane in PLANES
    )
    np.testing.assert_allclose(strain, (1.0 - 0.3**2) * stress, rtol=1e-9)
    assert still == contact
    sheared = [compliance(plane=plane)[0] for plane in PLANES]
    np.testing.assert_allclose(sheared[0] - stress, sheared[1] - strain, rtol=1e-6)
    for foundation in ("sainsot", "annulus"):
        soft, stiff = (
            compliance(plane=plane, foundation=foundation)[0] for plane in PLANES
        )
        assert np.all(stiff < 0.96 * soft) and np.all(stiff > (1.0 - 0.3**2) * soft)
