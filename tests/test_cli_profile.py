"""``wearlab profile``: a measured flank as it was understood."""

import json

import pytest

from wearlab.cli.app import status_of

MACHINE = (
    "Protokoll 17;Zähne 50\r\nPunkt;Durchmesser [mm];Abweichung (µm)\r\n"
    "1;143,0;-5,0\r\n2;146,0;-2,0\r\n3;150,0;0,0\r\n4;157,0;-6,0\r\n"
)


def test_it_draws_and_says_what_was_understood(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "flank.csv").write_bytes(MACHINE.encode("cp1252"))
    assert status_of(["profile", "flank.csv", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (
        told["x"] == "diameter: column 'Durchmesser', 4 values"
        and "Abweichung" in told["y"]
    )
    assert (
        "cp1252, separated by semicolon, decimal comma, headers in line 2, 4 rows"
        in told["read as"]
    )
    assert (tmp_path / "flank.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["profile", "no.csv"], "cannot read no.csv"),
        (["profile", "flank.csv", "--columns", "x"], "write NAME=TEXT"),
        (
            ["profile", "flank.csv", "--columns", "depth=Tiefe"],
            "columns are Punkt, Durchmesser, Abweichung",
        ),
        (["profile", "flank.csv", "--out", "flank.txt"], "format 'txt'"),
    ],
)
def test_what_cannot_be_read_is_one_message_and_nothing_written(
    tmp_path, monkeypatch, capsys, words, why
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "flank.csv").write_bytes(MACHINE.encode("cp1252"))
    assert status_of(words) == 2
    assert why in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["flank.csv"]
