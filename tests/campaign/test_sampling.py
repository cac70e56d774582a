import math
import statistics

import pytest

from wearlab.campaign import CampaignError
from wearlab.campaign.axes import read_axes

BLOCK = {
    "operation.torque": {"normal": {"mean": "340 N*m", "sd": "0.01 kN*m"}},
    "wear.coefficient.factor": {"lognormal": {"median": 2.0, "cov": 0.3}},
    "errors.pinion.total_composite": {"uniform": ["5 um", "0.025 mm"]},
}


def sampled(method="sobol", n=64, seed=7, **block):
    (axis,) = read_axes(
        [{**(block or BLOCK), "sample": {"method": method, "n": n, "seed": seed}}]
    )
    return axis


def refused(block):
    with pytest.raises(CampaignError) as caught:
        read_axes([block])
    return str(caught.value)


def columns(axis):
    """What is drawn stands beside the numbered samples, by its old names."""
    assert axis.name == "sample" and axis.values == tuple(range(len(axis.values)))
    return tuple(
        axis.coordinates[name].values
        for name in ("torque", "factor", "total_composite")
    )


@pytest.mark.parametrize("method", ["sobol", "latin-hypercube", "random"])
def test_drawn_values_follow_their_distributions(method):
    axis = sampled(method, 2048)
    torque, factor, error = columns(axis)
    units = [axis.coordinates[name].units for name in ("torque", "total_composite")]
    assert units == ["N*m", "um"]
    assert statistics.mean(torque) == pytest.approx(340.0, abs=0.7)
    assert statistics.stdev(torque) == pytest.approx(10.0, rel=0.05)
    assert statistics.median(factor) == pytest.approx(2.0, rel=0.03)
    assert statistics.stdev(factor) / statistics.mean(factor) == pytest.approx(
        0.3, rel=0.08
    )
    assert min(error) >= 5.0 and max(error) <= 25.0
    assert statistics.mean(error) == pytest.approx(15.0, rel=0.03)
    assert axis.written["operation.torque"][0] == f"{torque[0]!r} N*m"


@pytest.mark.parametrize("method", ["sobol", "latin-hypercube", "random"])
def test_keys_are_drawn_independently_and_reproducibly(method):
    torque, factor, error = columns(sampled(method, 1024))
    for one, other in ((torque, factor), (torque, error), (factor, error)):
        assert abs(statistics.correlation(one, other)) < 0.1
    assert columns(sampled(method, 1024)) == (torque, factor, error)
    assert columns(sampled(method, 1024, seed=8)) != (torque, factor, error)


@pytest.mark.parametrize(
    ("method", "keeps"), [("sobol", True), ("random", True), ("latin-hypercube", False)]
)
def test_what_can_be_extended_keeps_its_first_points(method, keeps):
    few = columns(sampled(method, 12))[0]
    more = columns(sampled(method, 20))[0]
    assert (more[:12] == few) is keeps


def test_a_latin_hypercube_has_one_point_in_every_stratum():
    _, _, error = columns(sampled("latin-hypercube", 20))
    assert sorted(math.floor(value - 5.0) for value in error) == list(range(20))


def test_lists_advance_beside_what_is_drawn():
    block = {
        "errors.seed": {"integers": [1, 20]},
        "wear.coefficient.factor": BLOCK["wear.coefficient.factor"],
    }
    axis = sampled("latin-hypercube", 20, **block)
    alone = sampled(
        "latin-hypercube", 20, **{"a.factor": BLOCK["wear.coefficient.factor"]}
    )
    assert axis.coordinates["seed"].values == tuple(range(1, 21))
    assert axis.coordinates["factor"].values == alone.coordinates["factor"].values
    said = refused(
        {**block, "sample": {"method": "latin-hypercube", "n": 21, "seed": 7}}
    )
    assert "errors.seed has 20, wear.coefficient.factor has 21 values" in said


