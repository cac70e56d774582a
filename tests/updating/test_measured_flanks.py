"""A flank that was measured once, by a machine's file or a table, as wear that is."""

import measured_gear as gear
import numpy as np
import pytest
from conftest import STATIC, WEIGHINGS
from scenes import external_pair

import wearlab as wl
from wearlab.assembly.sets import build_set
from wearlab.campaign.blocks import CampaignError
from wearlab.campaign.update import read_update
from wearlab.updating import UpdateError, measured_flanks, update
from wearlab.updating.calendar import DAYS_A_YEAR, Calendar
from wearlab.updating.cases import studies
from wearlab.updating.flank_depths import MAX_POINTS

UNKNOWN = {"wear.coefficient.factor": {"lognormal": {"median": 1.0, "cov": 1.0}}}
SCENE = {
    "gears": external_pair(24, 36, face_width="30 mm"),
    "operation": {"torque": "150 N*m", "speed": "900 rpm"},
    "mesh": {},
}
PITCH_ROLL = 0.5 * gear.MODULE * gear.TEETH * np.sin(np.radians(20.0))


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "pinion.mka"
    path.write_text(gear.mka(), encoding="utf-8-sig")
    return path


def block(file, **more):
    data = {
        "file": str(file),
        "quantity": "wear_depth",
        "flank": "pinion",
        "at": "5000 h",
        "side": "right",
        "continuation": "hold",
        "error": {"sd": "1 um"},
    } | more
    present = {key: value for key, value in data.items() if value is not None}
    return read_update({"unknown": UNKNOWN, "data": [present]}).data[0]


def seen(file, calendar=None, scene=SCENE, **more):
    scene = wl.Scene.from_mapping(scene)
    return measured_flanks.read_flank(block(file, **more), scene, calendar)


def test_a_machine_s_curve_is_wear_along_the_path(file):
    """By the formula that the file was made of, and by the involute."""
    found = seen(file)
    roll = 1e3 * found.place + PITCH_ROLL
    expected = [-gear.deviation(length) for length in roll]
    assert 1e6 * found.value == pytest.approx(expected, abs=0.01)
    assert found.value.max() > 5e-6 and len(found) == MAX_POINTS
    assert (found.clock, *set(found.time)) == ("hours", 5000 * 3600.0)
    assert found.data.place == "update.data[0]"


def test_one_tooth_stands_above_the_mean_and_a_zero_takes_it_out(file):
    mean = seen(file)
    ninth = seen(file, teeth=9)
    assert 1e6 * (ninth.value - mean.value) == pytest.approx(1.5, abs=0.01)
    zeroed = seen(file, teeth=9, zero="max")
    assert 1e6 * zeroed.value == pytest.approx(1e6 * mean.value, abs=0.01)


def test_it_was_then(file):
    by_cycles = seen(file, at=2e6)
    assert (by_cycles.clock, by_cycles.time[0]) == ("cycle", 2e6)
    calendar = Calendar(np.array([20_000.0]), np.array([0.0]), 3652.5)
    day = np.datetime64("1970-01-01") + np.timedelta64(20_100, "D")
    for written in (str(day), day.astype(object)):
        by_date = seen(file, calendar, at=written)
        hours = 100.0 * 3652.5 / DAYS_A_YEAR
        assert by_date.time[0] == pytest.approx(hours * 3600.0, rel=1e-9)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"side": None}, "say which side: side = 'left' or side = 'right'"),
        ({"continuation": None}, "or say how it goes on: continuation = 'hold'"),
        ({"at": "soon"}, "'soon' is no time: write cycles"),
        ({"at": "2026-02-28"}, "a date needs update.calendar"),
        ({"flank": "sun"}, "'sun' is not one of pinion, gear"),
        ({"teeth": 5}, "teeth with one: 1, 9, 17"),
    ],
)
def test_what_cannot_be_is_refused_with_its_place(file, more, said):
    with pytest.raises(UpdateError, match=rf"update\.data\[0\].*{said}"):
        seen(file, **more)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"at": None}, "a flank that was measured once: say when, such as at"),
        ({"at": None, "side": None, "continuation": None}, "the file is a flank"),
        ({"quantity": "max_wear_depth"}, "once: give quantity = 'wear_depth'"),
        ({"columns": {"cycle": "cycles"}}, "leave out columns, or at"),
    ],
)
def test_what_does_not_go_together_is_refused(file, more, said):
    with pytest.raises(CampaignError, match=said):
        block(file, **more)


