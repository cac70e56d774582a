"""What helps to find a run: cases in order, conditions with units,
which run lives longest.
"""

import re
from types import SimpleNamespace

import pytest
from fake_campaign import filled, sweep
from scenes import external_pair

import wearlab as wl
from wearlab.browsing import contents, figures, listing, recorded
from wearlab.browsing.one_run import (
    LabelledRun,
    WornPlace,
    in_hours,
    lives_in_words,
    longest,
    margin,
    why,
    worn_place,
)


def test_a_number_without_a_unit_is_asked_for_it_and_kept(small):
    told = listing.listed(
        small.store,
        {"where": "life > 1", "word": "torque", "sign": ">=", "value": "340"},
    )
    assert told.problem == "340 of what? Write torque with its unit: 340 N*m"
    assert (told.where, told.refused) == ("life > 1", ("torque", ">=", "340"))
    page = small.page("runs", word="torque", sign=">=", value="340")
    assert (
        'placeholder="such as 340 N*m" value="340"' in page
        and '<option value="&gt;=" selected>' in page
    )
    for written in ("340 N*m", "340 Nm", "340 N·m"):
        told = listing.listed(
            small.store, {"word": "torque", "sign": ">=", "value": written}
        )
        assert (told.problem, told.where) == ("", f"torque >= {written}")


def test_columns_are_formulas_and_the_page_says_what_a_condition_means(small):
    columns = "case,max_wear_depth,max_wear_depth[flank=pinion, update=-1]"
    told = listing.listed(
        small.store, {"where": "max_wear_depth > 0 um", "columns": columns}
    )
    assert told.problem == ""
    assert [head for _, head in told.heads[2:]] == [
        "max(max wear depth) [µm]",
        "max wear depth[flank=pinion, update=-1] [µm]",
    ]
    (note,) = told.notes
    assert note.startswith("max_wear_depth has several values in a run")
    page = small.page("runs", where="max_wear_depth > 0 um")
    assert "max_wear_depth has several values in a run" in page
    refused = listing.listed(small.store, {"where": "torque >", "columns": columns})
    assert refused.columns == told.columns


def test_a_unit_of_something_else_is_told_as_on_the_command_line(small):
    told = listing.listed(
        small.store, {"word": "torque", "sign": ">=", "value": "340 rpm"}
    )
    assert "rpm" in told.problem and told.where == "" and told.refused[2] == "340 rpm"


def test_cases_are_sorted_by_the_numbers_in_their_cells(tmp_path, opened):
    store = filled(tmp_path / "store", sweep(5))
    (told,) = recorded.campaigns(store)[0]
    rows = contents.cases(store, told.key, "", 0, 9)[1]
    lives = [float(cells[-2].split()[0]) for _, cells in rows]
    assert len(set(lives)) == 5
    pages = [
        contents.cases(store, told.key, "-result", skip, 2)[1] for skip in (0, 2, 4)
    ]
    assert [len(page) for page in pages] == [2, 2, 1]
    assert [
        float(cells[-2].split()[0]) for page in pages for _, cells in page
    ] == sorted(lives, reverse=True)
    page = opened(store).page("campaign", key=told.key, sort="-result")
    assert re.search(r'aria-sort="descending">\s*<a [^>]*sort=result"', page)
    assert contents.cases(store, told.key, "none", 0, 2)[1] == rows[:2]


@pytest.mark.parametrize("cell", ["9.5e+07 cycles of life", "± 3 %", "-2 mm"])
def test_a_cell_is_put_in_order_by_its_number(cell):
    assert contents._sort_key(cell)[:2] == (
        False,
        {"9": 9.5e7, "±": 3.0, "-": -2.0}[cell[0]],
    )
    assert contents._sort_key("completed") > contents._sort_key(cell)


def lived(lives, labels, hours=(None,) * 4, **values):
    """Return the keys and the runs of some lives, torques, models.

    Of each what the catalogue has.
    """
    keys = [f"operation.{name}" for name in values]
    scenes = [
        dict(zip(keys, each, strict=True))
        for each in zip(*values.values(), strict=True)
    ]
    told = zip(
        lives, labels, hours[: len(lives)], scenes or [{}] * len(lives), strict=True
    )
    runs = [
        LabelledRun(
            SimpleNamespace(summary={"life": life, "service_life": time}, values=scene),
            label,
        )
        for life, label, time, scene in told
    ]
    return runs, keys


def test_the_longest_life_is_told_with_what_differs():
    torque = (300.0, 340.0, 400.0)
    assert longest(*lived((9e8, 6e8, 3e8), "abc", torque=torque)) == [
        "The longest life is 9e+08 cycles, of a: 3 times the shortest, of c.",
        "It has the lowest torque, 300 N·m: in these runs life never falls as it gets "
        "lower.",
    ]
    beside = longest(*lived((9e8, 3e8, 6e8), "abc", torque=torque))[1]
    assert beside == "It has the lowest torque, 300 N·m."
    middle = longest(*lived((3e8, 9e8, 6e8), "abc", torque=torque))[1]
    assert middle == "It has torque 340 N·m, neither the lowest nor the highest."


