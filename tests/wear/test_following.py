"""A contact patch as wide as the force of the moment makes it."""

from dataclasses import replace

import numpy as np
import pytest
from golden import SCENES
from scenes import CAMPAIGNS

import wearlab as wl
from wearlab.assembly import build
from wearlab.campaign import load
from wearlab.life.coupled import StartingPoint
from wearlab.life.history import FOLLOWED_WITHIN, History, Widths
from wearlab.simulation.dataset.validity import _width_flags
from wearlab.simulation.operating import operating_conditions
from wearlab.wear.ahead import Ahead
from wearlab.wear.law import wear_rate
from wearlab.wear.levelling import levelling
from wearlab.wear.patch import spread_matrix, two_way
from wearlab.wear.widths import (
    NARROWEST,
    NodeForces,
    node_forces,
    shares_of_widths,
    shares_that_level,
)

WIDEST = 6


@pytest.fixture(scope="module")
def scene():
    """A pair that wears under its static load."""
    cases = load(CAMPAIGNS / "spur_speeds.toml").cases
    static = next(case.scene for case in cases if case.scene.dynamics is None)
    few = static.replace("numerics.profile_points", 121)
    return few.replace("wear.contact_patch", "following")


@pytest.fixture(scope="module")
def kind(scene):
    return build(scene).coupling.kinds[0]


def wavy(path):
    """Wear of both flanks with a wave as long as a few patches."""
    along = path.arc - path.arc.min(axis=1, keepdims=True)
    share = along / np.ptp(path.arc, axis=1)[:, None]
    return 2e-6 * (1.0 + 0.1 * np.sin(12.0 * share))


def test_shares_keep_the_mean_width_squared():
    """Linear in the force, which goes with the square of the width."""
    ratio = 2.0 ** np.random.default_rng(5).uniform(NARROWEST, WIDEST, (4, 30))
    weight = np.random.default_rng(6).uniform(0.0, 1.0, (4, 30))
    shares = shares_of_widths(ratio, weight, WIDEST)
    assert sum(shares.values()) == pytest.approx(weight.sum(axis=0), rel=1e-12)
    squares = sum(2.0**level * share for level, share in shares.items())
    assert squares == pytest.approx((weight * ratio).sum(axis=0), rel=1e-12)
    assert all(share.min() >= 0.0 for share in shares.values())


def test_what_never_touches_levels_nothing():
    ratio = np.array([[0.0, 1e-6, 2.0**NARROWEST, 1.0]])
    shares = shares_that_level(ratio, np.ones(1), WIDEST)
    total = sum(shares.values())
    assert total == pytest.approx([0.0, 1e-6 / 2.0**NARROWEST, 1.0, 1.0], rel=1e-12)


def test_teeth_apart_half_the_time_level_half_as_much():
    ratio = np.array([[0.0], [2.0]])
    shares = shares_that_level(ratio, np.array([0.5, 0.5]), WIDEST)
    assert sum(shares.values()) == pytest.approx(0.5)
    assert shares[1] == pytest.approx(0.5)


def test_the_wearing_force_counts_what_each_force_wears():
    forces = NodeForces(np.array([0.25, 0.75]), np.array([[4.0, 0.0], [2.0, 0.0]]))
    assert forces.mean == pytest.approx([2.5, 0.0])
    assert forces.wearing == pytest.approx([(4.0 + 3.0) / 2.5, 0.0])


def test_under_the_load_of_unworn_flanks_the_patch_is_theirs(kind):
    """A constant load: the limiting case, to the bit of the frozen operators."""
    path = kind.law.path
    setting = kind.patch.setting
    worn = wavy(path)
    frozen = two_way(setting.half_width, path)
    found = kind.patch.effective_wear(worn, setting.reference)
    assert found == pytest.approx(frozen.effective_wear(worn), rel=1e-14)

    force = setting.reference
    rate = wear_rate(kind.law, force)
    level = levelling(setting.half_width, kind.patch.sliding, path)
    felt = frozen.effective_wear(worn).ravel()
    moved = kind.patch.unworn.moved.at(felt, np.ones(len(force)))
    explicit = frozen.spreading @ (rate.ravel() + moved)
    explicit = explicit + level.at(worn.ravel(), np.ones(len(force)))
    apart = []
    for finer in (1, 100, 10_000):  # the lag goes down with the nodes
        kept = kind.patch.unworn
        ahead = Ahead(kept.ahead.matrix, kept.ahead.fastest, kept.ahead.nodes * finer)
        patch = replace(kind.patch)
        patch.__dict__["unworn"] = kept._replace(ahead=ahead)
        looked = patch.rate(rate, worn, node_forces(force))
        area = (looked * path.arc_weight).sum(axis=1)
        assert area == pytest.approx((rate * path.arc_weight).sum(axis=1), rel=1e-9)
        apart.append(float(np.abs(looked.ravel() - explicit).max()))
    assert apart[2] < 0.1 * apart[1] < 0.1 * apart[0]


