"""Measured flanks and exact contact as scenes: what is read, what is refused, and a run's own export."""

import numpy as np
import pytest

from wearlab.scene import Scene, SceneError
from wearlab.scene.merge import merge
from wearlab.simulation import simulate

UNITS = {"diameter": "mm", "deviation": "um"}
CSV = "# measured\ndiameter,deviation\n143,-5\n146,-2\n150,0\n153,-3\n157,-6\n"


def static(table, **more):
    still = {key: value for key, value in table.items() if key != "dynamics"}
    return merge({**still, "mesh": {}}, more)


def scene(table, folder, text=CSV, units=UNITS, **options):
    (folder / "flank.csv").write_text(text)
    initial = {"pinion": {"file": "flank.csv", "units": units, **options}}
    return Scene.from_mapping(static(table, wear={"initial": initial}), folder)


def test_contents_become_part_of_the_scene(table, tmp_path):
    one = scene(table, tmp_path)
    pinion = one.wear.initial_of("pinion")
    assert (pinion.x, pinion.y, pinion.direction, pinion.zero) == (
        "diameter",
        "deviation",
        "normal",
        "as-measured",
    )
    assert pinion.abscissa == pytest.approx([0.143, 0.146, 0.150, 0.153, 0.157])
    assert pinion.ordinate == pytest.approx([-5e-6, -2e-6, 0.0, -3e-6, -6e-6])
    assert Scene.from_canonical(one.canonical()) == one and "csv" not in one.canonical()
    assert scene(table, tmp_path, CSV.replace("-6", "-7")).id != one.id
    assert scene(table, tmp_path, zero="line").id != one.id
    assert scene(table, tmp_path, smooth="1 mm").wear.initial_of("pinion").smooth == pytest.approx(1e-3)


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        (CSV.replace("146", "156"), {}, "neither rises nor falls"),
        (CSV.replace("-2", "nan"), {}, "not finite"),
        (CSV.replace("diameter", "radius"), {}, "expected diameter or roll_angle or path_position for x"),
        (CSV, {"x": "roll_angle"}, "expected roll_angle for x"),
        (CSV, {"units": {"diameter": "mm"}}, "units.deviation is required"),
        (CSV, {"units": "um"}, "units: 'um' is no table: write units = { diameter = "),
        (CSV, {"abscissa": 3}, "'abscissa' is read from file"),
        (CSV, {"zero": "middle"}, "zero"),
        (CSV, {"depth": "3 um"}, "depth"),
    ],
)
def test_files_that_are_not_a_flank_are_refused(table, tmp_path, text, options, said):
    with pytest.raises(SceneError, match=said):
        scene(table, tmp_path, text, **options)


def test_a_runs_own_deviation_read_back_is_its_wear(table, tmp_path):
    relief = {"pinion": {"tip_relief": {"amount": "6 um", "length": "2 mm"}}}
    worn = simulate(Scene.from_mapping(static(table, gears=relief))).isel(update=-1)
    assert float(worn.max_wear_depth.min()) > 1e-6
    initial = {}
    for flank in ("pinion", "gear"):
        one = worn.sel(flank=flank)
        rows = zip(1e3 * one.diameter.values, 1e6 * one.flank_deviation.values, strict=True)
        text = "diameter,deviation\n" + "".join(f"{x:.15g},{y:.15g}\n" for x, y in rows)
        (tmp_path / f"{flank}.csv").write_text(text)
        initial[flank] = {"file": f"{flank}.csv", "units": UNITS}
    again = merge(static(table, gears=relief), {"wear": {"initial": initial}})
    del again["wear"]["until"]
    read = simulate(Scene.from_mapping(again, tmp_path))
    np.testing.assert_allclose(read.wear_depth.values[0], worn.wear_depth.values, atol=1e-12)


def test_exact_contact_is_told_and_agrees_for_slight_wear(table):
    uniform = {"pinion": {"depth": "2 um", "shape": "uniform"}}
    base = merge(static(table, wear={"initial": uniform}), {"mesh": {"extended_contact": False}})
    del base["wear"]["until"]
    plain, exact = (
        simulate(Scene.from_mapping(merge(base, {"mesh": {"contact": model}})))
        for model in ("displacement", "exact")
    )
    np.testing.assert_allclose(
        exact.static_transmission_error, plain.static_transmission_error, rtol=3e-4
    )  # teeth bend 2 µm off
    assert "contact_angle" not in plain and exact.contact_angle.sizes["member"] == 2
    angle = exact.unloaded_transmission_angle.values
    r_b = 0.5 * 0.150 * np.cos(np.radians(20.0))
    np.testing.assert_allclose(angle * r_b, exact.unloaded_transmission_error.values, rtol=1e-5)
    share = float(exact.single_contact_share.values[0, 0])
    assert share == pytest.approx(2.0 - float(exact.contact_ratio.values[0]), abs=0.02)


def test_extended_contact_removes_the_jump_and_says_how_far_it_reaches(table):
    base = static(table)
    del base["wear"]["until"]
    jump, smooth = (
        simulate(Scene.from_mapping(merge(base, {"mesh": {"extended_contact": on}}))) for on in (False, True)
    )
    assert "would extend the path" in str(jump.validity.values)
    assert "pairs may touch up to" in str(smooth.validity.values)
    assert jump.sizes["pair"] == smooth.sizes["pair"]

    def largest_step(dataset):
        share = dataset.load_share.values[0, 0]
        inside = np.abs(np.diff(share, axis=1)).max()
        across = np.abs(share[:-1, 0] - np.roll(share, -1, axis=0)[:-1, -1]).max()
        return max(inside, across)

    assert largest_step(jump) > 0.3 and largest_step(smooth) < 0.1
    last = smooth.load_share.values[0, 0, -1]
    assert last[-1] > 0.2 and last[len(last) // 2] == 0.0
