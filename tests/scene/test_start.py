"""``[start]``: what it accepts, what it makes of a campaign's case, and that it is part
of the identity.
"""

import pickle

import pytest
from scenes import SPUR_50_50

import wearlab as wl
from wearlab.campaign.blocks import CampaignError
from wearlab.scene import Scene, SceneError
from wearlab.scene.start import StartWear, is_replaced

PARENT = "0123456789abcdef0123"
WEAR = StartWear(
    1e7, 0.0, {"pinion": "right"}, {"pinion": (0.0, 1.0)}, {"pinion": (0.0, 1e-6)}
)


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    file = tmp_path_factory.mktemp("start") / "a.toml"
    file.write_text(
        f'extends = "{SPUR_50_50.as_posix()}"\n[start]\nrun = "{PARENT}"\ncycle = 1e7\n'
    )
    return wl.load(file).cases[0].scene


def test_run_cycle_and_replaced_members_are_the_identity(scene):
    ids = {scene.id}
    for key, value in (
        ("start.run", PARENT[::-1]),
        ("start.cycle", 2e7),
        ("start.life_fraction", 0.5),
        ("start.replace", ["gear"]),
        ("start", None),
    ):
        ids.add(scene.replace(key, value).id)
    assert len(ids) == 6
    assert Scene.from_canonical(scene.canonical()).id == scene.id


def test_the_wear_travels_and_is_no_part_of_the_identity(scene):
    ready = scene.with_start_wear(WEAR)
    there = pickle.loads(pickle.dumps(ready))
    assert (
        there.start_wear == WEAR and there.id == ready.id == scene.id and there == scene
    )
    assert scene.start_wear is None


@pytest.mark.parametrize(
    "key, value, message",
    [
        ("start.run", "../../evil", "no full id"),
        ("start.run", PARENT[:8], "no full id"),
        ("start.cycle", -1, "must be at least 0"),
        ("start.life_fraction", 1.5, "must be at most 1"),
        ("start.replace", ["pinon"], "no member with teeth; there are pinion, gear"),
        ("start", {"cycle": 1e7}, "give 'run', or 'campaign'"),
        ("start", {"run": PARENT, "cycle": 1, "life_fraction": 0.1}, "not both"),
        ("wear.initial.pinion", {"depth": "1 um", "shape": "uniform"}, "leave one out"),
    ],
)
def test_what_is_refused(scene, key, value, message):
    base = scene.replace("start", None) if key == "start" else scene
    with pytest.raises(SceneError, match=message):
        base.replace(key, value)


def write(folder, name, text):
    (folder / name).write_text(text)
    return folder / name


def test_a_case_of_a_campaign_is_a_run(tmp_path):
    parent = write(
        tmp_path,
        "parent.toml",
        f'extends = "{SPUR_50_50.as_posix()}"\n[[sweep]]\n'
        '"operation.speed" = ["800 rpm", '
        '"1100 rpm"]\n',
    )
    child = write(
        tmp_path,
        "child.toml",
        f'extends = "{SPUR_50_50.as_posix()}"\n'
        'start = { campaign = "parent.toml", select = { speed = 1100 }, cycle = 1e7 '
        "}\n",
    )
    assert wl.load(child).cases[0].scene.start.run == wl.load(parent).cases[1].id
    for select, message in (
        ("{ speed = 900 }", "not on the axis; there are 800, 1100 rpm"),
        ("{ torque = 1 }", "no axis"),
        ("{ }", "means 2 runs"),
    ):
        text = child.read_text().replace("{ speed = 1100 }", select)
        with pytest.raises(CampaignError, match=message):
            wl.load(write(tmp_path, "bad.toml", text))


def test_campaigns_that_continue_each_other(tmp_path):
    for name, other in (("a", "b"), ("b", "a")):
        write(
            tmp_path,
            f"{name}.toml",
            f'extends = "{SPUR_50_50.as_posix()}"\n'
            f'start = {{ campaign = "{other}.toml" }}\n',
        )
    with pytest.raises(CampaignError, match="in a circle"):
        wl.load(tmp_path / "a.toml")


def test_which_flanks_a_member_has():
    assert is_replaced("planet-ring", ("planet",)) and is_replaced(
        "planet-sun", ("planet",)
    )
    assert is_replaced("ring", ("ring",)) and not is_replaced("planet-ring", ("ring",))


@pytest.mark.parametrize(
    "told", ['"1100 rpm"', '"115.191730632 rad/s"', '"1100 1/min"', "1100.0"]
)
def test_select_understands_quantities(tmp_path, told):
    parent = write(
        tmp_path,
        "parent.toml",
        f'extends = "{SPUR_50_50.as_posix()}"\n[[sweep]]\n'
        '"operation.speed" = ["800 rpm", '
        '"1100 rpm"]\n',
    )
    child = write(
        tmp_path,
        "child.toml",
        f'extends = "{SPUR_50_50.as_posix()}"\n'
        f'start = {{ campaign = "parent.toml", select = {{ speed = {told} }}, cycle = '
        f"1e7 }}\n",
    )
    assert wl.load(child).cases[0].scene.start.run == wl.load(parent).cases[1].id
