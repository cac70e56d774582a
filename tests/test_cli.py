"""The command line as users meet it: exit statuses, one message, nothing written where
it should not be.
"""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import fake_campaign
import made_up
import pytest
from fake_campaign import alter, sweep
from scenes import CAMPAIGNS

import wearlab
from wearlab.cli import app, output
from wearlab.cli.commands import plan
from wearlab.runner import Interrupted
from wearlab.store import Store

SPEEDS = CAMPAIGNS / "spur_speeds.toml"


class Result:
    def __init__(self, status, captured):
        self.status = status
        self.out = captured.out
        self.err = captured.err


@pytest.fixture
def command(capsys, tmp_path, monkeypatch):
    """Return a function that runs a command in an empty folder and
    tells status and output.
    """
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("WEARLAB_STORE", raising=False)

    def run(*words):
        status = app.status_of([str(word) for word in words])
        return Result(status, capsys.readouterr())

    return run


@pytest.fixture
def campaign(monkeypatch):
    """Let every FILE be a fake campaign, which cases of this process compute.

    Return how to set it.
    """
    current = {"campaign": sweep(3)}
    monkeypatch.setattr(output, "read_campaign", lambda file: current["campaign"])
    monkeypatch.setattr(plan, "refuse_the_impossible", lambda campaign: None)
    original = wearlab.runner.run

    def run(*arguments, **options):
        options |= {"workers": 0, "simulate": fake_campaign.SIMULATE}
        return original(*arguments, **options)

    monkeypatch.setattr("wearlab.runner.run", run)

    def use(made):
        current["campaign"] = made

    return use


def files(folder):
    return sorted(path.name for path in Path(folder).iterdir())


def test_run_then_ls_then_verify(command, campaign):
    done = command("run", "any.toml")
    assert (done.status, done.err) == (0, "")
    assert done.out.startswith("3 of 3 done; 3 computed in ")
    assert command("run", "any.toml").out.startswith("3 of 3 done; 0 computed")
    listed = command("ls")
    assert listed.status == 0
    row = next(line for line in listed.out.splitlines() if "speed=900 rpm" in line)
    assert row.split()[0] == sweep(3).cases[1].id[:10]
    for word in ("five speeds", "base", "done", "1.111e+05 cycles"):
        assert word in row
    verified = command("verify")
    assert (verified.status, verified.out) == (0, "3 runs compared, 0 problems\n")


def test_trouble_is_named_and_gives_status_one(command, campaign):
    campaign(
        alter(alter(alter(sweep(4), 0, act="fail"), 1, act="refuse"), 2, act="warn")
    )
    done = command("run", "any.toml")
    assert done.status == 1
    assert done.out.startswith("2 of 4 done, 1 failed, 1 refused; 4 tried in ")
    failed, refused, warned = sorted(done.err.splitlines())
    assert failed.startswith("failed: base (speed=800 rpm), run ")
    assert failed.endswith("FloatingPointError: the shooting did not converge")
    assert "contact ratio 0.93 is below one" in refused
    assert warned.endswith("RuntimeWarning: the film is thin")
    assert command("run", "any.toml").status == 1
    notes = {row["state"]: row for row in json.loads(command("ls", "--json").out)}
    assert "Traceback" in notes["failed"]["reason"]
    assert [
        r["state"]
        for r in json.loads(command("ls", "--json", "--state", "refused").out)
    ] == ["refused"]


@pytest.mark.parametrize("name", ["status", "state"])
def test_a_run_whose_process_died_is_interrupted_in_every_table(
    command, campaign, name
):
    command("run", "any.toml")
    store = Store("wearlab-store")
    with store.archive.presence() as dead:
        store.archive.claim(["c" * 32], dead.token, lambda entry: False)
    listed = command("ls", "--columns", name)
    states = [line.split()[1] for line in listed.out.splitlines()[-4:]]
    assert sorted(states) == ["done", "done", "done", "interrupted"]


