import json
from dataclasses import replace

import made_up
import numpy as np
import pytest

from wearlab.query import QueryError
from wearlab.query.evaluate import COMPARED, first_cycle
from wearlab.store import Store, StoreError, search
from wearlab.store.outcome import Outcome
from wearlab.store.table import Column, Table
from wearlab.units import quantity, rounded

CYCLES = np.array([0.0, 1e6, 3e6])


def outcome(number, torque, life, state="done", **more):
    scene = {
        "operation": {"torque": torque, "speed": 100.0},
        "gears": {"pinion": {"teeth": 20 + number}, "gear": {"teeth": 50}},
        "wear": {"coefficient": {"model": "constant", "film": number == 1}},
    }
    depth = np.array([0.0, 10e-6, 30e-6]) * number
    summary = {
        "life": life,
        "verdict": "completed",
        "max_wear_depth": depth[-1],
        "stiffness_mean": 4e8,
    }
    histories = {
        "max_wear_depth": np.concatenate([0.5 * depth, depth]).tobytes(),
        "cycle": CYCLES.tobytes(),
    }
    started = f"2026-01-0{number + 1}T08:00:00.000+00:00"
    done = Outcome(
        *(f"{number:020x}", state, started, 2.0 * number, json.dumps(scene)),
        **{
            "summary": summary,
            "histories": histories,
            "source_hash": "abc",
            "wearlab_version": "0.1.0",
        },
    )
    if state == "failed":
        done = replace(
            done,
            summary={},
            histories={},
            reason="FloatingPointError: no 100 % convergence",
        )
    return replace(done, **more)


@pytest.fixture
def asked(tmp_path):
    """Return a function from a condition to the numbers of the runs it finds."""
    store = Store(tmp_path / "store")
    store.archive.create()
    runs = [outcome(1, 100.0, 1e7), outcome(2, 200.0, 2e7), outcome(3, 300.0, None)]
    store.archive.catalogue.record([*runs, outcome(4, 400.0, None, "failed")])
    members = [(run.id, "base", {"torque": i}) for i, run in enumerate(runs)]
    store.archive.catalogue.record_campaign("Torques", None, "a.toml", members)
    store.archive.catalogue.record_campaign(
        "Other", None, "b.toml", [(runs[0].id, "first", {})]
    )

    def ask(where, **options):
        return [int(row["id"], 16) for row in store.query(where, **options)]

    ask.store = store
    return ask


@pytest.mark.parametrize(
    ("where", "found"),
    [
        ("", [1, 2, 3, 4]),
        ("torque > 150 N*m", [2, 3, 4]),
        ("torque > 0.15 kN*m and life < 3e7", [2]),
        ("life < 3e7", [1, 2]),
        ("not life < 1.5e7", [2]),
        ("life is missing", [3, 4]),
        ("life is missing and status = done", [3]),
        ("torque = 100 N*m or status = failed", [1, 4]),
        ("status in [failed, refused]", [4]),
        ("efficiency > 0.9 or torque = 100 N*m", [1]),
        (
            "efficiency is missing and lubricant.pressure_viscosity is missing",
            [1, 2, 3, 4],
        ),
        ("pinion.teeth < gear.teeth and pinion.teeth > 22", [3, 4]),
        ("film", [1]),
        ("coefficient.model = constant and not film", [2, 3, 4]),
        ("max_wear_depth > 50 um", [2, 3]),
        ("stiffness_mean > 399 N/um", [1, 2, 3]),
        ("seconds between 3 s and 0.11 min", [2, 3]),
        ("started >= 2026-01-03 and started < 2026-01-04", [2]),
        ("date > 2026-01-03", [3, 4]),
        ("started = 2026-01-03", [2]),
        ("campaign = Torques", [1, 2, 3]),
        ("campaign = 'Other' and campaign = Torques", [1]),
        ("not campaign contains tor", [4]),
        ("campaign is missing", [4]),
        ("case = first", [1]),
        ("reason contains '100 % conv'", [4]),
        ("code = abc and wearlab_version = '0.1.0'", [1, 2, 3, 4]),
        ("other_code", [1, 2, 3, 4]),
        ("id = '00000000000000000002'", [2]),
        ("max_wear_depth < 1 um", [1, 2, 3]),  # any of its values
        ("max(max_wear_depth) < 40 um", [1]),
        ("not max_wear_depth > 50 um", [1]),
        (
            "max_wear_depth between 12 um and 14 um",
            [],
        ),  # one value within, not two beside
        ("14 um < max_wear_depth < 16 um", [1, 3]),
        ("max_wear_depth = 45 um", [3]),
        ("first_cycle(max_wear_depth > 20 um) < 1.6e6", [2, 3]),
        ("first_cycle(max_wear_depth > 25 um) <= 2.5e6 and life > 0", [1, 2]),
        ("first_cycle(max_wear_depth > 1 mm) is missing", [1, 2, 3, 4]),
    ],
)
def test_conditions_find_runs(asked, where, found):
    assert asked(where) == found


