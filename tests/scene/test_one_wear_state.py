"""A scene whose flanks wear and nobody says until when: one wear
state, told with the remedy.
"""

import math

import pytest
from scenes import external_pair

import wearlab as wl
from wearlab.assembly.sets import build_set
from wearlab.assembly.wear_checks import check_initial_wear, check_limits
from wearlab.cli import app
from wearlab.gears.specification import GearError
from wearlab.scene import Scene, parts_left_out, parts_present

SCENE = {
    "title": "one state",
    "gears": external_pair(20, 30),
    "operation": {"torque": "100 N*m", "speed": "1000 rpm"},
    "wear": {"coefficient": {"model": "constant", "value": "1e-18 m^2/N"}},
}
SAID = "no cycles pass; for a life give wear.until, such as until = { hours = 20000 }"


def scene(**wear):
    found = {key: SCENE[key] for key in ("gears", "operation")}
    return Scene.from_mapping(found | ({"wear": SCENE["wear"] | wear} if wear else {}))


def test_a_scene_with_an_end_has_a_life_and_one_without_wear_says_nothing():
    ended = scene(until={"hours": 20000})
    assert "life: adaptive" in parts_present(ended)
    for other in (ended, scene()):
        assert not any(
            "one wear state" in part
            for part in parts_present(other) + parts_left_out(other)
        )


def test_initial_wear_by_the_law_is_no_deeper_than_the_tooth_is_thick():
    for flank, most in (("pinion", "4.9 mm"), ("gear", "5.1 mm")):
        deep = scene(initial={flank: {"depth": "8 mm"}})
        with pytest.raises(
            GearError,
            match=rf"wear.initial.{flank}: wear of 8 mm is deeper than the tooth",
        ):
            check_initial_wear(deep, build_set(deep))
        check_initial_wear(
            deep.replace(f"wear.initial.{flank}.depth", most), build_set(deep)
        )


@pytest.mark.parametrize("flank", [{}, {"flank": "gear"}])
def test_a_depth_to_be_reached_is_less_than_a_tooth_is_thick(flank, tmp_path, capsys):
    """More than 10 mm is no wear depth at all.

    Teeth are thicker than on the reference circle, pi m / 2.
    """
    for place, deep in (("until", "8 mm"), ("snapshots", ["1 mm", "8 mm"])):
        asked = {"until": {"hours": 10}} | {place: {"depth": deep, **flank}}
        with pytest.raises(
            GearError, match=rf"wear.{place}.depth: 8 mm is deeper than .* is thick"
        ) as raised:
            check_limits(scene(**asked), build_set(scene()))
        thick = float(str(raised.value).partition("thick, ")[2].partition(" mm")[0])
        assert math.pi * 3 / 2 < thick < 3 * math.pi
        asked[place] = {
            "depth": "4.7 mm" if place == "until" else ["1 mm", "4.7 mm"],
            **flank,
        }
        check_limits(scene(**asked), build_set(scene()))
    written = tmp_path / "deep.toml"
    written.write_text(
        'title = "deep"\ngears = { kind = "external-pair", module = "3 mm", '
        'face_width = "20 mm", '
        "pinion = { teeth = 20 }, gear = { teeth = 30 } }\n"
        'operation = { torque = "9 N*m", speed = "9 rpm" }\n'
        'wear = { coefficient = { model = "constant", value = "1e-18 m^2/N" }, until '
        '= { depth = "8 mm" } }\n'
    )
    for command in (["check"], ["run", "--store", str(tmp_path / "store")]):
        assert app.status_of([*command, str(written)]) == 2
        said = capsys.readouterr().err
        assert "wear.until.depth: 8 mm is deeper than any tooth is thick" in said
    assert not (tmp_path / "store").exists()


def test_check_and_show_say_it_with_the_remedy(tmp_path, capsys):
    report = wl.run(SCENE, tmp_path / "store")
    run = report.to_xarray().run_id.item()
    capsys.readouterr()
    assert app.status_of(["show", str(run), "--store", str(tmp_path / "store")]) == 0
    assert f"wear states     one: {SAID}" in capsys.readouterr().out


def test_what_a_static_run_cannot_have_is_told_with_what_it_takes(tmp_path, capsys):
    """Was a list of all that is there, and in ls a column that was
    silently left out.
    """
    report = wl.run(SCENE, tmp_path / "store")
    with pytest.raises(
        wl.FigureError,
        match=r"'mesh_acceleration_orders' is not there; it takes \[dynamics\]",
    ):
        wl.figure(report.to_xarray(), "line", y="mesh_acceleration_orders")
    capsys.readouterr()
    asked = [
        "ls",
        "--columns",
        "max_wear_depth,dynamic_factor",
        "--store",
        str(tmp_path / "store"),
    ]
    assert app.status_of(asked) == 0
    shown = capsys.readouterr()
    assert "max_wear_depth" in shown.out and "dynamic_factor" not in shown.out
    assert (
        shown.err.strip()
        == "none of these runs has dynamic_factor: it takes [dynamics]"
    )
    # a statistic that no run has went without a word
    asked[2] = "max_wear_depth,wear_depth_min"
    assert app.status_of(asked) == 0
    said = capsys.readouterr().err
    assert "none of these runs has wear_depth_min: few variables have _min" in said