HEAD = STATIC[: STATIC.index("[[update.data]]")]
DATA = """
[[update.data]]
file     = "{file}"
quantity = "wear_depth"
flank    = "pinion"
error    = {{ sd = "0.5 um" }}
"""


def factor(folder, name, more, store):
    (folder / name).write_text(HEAD + more)
    tree = update(wl.load(folder / name), store, progress=False)
    return tree["predictions"]["life_quantile"].values


def test_an_update_is_that_of_the_same_points_in_a_table(tmp_path, store):
    (tmp_path / "weighings.csv").write_text(WEIGHINGS)
    (tmp_path / "scene.toml").write_text(STATIC)
    scene = wl.load(tmp_path / "scene.toml").cases[0].scene
    run = wl.simulate(scene).sel(flank="pinion").isel(update=2)
    cycle = float(run["cycle"])
    place, first = np.unique(run["path_position"].values, return_index=True)
    some = np.round(np.linspace(0, len(place) - 1, 25)).astype(int)
    place, depth = place[some], run["wear_depth"].values[first][some]

    pairs = list(zip(place.tolist(), depth.tolist(), strict=True))
    flank = "".join(f"{s!r},{h!r}\n" for s, h in pairs)
    rows = "".join(f"{cycle!r},{s!r},{h!r}\n" for s, h in pairs)
    (tmp_path / "flank.csv").write_text(f"path_position [m],depth [m]\n{flank}")
    (tmp_path / "table.csv").write_text(f"cycle,path_position [m],h [m]\n{rows}")

    once = DATA.format(file="flank.csv") + f"at = {cycle!r}\n"
    columns = 'columns = { cycle = "cycle", path_position = "path_position", '
    table = DATA.format(file="table.csv") + columns + 'value = "h" }\n'
    by_flank = factor(tmp_path, "once.toml", once, store)
    by_table = factor(tmp_path, "table.toml", table, store)
    np.testing.assert_allclose(by_flank, by_table, rtol=1e-6)


OTHER_GEARS = """
[[case]]
label = "large"
[[case]]
label = "small"
"gears.module" = "2 mm"
"gears.pinion.tip_diameter"  = "104 mm"
"gears.pinion.root_diameter" = "94 mm"
"gears.gear.tip_diameter"    = "104 mm"
"gears.gear.root_diameter"   = "94 mm"
"""


def test_a_flank_is_read_by_the_gears_of_its_own_case(tmp_path):
    """It was read by those of the first case, though that was excluded: refused."""
    points = "".join(f"{d},{0.1 * (d - 97)}\n" for d in range(97, 104))
    (tmp_path / "flank.csv").write_text(f"diameter [mm],depth [um]\n{points}")
    more = 'at = 1e6\ncase = "small"\ncontinuation = "hold"\n'
    file = tmp_path / "two.toml"
    file.write_text(HEAD + DATA.format(file="flank.csv") + more + OTHER_GEARS)
    of_cases = studies(wl.load(file))
    assert [len(study.observations) for study in of_cases] == [0, 1]
    assert len(of_cases[1].observations[0]) > 0


FACED = {
    "gears": {
        **external_pair(
            {
                "teeth": 24,
                "lead_crowning": "8 um",
                "tip_relief": {"amount": "12 um", "length": "3 mm"},
            },
            36,
            face_width="30 mm",
        ),
        "helix_angle": "15 deg",
    },
    "operation": {"torque": "150 N*m", "speed": "900 rpm"},
    "mesh": {"misalignment": "10 um"},
}


def test_a_flank_with_a_width_is_less_what_was_taken_off_at_its_place(tmp_path):
    """A deviation made of a known depth, a tip relief and a crowned lead: at 12 mm from
    mid-face of 30 mm a crowning of 8 um takes 4 (12/30)² of it.
    """
    scene = wl.Scene.from_mapping(FACED)
    pair = build_set(scene).kinds[0].pair
    place = np.linspace(pair.path.A, pair.path.E, 41)
    depth = 2e-6 + 1e-4 * np.abs(place)
    from_tip = 1e3 * (pair.path.E - place)
    relief = 12e-6 * np.clip(1.0 - from_tip / 3.0, 0.0, None)
    lead = 8e-6 * 4.0 * (12.0 / 30.0) ** 2
    deviation = -(depth + relief + lead)
    rows = zip(place.tolist(), deviation.tolist(), strict=True)
    text = "".join(f"{s!r},{d!r}\n" for s, d in rows)
    (tmp_path / "flank.csv").write_text(f"path_position [m],deviation [m]\n{text}")

    select = {"face_position": "12 mm"}
    more = {"side": None, "continuation": "hold", "select": select}
    found = seen(tmp_path / "flank.csv", scene=FACED, **more)
    expected = np.interp(found.place, place, depth)
    np.testing.assert_allclose(found.value, expected, atol=1e-9)
    with pytest.raises(UpdateError, match=r"select\.face_position: required"):
        seen(tmp_path / "flank.csv", scene=FACED, **more | {"select": None})