def test_an_answer_says_that_any_of_several_values_counts(asked):
    """Of two safeties the larger was compared, and nothing said so."""
    (note,) = asked.store.query("max_wear_depth < 1 um").notes
    assert note == (
        "max_wear_depth has several values in a run: any of them counts; write "
        "max(max_wear_depth) or min(max_wear_depth), or max_wear_depth[…] for one of "
        "them"
    )
    for where in ("max(max_wear_depth) < 1 um", "stiffness_mean > 1 N/um", "life > 1"):
        assert asked.store.query(where).notes == ()
    first_cycle = "first_cycle(max_wear_depth > 20 um) > 1"
    assert asked.store.query(first_cycle).notes == ()
    assert len(asked.store.query(f"{first_cycle} or max_wear_depth > 1 um").notes) == 1


def test_torque_is_that_of_the_operation_whatever_else_has_one(asked):
    duty = {"operation": {"torque": 500.0, "duty": [{"torque": 900.0, "share": 1.0}]}}
    asked.store.archive.catalogue.record(
        [outcome(5, 0.0, None, scene=json.dumps(duty))]
    )
    assert asked("torque > 250 N*m") == [3, 4, 5]
    assert asked("torque = 500 N*m and duty.0.torque = 900 N*m") == [5]


def test_conditions_are_asked_everywhere_alike(asked):
    from wearlab.query import read_condition
    from wearlab.query.keys import flat
    from wearlab.store.search import CatalogueSearch

    vocabulary = CatalogueSearch(asked.store.archive.catalogue).vocabulary
    for where in (
        "not life < 1.5e7",
        "life < 3e7 or torque > 350 N*m",
        "not (life > 1 and torque > 150 N*m)",
    ):
        tree = read_condition(where, vocabulary)
        entries = asked.store.archive.entries().values()
        values = [dict(flat(json.loads(e.scene))) | e.summary for e in entries]
        assert asked(where) == [
            i + 1 for i, known in enumerate(values) if tree.holds(known)
        ]


def test_columns_order_and_limit(asked):
    table = asked.store.query(
        "status = done",
        columns=["torque", "life", "first_cycle(max_wear_depth > 20 um)", "campaign"],
        sort="-life",
    )
    assert table["id"] == [f"{number:020x}" for number in (2, 1, 3)]
    assert table["torque"] == [200.0, 100.0, 300.0] and table["life"] == [
        2e7,
        1e7,
        None,
    ]
    first = table["first_cycle(max_wear_depth > 20 um)"]
    np.testing.assert_allclose(first, [1e6, 2e6, 2e6 / 3])
    assert sorted(table["campaign"][1].split(",")) == ["Other", "Torques"]
    assert asked("", sort="torque", limit=2) == [1, 2]
    assert asked("status = done", sort="life") == [1, 2, 3]


def test_without_columns_what_the_condition_names_is_shown(asked):
    table = asked.store.query("torque > 100 N*m and (life > 1 or not film)")
    assert [column.name for column in table.columns] == [
        *("id", "status", "operation.torque", "life", "wear.coefficient.film"),
    ]


def test_what_is_found_in_other_forms(asked):
    table = asked.store.query(
        "life > 0", columns=["torque", "max_wear_depth", "verdict"]
    )
    assert table.to_csv().splitlines() == [
        "id,status,torque [N*m],max(max_wear_depth) [um],verdict",
        "00000000000000000001,done,100.0,30.0,completed",
        "00000000000000000002,done,200.0,60.0,completed",
    ]
    data = table.to_xarray()
    assert list(data.run.values) == table["id"]
    assert data["max(max_wear_depth)"].attrs == {"units": "m"}
    np.testing.assert_allclose(data["max(max_wear_depth)"], [30e-6, 60e-6])
    assert list(data.verdict.values) == ["completed"] * 2
    assert len(asked.store.query("life < 0").to_xarray().run) == 0


def test_no_text_of_a_run_becomes_a_formula_of_a_spreadsheet():
    table = Table((Column("reason"),), [("=HYPERLINK(1)",), ("plain",)])
    assert table.to_csv().splitlines() == ["reason", "'=HYPERLINK(1)", "plain"]


