"""Very many values, condensed, are as probable as they are one by one."""

from dataclasses import replace

import numpy as np
import pytest
from made import ErrorModel, blocks, history, observed, study

from wearlab.campaign.distributions import read_distribution
from wearlab.updating import answers, condensing, likelihood
from wearlab.updating.answers import answer_of
from wearlab.updating.likelihood import ParameterBatch
from wearlab.updating.measurements import UpdateError
from wearlab.updating.run_curves import ObservationPoints, RunCurve

KNOTS = np.array([0.0, 1e5, 1.3e5, 4e5, 4.001e5, 9e5, 1.2e6])
PLACES = 3
N = 900


@pytest.fixture(autouse=True)
def few_are_many(monkeypatch):
    monkeypatch.setattr(condensing, "MANY", 600)


def run_and(error, own=0.0, seed=0):
    """Return a run whose wear bends at uneven cycles, and values at three places, some
    of them repeated.
    """
    rng = np.random.default_rng(seed)
    value = np.cumsum(rng.uniform(0.5, 2.0, (len(KNOTS), PLACES)), axis=0) * 1e-3
    curve = RunCurve(KNOTS, value, rng.uniform(0.5, 2.0, value.shape) * 1e-8)
    cycle = rng.uniform(0.0, 1.1e6, N)
    cycle[:150], cycle[150:180] = 7e5, 0.0
    column = rng.integers(0, PLACES, N)
    seen = observed(
        cycle, curve.at(1.3 * cycle, column) + 4e-4 * rng.standard_normal(N), error
    )
    seen = replace(seen, sd=own * rng.uniform(0.5, 2.0, N))
    run = replace(
        history((seen,)),
        points=(ObservationPoints(curve, column.astype(np.intp), cycle),),
    )
    return run, seen


def both(monkeypatch, found):
    """Return what is found by what is sufficient, and value by value."""
    short = found()
    monkeypatch.setattr(condensing, "condenses", lambda *_: False)
    return short, found()


@pytest.mark.parametrize("gain", [0.0, 0.2])
@pytest.mark.parametrize(
    ("own", "relative"), [(0.0, 0.0), (2e-4, 0.0), (0.0, 0.05), (2e-4, 0.05)]
)
def test_the_sum_of_squares_is_that_of_all_values(monkeypatch, own, relative, gain):
    run, seen = run_and(ErrorModel(4e-4, relative=relative, gain_sd=gain), own)
    (block,) = blocks((seen,))
    factor = np.geomspace(0.2, 8.0, 57)[:, None, None]

    def found():
        return likelihood.log_likelihood(
            block, run, 0, ParameterBatch(factor, np.array([[[4e-4]]]), np.zeros(1))
        )

    short, whole = both(monkeypatch, found)
    assert (
        short.log_likelihood.shape == whole.log_likelihood.shape
        and short.cycle == whole.cycle
    )
    assert short.log_likelihood == pytest.approx(
        whole.log_likelihood, rel=1e-12, abs=1e-5 if relative else 1e-7
    )
    for part in ("mean", "variance"):  # of the gain
        assert getattr(short, part) == pytest.approx(
            getattr(whole, part), rel=1e-6, abs=1e-9
        )


def test_rows_that_do_not_count_do_not():
    run, seen = run_and(ErrorModel(4e-4))
    (block,) = blocks((seen,))
    some = replace(block, rows=np.arange(0, N - 250))
    one = np.array([1.3])
    zero = np.zeros(1)
    less = likelihood.log_likelihood(
        some, run, 0, ParameterBatch(one, np.array([4e-4]), zero)
    ).log_likelihood
    rest = replace(block, rows=np.arange(N - 250, N))
    rest_of = likelihood.log_likelihood(
        rest, run, 0, ParameterBatch(one, np.array([4e-4]), zero)
    ).log_likelihood
    all_of = likelihood.log_likelihood(
        block, run, 0, ParameterBatch(one, np.array([4e-4]), zero)
    ).log_likelihood
    assert less + rest_of == pytest.approx(all_of, rel=1e-12)


def test_the_answer_is_the_same(monkeypatch):
    unknown = read_distribution({"loguniform": ["0.01 g", "5 g"]}, "sd")
    run, seen = run_and(ErrorModel(unknown))
    asked = study({"lognormal": {"median": 1.0, "cov": 3.0}}, (seen,))
    short, whole = both(monkeypatch, lambda: answer_of(asked, [run], blocks((seen,))))
    p = np.array([0.05, 0.5, 0.95])
    assert short.factor(p) == pytest.approx(whole.factor(p), rel=1e-10)
    assert short.posterior.evidence == pytest.approx(whole.posterior.evidence, abs=1e-7)
    assert short.posterior.spreads[0][0][0] == pytest.approx(
        whole.posterior.spreads[0][0][0]
    )


@pytest.mark.parametrize(
    ("error", "own"),
    [
        (ErrorModel(4e-4, offset_sd=1e-4), 0.0),
        (ErrorModel(4e-4, 0.05), 2e-4),
        (ErrorModel(4e-4, drift=1e-3), 0.0),
    ],
)
def test_too_many_values_that_cannot_be_condensed_are_refused(monkeypatch, error, own):
    """A hundred thousand of them took minutes, a million had no end."""
    monkeypatch.setattr(answers, "MAX_ONE_BY_ONE", N - 1)
    run, seen = run_and(error, own)
    accumulates = "none" if error.drift is None else "accumulating"
    asked = study({"lognormal": {"median": 1.0, "cov": 3.0}}, (seen,), accumulates)
    with pytest.raises(
        UpdateError, match=r"update.data\[0\]: 900 values .* thin them out"
    ):
        answers.blocks_of(asked, [run])
    plain = study(
        {"lognormal": {"median": 1.0, "cov": 3.0}}, (run_and(ErrorModel(4e-4))[1],)
    )
    assert len(answers.blocks_of(plain, [run])) == 1
