"""What helps to find a run: cases in order, conditions with units, which run lives longest."""

import re

import pytest
from fake_campaign import filled, sweep

from wearlab.browsing import contents, listing, recorded
from wearlab.browsing.one_run import in_hours, longest


def test_a_number_without_a_unit_is_asked_for_it_and_kept(small):
    told = listing.listed(small.store, {"where": "life > 1", "word": "torque", "sign": ">=", "value": "340"})
    assert told.problem == "340 of what? Write torque with its unit: 340 N*m"
    assert (told.where, told.refused) == ("life > 1", ("torque", ">=", "340"))
    page = small.page("runs", word="torque", sign=">=", value="340")
    assert 'placeholder="340 N*m" value="340"' in page and '<option value="&gt;=" selected>' in page
    for written in ("340 N*m", "340 Nm", "340 N·m"):
        told = listing.listed(small.store, {"word": "torque", "sign": ">=", "value": written})
        assert (told.problem, told.where) == ("", f"torque >= {written}")


def test_a_unit_of_something_else_is_told_as_on_the_command_line(small):
    told = listing.listed(small.store, {"word": "torque", "sign": ">=", "value": "340 rpm"})
    assert "rpm" in told.problem and told.where == "" and told.refused[2] == "340 rpm"


def test_cases_are_sorted_by_the_numbers_in_their_cells(tmp_path, opened, monkeypatch):
    monkeypatch.setattr(contents, "ROWS", 2)
    store = filled(tmp_path / "store", sweep(5))
    (told,) = recorded.campaigns(store)[0]
    rows = contents.cases(store, told.key, 0, 9)[1]
    lives = [float(cells[-2].split()[0]) for _, cells in rows]
    assert len(set(lives)) == 5
    pages = [contents.sorted_cases(store, told.key, "-result", number)[1] for number in (1, 2, 3)]
    assert [len(page) for page in pages] == [2, 2, 1]
    assert [float(cells[-2].split()[0]) for page in pages for _, cells in page] == sorted(lives, reverse=True)
    page = opened(store).page("campaign", key=told.key, sort="-result")
    assert re.search(r'aria-sort="descending">\s*<a [^>]*sort=result"', page)
    assert contents.sorted_cases(store, told.key, "none", 1)[1] == rows[:2]


@pytest.mark.parametrize("cell", ["9.5e+07 cycles of life", "± 3 %", "-2 mm"])
def test_a_cell_is_put_in_order_by_its_number(cell):
    assert contents._in_order(cell)[:2] == (False, {"9": 9.5e7, "±": 3.0, "-": -2.0}[cell[0]])
    assert contents._in_order("completed") > contents._in_order(cell)


def scenes(**values):
    keys = [f"operation.{name}" for name in values]
    return keys, [dict(zip(keys, each, strict=True)) for each in zip(*values.values(), strict=True)]


def test_the_longest_life_is_told_with_what_differs():
    keys, told = scenes(torque=(300.0, 340.0, 400.0))
    assert longest((9e8, 6e8, 3e8), "abc", told, keys) == [
        "The longest life is 9e+08 cycles, of a: 3 times the shortest, of c.",
        "It has the lowest operation.torque, 300 N·m: in these runs life never falls as it gets lower.",
    ]
    beside = longest((9e8, 3e8, 6e8), "abc", told, keys)[1]
    assert beside == "It has the lowest operation.torque, 300 N·m."
    middle = longest((3e8, 9e8, 6e8), "abc", told, keys)[1]
    assert middle == "It has operation.torque 340 N·m, neither the lowest nor the highest."


def test_several_differences_name_no_cause():
    keys, told = scenes(torque=(300.0, 300.0, 400.0, 400.0), model=("x", "y", "y", "x"))
    said = longest((9e8, 6e8, 3e8, None), "abcd", told, keys)
    assert said[1:] == [
        "It has the lowest operation.torque, 300 N·m, shared with others: "
        "in these runs life never falls as it gets lower.",
        "It has operation.model x.",
        "2 keys differ: compare runs that differ in one alone to see what each does.",
        "1 of these runs have no life.",
    ]


def test_no_longest_life_without_two():
    keys, told = scenes(torque=(300.0, 340.0))
    assert longest((9e8, None), "ab", told, keys) == longest((None, None), "ab", told, keys) == []
    assert longest((9e8, 9e8), "ab", told, keys) == ["All 2 lives are 9e+08 cycles."]


def test_a_campaign_without_figures_is_shown_by_a_result_over_its_axis(drawn):
    (told,) = recorded.campaigns(drawn.store)[0]
    source = recorded.campaign_of(drawn.store, told.key)
    asked = contents.asked_of(source, drawn.store.open(source))
    assert asked[0].table["kind"] == "line" and len(asked) == contents.FIGURES
    assert (asked[0].table["y"], asked[0].table["x"]) == ("life", "speed")
    assert "Which lives longest" in drawn.page("compare", run=list(drawn.store.entries()))


def test_a_life_that_is_longest_in_hours_alone_is_told():
    told = in_hours((3.6e8, 3.7e8, None), (5500 * 3600.0, 3310 * 3600.0, 9e9), "abc")
    assert told == "Counted in hours it is another one: 5,500 h, of a."
    assert in_hours((3.6e8, 3.7e8), (10 * 3600.0, 20 * 3600.0), "ab") == in_hours((1.0,), (None,), "a") == ""