def test_the_store_is_where_it_is_said(command, campaign, tmp_path, monkeypatch):
    command("run", "any.toml")
    command("run", "any.toml", "--store", "here")
    monkeypatch.setenv("WEARLAB_STORE", "there")
    command("run", "any.toml")
    assert files(tmp_path) == ["here", "there", "wearlab-store"]


def test_show(command, campaign):
    command("run", "any.toml")
    case = sweep(3).cases[0]
    shown = command("show", case.id[:6])
    assert shown.status == 0
    for words in (case.id, "completed", "five speeds (base)", "speed = 800.0"):
        assert words in shown.out
    assert any(
        line.split()[:2] == ["wear", "wear_depth,"] for line in shown.out.splitlines()
    )
    described = command("show", case.id[:6], "--variables").out.splitlines()
    line = next(line for line in described if line.startswith("wear_depth"))
    assert "update 3, flank 2, profile 4" in line
    assert line.split()[-1] == "m"
    content = json.loads(command("show", case.id, "--json").out)
    assert content["scene"]["speed"] == 800.0
    assert content["variables"]["wear_depth"]["attrs"]["units"] == "m"
    assert content["summary"]["life"] == 1e8 / 800


def test_show_names_what_each_of_several_numbers_is_of(command, tmp_path):
    """Safeties of a pair, and the transmission error unworn and worn, are told."""
    store = Store(tmp_path / "wearlab-store")
    store.archive.create()
    data = made_up.run(1.0)
    data["iso_pitting_safety"] = ("flank", [1.2824, 1.3275], {"units": "1"})
    data["ste_peak_to_peak"].values[:] = [[4e-6], [5e-6], [3e-6]]
    made_up.put(store, "a" * 20, data)
    text = command("show", "a" * 20).out
    lines = {line.split()[0]: line.split() for line in text.splitlines() if line}
    assert lines["iso_pitting_safety[flank='pinion']"][1] == "1.2824"
    assert lines["iso_pitting_safety[flank='gear']"][1] == "1.3275"
    assert lines["ste_peak_to_peak[update=0]"][1:3] == ["4", "um"]
    assert lines["ste_peak_to_peak[update=0]"][-1] == "unworn"
    assert lines["ste_peak_to_peak[update=-1]"][1:3] == ["3", "um"]
    content = json.loads(command("show", "a" * 20, "--json").out)
    assert content["key_results"]["iso_pitting_safety[flank='pinion']"] == 1.2824

    # these names are columns
    columns = ",".join(content["key_results"])
    row = command("ls", "--columns", columns).out.splitlines()[-1].split()
    assert row[2:4] == ["1.2824", "1.3275"]
    assert [value for value in row if value in ("3", "4")] == ["4", "3"]


def test_a_bare_comparison_asks_every_flank(command, tmp_path):
    """Of two safeties the larger was compared: a search for unsafe pairs found none."""
    store = Store(tmp_path / "wearlab-store")
    store.archive.create()
    data = made_up.run(1.0)
    for name, safeties in (("a" * 20, [1.2824, 1.3275]), ("b" * 20, [1.4, 1.5])):
        attributes = {"units": "1"}
        rated = data.assign(iso_pitting_safety=("flank", safeties, attributes))
        made_up.put(store, name, rated)
    unsafe = command(
        "ls", "--where", "iso_pitting_safety < 1.3", "--columns", "seconds"
    )
    assert "aaaaaaaa" in unsafe.out and "bbbbbbbb" not in unsafe.out
    assert "iso_pitting_safety has several values in a run: any of them" in unsafe.err
    safe = command("ls", "--where", "min(iso_pitting_safety) > 1.3")
    assert "bbbbbbbb" in safe.out and "aaaaaaaa" not in safe.out
    assert safe.err == ""


