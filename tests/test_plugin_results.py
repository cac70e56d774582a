"""Results and kinds of figures of a user's own: a plug-in may hold one alone."""

import json
import textwrap
from pathlib import Path

import numpy as np
import pytest
from scenes import CAMPAIGNS, external_pair

import wearlab as wl
from wearlab.campaign import load
from wearlab.cli.app import status_of
from wearlab.figures.kinds import KINDS
from wearlab.plugins import PluginError, Trust, forget, stand_in, trusting, use
from wearlab.schema import VARIABLES, attributes
from wearlab.simulation.run import simulate

EXAMPLE = CAMPAIGNS / "plugins" / "unevenness.toml"
RESULT = """
    from wearlab.variable import Result, Variable

    RESULT = Result(
        "{name}",
        Variable(("{dim}", "flank"), "{units}", "{shown}", "{words}"),
        lambda run: {found},
        needs=("{needs}",),
    )
"""
GIVEN = {
    "name": "mean_wear",
    "dim": "update",
    "units": "m",
    "shown": "um",
    "words": "mean wear depth",
    "found": 'run["wear_depth"].mean("profile")',
    "needs": "wear_depth",
}
SMALL = {
    "gears": external_pair(25, 30),
    "operation": {"torque": "100 N*m", "speed": "1100 rpm"},
    "mesh": {"stiffness": "potential-energy"},
    "wear": {
        "coefficient": {"model": "constant", "value": "1e-16 m^2/N"},
        "load": "static",
        "until": {"depth": "1 um"},
    },
}


@pytest.fixture
def plugin(tmp_path):
    def write(**said):
        path = tmp_path / "mine.py"
        text = textwrap.dedent(RESULT)
        for key, value in (GIVEN | said).items():
            text = text.replace(f"{{{key}}}", value)
        path.write_text(text)
        return str(path)

    return write


def test_a_result_alone_is_stored_shown_and_part_of_the_identity(plugin, tmp_path):
    table = {**SMALL, "plugins": [plugin()]}
    campaign = load(table)
    plain = load(SMALL)
    (run,) = (simulate(case.scene) for case in campaign.cases)
    np.testing.assert_allclose(
        run.mean_wear, run.wear_depth.mean("profile"), rtol=1e-12
    )
    assert (
        run.mean_wear.attrs == attributes("mean_wear")
        and run.mean_wear.attrs["display_units"] == "um"
    )
    assert "mean_wear" not in simulate(plain.cases[0].scene)
    edited = load(
        {**SMALL, "plugins": [plugin(found='run["wear_depth"].median("profile")')]}
    )
    ids = {c.cases[0].scene.id for c in (plain, campaign, edited)}
    assert len(ids) == 3

    store = wl.Store(tmp_path / "store")
    wl.run(edited, store)
    forget()
    assert "mean_wear" not in VARIABLES
    with trusting(Trust(runs=False, declared=tmp_path / "store" / "plugins")):
        stored = load({**SMALL, "plugins": [str(tmp_path / "mine.py")]})
    assert VARIABLES["mean_wear"].display_units == "um"
    grid = wl.Store(tmp_path / "store").open(stored)
    np.testing.assert_allclose(
        grid.mean_wear, grid.wear_depth.median("profile"), rtol=1e-12
    )
    with pytest.raises(PluginError, match=r"'mean_wear' was not run.*--plugins"):
        stored.cases[0].scene.plugins_used()


@pytest.mark.parametrize(
    ("said", "message"),
    [
        (
            {"dim": "updates"},
            "Result 'mean_wear': 'updates' is no dimension, did you mean 'update'?",
        ),
        (
            {"needs": "wear_dept"},
            "'wear_dept' is no variable, did you mean 'wear_depth'?",
        ),
        ({"shown": "N"}, "units = 'm', display_units = 'N'"),
        ({"words": ""}, "its long_name is empty"),
        ({"name": "wear_depth"}, "wearlab has a variable of this name"),
    ],
)
def test_a_wrong_declaration_is_refused_when_loaded(plugin, said, message):
    with pytest.raises(PluginError) as refused:
        use([plugin(**said)])
    assert str(refused.value).startswith("mine.py: ") and message in str(refused.value)
    assert "mean_wear" not in VARIABLES and "wear_depth" in VARIABLES


