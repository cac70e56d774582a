"""A coupled life against an independent march: SciPy's, small steps, the patch written
out, no lag.
"""

import numpy as np
import pytest
from outside_patch import outside_patch
from scenes import CAMPAIGNS
from scipy.integrate import solve_ivp

from wearlab.assembly import build
from wearlab.campaign import load
from wearlab.life.history import SetRate
from wearlab.simulation.life_run import integrate_life
from wearlab.simulation.operating import operating_conditions
from wearlab.simulation.run import simulate
from wearlab.wear.law import wear_rate

DEPTH = 25e-6


@pytest.fixture(scope="module")
def scene():
    """NGW11-6, coupled, few nodes, worn to 25 µm on the sun."""
    found = load(CAMPAIGNS / "planetary_speed.toml").cases[4].scene
    for key, value in (
        ("mesh.stiffness.model", "potential-energy"),
        ("numerics.profile_points", 61),
        ("wear.coefficient", {"model": "constant", "value": "1e-16 m^2/N"}),
        ("wear.until", {"depth": "25 um", "flank": "sun"}),
        ("wear.snapshots", None),
    ):
        found = found.replace(key, value)
    return found


def marched(parts):
    """Return the cycles to the depth by ``h' = max(0, S r + D h)``, r the pointwise
    rate of felt flanks.

    Patches that follow are as wide as the forces of the state make them, and felt as
    wide as the rate before has loaded them.
    """
    coupling = parts.coupling
    near = coupling.evaluate(coupling.unworn()).start

    def rate(cycle, flat):
        nonlocal near
        state = coupling.evaluate(coupling.split(np.maximum(flat, 0.0)), near)
        near = near._replace(forces=state.start.forces)
        found = []
        for kind, one in zip(coupling.kinds, state.kind, strict=True):
            force = one.mean_tooth_force
            pointwise = wear_rate(kind.law, force).ravel()
            worn = one.wear.ravel()
            patch = outside_patch(kind, force)
            change = patch.spreading @ pointwise + patch.levels @ worn
            found.append(np.maximum(0.0, change))
        return np.concatenate(found)

    sun = coupling.entries(0, 0)

    def reached(cycle, flat):
        return float(flat[sun].max()) - DEPTH

    reached.terminal = True
    begin = coupling.flat(coupling.unworn())
    found = solve_ivp(
        rate,
        (0.0, 1e8),
        begin,
        method="RK23",
        rtol=1e-5,
        atol=1e-9,
        max_step=4e4,
        events=reached,
    )
    return float(found.t_events[0][0])


@pytest.mark.slow
@pytest.mark.parametrize("patch", ["elastic", "following"])
def test_a_coupled_life_is_that_of_an_independent_march(scene, patch):
    scene = scene.replace("wear.contact_patch", patch)
    (stage,) = operating_conditions(scene)
    parts = stage.first
    life = integrate_life(scene, (stage,)).life
    assert life.end_reason == "depth"
    assert float(life.cycle[-1]) == pytest.approx(marched(parts), rel=5e-3)


def test_what_rests_wears_as_the_static_scene_does(scene):
    """The rate that held steps follow is that of the scene under its static load."""
    moving = build(scene.replace("wear.load", "instant")).coupling
    still = build(scene.replace("wear.load", "static")).coupling
    assert still.static_only() is None
    depth = still.flat(still.unworn()) + 2e-6
    rates = [SetRate(one)(depth) for one in (moving.static_only(), still)]
    np.testing.assert_array_equal(*rates)
    assert SetRate(moving).still is not None


def test_a_pair_that_once_jumped_is_within_its_estimate_at_any_tolerance():
    """The torsional pair at 1100 rpm to 1e8 cycles.

    Point by point its response jumps on the way.
    """
    found = load(CAMPAIGNS / "spur_1dof.toml").cases[1].scene
    assert found.operation.speed == pytest.approx(1100.0 * np.pi / 30.0)
    assert found.wear.load.model == "instant"

    def lived(tolerance):
        data = simulate(found.replace("numerics.tolerance", tolerance))
        last = data.isel(update=-1)
        return float(last.max_wear_depth.max()), float(
            last.error_estimate_wear_depth.max()
        )

    true, _ = lived(1e-4)
    for tolerance in (2e-3, 1e-3, 5e-4):
        depth, estimate = lived(tolerance)
        assert abs(depth - true) < estimate < 0.05 * true
