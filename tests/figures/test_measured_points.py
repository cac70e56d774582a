"""A measuring machine's file over a profile of wear, by the coordinates of the run."""

import measured_gear as gear
import numpy as np
import pytest

import wearlab as wl
from wearlab.campaign.campaign import with_figures
from wearlab.cli.app import status_of
from wearlab.figures import FigureError, plotting, question, single
from wearlab.figures.kind import read

PITCH_RADIUS = 0.5 * gear.MODULE * gear.TEETH
SCENE = {
    "gears": {
        "kind": "external-pair",
        "module": "3 mm",
        "pressure_angle": "20 deg",
        "face_width": "30 mm",
        "pinion": {
            "teeth": gear.TEETH,
            "tip_relief": {"amount": "6 um", "length": "2 mm"},
        },
        "gear": {"teeth": 40},
    },
    "operation": {"torque": "150 N*m", "speed": "900 rpm"},
    "mesh": {"stiffness": {"model": "potential-energy"}},
    "wear": {
        "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
        "until": {"depth": "1 um"},
    },
    "numerics": {"profile_points": 301},
}
ROLL = np.array(gear.roll_lengths()[1:-1])
DEVIATION = np.array([gear.deviation(roll) for roll in ROLL])
PINION = {"flank": "pinion", "update": 0}


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("measured") / "pinion.mka"
    path.write_text(gear.mka(), encoding="utf-8-sig")
    return path


@pytest.fixture(scope="module")
def run():
    return wl.simulate(wl.Scene.from_mapping(SCENE))


def points_of(run, published, **options):
    options = {"select": PINION, **options}
    spec = single.specified({"kind": "wear-profile", "published": published, **options})
    plot = plotting.plotted(single.grid_of(run), read(spec, 1, None))[0]
    assert "measured" in [entry.text for entry in plot.legend]
    return [
        curve
        for panel in plot.panels
        for curve in panel.curves
        if curve.style == "published"
    ]


def radius(roll):
    return np.hypot(gear.base_radius(), roll)


