"""Expectations met and missed: what counts as success, what is shown,
what the store remembers.
"""

from dataclasses import dataclass

import pytest
from fake_campaign import SIMULATE, Campaign, Case, sweep

import wearlab
from wearlab.campaign import Expectation, ExpectedNumber
from wearlab.store import Store


@dataclass(frozen=True)
class ExpectingCase(Case):
    expect: Expectation | None = None


@pytest.fixture
def store(tmp_path):
    made = Store(tmp_path / "store")
    yield made
    made.close()


def expecting(expect: Expectation | None, act: str = "finish") -> Campaign:
    campaign = sweep(1, act=act)
    (case,) = campaign.cases
    return Campaign(
        (ExpectingCase(case.label, case.scene, case.position, expect),), campaign.axes
    )


def compared(campaign, store):
    report = wearlab.run(campaign, store, simulate=SIMULATE, progress=False, workers=0)
    (one,) = report.expected
    return report.ok, one.comparison


DEEPEST = (
    800.0 + 20.0 + 1.0 + 0.3
)  # last update, second flank, last node of the fake dataset [m]


def wear_depth(value, tolerance):
    return {"wear_depth": ExpectedNumber(value, tolerance, f"{value} ± {tolerance}")}


@pytest.mark.parametrize(
    ("act", "expect", "met"),
    [
        ("refuse", Expectation("refused"), True),
        ("refuse", Expectation("failed"), False),
        ("fail", Expectation("failed"), True),
        ("fail", Expectation("completed"), False),
        ("finish", Expectation("completed"), True),
        ("finish", Expectation("refused"), False),
        ("finish", Expectation(values=wear_depth(DEEPEST, 1e-9)), True),
        ("finish", Expectation(values=wear_depth(DEEPEST - 0.2, 0.1)), False),
        ("refuse", Expectation(values=wear_depth(DEEPEST, 1e9)), False),
        ("finish", Expectation(end_reason="no such reason"), False),
        (
            "finish",
            Expectation(values={"life": ExpectedNumber(0.0, 1e99, "anything")}),
            None,
        ),
    ],
)
def test_success_is_what_was_expected(store, act, expect, met):
    ok, comparison = compared(expecting(expect, act), store)
    if met is None:
        assert comparison.met == ("absent" not in comparison.measured)
    else:
        assert (ok, comparison.met) == (met, met)


def test_a_run_without_expectation_still_has_to_be_done(store):
    report = wearlab.run(
        expecting(None, "refuse"),
        store,
        workers=0,
        simulate=SIMULATE,
        progress=False,
    )
    assert not report.ok
    assert report.expected == ()


def test_measured_stands_beside_expected_in_words_and_in_the_store(store):
    _, comparison = compared(
        expecting(Expectation("completed", None, wear_depth(1.0, 0.5))), store
    )
    assert comparison.verdict == "completed"
    assert comparison.expected == "completed, wear_depth = 1.0 ± 0.5"
    assert comparison.measured == f"completed, wear_depth = {DEEPEST:.6g}"
    (member,) = store.archive.catalogue.members()
    assert member.comparison == comparison


def test_an_expectation_that_is_taken_back_is_forgotten(store):
    compared(expecting(Expectation("completed")), store)
    wearlab.run(expecting(None), store, simulate=SIMULATE, progress=False, workers=0)
    (member,) = store.archive.catalogue.members()
    assert member.comparison is None
