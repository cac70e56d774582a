"""Iron in the oil, wear since a time of its own, and unknown gains: of one gear set and
of a fleet, beside made-up units whose wear is known in closed form.
"""

from dataclasses import replace

import numpy as np
import pytest
from conftest import STATIC
from made import ErrorModel, blocks, history, observed, study
from scipy.stats import multivariate_normal
from test_fleet import BLOCK, FLEET, ROWS, fleet
from units import RATE, law, unit

import wearlab as wl
from wearlab.campaign import CampaignError
from wearlab.updating import UpdateError, answers, interval_blocks, update
from wearlab.updating.unit_factors import unit_likelihood

OIL = (
    STATIC.partition("[[update.data]]")[0]
    + """
[[update.data]]
file     = "oil.csv"
quantity = "worn_mass"
member   = "all"
columns  = { hours = "hours", value = "Fe", oil_hours = "oil age" }
units    = { hours = "h", "oil age" = "h" }
oil      = { volume = "20 l" }
error    = { sd = "0.5 ppm", relative = 0.02 }
"""
)


def simulated(folder, text, rows, name="oil.csv"):
    (folder / name).write_text(rows)
    (folder / "oil.toml").write_text(text)
    return wl.load(folder / "oil.toml")


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    return wl.Store(tmp_path_factory.mktemp("store"))


def iron(run, hours, oil_hours, factor):
    """Iron in 20 l of oil with 870 kg/m³ [ppm], from a run's own masses."""
    seconds = float(run.operating_hours[-1]) / float(run.cycle[-1])
    cycles = factor * 3600.0 * np.array([hours - oil_hours, hours]) / seconds
    mass = run.worn_mass.sum("member").values
    worn = np.interp(cycles, run.cycle.values, mass)
    return 1e6 * float(np.diff(worn)[0]) / (0.020 * 870.0)


def test_iron_since_the_last_oil_change_tells_the_coefficient(tmp_path, store):
    """Two fills of oil, samples made from a real run with 1.3 times the coefficient."""
    campaign = simulated(tmp_path, OIL, "hours,Fe [ppm],oil age\n1000,1,1000\n")
    run = wl.simulate(campaign.cases[0].scene)
    samples = [(400.0, 400.0), (900.0, 900.0), (1300.0, 400.0), (1800.0, 900.0)]
    rows = "".join(
        f"{hours},{iron(run, hours, age, 1.3)!r},{age}\n" for hours, age in samples
    )
    tree = update(
        simulated(tmp_path, OIL, "hours,Fe [ppm],oil age\n" + rows),
        store,
        progress=False,
    )
    factor = tree["predictions"]["factor_quantile"].values
    assert factor[2] == pytest.approx(1.3, rel=5e-3)
    assert factor[0] < 1.3 < factor[4]


def test_a_day_of_the_oil_change_says_the_same_as_its_hours(tmp_path, store):
    """366 days at 6,000 h a year."""
    by_hours = "hours,Fe (mg/kg),oil age\n6012,9,6012\n"
    by_days = "date,Fe (mg/kg),changed\n2026-01-01,9,2024-12-31\n"
    dated = OIL.replace('hours = "hours"', 'date = "date"')
    dated = dated.replace('oil_hours = "oil age"', 'oil_changed = "changed"')
    dated = dated.replace('units    = { hours = "h", "oil age" = "h" }\n', "")
    dated = dated.replace(
        "[update]",
        '[update]\ncalendar = { date = "2026-01-01", hours = 6012.3, hours_per_year = '
        "6000 }\n",
        1,
    )
    one = update(simulated(tmp_path, OIL, by_hours), store, progress=False)
    other = update(simulated(tmp_path, dated, by_days), store, progress=False)
    name = "factor_quantile"
    beside = one["predictions"][name].values
    assert other["predictions"][name].values == pytest.approx(beside, rel=2e-3)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('oil      = { volume = "20 l" }\n', "", "oil: required with columns of"),
        ("20 l", "20 kg", "update.data[0].oil.volume"),
        ('"worn_mass"', '"max_wear_depth"', "iron in the oil is worn_mass"),
        ('"0.5 ppm"', '"5 mg"', "update.data[0].error.sd"),
        (
            'oil_hours = "oil age"',
            'oil_hours = "oil age", oil_changed = "x"',
            "oil_hours and oil_changed both say",
        ),
    ],
)
def test_what_no_oil_can_be_is_one_line(tmp_path, old, new, said):
    text = OIL.replace(old, new, 1)
    with pytest.raises(CampaignError) as caught:
        simulated(tmp_path, text, "hours,Fe,oil age\n1000,9,1000\n")
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("hours,Fe [g],oil age\n1000,9,1000\n", "'g' is no share of the oil's mass"),
        ("hours,Fe,oil age\n1000,9,1200\n", "is more than the hours of the gearbox"),
        ("hours,Fe,oil age\n1000,9,-5\n", "is after the sample"),
    ],
)
def test_a_sheet_that_cannot_be_is_refused_by_row(tmp_path, store, rows, said):
    with pytest.raises(UpdateError, match=said):
        update(simulated(tmp_path, OIL, rows), store, progress=False)


def with_block(member, cycle, value, error, since=None, data_since=None):
    """A unit of a fleet that has one block, of depths since some cycles."""
    seen = observed(
        np.asarray(cycle, float),
        value,
        error,
        quantity="max_wear_depth",
        where=None,
        since=data_since,
    )
    since = None if since is None else np.asarray(since, float)
    seen = replace(seen, since=since)
    points = member.run.points[0]._replace(
        cycle=seen.time, column=np.zeros(len(seen), np.intp), since=since
    )
    run = replace(member.run, points=(points,))
    return replace(member, run=run, blocks=blocks((seen,)))


