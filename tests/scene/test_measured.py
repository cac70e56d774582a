"""Measured flanks and exact contact as scenes: what is read, what is refused, and a
run's own export.
"""

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
    assert scene(table, tmp_path, smooth="1 mm").wear.initial_of(
        "pinion"
    ).smooth == pytest.approx(1e-3)


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        (CSV.replace("146", "156"), {}, "neither rises nor falls"),
        (CSV.replace("-2", "nan"), {}, "not finite"),
        (
            CSV.replace("diameter", "radius"),
            {},
            "expected diameter or roll_angle or roll_length or path_position for x",
        ),
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
        rows = zip(
            1e3 * one.diameter.values, 1e6 * one.flank_deviation.values, strict=True
        )
        text = "diameter,deviation\n" + "".join(f"{x:.15g},{y:.15g}\n" for x, y in rows)
        (tmp_path / f"{flank}.csv").write_text(text)
        initial[flank] = {"file": f"{flank}.csv", "units": UNITS}
    again = merge(static(table, gears=relief), {"wear": {"initial": initial}})
    del again["wear"]["until"]
    read = simulate(Scene.from_mapping(again, tmp_path))
    np.testing.assert_allclose(
        read.wear_depth.values[0], worn.wear_depth.values, atol=1e-12
    )


def test_exact_contact_is_told_and_agrees_for_slight_wear(table):
    uniform = {"pinion": {"depth": "2 um", "shape": "uniform"}}
    base = merge(
        static(table, wear={"initial": uniform}), {"mesh": {"extended_contact": False}}
    )
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
    np.testing.assert_allclose(
        angle * r_b, exact.unloaded_transmission_error.values, rtol=1e-5
    )
    share = float(exact.single_contact_share.values[0, 0])
    assert share == pytest.approx(2.0 - float(exact.contact_ratio.values[0]), abs=0.02)


def test_extended_contact_removes_the_jump_and_says_how_far_it_reaches(table):
    base = static(table)
    del base["wear"]["until"]
    jump, smooth = (
        simulate(Scene.from_mapping(merge(base, {"mesh": {"extended_contact": on}})))
        for on in (False, True)
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


MACHINE = (
    "Gear measuring centre;Protokoll 17\r\nZähne;50\r\n\r\n"
    "Punkt;Durchmesser [mm];Abweichung (µm)\r\n"
    "1;143,0;-5,0\r\n2;146,0;-2,0\r\n3;150,0;0,0\r\n"
    "4;153,0;-3,0\r\n5;157,0;-6,0\r\nEnde;;\r\n"
)


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252", "utf-16", "utf-8-sig"])
def test_a_file_as_a_machine_writes_it(table, tmp_path, encoding):
    """Preamble, German names, semicolons, decimal commas, units in
    headers, a last line without numbers.
    """
    plain = scene(table, tmp_path)
    (tmp_path / "machine.csv").write_bytes(MACHINE.encode(encoding))
    initial = {"pinion": {"file": "machine.csv"}}
    found = Scene.from_mapping(static(table, wear={"initial": initial}), tmp_path)
    assert found == plain and found.id == plain.id


@pytest.mark.parametrize(
    "text",
    [
        "diameter\tdeviation\nmm\tum\n143\t-5\n146\t-2\n150\t0\n153\t-3\n157\t-6\n",
        "diameter_mm deviation_um\n143 -5\n146 -2\n150 0\n153 -3\n157 -6\n",
        "d / mm;f / µm\n143;-5\n146;-2\n150;0\n153;-3\n157;-6\n",
        '"diameter [mm]","deviation '
        '[mm]"\n143,-5e-3\n146,-2e-3\n150,0\n153,-3e-3\n157,-6e-3\n',
    ],
    ids=["a row of units", "blanks", "slashes", "quotes and millimetres"],
)
def test_other_ways_to_write_the_same(table, tmp_path, text):
    plain = scene(table, tmp_path)
    (tmp_path / "other.csv").write_text(text)
    found = Scene.from_mapping(
        static(table, wear={"initial": {"pinion": {"file": "other.csv"}}}), tmp_path
    )
    assert found.id == plain.id


def test_columns_by_their_own_names(table, tmp_path):
    text = CSV.replace("diameter,deviation", "A,B")
    with pytest.raises(
        SceneError, match=r'columns are A, B; .*columns = \{ diameter = "…" \}'
    ):
        scene(table, tmp_path, text)
    columns = {"diameter": "A", "deviation": "B"}
    assert scene(table, tmp_path, text, columns=columns).id == scene(table, tmp_path).id


@pytest.mark.parametrize("how", ["hold", "slope", "zero"])
def test_an_evaluated_range_shorter_than_the_flank_goes_on_as_it_is_told(how):
    from wearlab.wear.measured_profile import continued

    x = np.linspace(-2.0, 3.0, 51)
    y = 1.0 + 0.5 * np.linspace(-2.0, 3.0, 51)
    where, depth = continued(x, y, -4.0, 5.0, how)
    assert (where[0], where[-1]) == (-4.0, 5.0) and np.all(np.diff(where) >= 0.0)
    ends = {"hold": (0.0, 2.5), "slope": (-1.0, 3.5), "zero": (0.0, 0.0)}[how]
    assert (depth[0], depth[-1]) == pytest.approx(ends, abs=1e-12)
    np.testing.assert_array_equal(np.interp(x[1:-1], where, depth), y[1:-1])


def test_a_shorter_range_is_refused_unless_it_is_told(table, tmp_path):
    short = (
        "\n".join(
            line for line in CSV.splitlines() if not line.startswith(("143", "157"))
        )
        + "\n151,-1\n"
    )
    short = short.replace("150,0\n153,-3\n151,-1", "150,0\n151,-1\n153,-3")
    with pytest.raises(Exception, match="continuation = 'hold', 'slope' or 'zero'"):
        simulate(scene(table, tmp_path, short))
    run = simulate(scene(table, tmp_path, short + "154,-4\n", continuation="hold"))
    assert "continued by 'hold'" in str(run.validity.values)
