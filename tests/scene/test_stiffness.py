"""``mesh.stiffness``: the finite-element choice and the library it needs."""

import importlib.util
from pathlib import Path

import pytest

import wearlab
from wearlab.cli import app
from wearlab.scene import Scene, SceneError, stiffness

LIBRARY = r"scene\.mesh\.stiffness: .*pip install wearlab\[fem\]"


@pytest.fixture
def missing(monkeypatch):
    """Return a machine without scikit-fem."""
    real = importlib.util.find_spec
    monkeypatch.setattr(stiffness, "find_spec", lambda name: None if name == "skfem" else real(name))


def test_defaults(table):
    chosen = Scene.from_mapping(table | {"mesh": {**table["mesh"], "stiffness": "finite-element"}}).mesh
    assert (chosen.stiffness.plane, chosen.stiffness.hertz, chosen.stiffness.scale) == (
        "strain",
        "weber",
        1.0,
    )
    mapping = {**table, "mesh": {key: value for key, value in table["mesh"].items() if key != "stiffness"}}
    plain = Scene.from_mapping(mapping).mesh.stiffness
    assert (plain.hertz, plain.foundation, plain.coupling, plain.plane) == (
        "yang-sun",
        "sainsot",
        "shared",
        "stress",
    )


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"plane": "shell"}, "'shell' is not one of 'strain', 'stress'"),
        ({"foundation": "none"}, "not an option of 'finite-element'"),
    ],
)
def test_what_it_refuses(table, changes, said):
    asked = {"model": "finite-element", **changes}
    with pytest.raises(SceneError, match=said):
        Scene.from_mapping(table | {"mesh": {**table["mesh"], "stiffness": asked}})


def test_a_scene_is_refused_without_the_library(table, monkeypatch):
    """What was computed once can be read on."""
    scene = table | {"mesh": {**table["mesh"], "stiffness": "finite-element"}}
    kept = Scene.from_mapping(scene).canonical()
    monkeypatch.setattr(stiffness, "find_spec", lambda name: None)
    with pytest.raises(SceneError, match=LIBRARY):
        Scene.from_mapping(scene)
    assert Scene.from_canonical(kept).canonical() == kept
    assert Scene.from_mapping(table).mesh.stiffness.model == "potential-energy"


def test_the_command_says_so_and_exits_with_2(missing, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    base = Path(wearlab.__file__).parents[1] / "campaigns" / "base" / "spur_50_50.toml"
    file = tmp_path / "elements.toml"
    file.write_text(f'extends = "{base.as_posix()}"\n[mesh]\nstiffness = "finite-element"\n')
    status = app.status_of(["run", str(file)])
    said = capsys.readouterr().err
    assert status == 2 and said.count("pip install wearlab[fem]") == 1 and "Traceback" not in said
    assert sorted(path.name for path in tmp_path.iterdir()) == ["elements.toml"]