@pytest.mark.parametrize(
    "where",
    [
        "verdict = 'x'' OR 1=1 --'",
        'verdict = "\'; DROP TABLE runs; --"',
        "campaign = '%' or reason contains '%_'",
        'id = "x\' UNION SELECT scene FROM documents --"',
    ],
)
def test_texts_are_never_sql(asked, where):
    assert asked(where) == []
    assert asked("") == [1, 2, 3, 4]


@pytest.mark.parametrize(
    ("where", "said"),
    [
        ("torque > 1", "needs a unit, such as '340 N\\*m'"),
        ("teeth = 3", "may mean 'gears.gear.teeth' or 'gears.pinion.teeth'"),
        ("lief < 1", "did you mean 'life'"),
        ("max_wear_depth > 1 N", "'N' is not a unit like 'm'"),
        ("first_cycle(life > 3) > 1", "there are .*'max_wear_depth'"),
    ],
)
def test_what_does_not_fit_is_refused(asked, where, said):
    with pytest.raises(QueryError, match=said):
        asked(where)


def test_many_values_in_one_question(asked):
    runs = [outcome(9, 1.0, 1.0, summary={f"count_{i}": i for i in range(90)})]
    asked.store.archive.catalogue.record(runs)
    assert asked(" and ".join(f"count_{i} >= {i}" for i in range(90))) == [9]


def test_numbers_of_keys_are_those_of_now_when_another_process_made_the_tables_anew(
    asked,
):
    other = Store(asked.store.path)
    other.archive.catalogue.record([outcome(5, 500.0, 1e7)])
    asked.store.archive.catalogue.make_anew((), lambda owner: False)
    asked.store.archive.catalogue.record(
        [outcome(9, 1.0, 1.0, summary={"first_here": 4.0})]
    )
    other.archive.catalogue.record([outcome(5, 500.0, 1e7)])
    assert asked("first_here = 4") == [9] and asked("life = 1e7") == [5]
    assert asked("torque = 500 N*m") == [5]
    other.close()


def test_a_run_computed_again_is_asked_for_as_it_is_now(asked):
    asked.store.archive.catalogue.record(
        [outcome(1, 100.0, 5e8, summary={"life": 5e8})]
    )
    assert asked("life > 1e8") == [1]
    assert asked("max_wear_depth > 0 um") == [2, 3]
    assert asked.store.archive.catalogue.forget(["0" * 19 + "1", "unknown"]) == 1
    assert asked("life > 1e8") == [] and asked("torque = 100 N*m") == []


def test_a_failed_transaction_does_not_spoil_the_numbers_of_keys(asked):
    catalogue = asked.store.archive.catalogue
    bad = outcome(7, 1.0, 1.0, summary={"new_result": 3.0})
    with pytest.raises(StoreError):
        catalogue.record([bad, replace(bad, id="x", state="nonsense")])
    catalogue.record([outcome(8, 1.0, 1.0, summary={"another": 4.0})])
    catalogue.record([outcome(9, 1.0, 1.0, summary={"new_result": 3.0})])
    assert asked("another = 4") == [8] and asked("new_result = 3") == [9]


def test_first_cycle_between_two_states():
    cycles = np.array([0.0, 10.0, 20.0]).tobytes()
    rising = np.array([1.0, 2.0, 4.0]).tobytes()
    both = np.array([0.5, 1.0, 2.0, 1.0, 2.0, 4.0]).tobytes()  # lowest, then highest
    assert first_cycle(">", 3.0, rising, cycles) == 15.0
    assert first_cycle(">", 2.0, rising, cycles) == 10.0
    assert first_cycle(">=", 4.0, rising, cycles) == 20.0
    assert first_cycle(">", 4.0, rising, cycles) is None
    assert first_cycle(">", 0.5, rising, cycles) == 0.0
    assert first_cycle(">", 3.0, both, cycles) == 15.0
    assert first_cycle("<", 0.75, both, cycles) == 0.0
    falling = np.array([4.0, 3.0, 1.0]).tobytes()
    assert first_cycle("<", 2.0, falling, cycles) == 15.0
    assert first_cycle("<", 2.0, None, cycles) is None
    gap = np.array([np.nan, 3.0, 5.0]).tobytes()
    assert first_cycle(">", 1.0, gap, cycles) == 10.0


