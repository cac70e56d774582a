"""Pairs beyond A and E wear both flanks where whole outlines meet: worn volume, places,
the part that is theirs, and what leaves everything else alone.
"""

import numpy as np
import pytest
from scenes import external_pair, planetary_set
from warm_pair import warm_pair

from wearlab import assembly
from wearlab.assembly import construction
from wearlab.life.history import SetRate
from wearlab.life.loads import LoadModel
from wearlab.life.loads.static import StaticLoad
from wearlab.mesh.exact import gaps
from wearlab.scene import Scene, SceneError
from wearlab.simulation import simulate

FRICTION = 0.2
K_OF_PINION = 2e-16
EXACT = {"contact": "exact"}
CONSTANT = {
    "pinion": {"model": "constant", "value": "2e-16 m^2/N"},
    "gear": {"model": "constant", "value": "1e-15 m^2/N"},
}
COARSE = {"profile_points": 81}
VIBRATING = {
    "mesh": {**EXACT, "damping_ratio": 0.07},
    "dynamics": {"model": "torsional"},
}


def warm(**changes):
    """Return a steel pinion on a plastic wheel whose outlines are followed."""
    asked = {
        "mesh": EXACT,
        "numerics": COARSE,
        "wear__coefficient": CONSTANT,
        "wear__contact_patch": "elastic",
        **changes,
    }
    return warm_pair(**asked)


def cold(**wear):
    """Return a pair of steel without [thermal]."""
    return {
        "gears": external_pair(20, 40, module="2 mm", face_width="20 mm"),
        "operation": {"torque": "20 N*m", "speed": "1000 rpm"},
        "mesh": EXACT,
        "numerics": COARSE,
        "wear": {"coefficient": CONSTANT, **wear},
    }


def worn_volume(model, rate):
    """Return the volume that all teeth lose in a cycle at a rate (2, n), (2,) [m³]."""
    path = model.kinds[0].path
    teeth = np.array([gear.teeth for gear in model.kinds[0].pair.gears])
    return (path.arc_weight * rate).sum(axis=1) * path.face_width * teeth


@pytest.mark.parametrize("moving", [{}, VIBRATING])
@pytest.mark.parametrize("patch", ["none", "elastic"])
def test_worn_volume_is_that_of_the_sliding_of_all_pairs(patch, moving):
    """``k ∮ Σ F v dt`` is k times the loss over μ, which another module adds up."""
    model = construction.build(warm(wear__contact_patch=patch, **moving))
    coupling = model.coupling
    depth = coupling.unworn()[0] + 3e-6 * np.linspace(1.0, 0.0, 2)[:, None]
    for wear in (coupling.unworn(), (depth,)):
        state = coupling.evaluate(wear)
        kind = state.kind[0]
        sliding = state.heat.friction_power / FRICTION
        turn = 2.0 * np.pi / model.gears.kinds[0].speed
        expected = np.array([K_OF_PINION, 5.0 * K_OF_PINION]) * sliding * turn
        found = worn_volume(model, kind.rate)
        np.testing.assert_allclose(found, expected, rtol=2e-3)
        share = worn_volume(model, kind.rate_beyond) / found
        assert share[0] == pytest.approx(share[1], rel=1e-2)
        assert share[0] > 1.5 * state.heat.load_beyond  # it slides most


def test_unworn_corners_meet_where_geometry_says():
    """`separations` knows the points by circles and involutes alone."""
    model = construction.build(warm())
    pair = model.kinds[0].pair
    grid = model.kinds[0].analysis.grid
    met = model.kinds[0].analysis.unworn[0].touching
    after = slice(grid.on_flank.stop, None)
    for nodes, end in ((slice(0, grid.before), "A"), (after, "E")):
        corner = pair.corner_at(end)
        tip = getattr(pair.path, end)
        x = grid.contact_position[nodes]
        _, of_mate = gaps.separations(pair, corner, x, np.full(len(x), tip))
        np.testing.assert_allclose(met[corner, nodes], tip, atol=3e-8)
        np.testing.assert_allclose(met[1 - corner, nodes], of_mate, atol=1e-7)
        assert np.all(met[:, nodes] >= pair.path.A - 3e-8)
        assert np.all(met[:, nodes] <= pair.path.E + 3e-8)


