"""The stiff and extreme cases of ``campaigns/extremes``: each ends as
its file expects.
"""

import pytest
from scenes import CAMPAIGNS

import wearlab
from wearlab.campaign import load
from wearlab.store import Store

FILES = sorted((CAMPAIGNS / "extremes").glob("*.toml"))


LONG = ("lives",)
"""Teeth strike in two of its cases, which takes some twenty seconds of a core each."""


@pytest.mark.parametrize(
    "file",
    [
        pytest.param(one, marks=pytest.mark.slow) if one.stem in LONG else one
        for one in FILES
    ],
    ids=lambda file: file.stem,
)
def test_every_extreme_case_ends_as_its_file_expects(file, tmp_path):
    """129 stiff and extreme scenes keep verdict, end and values: each is a row of
    docs/evidence/extremes.md, with its tolerance.
    """
    campaign = load(file)
    assert all(case.expect is not None for case in campaign.cases)
    assert all(case.expect.verdict is not None for case in campaign.cases)
    store = Store(tmp_path / "store")
    report = wearlab.run(campaign, store, workers=0, progress=False)
    store.close()
    missed = [
        (case.label, *case.comparison)
        for case in report.expected
        if not case.comparison.met
    ]
    assert missed == []
    assert len(report.expected) == len(campaign.cases)
