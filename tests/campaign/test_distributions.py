"""Every distribution against SciPy's of the same name; truncation by its definition."""

import math

import numpy as np
import pytest
from scipy import stats

from wearlab.campaign import CampaignError
from wearlab.campaign.axes import read_axes
from wearlab.campaign.distributions import read_distribution

SAME = {
    "normal": ({"normal": {"mean": 3.0, "sd": 2.0}}, stats.norm(3.0, 2.0)),
    "lognormal": (
        {"lognormal": {"median": 2.0, "cov": 0.5}},
        stats.lognorm(math.sqrt(math.log(1.25)), scale=2.0),
    ),
    "uniform": ({"uniform": [1.0, 4.0]}, stats.uniform(1.0, 3.0)),
    "loguniform": ({"loguniform": [1e-3, 10.0]}, stats.loguniform(1e-3, 10.0)),
    "triangular": ({"triangular": [1.0, 2.0, 5.0]}, stats.triang(0.25, 1.0, 4.0)),
    "weibull": (
        {"weibull": {"scale": 3.0, "shape": 1.7}},
        stats.weibull_min(1.7, scale=3.0),
    ),
}
PROBABILITIES = (1e-6, 0.01, 0.2, 0.5, 0.9, 0.999)


def density(law, value):
    return np.exp(law.log_density(value))


def refused(given):
    with pytest.raises(CampaignError) as caught:
        read_distribution(given, "a.b")
    return str(caught.value)


@pytest.mark.parametrize(("given", "peer"), SAME.values(), ids=SAME)
def test_each_is_the_one_of_its_name(given, peer):
    one = read_distribution(given, "a.b")
    for p in PROBABILITIES:
        value = peer.ppf(p)
        assert one.at(p) == pytest.approx(value, rel=1e-9)
        assert one.below(value) == pytest.approx(p, rel=1e-9)
        assert density(one, value) == pytest.approx(peer.pdf(value), rel=1e-9)
    np.testing.assert_array_equal(
        one.at(np.array(PROBABILITIES)), [one.at(p) for p in PROBABILITIES]
    )
    assert math.isfinite(one.at(0.0)) and math.isfinite(one.at(1.0))


@pytest.mark.parametrize(("given", "peer"), SAME.values(), ids=SAME)
def test_a_truncated_one_is_the_rest_made_whole(given, peer):
    low = float(peer.ppf(0.1))
    high = float(peer.ppf(0.7))
    one = read_distribution({**given, "truncate": [low, high]}, "a.b")
    assert (one.at(0.0), one.at(1.0)) == (pytest.approx(low), pytest.approx(high))
    assert one.at(0.5) == pytest.approx(peer.ppf(0.4))
    assert one.below(peer.ppf(0.25)) == pytest.approx(0.25)
    assert density(one, peer.ppf(0.25)) == pytest.approx(peer.pdf(peer.ppf(0.25)) / 0.6)
    assert (
        density(one, low - 1e-9) == density(one, high + 1e-9) == one.below(low) == 0.0
    )


def test_triangles_may_be_right_angled():
    left = read_distribution({"triangular": [0.0, 0.0, 1.0]}, "a.b")
    right = read_distribution({"triangular": [0.0, 1.0, 1.0]}, "a.b")
    for p in PROBABILITIES:
        assert left.at(p) == pytest.approx(1.0 - right.at(1.0 - p))
        assert left.below(left.at(p)) == pytest.approx(p)
    assert density(left, 0.0) == density(right, 1.0) == 2.0


def test_units_join_the_first():
    one = read_distribution(
        {"triangular": ["1 mm", "2000 um", "0.5 cm"], "truncate": ["1.5 mm", "4e-3 m"]},
        "a",
    )
    assert one.unit == "mm" and one.numbers == pytest.approx((1.0, 2.0, 5.0))
    assert (one.low, one.high) == (1.5, pytest.approx(4.0))


@pytest.mark.parametrize("word", SAME)
def test_sweeps_draw_from_each(word):
    given, peer = SAME[word]
    sample = {"method": "sobol", "n": 1024, "seed": 3}
    (axis,) = read_axes([{"wear.coefficient.factor": given, "sample": sample}])
    inside = [peer.cdf(value) for value in axis.coordinates["factor"].values]
    assert stats.kstest(inside, "uniform").statistic < 0.005
    (axis,) = read_axes(
        [
            {
                "wear.coefficient.factor": {**given, "truncate": [1.5, 2.0]},
                "sample": sample,
            }
        ]
    )
    drawn = axis.coordinates["factor"].values
    assert min(drawn) >= 1.5 and max(drawn) <= 2.0


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"loguniform": [0, 1]}, "a.b.loguniform.low: 0 must be greater than 0"),
        ({"loguniform": [2, 1]}, "from 2 to 1 there is nothing to draw"),
        ({"triangular": [1, 2]}, "[1, 2] is not [low, mode, high]"),
        ({"triangular": [1, 0, 2]}, "1, 0, 2 are not in rising order"),
        ({"triangular": [1, 1, 1]}, "are not in rising order"),
        ({"weibull": {"scale": 1, "shape": 0}}, "shape: 0 must be greater than 0"),
        (
            {"weibull": {"scale": 1, "shape": "2 mm"}},
            "shape: a plain number, the exponent",
        ),
        (
            {"uniform": [0, 1], "truncate": [2, 3]},
            "truncate: practically nothing of the distribution",
        ),
        (
            {"uniform": [0, 1], "truncate": [1, 0]},
            "truncate: from 1 to 0 there is nothing",
        ),
        ({"uniform": [0, 1], "truncate": 1}, "truncate: 1 is not [low, high]"),
        (
            {"uniform": ["0 mm", "1 mm"], "truncate": [0, 1]},
            "one value has a unit, the other has none",
        ),
    ],
)
def test_wrong_ones_are_refused(given, said):
    assert said in refused(given)