def test_part_of_the_wear_is_that_of_many_short_steps():
    """Explicit steps of a hundredth of the life, each with its own rates."""
    until = {"cycles": 4e5}
    scene = warm(wear__until=until, wear__snapshots={"cycles": [1e5]})
    run = simulate(scene)
    model = construction.build(scene)
    rate = SetRate(model.coupling)
    depth = model.coupling.flat(model.coupling.unworn())
    beyond = np.zeros_like(depth)
    parts = []
    steps = 60
    size = until["cycles"] / steps
    for number in range(steps):
        first = rate(depth)
        middle = depth + 0.5 * size * first
        at_middle = rate(middle)
        beyond += size * at_middle * rate.share_beyond(middle)
        depth = depth + size * at_middle
        if number + 1 == steps // 4:
            parts.append(beyond.copy())
    parts.append(beyond)
    path = model.kinds[0].path
    for update, part in zip((1, 2), parts, strict=True):
        found = run["wear_depth_beyond"].isel(update=update).values
        expected = model.coupling.split(part)[0]
        of_all = np.abs(expected).max()
        np.testing.assert_allclose(found, expected, atol=0.05 * of_all)
        area = (path.arc_weight * found).sum(axis=1)
        by_steps = (path.arc_weight * expected).sum(axis=1)
        np.testing.assert_allclose(area, by_steps, rtol=0.02)
        whole = run["wear_depth"].isel(update=update).values
        assert np.all(found <= whole + 1e-12)
        assert np.all(found >= 0.0)


def test_wear_beyond_takes_the_load_there_away():
    """The gap grows where tips are worn round: less load and less heat beyond."""
    asked = {"wear__until": {"cycles": 1e6}, "wear__snapshots": None}
    worn, spared = (
        simulate(warm(**asked, wear__beyond_path=wears)) for wears in (True, False)
    )
    assert "wear_depth_beyond" not in spared
    first = worn["load_beyond_path"].values[0]
    assert spared["load_beyond_path"].values[0] == first
    last = worn["load_beyond_path"].values[-1]
    last_spared = spared["load_beyond_path"].values[-1]
    assert last < 0.85 * last_spared
    assert last_spared < 0.85 * first
    assert "wears both flanks (wear_depth_beyond)" in worn["validity"].item()
    assert "wears no flank, though" not in worn["validity"].item()
    assert "mesh.contact = 'exact'" in spared["validity"].item()


def test_stiff_gears_wear_nothing_beyond():
    """As of stiffer teeth: a thousandth of the load leaves what nodes resolve."""
    shares = []
    for torque in ("20 N*m", "0.02 N*m"):
        table = cold(beyond_path=True)
        table["operation"]["torque"] = torque
        model = construction.build(Scene.from_mapping(table))
        kind = model.coupling.evaluate(model.coupling.unworn()).kind[0]
        volumes = [worn_volume(model, of) for of in (kind.rate_beyond, kind.rate)]
        shares.append(float((volumes[0] / volumes[1]).max()))
    assert shares[0] > 0.02
    assert shares[1] < 0.15 * shares[0]


def test_nothing_moves_without_the_key():
    """The identity and every number but the part beyond are those without it."""
    plain = Scene.from_mapping(cold())
    off = Scene.from_mapping(cold(beyond_path=False))
    assert plain.id == off.id
    assert Scene.from_mapping(cold(beyond_path=True)).id != plain.id
    warm_plain = warm()
    assert warm_plain.id == warm(wear__beyond_path=True).id
    assert warm_plain.id != warm(wear__beyond_path=False).id
    first_order = warm(mesh={})
    assert first_order.id == warm(mesh={}, wear__beyond_path=False).id
    again = Scene.from_canonical(warm_plain.canonical())
    assert again.id == warm_plain.id


