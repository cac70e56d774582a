"""Load spectra with idle rows, standstill and reversed torque: DOOR's table of bins."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import external_pair

from wearlab.assembly import build
from wearlab.assembly.sheet import sheet
from wearlab.scene import Scene, SceneError
from wearlab.simulation import simulate
from wearlab.store.align import start_wear

ROWS = (
    ("0 N*m", "0 rpm", 4000),
    ("345 N*m", "1200 rpm", 9000),
    ("567 N*m", "1150 rpm", 800),
    ("-210 N*m", "1180 rpm", 300),
    ("0 N*m", "1500 rpm", 900),
)
CYCLES = np.array([6.48e8, 5.52e7, 2.124e7])
TORQUES = np.array([345.0, 567.0, 210.0])
HOURS = 15_000


def spectrum(rows=ROWS, **changes):
    total = sum(hours for *_, hours in rows)
    table = {
        "gears": external_pair(27, 51, module="4.5 mm", face_width="50 mm"),
        "operation": {
            "duty": [
                {"torque": torque, "speed": speed, "share": hours / total}
                for torque, speed, hours in rows
            ]
        },
        "mesh": {"stiffness": "potential-energy"},
        "wear": {
            "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
            "until": {"hours": HOURS},
        },
        "numerics": {"profile_points": 61},
    }
    return Scene.from_mapping(table).replace(
        {key.replace("__", "."): value for key, value in changes.items()}
    )


def sides_changed(rows=ROWS):
    return [(f"{-float(torque.split()[0]):g} N*m", *others) for torque, *others in rows]


@pytest.fixture(scope="module")
def run():
    return simulate(spectrum())


def test_hours_and_cycles_are_those_of_the_table(run):
    assert run["operating_hours"].values[-1] / 3600.0 == pytest.approx(HOURS)
    assert run["cycle"].values[-1] == pytest.approx(8.0544e8)
    loaded = run["load_cycles"].isel(update=-1).sel(flank=["pinion", "pinion-back"])
    assert loaded.values == pytest.approx([CYCLES[:2].sum(), CYCLES[2]])
    assert list(run["duty"].values) == [2, 3, 4]
    assert run["duty_torque"].values == pytest.approx([345.0, 567.0, -210.0])
    assert run["duty_share"].values * HOURS == pytest.approx([9000, 800, 300])


def test_back_flanks_wear_as_the_front_ones_by_their_torque_times_cycles():
    """Where shares of pairs know no load the rates are as Σ N T: 0.0175015."""
    linear = {"mesh__extended_contact": False, "wear__contact_patch": "none"}
    rate = simulate(spectrum(**linear))["wear_rate"].isel(update=0)
    work = CYCLES * TORQUES
    wanted = work[2] / work[:2].sum()
    assert wanted == pytest.approx(0.0175015, abs=5e-8)
    for flank in ("pinion", "gear"):
        back = rate.sel(flank=f"{flank}-back").values
        assert back == pytest.approx(wanted * rate.sel(flank=flank).values, rel=1e-9)


def test_sides_change_places_with_the_sign_of_the_torque(run):
    turned = simulate(spectrum(sides_changed()))
    for flank in ("pinion", "gear"):
        for one, other in ((flank, f"{flank}-back"), (f"{flank}-back", flank)):
            rates = [run["wear_rate"][0].sel(flank=one)]
            rates.append(turned["wear_rate"][0].sel(flank=other))
            assert rates[1].values == pytest.approx(rates[0].values, rel=1e-9)
            depths = [run["wear_depth"][-1].sel(flank=one)]
            depths.append(turned["wear_depth"][-1].sel(flank=other))
            # steps over cycles differ, as their errors say
            off = float(run["error_estimate_wear_depth"][-1])
            assert depths[1].values == pytest.approx(depths[0].values, abs=off)


def test_forces_stand_on_the_flanks_that_carry_them(run):
    force = run["tooth_force"].isel(update=0).max("profile")
    assert (force.sel(flank="pinion-back", duty=[2, 3]) == 0.0).all()
    assert (force.sel(flank="pinion", duty=4) == 0.0).all()
    assert (force.sel(flank="pinion-back", duty=4) > 0.0).all()
    sides = dict(zip(run["flank"].values, run["flank_side"].values, strict=True))
    assert sides["pinion"] == sides["gear"] == "right"
    assert sides["pinion-back"] == sides["gear-back"] == "left"
    assert "back flanks: loaded as the front ones" in str(run["validity"].values)


def test_the_mass_worn_off_a_gear_is_that_of_both_its_sides(run):
    front = simulate(spectrum([row for row in ROWS if row[0][0] != "-"]))
    # hardly worn, so that the rates are those of new flanks; without the reversed row
    # the same hours have more of the others
    longer = (HOURS - 300) / HOURS
    back_share = 1.0 + (CYCLES * TORQUES)[2] / (CYCLES * TORQUES)[:2].sum()
    ratio = run["worn_mass"].values[-1] / front["worn_mass"].values[-1] / longer
    assert ratio == pytest.approx(back_share, rel=3e-3)


def test_wear_of_either_side_thins_the_teeth():
    """Ten times the back's wear makes the mesh softer where only fronts are loaded."""
    much = [
        ("345 N*m", "1200 rpm", 5000),
        ("-345 N*m", "1200 rpm", 5000),
    ]
    coefficient = {"model": "constant", "value": "1e-16 m^2/N"}
    both = simulate(
        spectrum(much, wear__coefficient=coefficient, wear__until={"hours": 2000})
    )
    front = simulate(
        spectrum(much[:1], wear__coefficient=coefficient, wear__until={"hours": 1000})
    )
    depth = [run["max_wear_depth"].values[-1][0] for run in (both, front)]
    assert depth[0] == pytest.approx(depth[1], rel=0.01)
    worn = [
        run["mesh_stiffness"].isel(update=-1, duty=0).mean().item()
        for run in (both, front)
    ]
    new = [
        run["mesh_stiffness"].isel(update=0, duty=0).mean().item()
        for run in (both, front)
    ]
    assert new[0] == pytest.approx(new[1], rel=1e-9)
    assert worn[0] < worn[1] < new[0]


