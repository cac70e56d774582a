"""Which code a run used: a run is stale only when that has changed."""

import shutil
import sys

import pytest
from scenes import external_pair

import wearlab as wl
from wearlab import sources

PAIR = {
    "gears": external_pair(20, 30),
    "operation": {"torque": "50 N*m", "speed": "1100 rpm"},
    "wear": {
        "load": "static",
        "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
        "until": {"cycles": 1e6},
    },
}


@pytest.fixture
def changed(tmp_path, monkeypatch):
    """Return a function: which hashes move when a file of the package is edited."""
    copy = tmp_path / "wearlab"
    shutil.copytree(sources.PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(sources, "PACKAGE", copy)
    hashes = {
        "still": lambda: sources.used_hash.__wrapped__(False),
        "moving": lambda: sources.used_hash.__wrapped__(True),
    }

    def edit(name):
        before = {key: found() for key, found in hashes.items()}
        with (copy / name).open("a") as file:
            file.write("\n# a change\n")
        return {key for key, found in hashes.items() if found() != before[key]}

    return edit


def test_a_change_touches_the_runs_that_used_the_file(changed):
    assert (
        changed("mesh/contact.py")
        == changed("life/integrate.py")
        == {"still", "moving"}
    )
    assert changed("dynamics/periodic.py") == {"moving"}
    for after in (
        "cli/app.py",
        "figures/render.py",
        "store/store.py",
        "report/page.py",
        "__init__.py",
    ):
        assert changed(after) == set()


def test_every_room_is_either_used_or_comes_after():
    rooms = {
        file.relative_to(sources.PACKAGE).parts[0]
        for file in sources.PACKAGE.rglob("*.py")
    }
    assert sources.AFTER <= rooms and sources.DYNAMICS in rooms


def test_a_run_without_dynamics_calls_nothing_of_it():
    """The hash of such a run leaves the room out: not one function of
    it may be called.
    """
    scene = wl.load(PAIR).cases[0].scene
    wl.simulate(scene)  # what is imported or compiled on the way is
    called = set()

    def watch(frame, event, argument):
        if event == "call" and frame.f_code.co_name != "<module>":
            called.add(frame.f_code.co_filename)

    sys.setprofile(watch)
    try:
        run = wl.simulate(scene)
    finally:
        sys.setprofile(None)
    ours = {name for name in called if str(sources.PACKAGE) in name}
    assert any("/mesh/" in name for name in ours)
    assert not [
        name
        for name in ours
        for room in (sources.DYNAMICS, *sources.AFTER)
        if f"/wearlab/{room}/" in name
    ]
    assert (
        run.attrs["source_hash"] == sources.used_hash(False) != sources.used_hash(True)
    )
    assert not sources.is_other_code(
        run.attrs["source_hash"]
    ) and sources.is_other_code("feed")
    assert not sources.is_other_code("") and not sources.is_other_code(None)