def test_a_state_that_does_not_wear_on_has_worn_nothing_beyond():
    run = simulate(Scene.from_mapping(cold(beyond_path=True)))
    assert run["wear_depth_beyond"].dims == ("update", "flank", "profile")
    assert not run["wear_depth_beyond"].values.any()
    assert "wear_depth_beyond" not in simulate(Scene.from_mapping(cold()))


def test_stages_go_on_with_what_was_worn_beyond():
    stages = [
        {"torque": "20 N*m", "speed": "1000 rpm", "cycles": 2e5},
        {"torque": "10 N*m", "speed": "1000 rpm", "cycles": 2e5},
    ]
    table = cold(beyond_path=True)
    table["operation"] = {"stage": stages}
    run = simulate(Scene.from_mapping(table))
    deepest = run["wear_depth_beyond"].max(["flank", "profile"]).values
    assert deepest[0] == 0.0
    assert np.all(np.diff(deepest) >= 0.0)
    assert run["cycle"].values[-1] == 4e5


@pytest.mark.parametrize(
    ("mesh", "words", "advice"),
    [
        (
            {"contact": "displacement"},
            "scene.wear.beyond_path: mesh.contact = 'displacement' does not tell which "
            "points meet beyond A and E: give mesh.contact = 'exact', or beyond_path",
            {"mesh": {"contact": "exact"}},
        ),
        (
            {"contact": "algorithm-1"},
            "mesh.contact = 'algorithm-1' does not tell",
            {"mesh": {"contact": "exact"}},
        ),
        (
            {"contact": "exact", "extended_contact": False},
            "without extended contact: leave mesh.extended_contact out, or give",
            {"mesh": {"contact": "exact"}},
        ),
    ],
)
def test_points_must_be_known(mesh, words, advice):
    table = {**cold(beyond_path=True), "mesh": mesh}
    with pytest.raises(SceneError, match="beyond_path") as told:
        Scene.from_mapping(table)
    (problem,) = told.value.problems
    assert words in problem
    spared = {**table["wear"], "beyond_path": False}
    assembly.build(Scene.from_mapping({**table, **advice}))
    assembly.build(Scene.from_mapping({**table, "wear": spared}))


def test_planets_wear_beyond_as_pairs_do():
    """Both meshes of a planet, each by its own sliding."""
    table = {
        "gears": planetary_set(21, 33, {"teeth": 87, "rim_diameter": "300 mm"}),
        "operation": {"torque": "200 N*m", "speed": "600 rpm"},
        "mesh": EXACT,
        "numerics": COARSE,
        "wear": {
            "coefficient": {"model": "constant", "value": "1e-16 m^2/N"},
            "beyond_path": True,
        },
    }
    model = assembly.build(Scene.from_mapping(table))
    state = model.coupling.evaluate(model.coupling.unworn())
    for kind in state.kind:
        assert np.all(kind.rate_beyond <= kind.rate)
        assert kind.rate_beyond.max(axis=1).min() > 0.0


def test_a_load_that_knows_nodes_alone_wears_none_beyond(monkeypatch):
    """As plug-ins have it: nothing wears there, and to ask for it is refused."""
    monkeypatch.setattr(StaticLoad, "of_pairs", LoadModel.of_pairs)
    monkeypatch.setattr(
        StaticLoad,
        "at_nodes",
        lambda self, flanks, static, force: flanks.analysis.force_at_nodes(
            static.force
        )[None],
    )
    run = simulate(warm(wear__until=None, wear__snapshots=None))
    assert "wear_depth_beyond" not in run
    with pytest.raises(SceneError, match="does not say the force on each pair"):
        warm(wear__beyond_path=True)
    assert warm(wear__beyond_path=False)