def test_show_keeps_long_texts_out_of_the_table(command, tmp_path):
    flags = [f"sun: something of it is assumed, number {number}" for number in range(9)]
    scene = {
        "operation": {
            "duty": [{"share": 0.2, "torque": 150.0}, {"share": 0.8, "torque": 90.0}],
            "speed": 115.191730632,
        },
        "wear": {"snapshots": {"depth": [5e-6, 1e-5]}},
        "mesh": {"stiffness": {"abscissa": [number / 500 for number in range(500)]}},
    }
    store = Store(tmp_path / "wearlab-store")
    store.archive.create()
    data = made_up.run(1.0).assign(
        validity=((), "\n".join(flags)), verdict=((), "completed")
    )
    made_up.put(store, "a" * 20, data, json.dumps(scene))
    lines = command("show", "a" * 20).out.splitlines()
    assert max(map(len, lines)) < 180
    first = lines.index("validity") + 1
    assert lines[first : first + 9] == [f"  {flag}" for flag in flags]
    assert (
        "  operation.duty[1].torque = 90 N*m" in lines
    )  # as files write it; --json has SI
    assert "  operation.speed = 1100 rpm" in lines
    assert "  wear.snapshots.depth = [5 um, 10 um]" in lines
    assert "  mesh.stiffness.abscissa = [0.0, 0.002, 0.004, … 500 in all]" in lines


def test_show_a_failure_with_its_traceback(command, campaign):
    campaign(alter(sweep(1), 0, act="fail"))
    command("run", "any.toml")
    shown = command("show", alter(sweep(1), 0, act="fail").cases[0].id)
    assert shown.status == 0
    assert "Traceback" in shown.out
    assert "the shooting did not converge" in shown.out


def test_verify_names_damage(command, campaign, tmp_path):
    command("run", "any.toml")
    run = next((tmp_path / "wearlab-store" / "runs").rglob("*.nc"))
    run.write_bytes(run.read_bytes()[:-1])
    verified = command("verify")
    assert verified.status == 1
    assert f"truncated  wearlab-store/runs/{run.parent.name}/{run.name}" in verified.out
    assert [
        problem["kind"] for problem in json.loads(command("verify", "--json").out)
    ] == ["truncated"]
    assert "lost" in command("ls").out


def test_json_of_a_run(command, campaign):
    report = json.loads(command("run", "any.toml", "--json").out)
    assert (report["total"], report["done"], report["computed"]) == (3, 3, 3)


def test_ls_tells_runs_of_other_code(command, campaign):
    command("run", "any.toml")
    assert (
        "made by other code" in command("ls").out
    )  # the fake's hash is no hash of these sources


def test_an_interrupt_says_how_to_go_on(command, campaign, monkeypatch):
    def interrupted(*_, **__):
        raise Interrupted("interrupted: 1 done, 2 to go; run again to continue")

    monkeypatch.setattr("wearlab.runner.run", interrupted)
    done = command("run", "any.toml")
    assert (done.status, done.out) == (130, "")
    assert done.err == "wearlab: interrupted: 1 done, 2 to go; run again to continue\n"


def test_figures_are_drawn_and_named(command, campaign, monkeypatch):
    drawn = []

    def draw(campaign, store, out, ending, paper):
        drawn.append((campaign.title, str(store.path), out, ending))
        return [out / "01-tvms.png"]

    monkeypatch.setattr("wearlab.figures.draw", draw, raising=False)
    done = command("figures", "any.toml", "--out", "drawn")
    assert (done.status, done.out) == (0, "drawn/01-tvms.png\n")
    assert drawn == [("five speeds", "wearlab-store", Path("drawn"), "png")]


def test_a_figure_that_cannot_be_drawn_does_not_stop_the_others(
    command, campaign, monkeypatch
):
    from wearlab.figures import FigureError

    def draw(campaign, store, out, ending, paper):
        raise FigureError("figure 2: no such variable", (out / "01-tvms.png",))

    monkeypatch.setattr("wearlab.figures.draw", draw, raising=False)
    done = command("figures", "any.toml")
    assert (done.status, done.out, done.err) == (
        1,
        "figures/01-tvms.png\n",
        "figure 2: no such variable\n",
    )