@pytest.mark.parametrize(
    ("block", "said"),
    [
        ({"a.b": [1, 2]}, "sweep[0].a.b: [1, 2] is no distribution"),
        ({"a.b": {"normal": {"mean": 1}}}, "is not {mean = …, sd = …}"),
        ({"a.b": {"normal": {"mean": 1, "sd": 0}}}, "sd: 0 must be greater than 0"),
        (
            {"a.b": {"normal": {"mean": "1 mm", "sd": 2}}},
            "one value has a unit, the other has none",
        ),
        (
            {"a.b": {"normal": {"mean": "1 mm", "sd": "2 N"}}},
            "'N' is not a unit like 'mm'",
        ),
        (
            {"a.b": {"lognormal": {"median": -1, "cov": 0.1}}},
            "median: -1 must be greater than 0",
        ),
        ({"a.b": {"lognormal": {"median": 1, "cov": "1 mm"}}}, "cov: a plain number"),
        ({"a.b": {"uniform": [2, 1]}}, "from 2 to 1 there is nothing"),
        ({"a.b": {"uniform": [1]}}, "[1] is not [low, high]"),
        ({"a.b": {"uniform": [1, math.inf]}}, "inf is neither"),
        ({"a.b": {"uniform": [1, 2], "unit": "mm"}}, "'unit' does not belong"),
    ],
)
def test_wrong_distributions_are_refused(block, said):
    assert said in refused({**block, "sample": {"method": "random", "n": 2, "seed": 0}})


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"method": "sobel"}, "did you mean 'sobol'?"),
        ({"n": 0}, "sample.n: 0 is no whole number from 1 on"),
        ({"n": 10**9}, "more than 100,000: take fewer"),
        ({"n": 2.0}, "no whole number"),
        ({"seed": -1}, "sample.seed: -1 is no whole number"),
        ({"sead": 1}, "sample.sead: unknown key, did you mean 'seed'?"),
    ],
)
def test_wrong_samples_are_refused(change, said):
    assert said in refused(
        {
            "a.b": {"uniform": [1, 2]},
            "sample": {"method": "random", "n": 2, "seed": 0} | change,
        }
    )


def test_correlated_inputs_have_the_rank_correlation_and_keep_their_distributions():
    """A Gaussian copula: Spearman's ρ as asked, every margin as without it."""
    from scipy.stats import kstest, spearmanr

    keys = list(BLOCK)
    sample = {"method": "sobol", "n": 4096, "seed": 7}
    pairs = [[keys[0], keys[1], -0.7], [keys[1], keys[2], 0.5]]
    (axis,) = read_axes([{**BLOCK, "sample": {**sample, "correlation": pairs}}])
    torque, factor, error = columns(axis)
    assert spearmanr(torque, factor).statistic == pytest.approx(-0.7, abs=0.01)
    assert spearmanr(factor, error).statistic == pytest.approx(0.5, abs=0.01)
    assert spearmanr(torque, error).statistic == pytest.approx(0.0, abs=0.02)
    assert kstest(torque, "norm", args=(340.0, 10.0)).pvalue > 0.5
    assert kstest(error, "uniform", args=(5.0, 20.0)).pvalue > 0.5


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (
            [["operation.torque", "wear.coefficient.factor", 1.0]],
            "with ρ within −1 and 1",
        ),
        (
            [["operation.torque", "operation.speed", 0.5]],
            "'operation.speed' is not drawn here",
        ),
        ([["operation.torque", "operation.torque", 0.5]], "stands beside itself"),
        ("operation.torque", "is no list: [key, key, Spearman's ρ]"),
        (
            [
                [*pair, rho]
                for pair, rho in zip(
                    [list(BLOCK)[:2], list(BLOCK)[1:], list(BLOCK)[::2]],
                    [0.95, 0.95, -0.95],
                    strict=True,
                )
            ],
            "contradict each other",
        ),
    ],
)
def test_correlations_that_cannot_be(given, told):
    sample = {"method": "sobol", "n": 8, "seed": 7, "correlation": given}
    assert told in refused({**BLOCK, "sample": sample})


def test_the_design_of_sobol_indices_swaps_one_input_of_pairs_of_points_at_a_time():
    axis = sampled("sobol-indices", 8)
    assert (axis.name, axis.values) == ("sample", tuple(range(8 * 5)))
    names = ("torque", "factor", "total_composite")
    rows = list(zip(*(axis.coordinates[name].values for name in names), strict=True))
    for a, b, *mixed in (rows[i : i + 5] for i in range(0, 40, 5)):
        for j, one in enumerate(mixed):
            assert one == (*a[:j], b[j], *a[j + 1 :])
    longer = sampled("sobol-indices", 16)
    assert (
        longer.coordinates["torque"].values[:40] == axis.coordinates["torque"].values
    )  # it can be extended
    correlated = {
        "method": "sobol-indices",
        "n": 8,
        "seed": 1,
        "correlation": [[*list(BLOCK)[:2], 0.5]],
    }
    assert "independent inputs" in refused({**BLOCK, "sample": correlated})
    assert "pairs of points" in refused(
        {**BLOCK, "sample": {"method": "sobol-indices", "n": 99_999, "seed": 1}}
    )