@pytest.mark.parametrize("beyond", [">", ">="])
@pytest.mark.parametrize("sign", ["<", "<=", ">", ">=", "=", "!="])
def test_first_cycles_are_found_as_if_every_history_were_looked_through(
    tmp_path, sign, beyond
):
    rng = np.random.default_rng(7)
    store = Store(tmp_path / "store")
    store.archive.create()
    lines = []
    runs = []
    for number in range(60):
        cycles = np.cumsum(rng.random(5)) * 1e6 * (number % 3 > 0) + np.arange(5.0)
        cycles[0] = 0.0
        depth = (np.cumsum(rng.random(5)) - (number % 4)) * (number % 7 > 0)
        both = np.concatenate([depth - 0.5, depth])
        lines.append((both, cycles))
        summary = {"max_wear_depth": depth.max()}
        histories = {"max_wear_depth": both.tobytes(), "cycle": cycles.tobytes()}
        runs.append(outcome(number, 1.0, None, summary=summary, histories=histories))
    store.archive.catalogue.record(runs)
    for limit in (-0.5, 0.0, 1.0, float(lines[5][0][7])):
        exact = {
            n: first_cycle(beyond, limit, a.tobytes(), b.tobytes())
            for n, (a, b) in enumerate(lines)
        }
        for last in (
            -1.0,
            0.0,
            2.0,
            1e6,
            *(exact[n] for n in (9, 17) if exact[n] is not None),
        ):
            where = f"first_cycle(max_wear_depth {beyond} {limit!r} m) {sign} {last!r}"
            found = [int(row["id"], 16) for row in store.query(where)]
            wanted = [
                n
                for n, cycle in exact.items()
                if cycle is not None and COMPARED[sign](cycle, last)
            ]
            assert found == wanted, where


def test_runs_are_found_by_the_quantity_that_their_file_wrote(tmp_path):
    """Forty runs at 1100 rpm, and eighty at drawn speeds: equality
    asks the stored twelve digits.
    """
    dice = np.random.default_rng(5)
    store = Store(tmp_path / "store")
    store.archive.create()
    texts = ["1100 rpm"] * 40 + [
        f"{speed:.7g} rpm" for speed in dice.uniform(10.0, 9999.0, 80)
    ]
    runs = []
    for number, text in enumerate(texts):
        kept = rounded(quantity(text, "speed"))
        made = outcome(number, 1.0, None)
        runs.append(
            replace(
                made, scene=json.dumps({"operation": {"speed": kept, "torque": kept}})
            )
        )
    store.archive.catalogue.record(runs)
    for where in (
        "speed = 1100 rpm",
        "speed = 115.191730632 rad/s",
        "speed in [1100 1/min, 7 rpm]",
    ):
        assert len(store.query(where)) == 40, where
    assert len(store.query("speed between 1100 rpm and 1100 rpm")) == 40
    assert (
        len(
            store.query(
                "speed >= 1100 rpm and not speed > 1100 rpm and 1100 rpm >= speed"
            )
        )
        == 40
    )
    assert len(store.query("speed != 1100 rpm")) == 80
    for number, text in enumerate(texts[40:], 40):
        turns = f"{float(text.split()[0]) / 60!r} rev/s"
        for told in (text, turns):
            found = store.query(
                f"speed = {told} and speed <= {told} and speed >= {told}", columns=()
            )
            assert [int(row["id"], 16) for row in found] == [number], told
            assert (
                len(store.query(f"speed < {told}"))
                + len(store.query(f"speed > {told}"))
                == 119
            )


@pytest.mark.parametrize(
    "asked, means",
    [
        ("life_hours", "service_life"),
        ("hours", "operating_hours"),
        ("hours_of_life", "service_life"),
    ],
)
def test_hours_are_those_of_the_run_and_no_limit(asked, means):
    """``hours`` alone meant the limit ``wear.until.hours``: the same
    number in every row.
    """
    from wearlab.query.keys import Key, Vocabulary
    from wearlab.store.search import ALIASES

    keys = [
        Key("wear.until.hours", is_path=True),
        Key("service_life"),
        Key("operating_hours"),
    ]
    assert Vocabulary(keys, ALIASES).find(asked, 0, asked).name == means


QUESTIONS = [
    ("", None),
    ("", "started"),
    ("", "-life"),
    ("", "torque"),
    ("torque >= 200 N*m", "-life"),
    ("status = done", "campaign"),
    ("not campaign = Other", "-torque"),
    ("first_cycle(max_wear_depth > 20 um) < 2e6", None),
]


@pytest.mark.parametrize(("where", "sort"), QUESTIONS, ids=map(str, QUESTIONS))
@pytest.mark.parametrize("at_once", [1, 3, 1000])
def test_pages_are_the_parts_of_the_whole_answer(asked, where, sort, at_once):
    """However many runs are read at once, and whether SQLite or this
    code puts them in order.
    """
    whole = asked(where, sort=sort)
    some = search.CatalogueSearch(asked.store.archive.catalogue, at_once=at_once)
    pages = [some.page(where, ["torque"], sort, 2, skip) for skip in (0, 2, 4)]
    assert [int(run, 16) for page in pages for run in page.table["id"]] == whole
    assert {page.total for page in pages} == {len(whole)}


