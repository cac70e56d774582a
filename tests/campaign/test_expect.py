"""What a campaign expects of its cases: read, inherited, swept, and
never part of an identity.
"""

import math

import pytest

from wearlab.campaign import CampaignError, ExpectedNumber


def test_file_expectation_holds_for_every_case_and_changes_no_identity(study):
    text = '[[sweep]]\n"operation.speed" = ["800 rpm", "900 rpm"]\n'
    plain = study(text)
    expecting = study('[expect]\nverdict = "completed"\nresponse_period = 1\n' + text)
    assert [case.id for case in expecting.cases] == [case.id for case in plain.cases]
    assert all(case.expect is None for case in plain.cases)
    for case in expecting.cases:
        assert case.expect.verdict == "completed"
        assert case.expect.values["response_period"][:2] == (1.0, 0.0)


def test_case_merges_over_the_file_and_another_verdict_replaces_it(study):
    campaign = study("""
        [expect]
        response_period = 1
        end_reason = "depth"
        [[case]]
        label = "same"
        expect = { response_period = 2 }
        [[case]]
        label = "other"
        expect = { verdict = "refused" }
        [[case]]
        label = "none"
        drop = ["expect"]
    """)
    same, other, none = (case.expect for case in campaign.cases)
    assert (same.end_reason, same.values["response_period"].value) == ("depth", 2.0)
    assert (other.verdict, other.end_reason, dict(other.values)) == (
        "refused",
        None,
        {},
    )
    assert none is None


def test_values_are_swept_with_their_keys_without_becoming_coordinates(study):
    campaign = study("""
        [[sweep]]
        "operation.speed" = ["800 rpm", "900 rpm"]
        "expect.floquet_multiplier" = [
            { value = 0.5, tolerance = 0.02 }, { value = 0.7, tolerance = 0.03 }
        ]
        "expect.verdict" = ["completed", "unstable"]
    """)
    assert [case.expect.verdict for case in campaign.cases] == ["completed", "unstable"]
    assert [
        case.expect.values["floquet_multiplier"].tolerance for case in campaign.cases
    ] == [0.02, 0.03]
    assert campaign.axes[0].coordinates == {}


@pytest.mark.parametrize(
    ("given", "value", "tolerance"),
    [
        ('wear_depth = { value = "12 um", tolerance = "0.5 um" }', 12e-6, 0.5e-6),
        ('wear_depth = { value = "12 um", tolerance = 0.5 }', 12e-6, 6e-6),
        ("dynamic_factor = { value = 2.0, tolerance = 0.5 }", 2.0, 0.5),
        ('service_life = { value = "2 h", tolerance = "1 min" }', 7200.0, 60.0),
    ],
)
def test_tolerance_is_absolute_unless_it_is_a_plain_number_beside_a_unit(
    study, given, value, tolerance
):
    (case,) = study("[expect]\n" + given).cases
    (wanted,) = case.expect.values.values()
    assert isinstance(wanted, ExpectedNumber)
    assert math.isclose(wanted.value, value)
    assert math.isclose(wanted.tolerance, tolerance)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('verdict = "complete"', "expect.verdict: 'complete' is not one of"),
        ("response_period = 1.5", "expect.response_period: 1.5 is no count"),
        ("end_reason = 3", "expect.end_reason: 3 is no text"),
        (
            "wear_dept = { value = 1, tolerance = 1 }",
            "expect.wear_dept: no variable of a dataset, did you",
        ),
        ("wear_depth = 3", "expect.wear_depth: 3 is not {value"),
        (
            "wear_depth = { value = 3, tolerance = 0.1 }",
            "needs its unit, such as '3 m'",
        ),
        (
            'wear_depth = { value = "3 s", tolerance = 0.1 }',
            "expect.wear_depth: value '3 s'",
        ),
        ("dynamic_factor = { value = 1, tolerance = -1 }", "tolerance -1 is negative"),
        ('verdict = "refused"\nresponse_period = 1', "has no data to compare"),
    ],
)
def test_what_cannot_be_expected_is_said(study, text, message):
    with pytest.raises(CampaignError) as caught:
        study(f"[expect]\n{text}")
    assert message in str(caught.value)
