"""Error estimates against tight references, on scenes of a seed that was not used to set their weights."""

import numpy as np

from wearlab.accuracy.drawn import draw, score, summary
from wearlab.scene.build import build
from wearlab.simulate.estimates import carried, rough_parts

SCENES = (0, 4, 6, 7, 8)
"""Those that take a second or two; 1 and 3 have long references."""


def test_values_carried_between_grids_keep_their_shape() -> None:
    scene = draw(5, 0)
    parts = build(scene)
    rough = rough_parts(scene, parts)
    assert rough is not None
    fine, coarse = parts.kinds[0].analysis.grid, rough.kinds[0].analysis.grid
    assert 0.4 < len(coarse.position) / len(fine.position) < 0.65
    assert rough.vibration is None or len(rough.vibration.stages.grid.width) < 0.7 * len(
        parts.vibration.stages.grid.width  # type: ignore[union-attr]
    )
    wave = np.stack([1.0 + (1e2 * fine.position) ** 3, np.sin(300.0 * fine.position)])
    there = np.stack([1.0 + (1e2 * coarse.position) ** 3, np.sin(300.0 * coarse.position)])
    found = carried(fine, wave, coarse)
    np.testing.assert_allclose(found[0], there[0], rtol=1e-12)
    np.testing.assert_allclose(found[1], there[1], atol=1e-4)


def test_estimates_bound_the_errors_and_do_not_exaggerate() -> None:
    scores = [score(draw(7, number)) for number in SCENES]
    found = summary(scores)
    for name, count in (("wear_depth", 5), ("life", 5), ("mesh_force", 4)):
        scenes, share, ratio = found[name]
        assert scenes == count and share == 1.0 and 1.5 < ratio < 10.0, (name, found[name])
