"""Meshes between the stages of their tables: at the stages what these
say, smooth between them.
"""

import numpy as np
import pytest
from scenes import VIBRATING_PAIR

from wearlab.accuracy.steady import steady
from wearlab.mesh.excitation import Between, stage_tables
from wearlab.mesh.stages import parabola
from wearlab.scene import Scene

PAIR = VIBRATING_PAIR | {"errors": {"harmonic": [{"order": 3, "amplitude": "2 um"}]}}
SERIES = {"model": "fourier", "stiffness_harmonics": 5, "error_harmonics": 5}


@pytest.mark.parametrize("excitation", [None, SERIES], ids=["pairs", "series"])
def test_it_is_the_table_at_the_stages_and_smooth_between(excitation) -> None:
    mesh = PAIR["mesh"] | ({"excitation": excitation} if excitation else {})
    problem = steady(Scene.from_mapping(PAIR | {"mesh": mesh}))
    stages = problem.vibration.sampling
    tables = stage_tables(problem.kinds, stages, None)
    slow = np.array([3e-6])
    between = Between(problem.kinds, stages, slow)
    steps = len(tables.width)
    for stage, x in enumerate((0.0, 0.5, 1.0)):
        at = np.arange(steps), np.full(steps, x)
        for found, known in zip(
            between.springs_at(*at)[:4], tables.springs[:4], strict=True
        ):
            np.testing.assert_allclose(found, known[:, stage], rtol=1e-9, atol=1e-15)
        error, rate = between.errors_at(*at)
        np.testing.assert_allclose(error - slow, tables.error[:, stage], atol=1e-18)
        np.testing.assert_allclose(rate, tables.error_rate[:, stage], atol=1e-16)
    fractions = np.array([0.1, 0.5, 0.8])
    for source in (between, tables):
        within = source.springs_within(fractions)
        for k, fraction in enumerate(fractions):
            at = np.arange(steps), np.full(steps, fraction)
            for found, known in zip(
                within[:4], source.springs_at(*at)[:4], strict=True
            ):
                np.testing.assert_allclose(found[:, k], known, rtol=1e-9, atol=1e-15)
    step = np.arange(steps)
    x = np.linspace(0.1, 0.9, steps)
    error, _ = between.errors_at(step, x)
    for found, table in (
        (between.springs_at(step, x)[0], tables.stiffness),
        (error - slow, tables.error),
    ):
        apart = np.abs(found - parabola(table, step, x)).max() / np.abs(table).max()
        assert 0.0 < apart < 2e-2
