"""``ls`` with a condition: the command line's questions to a store."""

import csv
import io
import json

import fake_campaign
import pytest
from fake_campaign import alter, sweep

from wearlab.cli import app
from wearlab.query import split_columns
from wearlab.runner.worker import Task, execute
from wearlab.store import Store


@pytest.fixture
def ask(capsys, tmp_path):
    """Return a function that lists a store of four runs, one of them failed."""
    campaign = alter(sweep(4), 3, act="fail")
    store = Store(tmp_path / "a store of Größe")
    store.archive.create()
    with store.archive.presence() as presence:
        for case in campaign.cases:
            store.archive.save(
                [execute(Task(case.id, case.scene), fake_campaign.SIMULATE)],
                presence.token,
            )
    members = [
        (case.id, case.label, {"speed": f"{case.scene.speed:g} rpm"})
        for case in campaign.cases
    ]
    store.archive.catalogue.record_campaign("five speeds", None, None, members)
    capsys.readouterr()

    def asked(*words):
        status = app.status_of(["ls", "--store", str(store.path), *words])
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return asked


def test_a_condition_chooses_runs(ask):
    status, out, err = ask("--where", "speed > 850 and status = done", "--json")
    assert (status, err) == (0, "")
    assert [row["position"]["speed"] for row in json.loads(out)] == [
        "900 rpm",
        "1000 rpm",
    ]
    assert ask("--where", "speed > 1e6") == (0, "", "no such runs\n")


def test_order_and_limit(ask):
    out = ask("--sort", "-speed", "--limit", "2", "--json")[1]
    assert [row["position"]["speed"] for row in json.loads(out)] == [
        "1100 rpm",
        "1000 rpm",
    ]
    out = ask("--sort", "-speed", "--limit", "2", "--state", "done", "--json")[1]
    assert [row["position"]["speed"] for row in json.loads(out)] == [
        "1000 rpm",
        "900 rpm",
    ]


def test_columns_as_table_json_and_csv(ask):
    words = (
        "--where",
        "status = done",
        "--columns",
        "speed, life, first_cycle(max_wear_depth > 915 m)",
    )
    out = ask(*words)[1].splitlines()
    assert out[0].split() == [
        "id",
        "status",
        "speed",
        "life",
        "first_cycle(max_wear_depth",
        ">",
        "915",
        "m)",
    ]
    assert [line.split()[2:] for line in out[1:]] == [
        [
            "800",
            "125000",
        ],  # 800, 810, 820 over three states, and 1.3 more at the far end
        ["900", "111111", "1.37e+06"],
        ["1000", "100000", "0"],
    ]
    content = json.loads(ask(*words, "--format", "json")[1])
    assert [column["name"] for column in content["columns"]][2:4] == ["speed", "life"]
    assert content["rows"][1]["life"] == pytest.approx(1e8 / 900)
    rows = list(csv.DictReader(io.StringIO(ask(*words, "--format", "csv")[1])))
    assert [row["speed"] for row in rows] == ["800.0", "900.0", "1000.0"]
    assert rows[0]["first_cycle(max_wear_depth > 915 m)"] == ""


def test_csv_without_columns_has_the_usual_ones(ask):
    (first, *_) = csv.DictReader(io.StringIO(ask("--format", "csv")[1]))
    assert {
        "id",
        "status",
        "campaign",
        "case",
        "life",
        "max(max_wear_depth) [um]",
        "verdict",
    } <= set(first)
    assert (first["campaign"], first["case"]) == ("five speeds", "base")
    assert float(first["max(max_wear_depth) [um]"]) == pytest.approx(821.3e6)


def test_columns_of_a_state(ask):
    out = ask("--columns", "speed,reason", "--state", "failed")[1]
    assert "1100" in out and "did not converge" in out and "900" not in out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("--where", "sped > 3"),
            "unknown name 'sped'; did you mean 'speed'?\n  sped > 3\n  ^",
        ),
        (("--where", "speed >"), "expected a name or a value, but it ends"),
        (("--where", "__import__('os').system('x')"), "belongs nowhere"),
        (("--columns", "sped"), "did you mean 'speed'"),
        (("--sort", "sped"), "did you mean 'speed'"),
        (("--format", "xml"), "'xml' is not one of"),
        (("--limit", "-1"), "Invalid value for '--limit'"),
    ],
)
def test_what_cannot_be_asked_is_one_message(ask, words, said):
    status, out, err = ask(*words)
    assert (status, out) == (2, "")
    assert said in err and "Traceback" not in err


def test_commas_within_parentheses_do_not_part_columns():
    assert split_columns("a, b") == ("a", "b")
    assert split_columns("first_cycle(a in [1, 2]), 'x,y',") == (
        "first_cycle(a in [1, 2])",
        "'x,y'",
    )
