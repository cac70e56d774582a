"""Planetary sets whose teeth part: the orbits of located changes, for
a bounded count of work.
"""

from functools import cache
from typing import Any

import numpy as np
import pytest
from scenes import CAMPAIGNS

from wearlab.assembly import build
from wearlab.campaign import load
from wearlab.dynamics.steady.periodic import (
    AVERAGED_LARGE,
    AVERAGED_SETTLED,
    Periodic,
)
from wearlab.dynamics.steady.shooting import Shooting

BASE = CAMPAIGNS / "base" / "planetary_ngw11_vibration.toml"
DEPTH = 40e-6
MAX_MAPS = 60 * 5
"""Mesh periods that the hardest steady state may take."""


@cache
def worn(torque: str, speed: str) -> Any:
    """NGW11-6 worn by 40 µm that wave: pairs part everywhere, at 30
    N·m and 4000 rpm whole meshes.
    """
    scene = (
        load(BASE)
        .cases[0]
        .scene.replace("operation.torque", torque)
        .replace("operation.speed", speed)
    )
    parts = build(scene.replace("mesh.extended_contact", False))
    wear = []
    for kind in parts.kinds:
        x = np.linspace(-1.0, 1.0, len(kind.analysis.grid.position))
        one = DEPTH * x**2 * (1.0 + 0.15 * np.sin(23.0 * x))
        wear.append(np.stack([one, 0.6 * one]))
    return parts, tuple(wear), parts.coupling.evaluate(tuple(wear))


@pytest.mark.parametrize(
    ("torque", "speed"), [("134 N*m", "1500 rpm"), ("30 N*m", "1500 rpm")]
)
def test_the_orbit_is_that_of_located_changes(torque: str, speed: str) -> None:
    _, _, state = worn(torque, speed)
    found = state.response
    assert found is not None and found.period == 1
    shooting = Shooting(found.system, found.tables, found.mesh_period)
    located = shooting.shoot(1, found.state[0, 0].copy(), max_passes=4)
    assert located is not None
    q = len(found.system.load)
    size = np.abs(found.state[0, :, :q]).max()
    np.testing.assert_allclose(
        located.state[0, :, :q], found.state[0, :, :q], atol=1e-6 * size
    )
    assert found.counts.period_maps <= MAX_MAPS


def test_meshes_that_part_without_an_orbit_end_in_a_bounded_average() -> None:
    parts, wear, state = worn("30 N*m", "4000 rpm")
    found = state.response
    assert found is not None and isinstance(parts.vibration.method, Periodic)
    assert found.counts.period_maps <= MAX_MAPS
    if found.period == 0:
        assert len(found.state) >= AVERAGED_LARGE
    again = parts.coupling.evaluate(
        tuple(1.01 * one for one in wear), state.start
    ).response
    assert again is not None and again.counts.period_maps <= MAX_MAPS // 2
    if again.period == 0:
        assert np.isfinite(again.state).all() and len(again.state) >= AVERAGED_SETTLED


def test_what_a_state_leaves_to_the_next_is_small_and_enough() -> None:
    parts, wear, state = worn("134 N*m", "1500 rpm")
    found = state.response
    left = state.start.responses[0]
    assert found is not None and left.state.shape == (1, 2, found.state.shape[2])
    assert left.tables.width.size == 0 and left.between is None
    np.testing.assert_array_equal(left.end, found.end)
    further = tuple(1.01 * one for one in wear)
    by_all = state.start._replace(responses=state.responses)
    from_all, from_left = (
        parts.coupling.evaluate(further, start).response
        for start in (by_all, state.start)
    )
    assert from_all is not None and from_left is not None
    np.testing.assert_array_equal(from_all.state, from_left.state)