FLEET_HEAD = HEAD.replace('discrepancy = "none"\n', "")
OF_UNIT = """
[[update.data]]
file     = "{file}"
quantity = "wear_depth"
flank    = "pinion"
error    = {{ sd = "0.5 um" }}
unit     = "{unit}"
at       = {cycle!r}
"""
OF_ALL = """
[[update.data]]
file     = "all.csv"
quantity = "wear_depth"
flank    = "pinion"
error    = { sd = "0.5 um" }
columns  = { unit = "box", cycle = "cycle", path_position = "s", value = "h" }
units    = { s = "m", h = "m" }
"""
NEVER_MEASURED = """
[[update.unit]]
name = "D"
"""


def flanks_of_a_fleet(folder):
    """Write three units' flanks, of which B wears twice as fast, and one table."""
    (folder / "weighings.csv").write_text(WEIGHINGS)
    (folder / "scene.toml").write_text(STATIC)
    scene = wl.load(folder / "scene.toml").cases[0].scene
    run = wl.simulate(scene).sel(flank="pinion")
    place, first = np.unique(run["path_position"].values, return_index=True)
    some = np.round(np.linspace(0, len(place) - 1, 9)).astype(int)
    place = place[some]
    blocks = []
    rows = []
    for unit, state, pace in (("A", 1, 1.0), ("A", 2, 1.0), ("B", 3, 2.0), ("C", 2, 1)):
        cycle = float(run["cycle"][state]) / pace
        depth = run["wear_depth"].values[state][first][some]
        pairs = list(zip(place.tolist(), depth.tolist(), strict=True))
        name = f"{unit}{state}.csv"
        text = "".join(f"{s!r},{h!r}\n" for s, h in pairs)
        (folder / name).write_text(f"path_position [m],depth [m]\n{text}")
        blocks.append(OF_UNIT.format(file=name, unit=unit, cycle=cycle))
        rows += [f"{unit},{cycle!r},{s!r},{h!r}\n" for s, h in pairs]
    (folder / "all.csv").write_text("box,cycle,s,h\n" + "".join(rows))
    return "".join(blocks)


def test_flanks_of_a_fleet_count_as_the_same_points_in_a_table(tmp_path, store):
    """Units of which a block tells nothing, and one never measured, are among them."""
    blocks = flanks_of_a_fleet(tmp_path)
    (tmp_path / "flanks.toml").write_text(FLEET_HEAD + blocks + NEVER_MEASURED)
    (tmp_path / "table.toml").write_text(FLEET_HEAD + OF_ALL + NEVER_MEASURED)
    by_flanks = update(wl.load(tmp_path / "flanks.toml"), store, progress=False)
    by_table = update(wl.load(tmp_path / "table.toml"), store, progress=False)
    units = by_flanks["predictions"]["unit"].values.tolist()
    assert units == by_table["predictions"]["unit"].values.tolist() == [*"ABCD"]
    name = "life_quantile"
    lives = by_flanks["predictions"][name].values
    expected = by_table["predictions"][name].values
    np.testing.assert_allclose(lives, expected, rtol=1e-3)
    pace = by_flanks["predictions"]["pace"].values
    assert pace[1] / pace[0] == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({}, r"update\.data\[0\]\.unit: required of a fleet: whose flank was measured"),
        ({"unit": "A", "at": None, "columns": {"unit": "box"}}, "unit belongs to a"),
    ],
)
def test_a_flank_of_a_fleet_names_its_unit(tmp_path, more, said):
    data = {
        "file": "flank.csv",
        "quantity": "wear_depth",
        "flank": "pinion",
        "at": 1e6,
        "error": {"sd": "1 um"},
    } | more
    present = {key: value for key, value in data.items() if value is not None}
    table = {"unknown": UNKNOWN, "data": [present], "unit": [{"name": "A"}]}
    with pytest.raises(CampaignError, match=said):
        read_update(table)