@pytest.mark.parametrize("times", [0.3, 0.7, 1.4, 3.0])
def test_wear_spreads_as_wide_as_the_force_makes_the_contact(make_path, times):
    """The second moment of a contact is that of a patch of its own width."""
    s, path = make_path(n=401)
    a = np.full(len(s), 1.2e-4)
    ones = np.ones((1, len(s)))
    shares = shares_of_widths(times * ones, ones, WIDEST)
    widths = {level: a * 2.0 ** (0.5 * level) for level in shares}
    found = sum(
        spread_matrix(widths[level], path) * np.tile(share, 2)
        for level, share in shares.items()
    ).toarray()
    own = spread_matrix(np.sqrt(times) * a, path).toarray()
    arc = path.arc.ravel()
    middle = slice(50, 350)
    moments = [
        (matrix * (arc[:, None] - arc) ** 2).sum(axis=0)[middle]
        for matrix in (found, own)
    ]
    assert moments[0] == pytest.approx(moments[1], rel=5e-3)


@pytest.mark.parametrize("times", [0.35, 0.75, 1.4, 3.0])
@pytest.mark.parametrize("kappa_a", [1.0, 2.0, 4.0])
def test_waves_level_as_under_a_patch_of_their_own_width(make_path, times, kappa_a):
    """Between two widths that are made, by less than an eighth; doubling all levelling
    moves a life by 1.7 %.
    """
    s, path = make_path(n=401)
    a = np.full(len(s), 1.2e-4)
    sliding = np.full((2, len(s)), 1e-16)
    wave = np.zeros((2, len(s)))
    wave[0] = np.cos(kappa_a / (a[0] * np.sqrt(times)) * path.arc[0])
    ones = np.ones(len(s))
    own = levelling(np.sqrt(times) * a, sliding, path).at(wave.ravel(), ones)
    shares = shares_that_level(times * ones[None], np.ones(1), WIDEST)
    found = sum(
        levelling(a * 2.0 ** (0.5 * level), sliding, path).at(wave.ravel(), share)
        for level, share in shares.items()
    )
    inside = slice(50, 350)
    strength = float(found[inside] @ wave[0, inside])
    expected = float(own[inside] @ wave[0, inside])
    assert strength == pytest.approx(expected, rel=0.125)


def test_the_rate_conserves_what_contacts_wear_whatever_their_forces(kind):
    path = kind.law.path
    nodes = len(kind.patch.setting.reference)
    random = np.random.default_rng(8)
    force = kind.patch.setting.reference * random.uniform(0.0, 6.0, (3, nodes))
    forces = NodeForces(np.array([0.2, 0.3, 0.5]), force)
    pointwise = wear_rate(kind.law, forces.mean)
    even = np.full_like(path.arc, 50e-6)
    found = kind.patch.rate(pointwise, even, forces)
    assert (found * path.arc_weight).sum(axis=1) == pytest.approx(
        (pointwise * path.arc_weight).sum(axis=1), rel=1e-9
    )


def test_widths_go_on_from_step_to_step_without_a_jump():
    depth = np.full(8, 20e-6)
    felt = (np.array([100.0, 0.0, 30.0]),)
    loaded = (np.array([200.0, 50.0, 0.0]),)
    widths = Widths(felt, loaded, 20e-6)
    np.testing.assert_allclose(widths.at(depth)[0][[0, 2]], felt[0][[0, 2]], rtol=1e-12)
    further = depth + 7e-6
    share = np.exp(-7e-6 / FOLLOWED_WITHIN)
    expected = 200.0 * 0.5**share
    assert widths.at(further)[0][0] == pytest.approx(expected)
    following = widths.accepted(further, StartingPoint((), loaded))
    np.testing.assert_array_equal(following.at(further)[0], widths.at(further)[0])
    far = widths.at(depth + 1e-3)[0]
    assert far[:2] == pytest.approx(loaded[0][:2], rel=1e-6)


