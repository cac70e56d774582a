"""W23's planetary set, worn, against the set written out and marched: equations,
forces, and what wears.
"""

from collections.abc import Iterator

import numpy as np
import pytest
from outside_march import Outside, scene_at

from wearlab.assembly import build
from wearlab.dynamics.forces.mesh_forces import extremes
from wearlab.life.coupled import WearState

WORN = 60e-6


@pytest.fixture(scope="module")
def both() -> Iterator[tuple[Outside, WearState]]:
    """The set of W23, its flanks worn in two humps beside the pitch
    point, marched and found.
    """
    scene = scene_at(134.0)
    outside = Outside(scene, 2400)
    coupling = build(scene).coupling
    flanks = [
        np.array(
            [
                share
                * WORN
                * np.sin(2.0 * np.linspace(0.0, np.pi, depth.shape[1])) ** 2
                for share in (1.0, 0.3)
            ]
        )
        for depth in coupling.unworn()
    ]
    yield outside, coupling.evaluate(tuple(flanks))


def test_the_set_written_out_is_the_one_in_motion(both) -> None:
    outside, state = both
    written = outside.train
    system = state.response.system
    np.testing.assert_allclose(
        1.0 / written.inverse, system.mass.diagonal(), rtol=1e-12
    )
    size = np.abs(system.total_stiffness).max()
    np.testing.assert_allclose(
        written.stiffness, system.total_stiffness, atol=1e-5 * size
    )
    np.testing.assert_allclose(written.damping, system.total_damping, atol=1e-9)
    np.testing.assert_allclose(written.direction, system.direction, atol=1e-12)
    assert outside.period == pytest.approx(state.response.mesh_period, rel=1e-12)


def test_forces_and_wear_are_those_of_the_march(both) -> None:
    outside, state = both
    wear = state.wear
    motion = outside.steady(wear)
    assert motion.periods == 1
    found = extremes(state.response)
    np.testing.assert_allclose(motion.extremes, [found.least, found.largest], rtol=2e-3)
    for kind, one in enumerate(state.kind):
        forces = outside.tooth_forces(motion)[kind]
        np.testing.assert_allclose(
            forces, one.mean_tooth_force, atol=0.02 * forces.max()
        )
        assert forces.mean() == pytest.approx(one.mean_tooth_force.mean(), rel=1e-3)


def test_archard_law_written_out_wears_as_the_package_does(both) -> None:
    outside, state = both
    forces = [one.mean_tooth_force for one in state.kind]
    grown = outside.grown(state.wear, forces, 1.0)
    kinds = outside.coupling.kinds
    for of_kind, kind, law, now, later in zip(
        kinds, state.kind, outside.pointwise(forces), state.wear, grown, strict=True
    ):
        length = of_kind.law.path.arc_weight  # areas: what evens out moves wear
        own = (length * kind.rate).sum()
        assert (length * (later - now)).sum() == pytest.approx(own, rel=1e-2)
        assert (length * law).sum() == pytest.approx(own, rel=2e-2)
