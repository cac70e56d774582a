"""The time that people wait: the rows exist, and what they measure reaches the file.

No time is asserted.
"""

import json
from pathlib import Path

import pytest
import waiting
from waiting_rows import (
    PAIR,
    ROWS,
    Row,
    each_of,
    require_package_of,
    second_run,
    through_store,
)

import wearlab as wl

CAMPAIGNS = Path(__file__).parents[2] / "campaigns"
UNWORN = {section: keys for section, keys in PAIR.items() if section != "wear"}


def test_the_campaigns_of_the_rows_are_there() -> None:
    assert set(ROWS) >= {"w23-campaign", "spur-speeds", "static-life", "first-run"}
    for file in ("planetary_speed", "helical_coupled", "planetary_friction"):
        assert (CAMPAIGNS / f"{file}.toml").exists()


def test_a_row_is_measured_in_turns_and_kept(monkeypatch, tmp_path, capsys) -> None:
    taken = iter((4.0, 2.0, 6.0, 3.0))
    monkeypatch.setattr(waiting, "times", lambda row, side: {"cpu [s]": next(taken)})
    other = str(Path(__file__).parents[2])
    file = tmp_path / "waiting.json"
    waiting.main(
        [
            *("--only", "spur-speeds", "--repeat", "2"),
            *("--against", other, "--write", str(file)),
        ]
    )
    assert "| spur-speeds | cpu [s] | 5 | 2.5 | 0.500 |" in capsys.readouterr().out
    (measured,) = json.loads(file.read_text())["measured"]
    assert measured["before"] == [4.0, 6.0] and measured["now"] == [2.0, 3.0]


def test_another_package_than_that_of_the_checkout_is_not_measured(tmp_path) -> None:
    require_package_of(Path(wl.__file__).parents[1])
    with pytest.raises(SystemExit, match="is not what Python finds as wearlab"):
        require_package_of(tmp_path)


def test_scenes_are_timed() -> None:
    scene = wl.load(UNWORN).cases[0].scene
    assert second_run([scene])["cpu [s]"] > 0.0
    assert each_of([scene, scene])["cpu a run [ms]"] > 0.0
    assert Row(second_run).long is False


def test_a_store_is_held_against_joblib() -> None:
    pytest.importorskip("joblib")
    wearing = {
        "wear": {
            "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
            "load": "static",
            "until": {"cycles": 1e6},
        }
    }
    assert through_store(UNWORN | wearing)["store over joblib [1]"] > 0.0