def test_a_start_that_drops_worn_back_flanks_says_so(run):
    """They were new again without a word."""
    front = [row for row in ROWS if row[0][0] != "-"]
    for rows, replaced in ((front, []), (ROWS, []), (front, ["pinion"])):
        scene = spectrum(rows, start={"run": run.attrs["id"], "replace": replaced})
        after = simulate(scene.with_start_wear(start_wear(run, scene.start)))
        said = str(after["validity"].values)
        for flank in ("pinion", "gear"):
            is_dropped = rows is front and flank not in replaced
            assert (
                f"{flank}-back of the run that this one starts" in said
            ) is is_dropped
        if rows is ROWS:
            depth = after["wear_depth"].isel(update=0).sel(flank="pinion-back").max()
            assert float(depth) == pytest.approx(
                float(run["wear_depth"].isel(update=-1).sel(flank="pinion-back").max())
            )


def test_without_reversed_rows_there_are_no_back_flanks():
    front = simulate(spectrum([row for row in ROWS if row[0][0] != "-"]))
    assert list(front["flank"].values) == ["pinion", "gear"]
    assert "back flanks" not in str(front["validity"].values)


def test_idle_rows_pass_time_and_cycles_and_nothing_else():
    """Dropped idle rows gave 1.485 times the wear in the same hours."""
    loaded = [row for row in ROWS if row[0][0] not in "-0"]
    idle = [row for row in ROWS if row[0][0] != "-"]
    runs = [simulate(spectrum(rows)) for rows in (loaded, idle)]
    in_all_hours = [
        run["wear_rate"].values[0, 0].max() * run["cycle"].values[-1] for run in runs
    ]
    assert in_all_hours[0] / in_all_hours[1] == pytest.approx(14_700 / 9_800, rel=1e-9)


def test_a_limit_may_stand_on_a_back_flank():
    worn = simulate(
        spectrum(wear__until={"hours": None, "depth": "0.5 um", "flank": "pinion-back"})
    )
    assert worn["end_reason"].item() == "depth"
    last = worn["max_wear_depth"].isel(update=-1)
    assert last.sel(flank="pinion-back").item() == pytest.approx(0.5e-6)
    assert last.sel(flank="pinion").item() > 0.5e-6
    front = [row for row in ROWS if row[0][0] != "-"]
    with pytest.raises(SceneError, match="'pinion-back' is loaded by reversed torque"):
        spectrum(
            front, wear__until={"hours": None, "depth": "1 um", "flank": "pinion-back"}
        )