@pytest.mark.parametrize("gain_sd", [0.0, 0.4])
@pytest.mark.parametrize("straying", [0.0, 0.3])
def test_blocks_that_stand_apart_have_the_likelihood_of_scipy(gain_sd, straying):
    """One normal law of all values: their covariance is written out here."""
    cycle = np.array([5e3, 9e3, 9e3, 1.6e4])
    since = np.array([0.0, 0.0, 5e3, 9e3])
    value = np.array([6e-4, 9e-4, 3e-4, 9e-4])
    error = ErrorModel(sd=5e-5, relative=0.1, gain_sd=gain_sd)
    member = with_block(unit("A", [1e4], [1e-3]), cycle, value, error, since)
    shared = law("straying").shared(np.log([[max(straying, 1e-12), 0.3, 1.0]]))
    factors = np.array([0.7, 1.0, 1.4])
    filtered = unit_likelihood(member, shared, np.log(factors)[None], steps=True)

    reference = 1.5e4
    for k, factor in enumerate(factors):
        model = RATE * factor * (cycle - since)
        overlap = np.minimum.outer(cycle, cycle) - np.maximum.outer(since, since)
        rate = (straying * RATE * factor * reference) ** 2 / reference
        covariance = rate * np.maximum(overlap, 0.0)
        covariance += gain_sd**2 * np.outer(model, model)
        covariance += np.diag(5e-5**2 + (0.1 * model) ** 2)
        expected = multivariate_normal.logpdf(value, model, covariance)
        assert filtered.log_likelihood[0, k] == pytest.approx(expected, abs=1e-6)
        by_step = sum(step.log_likelihood[0, k] for step in filtered.steps)
        assert by_step == pytest.approx(expected, abs=1e-6)


def test_one_unit_and_a_gain_say_of_k_what_the_update_of_one_gear_set_says():
    """The same values with an unknown gain, without straying: two ways to integrate."""
    cycle = np.array([5e5, 1e6, 1.5e6])
    value = 2e-8 * 1.2 * cycle
    seen = observed(cycle, value, ErrorModel(sd=1e-3, gain_sd=0.3))
    prior = {"lognormal": {"median": 1.0, "cov": 1.0}}
    asked = study(prior, (seen,))
    run = history((seen,))
    alone = answers.answer_of(asked, (run,), blocks((seen,)))
    factors = alone.factor(np.array([0.05, 0.5, 0.95]))

    log_factor = np.linspace(-6.0, 6.0, 2001)
    member = replace(unit("A", [1.0], [1.0]), run=run, blocks=blocks((seen,)))
    shared = law().shared(np.log([[0.3, 1.0]]))
    logs = unit_likelihood(member, shared, log_factor[None]).log_likelihood[0]
    logs = logs + asked.prior.log_density(np.exp(log_factor)) + log_factor
    mass = np.exp(logs - logs.max())
    cumulative = np.cumsum(mass) / mass.sum()
    expected = np.exp(np.interp([0.05, 0.5, 0.95], cumulative, log_factor))
    assert factors == pytest.approx(expected, rel=5e-3)


OF_FLEET = (
    FLEET
    + """
[[update.data]]
file     = "fleet_oil.csv"
quantity = "worn_mass"
member   = "all"
columns  = { unit = "box", hours = "hours", value = "Fe", oil_hours = "oil age" }
units    = { hours = "h", "oil age" = "h" }
oil      = { volume = "20 l" }
error    = { sd = "0.5 ppm", gain_sd = 0.2, relative = 0.05 }
"""
)


def test_a_fleet_learns_from_iron_of_a_unit_that_was_never_weighed(tmp_path, store):
    """The unit without weighings gets a narrower interval, its pace from its ppm."""
    (tmp_path / "fleet_oil.csv").write_text(
        "box,hours,Fe [ppm],oil age\nnew,200,30,200\nnew,400,30,200\nA,840,14,200\n"
    )
    with_oil = update(fleet(tmp_path, ROWS, OF_FLEET), store, progress=False)
    plain = update(fleet(tmp_path, ROWS, FLEET), store, progress=False)
    name = "factor_quantile"
    q = with_oil["predictions"][name].sel(unit="new").values
    before = plain["predictions"][name].sel(unit="new").values
    assert np.ptp(np.log(q[[0, 4]])) < 0.85 * np.ptp(np.log(before[[0, 4]]))
    assert q[2] > 1.1 * before[2]
    of_a = with_oil["predictions"][name].sel(unit="A").values[2]
    before = plain["predictions"][name].sel(unit="A").values[2]
    assert of_a == pytest.approx(before, rel=0.1)


def test_very_many_values_of_one_unit_are_refused():
    cycle = np.linspace(1e3, 2e4, 61)
    error = ErrorModel(sd=5e-5, gain_sd=0.2)
    member = with_block(unit("A", [1e4], [1e-3]), cycle, RATE * cycle, error)
    with pytest.raises(UpdateError, match="at most 60: thin them out"):
        interval_blocks.refuse_many(member.blocks[0])


__all__ = ["BLOCK"]


def test_oil_that_holds_the_wear_of_a_replaced_gear_is_refused(tmp_path, store):
    """What the old pinion had left in it counted as wear of the new one."""
    head = "hours,Fe [ppm],oil age\n400,2,400\n"
    replaced = '\n[[update.replaced]]\nmembers = ["pinion"]\nhours = 840\n'
    told = simulated(tmp_path, OIL + replaced, f"{head}1120,6,1120\n")
    with pytest.raises(UpdateError, match=r"oil.csv: line 3: .* what the old one lost"):
        update(told, store, progress=False)
    changed = simulated(tmp_path, OIL + replaced, f"{head}1120,1.5,280\n")
    assert update(changed, store, progress=False)