def test_a_name_belongs_to_the_plugin_that_took_it(plugin, tmp_path):
    use([plugin()])
    use([plugin(words="the same, edited")])
    assert VARIABLES["mean_wear"].long_name == "the same, edited"
    other = tmp_path / "other.py"
    other.write_text(Path(plugin()).read_text() + "# mine\n")
    with pytest.raises(
        PluginError, match=r"other.py: Result 'mean_wear' is there already"
    ):
        use([str(other)])
    with pytest.raises(PluginError, match="its long_name is empty"):
        use([plugin(words="")])
    assert VARIABLES["mean_wear"].long_name == "the same, edited"


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"name": "wear_depth"}, "wear_depth: wearlab has a variable of this name"),
        ({"variable": {"dims": ["nowhere"], "units": "m"}}, "missing 2 required"),
        ({"variable": 3}, "not iterable"),
    ],
)
def test_a_strangers_declaration_moves_no_variable(changed, said):
    variable = {
        "dims": ["update"],
        "units": "ft",
        "display_units": "ft",
        "long_name": "mine",
    }
    result = {
        "name": "mean_wear",
        "needs": ["wear_depth"],
        "variable": variable,
        **changed,
    }
    record = {
        "name": "mine.py",
        "sha256": "0" * 64,
        "variants": [],
        "results": [result],
    }
    before = dict(VARIABLES)
    with pytest.raises(PluginError, match=said):
        stand_in(json.dumps(record))
    assert before == VARIABLES


def test_a_result_that_fails_costs_no_life(plugin):
    campaign = load(
        {**SMALL, "plugins": [plugin(found='run["wear_depth"].mean("nowhere")')]}
    )
    run = simulate(campaign.cases[0].scene)
    assert "mean_wear" not in run and float(run.max_wear_depth.max()) > 0.9e-6
    assert "mean_wear" in str(run.attrs) + str(run.validity.values)


@pytest.mark.parametrize(
    ("found", "said"),
    [
        (
            'run["wear_depth"]',
            "its dimensions are (update, flank, profile), declared are (update, flank)",
        ),
        (
            'run["wear_depth"].mean(("flank", "profile"))',
            "its dimensions are (update), declared",
        ),
        ('run["wear_depth"].mean("profile").isel(update=[0])', "not those of the run"),
        ('run["wear_depth"].mean("profile").astype(str)', "its values are no numbers"),
    ],
)
def test_a_result_is_held_to_its_declaration(plugin, found, said):
    run = simulate(load({**SMALL, "plugins": [plugin(found=found)]}).cases[0].scene)
    assert "mean_wear" not in run and said in run.validity.item()


def test_a_result_and_its_figure_are_one_file_as_the_page_shows_it(
    tmp_path, monkeypatch
):
    page = (CAMPAIGNS.parent / "docs" / "where_to_add.md").read_text()
    _, _, rest = page.partition("`campaigns/plugins/depth_spread.py`:\n\n```python\n")
    source, _, _ = rest.partition("```")
    monkeypatch.chdir(tmp_path)
    Path("depth_spread.py").write_text(source)
    campaign = (
        EXAMPLE.read_text()
        .replace("../base", str(EXAMPLE.parents[1] / "base"))
        .replace("unevenness.py", "depth_spread.py")
        .replace("wear-unevenness", "depth-spread")
        .replace("[operation]", '[mesh]\nstiffness = "potential-energy"\n[operation]')
    )
    Path("mine.toml").write_text(campaign)
    assert status_of(["run", "mine.toml", "--plugins"]) == 0
    assert status_of(["figures", "mine.toml", "--plugins"]) == 0
    (figure,) = tmp_path.rglob("*depth-spread.png")
    assert figure.stat().st_size > 10_000


def test_a_kind_of_figure_is_drawn_and_asks_for_its_code(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = EXAMPLE.read_text().replace("../base", str(EXAMPLE.parents[1] / "base"))
    (tmp_path / "unevenness.py").write_text(EXAMPLE.with_suffix(".py").read_text())
    Path("mine.toml").write_text(
        text.replace(
            "[operation]", '[mesh]\nstiffness = "potential-energy"\n[operation]'
        )
    )
    assert status_of(["run", "mine.toml", "--plugins"]) == 0
    assert status_of(["figures", "mine.toml", "--plugins"]) == 0
    (figure,) = tmp_path.rglob("*wear-unevenness.png")
    assert figure.stat().st_size > 10_000
    forget()
    assert "wear-unevenness" not in KINDS
    capsys.readouterr()
    assert status_of(["figures", "mine.toml"]) == 2
    assert (
        "its kind is drawn by unevenness.py, Python code that was not run"
        in capsys.readouterr().err
    )
    for words in (["ls"], ["plan", "mine.toml"], ["verify"], ["report", "mine.toml"]):
        assert status_of(words) in (0, 1), words
        assert "Traceback" not in capsys.readouterr().err