def test_how_soon_widths_follow_hardly_matters(scene, monkeypatch):
    """Halved and doubled, a life moves by less than its error is told to be."""
    lives = []
    for times in (1.0, 0.5, 2.0):
        within = times * FOLLOWED_WITHIN
        monkeypatch.setattr("wearlab.life.history.FOLLOWED_WITHIN", within)
        run = wl.simulate(scene)
        lives.append(float(run.max_wear_depth.isel(update=-1).max()))
        told = float(run.error_estimate_wear_depth.isel(update=-1))
    assert lives[1:] == pytest.approx(2 * [lives[0]], abs=told)


def test_a_worn_state_alone_is_as_one_of_a_life(scene):
    """Felt as wide as it is loaded: asked again from its own forces it is the same."""
    stage = operating_conditions(scene)[0]
    coupling = stage.coupling
    path = coupling.kinds[0].law.path
    wear = (20.0 * wavy(path),)
    alone = coupling.evaluate(wear)
    again = coupling.evaluate(wear, alone.start)
    (rate,) = alone.rate
    assert again.rate[0] == pytest.approx(rate, abs=1e-4 * float(rate.max()))


def test_blocks_of_a_duty_have_patches_of_their_own(scene):
    """Two equal blocks wear as one; a heavier one makes wider contacts."""
    torque = scene.operation.torque
    cycles = {"cycles": 2e7}
    one = scene.replace({"wear.until": cycles, "wear.snapshots": None})

    def duty(second):
        blocks = [
            {"torque": f"{value!r} N*m", "speed": "1000 rpm", "share": 0.5}
            for value in (torque, second)
        ]
        return wl.simulate(one.replace({"operation": {"duty": blocks}}))

    alone = wl.simulate(one.replace("operation.speed", "1000 rpm"))
    equal = duty(torque)
    assert float(equal.max_wear_depth.isel(update=-1).max()) == pytest.approx(
        float(alone.max_wear_depth.isel(update=-1).max()), rel=1e-6
    )
    stage = operating_conditions(one)[0]
    wear = (20.0 * wavy(stage.coupling.kinds[0].law.path),)
    state = stage.coupling.evaluate(wear)
    assert state.start.forces[0] == pytest.approx(state.kind[0].patch_force)


@pytest.mark.parametrize(
    ("patch", "told"),
    [
        ("following", "and the patch that spreads and levels wear with it"),
        ("elastic", 'wear.contact_patch = "following" takes that of the moment'),
    ],
)
def test_a_run_says_where_contacts_change_their_width(scene, patch, told):
    """By the root of the force: a fifth of it is more than twice, a third is not."""
    model = build(scene.replace("wear.contact_patch", patch))
    first = model.coupling.evaluate(model.coupling.unworn())

    def flags(share):
        (kind,) = first.kind
        lighter = kind._replace(tooth_force=share * kind.tooth_force)
        last = first._replace(kind=(lighter,))
        return _width_flags(model, History(np.array([0.0, 1.0]), (first, last)))

    (flag,) = flags(0.2)
    assert flag.startswith("the width of contact changes by up to 2.2 times")
    assert flag.endswith(told)
    assert flags(0.3) == []


FACE = {
    **SCENES["worn external pair"],
    "mesh": {"misalignment": "10 um", "face_points": 5},
}


@pytest.mark.parametrize(
    "table", [SCENES["worn planetary set"], FACE], ids=["planetary", "face"]
)
def test_the_stored_half_width_is_that_of_the_stored_pressure(table):
    """Hertz: ``a = 8 p R'/(π E*)`` of the mean pressure p, on every flank."""
    scene = wl.Scene.from_mapping(table)
    model = build(scene)
    run = wl.simulate(scene)
    for name in run.flank.values:
        kind, _ = model.gears.flank(str(name))
        path = model.kinds[kind].path
        radius = path.equivalent_radius
        of_flank = run.sel(flank=name).isel(profile=slice(len(radius)))
        pressure = of_flank.contact_pressure.transpose(..., "profile").values
        expected = 8.0 * pressure * radius / (np.pi * path.contact_modulus)
        found = of_flank.contact_half_width.transpose(..., "profile").values
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-15)
        assert found.max() > 1e-5