def test_a_figure_drawn_again_says_what_became_of_its_runs(command, monkeypatch):
    from wearlab.figures.drawing import Redrawn

    again = Redrawn(Path("figures/01.png"), False, ("base: failed",), (), ("a" * 10,))
    monkeypatch.setattr("wearlab.figures.drawing.redraw", lambda *asked: again)
    done = command("figures", "--from", "01.png", "--json")
    told = {
        "path": "figures/01.png",
        "same": False,
        "missing": ["base: failed"],
        "stale": [],
    }
    assert json.loads(done.out) == [told | {"changed": ["a" * 10]}]
    done = command("figures", "--from", "01.png")
    assert (done.status, done.out) == (
        1,
        "figures/01.png: differs from the figure it was drawn from\n",
    )
    assert done.err.splitlines()[0] == "missing: base: failed"


def test_figures_without_a_store(command, campaign, tmp_path):
    done = command("figures", "any.toml")
    assert (done.status, done.err) == (
        2,
        "wearlab: wearlab-store: there is no store here\n",
    )
    assert files(tmp_path) == []


def test_modes_of_a_case(command, campaign, monkeypatch):
    campaign(sweep(2, static=True))
    rows = [{"mode": 1, "natural frequency [Hz]": 3100.123456}]
    monkeypatch.setattr(
        "wearlab.simulation.modes_table", lambda scene: rows, raising=False
    )
    assert "3100.1" in command("modes", "any.toml").out
    assert json.loads(command("modes", "any.toml", "--json").out) == rows
    wrong = command("modes", "any.toml", "--case", "nothing")
    assert (wrong.status, wrong.err) == (
        2,
        "wearlab: --case nothing: there are base, static\n",
    )


def test_check_shows_parts_and_cases(command, tmp_path):
    checked = command("check", SPEEDS)
    assert (checked.status, checked.err) == (0, "")
    for words in (
        "6 cases, 6 runs",
        "speed: 800, 1100, 1860, 2200, 3720 rpm",
        "+ dynamics: spur-3dof",
        "left out: ",
        "working centre distance",
        "transverse contact ratio",
        "form diameter at the root",
    ):
        assert words in checked.out
    assert (
        checked.out.count("working centre distance") == 1
    )  # the static case has the same gears
    content = json.loads(command("check", SPEEDS, "--json").out)
    assert content["runs"] == 6
    assert "dynamics" in content["parts"]["static"]["left_out"]
    assert content["refused"] == []
    assert ["a_w", "working centre distance", "150", "", "mm"] in content["gears"][
        "base"
    ]
    assert files(tmp_path) == []


def test_check_names_impossible_cases(command, tmp_path):
    file = tmp_path / "bad.toml"
    file.write_text(
        f'extends = "{SPEEDS}"\n[[case]]\nlabel = "short '
        'teeth"\n"gears.pinion.tip_diameter" = "147 mm"\n'
    )
    checked = command("check", file)
    assert checked.status == 1
    assert "refused: short teeth: " in checked.err


WRONG = {
    "no such file": None,
    "no TOML": "title = ",
    "unknown key": "[gears]\nmodul = 3",
    "negative torque": f'extends = "{SPEEDS}"\n[operation]\ntorque = "-340 N*m"',
    "wrong unit": f'extends = "{SPEEDS}"\n[operation]\ntorque = "340 rpm"',
    "no number": f'extends = "{SPEEDS}"\n[numerics]\ntolerance = nan',
    "empty sweep": f'extends = "{SPEEDS}"\n[[sweep]]\n"operation.speed" = []',
}


@pytest.mark.parametrize("verb", ["check", "run", "figures", "modes"])
@pytest.mark.parametrize("fault", WRONG)
def test_a_bad_file_gives_one_message_and_writes_nothing(
    command, tmp_path, fault, verb
):
    text = WRONG[fault]
    if text is not None:
        (tmp_path / "bad.toml").write_text(text)
    done = command(verb, "bad.toml")
    assert (done.status, done.out) == (2, "")
    assert done.err.startswith("wearlab: ")
    assert "bad.toml" in done.err
    assert "Traceback" not in done.err
    assert files(tmp_path) == ([] if text is None else ["bad.toml"])


