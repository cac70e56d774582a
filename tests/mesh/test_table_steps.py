"""Steps that land on the points of a table where a group of them does not resolve it, and nowhere else."""

import numpy as np
import pytest

from wearlab.mesh.table_steps import Tables, table_grid

RAMP = 0.3, 0.34
POINTS = np.concatenate([[0.0], np.linspace(*RAMP, 21), [1.0]])


def ramped(phase: np.ndarray, middle: float) -> np.ndarray:
    """A smooth ramp between two constants, steeper in the second mesh; it jumps at 0.8."""
    x = np.clip((phase - RAMP[0]) / (RAMP[1] - RAMP[0]), 0.0, 1.0)
    smooth = 0.5 - 0.5 * np.cos(np.pi * x)
    return np.stack([2.0 - smooth, 1.0 + smooth]) * (1.0 if middle < 0.8 else 1.5)


def grid(missing: float, steps: int = 8, most: int = 1000):
    return table_grid(np.array([0.0, 0.8]), steps, 4, Tables(POINTS, ramped), missing, most)


def test_groups_end_where_the_ramp_does() -> None:
    found = grid(1e-4)
    assert set(np.round([0.0, *RAMP, 0.8], 12)) <= set(np.round(found.start, 12))
    assert found.width.sum() == pytest.approx(1.0) and found.width.max() <= 1.0 / 8 + 1e-12
    np.testing.assert_array_equal(np.unique(found.segment[found.start >= 0.8 - 1e-12]), [1])
    groups = found.width.reshape(-1, 4)
    np.testing.assert_allclose(groups, groups[:, :1] * np.ones(4))


def test_what_groups_miss_is_what_was_asked_for() -> None:
    counts = []
    for missing in (1e-4, 1e-9, 1e-12):
        found = grid(missing)
        begin, width = found.start[::4], found.width.reshape(-1, 4).sum(axis=1)
        fine, missed = np.linspace(0.001, 0.999, 200), 0.0
        for low, long, segment in zip(begin, width, found.segment[::4], strict=True):
            nodes, middle = np.linspace(0.0, 1.0, 9), (0.4, 0.9)[segment]
            for known, wanted in zip(
                ramped(low + long * nodes, middle), ramped(low + long * fine, middle), strict=True
            ):
                polynomial = np.polynomial.Polynomial.fit(nodes, known, 8)
                missed += 0.5 * long * np.abs(polynomial(fine) - wanted).mean()
        assert missed <= missing
        counts.append(len(found.width))
    assert counts[0] < counts[1] < counts[2]


def test_few_steps_where_nothing_bends_and_none_where_too_many_are_asked_for() -> None:
    straight = Tables(POINTS, lambda x, middle: np.ones((1, len(x))))
    flat = table_grid(np.zeros(1), 10, 4, straight, 1e-9, 100)
    assert flat is not None and len(flat.width) == 12
    assert grid(1e-12, most=20) is None