def test_the_next_life_is_told_with_how_far_it_is_behind():
    (first, second), _ = lived((3.70e8, 3.63e8), ["a", "speed 1100 rpm"])
    first.entry.summary["error_estimate_life"] = 1e6
    assert margin(first, second) == "The next, speed 1100 rpm, lives 1.9 % less."
    first.entry.summary["error_estimate_life"] = 1e7
    assert margin(first, second).endswith(
        "1.9 % less, which is within their numerical errors."
    )


def test_several_differences_name_no_cause():
    lives = (9e8, 6e8, 3e8, None)
    torque = (300.0, 300.0, 400.0, 400.0)
    said = longest(*lived(lives, "abcd", torque=torque, model=("x", "y", "y", "x")))
    assert said[1:] == [
        "1 of these runs reached no limit of wear: they may live longer.",
        "It has the lowest torque, 300 N·m, shared with others: "
        "in these runs life never falls as it gets lower.",
        "It has operation model x.",
        "2 keys differ: compare runs that differ in one alone to see what each does.",
    ]


def test_no_longest_life_without_two():
    torque = (300.0, 340.0)
    for lives in ((9e8, None), (None, None)):
        assert longest(*lived(lives, "ab", torque=torque)) == []
    assert longest(*lived((9e8, 9e8), "ab", torque=torque)) == [
        "All 2 lives are 9e+08 cycles."
    ]


def test_a_campaign_without_figures_is_shown_by_a_result_over_its_axis(drawn):
    (told,) = recorded.campaigns(drawn.store)[0]
    source = recorded.campaign_of(drawn.store, told.key)
    asked = figures.Source(drawn.store, source).asked()
    assert asked[0].table["kind"] == "line" and len(asked) == figures.MAX_AT_ONCE
    assert (asked[0].table["y"], asked[0].table["x"]) == ("life", "speed")
    assert "Which lives longest" in drawn.page(
        "compare", run=list(drawn.store.archive.entries())
    )


def test_a_life_that_is_longest_in_hours_alone_is_told():
    told = in_hours(
        lived((3.6e8, 3.7e8, None), "abc", (5500 * 3600.0, 3310 * 3600.0, 9e9))[0]
    )
    assert told == "Counted in hours another one lives longest, a: 5,500 h."
    assert in_hours(lived((3.6e8, 3.7e8), "ab", (10 * 3600.0, 20 * 3600.0))[0]) == ""
    assert in_hours(lived((1.0,), "a")[0]) == ""


def test_a_place_is_worn_out_by_what_differs_there():
    own = WornPlace(
        "pinion", -6.8e-3, 0.9e-13, {"tooth_force": 900.0, "specific_sliding": 0.5}
    )
    other = WornPlace(
        "gear", 0.0, 1e-13, {"tooth_force": 1000.0, "specific_sliding": 0.5}
    )
    assert why(own, other) == [
        "It is worn out on the pinion 6.8 mm before the pitch point, "
        "the next on the gear at the pitch point.",
        "There it wears 10 % less a cycle than the next: "
        "force on the tooth −10 %, specific sliding the same.",
    ]
    assert why(own, other._replace(rate=0.0)) == []


def test_the_page_says_why_one_lives_longer(opened, tmp_path):
    """Two torques, everything else alike: the force alone differs,
    and the product is the rate.
    """
    table = {
        "title": "Two torques",
        "gears": external_pair(25, 30),
        "operation": {"torque": "100 N*m", "speed": "1100 rpm"},
        "mesh": {"stiffness": "potential-energy"},
        "wear": {
            "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
            "load": "static",
            "contact_patch": "none",
            "until": {"depth": "2 um"},
        },
        "sweep": [{"operation.torque": ["100 N*m", "110 N*m"]}],
    }
    store = wl.Store(tmp_path / "store")
    campaign = wl.load(table)
    wl.run(campaign, store, workers=1, progress=False)
    first, second = (store.archive.find(case.scene.id) for case in campaign.cases)
    places = [worn_place(store, entry) for entry in (first, second)]
    for place, entry in zip(places, (first, second), strict=True):
        assert place.rate * entry.summary["life"] == pytest.approx(2e-6, rel=1e-9)
    force = places[0].factors["tooth_force"] / places[1].factors["tooth_force"]
    assert force == pytest.approx(places[0].rate / places[1].rate, rel=5e-3)
    runs = [LabelledRun(first, "100 N·m"), LabelledRun(second, "110 N·m")]
    said = lives_in_words(store, runs, ["operation.torque"])
    assert said[1].startswith("The next, 110 N·m, lives ")
    failed = SimpleNamespace(id="", summary={}, scene="{}")
    assert (
        lives_in_words(
            store, [*runs, LabelledRun(failed, "failed")], ["operation.torque"]
        )
        == said
    )
    assert said[2] == "It differs from the next in torque alone: 100 N·m for 110 N·m."
    assert said[4].startswith("There it wears") and "force on the tooth −" in said[4]
    page = opened(store).page("compare", run=[first.id, second.id])
    assert "Which lives longest, and why" in page and said[2] in page
    page = opened(store).page(
        "run", id=first.id, back="where=torque+%3E%3D+1+N*m&sort=-life&token=x"
    )
    assert "Back to the runs" in page and "Compare it with its campaign" in page
