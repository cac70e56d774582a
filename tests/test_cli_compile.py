"""Compiling ahead, from the command line."""

from scenes import SPUR_50_50

from wearlab.cli.app import status_of

STILL = f'extends = "{SPUR_50_50.as_posix()}"\ndrop = ["dynamics"]\n'


def test_it_compiles_for_every_kind_once_and_tells_how_long(tmp_path, capsys):
    file = tmp_path / "still.toml"
    file.write_text(STILL)
    assert status_of(["compile", str(file), str(file), "--workers", "1"]) == 0
    assert capsys.readouterr().out.startswith("compiled for 1 kind of scenes in ")


def test_a_file_that_is_not_there_is_one_message(tmp_path, capsys):
    assert status_of(["compile", str(tmp_path / "no.toml")]) == 2
    assert "no.toml" in capsys.readouterr().err