def test_pairs_that_vibrate_and_flanks_with_a_width_reverse_too():
    moving = {"dynamics": {"model": "torsional"}, "mesh__damping_ratio": 0.1}
    wide = {"mesh__face_points": 7, "mesh__misalignment": "5 um"}
    for changes in (moving, wide, {**moving, **wide}):
        run = simulate(spectrum(**changes, wear__until={"hours": 100}))
        depth = run["max_wear_depth"].isel(update=-1)
        assert (depth.values > 0.0).all()
        assert depth.sel(flank="pinion").item() > depth.sel(flank="pinion-back").item()
        assert "error_estimate_wear_depth" in run


def test_nothing_that_turns_under_load_is_refused():
    with pytest.raises(SceneError, match="no condition has a torque and a speed"):
        spectrum([ROWS[0], ROWS[-1]])


def test_planetary_sets_do_not_reverse():
    from scenes import planetary_set

    rows = [
        {"torque": torque, "speed": "100 rpm", "share": 0.5}
        for torque in ("100 N*m", "-50 N*m")
    ]
    with pytest.raises(SceneError, match="row 2 has a negative torque"):
        Scene.from_mapping(
            {
                "gears": planetary_set(
                    20, 28, {"teeth": 76, "rim_diameter": "190 mm"}, module="2 mm"
                ),
                "operation": {"duty": rows},
            }
        )


def test_a_reversed_spectrum_begins_with_worn_flanks():
    """Its back flanks start as new where the front ones alone are worn."""
    worn = {"pinion": {"depth": "4 um", "shape": "quadratic"}}
    run = simulate(spectrum(wear__initial=worn))
    first = run["wear_depth"].isel(update=0).max("profile")
    assert float(first.sel(flank="pinion")) == pytest.approx(4e-6, rel=1e-6)
    assert float(first.sel(flank="pinion-back")) == 0.0


def test_the_sheet_tells_each_mesh_once():
    rows = [row.symbol for row in sheet(spectrum()).rows]
    plain = [row.symbol for row in sheet(spectrum(rows=ROWS[:3])).rows]
    assert rows == plain
    assert len(sheet(spectrum()).drawings) == 1


def test_worn_flanks_behind_widen_the_backlash_of_the_motion():
    """Evenly worn by h on either gear, by 2 h: a light pair that strikes behind.

    In the mean over a mesh period, so that wear that leaves the pitch point alone
    widens it by less than its depth.
    """
    scene = spectrum(
        [("5 N*m", "1200 rpm", 1.0), ("-5 N*m", "1200 rpm", 1.0)],
        dynamics={"model": "torsional"},
        mesh__damping_ratio=0.05,
        mesh__normal_backlash="10 um",
        mesh__stiffness={"model": "constant", "value": "400 N/um", "of": "pair"},
        errors={
            "harmonic": [
                {
                    "mesh": "pinion-gear",
                    "order": 1,
                    "amplitude": "12 um",
                    "phase": "0 deg",
                }
            ]
        },
    )
    front = scene.operation.in_conditions()[0]
    coupling = build(scene.with_sections(operation=front)).coupling
    kinds = coupling.kinds
    new = tuple(np.zeros((2, *kind.shape)) for kind in kinds)
    behind = 3e-6
    worn = tuple(
        depth if kind.is_loaded else depth + behind
        for kind, depth in zip(kinds, new, strict=True)
    )
    (widened,) = coupling.evaluate(worn).responses
    wider = coupling.vibration.with_clearance(2.0 * behind)
    (expected,) = replace(coupling, vibration=wider).evaluate(new).responses
    (narrow,) = coupling.evaluate(new).responses
    assert widened.system.backlash == pytest.approx([16e-6])
    np.testing.assert_allclose(widened.state, expected.state, rtol=1e-9, atol=1e-15)
    assert not np.allclose(widened.state, narrow.state, rtol=1e-3)

    place = np.abs(kinds[0].analysis.grid.position)
    at_ends = 4e-6 * place / place.max() * np.ones((2, 1))
    assert 0.0 < kinds[0].clearance(at_ends) < 8e-6