@pytest.mark.parametrize(
    "words, message",
    [
        (["--nonsense"], "No such option: --nonsense"),
        (["lst"], "No such command 'lst'"),
        (["run"], "Missing argument 'FILE'"),
        (["run", "a.toml", "--worker", "2"], "No such option: --worker"),
        (["run", "a.toml", "--workers", "0"], "Invalid value for '--workers'"),
        (["run", "a.toml", "--workers", "two"], "Invalid value for '--workers'"),
        (["ls", "extra"], "unexpected extra argument"),
        (["ls"], "wearlab-store: there is no store here"),
        (["show", "abc"], "wearlab-store: there is no store here"),
        (["verify", "--store", "nowhere"], "nowhere: there is no store here"),
    ],
)
def test_a_bad_argument_gives_one_message(command, tmp_path, words, message):
    done = command(*words)
    assert (done.status, done.out) == (2, "")
    assert message in done.err
    assert len(done.err.splitlines()) == 1
    assert files(tmp_path) == []


def test_an_unwritable_store(command, campaign, tmp_path):
    (tmp_path / "file").write_text("mine")
    done = command("run", "any.toml", "--store", "file/store")
    assert (done.status, done.out) == (2, "")
    assert done.err.startswith("wearlab: file/store: no store can be made here")
    assert files(tmp_path) == ["file"]


def test_an_unreadable_store(command, campaign, tmp_path):
    (tmp_path / "wearlab-store").mkdir()
    (tmp_path / "wearlab-store" / "catalogue.sqlite").write_bytes(b"no database" * 100)
    for words in (
        ["ls"],
        ["run", "any.toml"],
        ["verify"],
        ["show", "a"],
        ["figures", "any.toml"],
    ):
        done = command(*words)
        assert (done.status, done.out) == (2, ""), words
        assert "catalogue cannot be used (file is not a database)" in done.err


def test_a_scheduler_that_does_not_answer(command, monkeypatch):
    monkeypatch.setattr("wearlab.runner.cluster.CONNECT_SECONDS", 0.3)
    done = command("run", SPEEDS, "--scheduler", "tcp://127.0.0.1:9")
    assert done.status == 2
    assert done.err.startswith(
        "wearlab: no dask scheduler answers at tcp://127.0.0.1:9"
    )