def test_the_order_of_sqlite_is_that_of_this_code(asked, monkeypatch):
    for sort in (
        "life",
        "-life",
        "status",
        "-started",
        "torque",
        "verdict",
        "seconds",
        "-reason",
    ):
        by_sqlite = asked("", sort=sort)
        monkeypatch.setattr(
            search.CatalogueSearch, "_is_of_tables", lambda self, by: False
        )
        assert asked("", sort=sort) == by_sqlite, sort
        monkeypatch.undo()


def test_no_more_of_a_catalogue_is_read_than_a_page_shows(asked, monkeypatch):
    read = []
    original = search.CatalogueSearch._column

    def column(self, name, runs):
        read.append(len(runs))
        return original(self, name, runs)

    monkeypatch.setattr(search.CatalogueSearch, "_column", column)
    search.CatalogueSearch(asked.store.archive.catalogue).page(
        "", ["torque", "life"], "-life", 2, 1
    )
    assert set(read) == {2}


def test_runs_of_several_torques_are_told_where_one_is_asked_for(asked):
    """They were not found, and nothing said why."""
    duty = [
        {"torque": torque, "speed": 100.0, "share": 0.5} for torque in (50.0, -90.0)
    ]
    several = outcome(5, 0.0, 1e7)
    summary = {**several.summary, "duty_torque_max": 50.0, "duty_torque_min": -90.0}
    scene = json.dumps({"operation": {"duty": duty}})
    asked.store.archive.catalogue.record(
        [replace(several, scene=scene, summary=summary)]
    )
    found = asked.store.query("torque > 20 N*m")
    assert 5 not in [int(row["id"], 16) for row in found]
    assert found.notes == (
        "torque: 1 run has operation.duty, each condition its own, and is not found by "
        "it: ask for max(duty_torque) or min(duty_torque)",
    )
    assert asked.store.query("life > 2").notes == ()
    assert asked.store.query("speed > 2 rpm").notes[0].startswith("speed: 1 run has")


@pytest.fixture
def in_files(tmp_path):
    """Return a function from a condition to the ids of runs with three conditions."""
    store = Store(tmp_path / "store")
    store.archive.create()
    for name, torques in (("a", [310.0, 95.0, 180.0]), ("b", [20.0, 10.0, 40.0])):
        duty_torque = ("duty", torques, {"units": "N m", "display_units": "N*m"})
        made_up.put(store, name * 20, made_up.run(1.0).assign(duty_torque=duty_torque))

    def ask(where):
        table = store.query(where)
        return "".join(run_id[0] for run_id in table["id"]), table.notes

    return ask


@pytest.mark.parametrize(
    ("where", "found"),
    [
        ("duty_torque > 200 N*m", "a"),
        ("duty_torque < 50 N*m", "b"),
        ("duty_torque = 180 N*m", "a"),  # neither the smallest nor the largest
        ("duty_torque != 180 N*m", "ab"),
        ("150 N*m < duty_torque < 200 N*m", "a"),
        ("duty_torque between 100 N*m and 150 N*m", ""),
        ("duty_torque in [20 N*m, 7 N*m]", "b"),
        ("not duty_torque > 200 N*m", "b"),
        ("duty_torque is missing", ""),
        ("wear_depth > 0.1 um", "ab"),
        ("wear_depth > 1 km", ""),
    ],
)
def test_results_that_files_alone_have_are_compared(in_files, where, found):
    """No run was found by them, and nothing said so."""
    assert in_files(where)[0] == found


def test_a_value_in_the_middle_of_several_is_found(tmp_path):
    """The smallest and the largest alone were compared."""
    store = Store(tmp_path / "store")
    store.archive.create()
    flanks = ["sun", "planet-sun", "planet-ring", "ring"]
    data = made_up.run(1.0).drop_dims("flank")
    safeties = ("flank", [1.1, 1.3, 1.7, 1.9], {"units": "1"})
    data = data.assign(iso_pitting_safety=safeties).assign_coords(flank=flanks)
    made_up.put(store, "a" * 20, data)
    for where, found in (("between 1.2 and 1.4", 1), ("between 1.4 and 1.6", 0)):
        assert len(store.query(f"iso_pitting_safety {where}")) == found
    assert len(store.query("iso_pitting_safety = 1.7")) == 1


def test_texts_at_places_are_no_condition(in_files):
    with pytest.raises(QueryError, match="a text at each place of flank"):
        in_files("flank_side = left")