@pytest.mark.parametrize(
    ("x", "expected"),
    [
        ("diameter", 2.0 * radius(ROLL)),
        ("roll_angle", np.degrees(ROLL / gear.base_radius())),
        ("path_position", ROLL - PITCH_RADIUS * np.sin(np.radians(20.0))),
    ],
)
def test_a_machine_s_curve_stands_where_the_involute_has_it(run, file, x, expected):
    units = {x: "deg" if x == "roll_angle" else "mm", "flank_deviation": "um"}
    (points,) = points_of(
        run,
        {"file": file, "side": "right"},
        x=x,
        y="flank_deviation",
        units=units,
    )
    np.testing.assert_allclose(points.x, expected, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(points.y, DEVIATION, atol=2e-3)


@pytest.mark.parametrize("zero", ["max", "pitch", "root", "line"])
def test_depths_are_those_of_initial_wear_by_the_same_file(run, file, zero):
    """Modifications are taken off by what the run stores, there by the drawing."""
    description = {"file": str(file), "side": "right", "teeth": 9, "zero": zero}
    (points,) = points_of(run, description)
    initial = {"pinion": {**description, "continuation": "slope"}}
    scene = {**SCENE, "wear": {"initial": initial}}
    worn = wl.simulate(wl.Scene.from_mapping(scene)).sel(flank="pinion").isel(update=0)
    path = 1e3 * worn["path_position"].values
    inside = (points.x >= path[0]) & (points.x <= path[-1])
    assert inside.sum() > 15
    at_points = np.interp(points.x[inside], path, 1e6 * worn["wear_depth"].values)
    # what stands a little above its zero is no wear
    depth = np.maximum(points.y[inside], 0.0)
    np.testing.assert_allclose(depth, at_points, atol=0.02)


def test_a_table_of_the_same_description_gives_the_same_points(run, file, tmp_path):
    table = tmp_path / "pinion.csv"
    rows = [
        f"{2.0 * radius(roll)};{value}"
        for roll, value in zip(ROLL, DEVIATION, strict=True)
    ]
    table.write_text("\n".join(["d (mm);Abweichung (um)", *rows, ""]))
    columns = {"diameter": "d", "deviation": "Abweichung"}
    (points,) = points_of(run, {"file": table, "columns": columns})
    (by_machine,) = points_of(run, {"file": file, "side": "right"})
    np.testing.assert_allclose(points.x, by_machine.x, rtol=1e-9)
    np.testing.assert_allclose(points.y, by_machine.y, atol=2e-3)


def test_both_flanks_are_told_apart_by_name(run, file):
    of_pinion = {"file": file, "side": "right", "flank": "pinion"}
    both = {"select": {"update": 0}, "cols": "flank"}
    (points,) = points_of(run, of_pinion, **both)
    assert points.x.size == ROLL.size


@pytest.mark.parametrize(
    ("published", "options", "said"),
    [
        ({}, {}, "say which side: side = 'left' or side = 'right'"),
        ({"side": "right"}, {"select": {"update": 0}}, "which flank is it"),
        (
            {"side": "right", "flank": "sun"},
            {},
            "there is no flank 'sun' here.*flank = 'pinion'",
        ),
        ({"side": "right"}, {"y": "wear_rate"}, "stands over wear_depth or flank_dev"),
        (
            {"side": "right"},
            {"select": {"flank": "pinion"}, "cols": "update"},
            "choose it in select.update",
        ),
        ({"side": "right", "teeth": 5}, {}, "teeth with one: 1, 9, 17"),
    ],
)
def test_what_has_no_place_is_refused(run, file, published, options, said):
    with pytest.raises(FigureError, match=said):
        points_of(run, {"file": file, **published}, **options)


def test_a_bare_table_of_a_flank_is_answered_with_what_to_write(run, tmp_path):
    table = tmp_path / "pinion.csv"
    table.write_text("diameter (mm),deviation (um)\n" + "70,0\n72,-1\n75,-2\n")
    with pytest.raises(FigureError, match=r"written published = \{ file = … \}"):
        points_of(run, str(table))
    (points,) = points_of(run, {"file": table})
    assert points.y.size == 3


def test_the_bare_file_is_answered_with_what_to_write(run, file):
    with pytest.raises(FigureError, match=r"published = \{ file = …, side = 'left' \}"):
        points_of(run, str(file))


CAMPAIGN = """
title = "measured"
[[figure]]
kind = "wear-profile"
select = { flank = "pinion", update = 0 }
published = { file = "pinion.mka", side = "right", zero = "max" }
"""


def test_a_figure_and_a_store_keep_the_points_of_a_campaign(file, tmp_path):
    path = tmp_path / "study.toml"
    scene = """
[gears]
kind = "external-pair"
module = "3 mm"
pressure_angle = "20 deg"
face_width = "30 mm"
pinion = { teeth = 24 }
gear = { teeth = 40 }
[operation]
torque = "150 N*m"
speed = "900 rpm"
[mesh]
"""
    path.write_text(CAMPAIGN.replace("[[figure]]", scene + "[[figure]]"))
    (tmp_path / "pinion.mka").write_bytes(file.read_bytes())
    campaign = wl.load(path)
    assert not question.figure_problems(campaign)

    asked = question.question(campaign, campaign.figures[0], 1)
    assert asked.points is not None and asked.points.zero == "max"
    record = with_figures(campaign)
    assert record is not None
    assert record["figures"][0]["points"] == asked.points.record()
    assert asked.request.published == asked.points

    (tmp_path / "pinion.mka").unlink()
    (problem,) = question.figure_problems(campaign)
    assert "pinion.mka is not there" in problem


def test_a_table_with_decimal_commas_is_drawn(run, tmp_path):
    """It was written anew with points, and read with commas."""
    rows = zip(2e3 * radius(ROLL), -1e6 * DEVIATION, strict=True)
    text = "\n".join(f"{x:.6f};{y:.6f}".replace(".", ",") for x, y in rows)
    table = tmp_path / "german.csv"
    table.write_text(f"diameter [mm];depth [um]\n{text}\n")
    published = {"file": str(table), "flank": "pinion"}
    (curve,) = points_of(run, published, decimal=",", x="diameter")
    assert curve.x == pytest.approx(2e3 * radius(ROLL), rel=1e-6)


def test_flanks_of_planets_take_a_machine_s_curve(file):
    """Of either flank of a planet, without reliefs: what is missing from the zero."""
    gears = {
        "kind": "planetary",
        "module": "3 mm",
        "pressure_angle": "20 deg",
        "face_width": "30 mm",
        "planets": 4,
        "sun": {"teeth": 20},
        "planet": {"teeth": gear.TEETH},
        "ring": {"teeth": 20 + 2 * gear.TEETH, "rim_diameter": "280 mm"},
    }
    worn = wl.simulate(wl.Scene.from_mapping({**SCENE, "gears": gears}))
    for flank in ("planet-sun", "planet-ring"):
        published = {"file": file, "side": "right", "zero": "max"}
        select = {"flank": flank, "update": 0}
        units = {"diameter": "mm", "wear_depth": "um"}
        (curve,) = points_of(worn, published, select=select, x="diameter", units=units)
        base = PITCH_RADIUS * np.cos(np.radians(20.0))
        diameter = 2.0 * np.hypot(base, ROLL)
        inside = np.isin(np.round(diameter, 6), np.round(curve.x, 6))
        expected = (DEVIATION.max() - DEVIATION)[inside]
        assert inside.sum() > 20
        np.testing.assert_allclose(np.sort(curve.y), np.sort(expected), atol=0.02)


def test_a_file_of_twists_alone_is_listed_without_a_figure(tmp_path, capsys):
    head, rest = gear.mka().split("\nProfil:")
    twist = rest[rest.index("\nVersch") :].split("\nFlankenlinie:\n")[0]
    path = tmp_path / "twist.mka"
    path.write_text(head + "\nProfil:" + twist, encoding="utf-8-sig")
    figure = tmp_path / "a.png"
    assert status_of(["profile", str(path), "--out", str(figure)]) == 0
    assert "there is no profile or lead of a tooth" in capsys.readouterr().out
    assert not figure.exists()