def test_a_fault_of_ours_keeps_its_traceback(command, monkeypatch):
    monkeypatch.setattr(output, "read_campaign", lambda file: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        command("check", "any.toml")


def test_help_and_nothing(command):
    assert command("--help").status == 0
    assert command().status == 2


def test_what_is_not_finite_is_no_json():
    with pytest.raises(ValueError, match="JSON"):
        output.show_json(float("nan"))


def test_a_reader_that_has_seen_enough(tmp_path):
    """``wearlab schema | head -1`` ends quietly."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    code = (
        "import sys; from wearlab.cli import app; sys.exit(app.status_of(['schema']))"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    ) as child:
        assert child.stdout is not None and child.stderr is not None
        child.stdout.read(1)
        child.stdout.close()
        assert child.stderr.read() == ""


def test_equal_labels_and_scenes_do_not_confuse(command, campaign):
    both = sweep(1)
    campaign(
        replace(
            both, cases=(*both.cases, replace(both.cases[0], label="same", position={}))
        )
    )
    assert command("run", "any.toml").out.startswith("1 of 1 done")
    assert {row["label"] for row in json.loads(command("ls", "--json").out)} == {
        "base",
        "same",
    }


PAIR = """
title = "one pair"
[gears]
kind = "external-pair"
module = "3 mm"
face_width = "20 mm"
[gears.pinion]
teeth = 50
{pinion}
[gears.gear]
teeth = 50
[operation]
torque = "340 N*m"
speed = "1100 rpm"
"""


@pytest.mark.parametrize(
    ("pinion", "figure", "says"),
    [
        ('tip_diameter = "149 mm"', "", "contact ratio"),
        ("", '[[figure]]\nkind = "tvsm"', "did you mean 'tvms'"),
        (
            "",
            '[[figure]]\nkind = "tvms"\nselect = { flnk = "pinion" }',
            "did you mean 'flank'",
        ),
        (
            "",
            '[[figure]]\nkind = "line"\ny = "wear_deepth"',
            "did you mean 'wear_depth'",
        ),
    ],
)
def test_what_can_never_work_stops_before_anything_is_written(
    command, tmp_path, pinion, figure, says
):
    file = tmp_path / "study.toml"
    file.write_text(PAIR.replace("{pinion}", pinion) + figure)
    for verb in ("run", "check"):
        done = command(verb, file)
        assert done.status == 2 and says in done.err and "Traceback" not in done.err
    assert files(tmp_path) == ["study.toml"]


FLOATING = """
title = "floating planets"
extends = "{base}"
[operation]
torque = "90 N*m"
speed = "1000 rpm"
[dynamics]
model = "planetary"
[dynamics.supports]
sun     = {{ radial_stiffness = "10 N/um" }}
ring    = {{ radial_stiffness = "10 N/um", tangential_stiffness = "57.6 N/um" }}
carrier = {{ radial_stiffness = "10 N/um", tangential_stiffness = "10 N/um" }}
[[case]]
label = "floating"
"""


@pytest.mark.parametrize("word", ["check", "run"])
def test_supports_between_which_planets_float_are_refused_before_anything_is_written(
    command, word
):
    base = CAMPAIGNS / "base" / "planetary_ngw11.toml"
    Path("floating.toml").write_text(FLOATING.format(base=base))
    refused = command(word, "floating.toml")
    assert refused.status == 2 and refused.out == ""
    assert "scene.dynamics.supports: planet-1, planet-2, planet-3 float" in refused.err
    assert "give a radial stiffness" in refused.err
    assert files(".") == ["floating.toml"]


def test_version(capsys):
    assert app.status_of(["--version"]) == 0
    assert capsys.readouterr().out == f"wearlab {wearlab.__version__}\n"


def test_every_file_of_commands_registers_itself():
    """A new command is one new file: whatever stands in the folder is
    on the command line.
    """
    files = {
        one.stem for one in (Path(app.__file__).parent / "commands").glob("*.py")
    } - {"__init__"}
    homes = {
        one.callback.__module__.rpartition(".")[2]
        for one in app.app.registered_commands
    }
    assert homes == files and set(app.COMMAND_FILES) <= files


def test_ls_says_that_a_life_did_not_reach_its_limit(command, tmp_path):
    """It named wear.until as what is missing, and that was given."""
    store = Store(tmp_path / "wearlab-store")
    store.archive.create()
    data = made_up.run(1.0).drop_vars("life")
    data["end_reason"] = ((), "cycles")
    made_up.put(store, "a" * 20, data)
    listed = command("ls", "--columns", "life,seconds")
    assert "none reached its depth limit, they ended by cycles" in listed.err
    assert "it takes" not in listed.err


def test_ls_says_that_a_spectrum_has_no_one_torque(command, tmp_path):
    """The torque of the first row stood for all of them."""
    store = Store(tmp_path / "wearlab-store")
    store.archive.create()
    duty = [{"share": 0.2, "torque": 150.0, "speed": 1.0}] * 2
    scene = json.dumps({"operation": {"duty": duty}})
    made_up.put(store, "a" * 20, made_up.run(1.0), scene)
    listed = command("ls", "--columns", "torque,seconds")
    assert "150" not in listed.out
    assert "torque: 1 run has operation.duty" in listed.err
    assert "ask for min(duty_torque) and max(duty_torque)" in listed.err
