"""A population of units: liners of engines that were measured, and a sampler that
shares no code with it.
"""

from dataclasses import replace

import numpy as np
import pytest
from made import ErrorModel, blocks, observed
from scipy import stats
from units import (
    LIMIT,
    LINERS,
    PRIORS,
    RATE,
    law,
    liners,
    lognormal,
    quantile,
    simulated,
    unit,
)

import wearlab
from wearlab.updating import UpdateError, fleet_law, kalman, unit_factors
from wearlab.updating import population as room
from wearlab.updating.fleet_law import Parameter
from wearlab.updating.grids import equal_draws
from wearlab.updating.population import fit_population
from wearlab.updating.run_curves import Clock, ObservationPoints, RunCurve
from wearlab.updating.unit_factors import factors
from wearlab.updating.unit_states import (
    DRAWS,
    UnitState,
    joint_draws,
    states_after,
    states_now,
)

P = np.array([0.05, 0.25, 0.5, 0.75, 0.95])


def rules():
    """Return how far the others' median rate since the last inspection, and a line from
    0, are off [mm].
    """
    hours = [np.append(0.0, each.cycles) for each in liners()]
    depth = [np.append(0.0, each.blocks[0].observed.value) for each in liners()]
    rates = [np.diff(y) / np.diff(x) for x, y in zip(hours, depth, strict=True)]
    rate = []
    line = []
    for k, (x, y) in enumerate(zip(hours, depth, strict=True)):
        others = np.median(
            np.concatenate([each for n, each in enumerate(rates) if n != k])
        )
        rate += list(np.abs(y[1:-1] + others * np.diff(x[1:]) - y[2:]))
        line += list(np.abs(y[1:-1] / x[1:-1] * x[2:] - y[2:]))
    return 1e3 * np.mean(rate), 1e3 * np.mean(line)


def test_the_next_inspection_of_every_liner_is_foreseen(tmp_path):
    """The campaign of the liners, um for mm: from the inspections
    before and the other liners.
    """
    campaign = wearlab.load(LINERS.parents[1] / "update_liners.toml")
    tree = wearlab.update(
        campaign, wearlab.Store(tmp_path / "store"), replay=True, progress=False
    )
    stats = tree["sample_stats"].to_dataset()
    error, of_rate, of_line = (
        1e6 * float(stats[f"replay_{name}"])
        for name in ("mean_error", "error_of_rate", "error_of_line")
    )
    assert (of_rate, of_line) == pytest.approx(rules(), rel=1e-6)
    assert of_rate == pytest.approx(0.245, abs=0.001) and error < 0.235
    assert int(stats["replay_count"]) == 26
    assert 0.80 <= float(stats["replay_in_90"]) / 26 <= 0.97
    assert 0.35 <= float(stats["replay_in_50"]) / 26 <= 0.7


def beside_emcee(emcee):
    """Return how far quantiles of what five units share, and of factors, are from a
    chain's, over its sd.

    And how far correlations of all of them are. All are sampled together; likelihoods
    from whole covariances.
    """
    units = liners()[:5]
    names = ("power", "straying", "spread", "median")
    found = fit_population(units, law("power", "straying"), 0)

    def log_probability(points):
        power, straying, spread, median = points[:, :4].T
        total = (
            -0.5 * ((points[:, 4:] - median[:, None]) / np.exp(spread)[:, None]) ** 2
        )
        total = total.sum(axis=1) - 5.0 * spread
        for name, column in zip(names, (power, straying, spread, median), strict=True):
            prior, _ = PRIORS[name]
            sigma = np.sqrt(
                np.log1p(
                    {"power": 0.3, "straying": 1.0, "spread": 1.0, "median": 2.0}[name]
                    ** 2
                )
            )
            total += stats.norm(np.log(prior.at(0.5)), sigma).logpdf(column)
        for k, each in enumerate(units):
            equal = 1.5e4 * (each.cycles / 1.5e4) ** np.exp(power)[:, None]
            factor = np.exp(points[:, 4 + k])
            rate = (np.exp(straying) * factor * RATE * 1.5e4) ** 2 / 1.5e4
            cov = rate[:, None, None] * np.minimum(equal[:, :, None], equal[:, None, :])
            root = np.linalg.cholesky(cov + 5e-5**2 * np.eye(len(each.cycles)))
            off = each.blocks[0].observed.value - RATE * factor[:, None] * equal
            z = np.linalg.solve(root, off[..., None])[..., 0]
            total += -0.5 * (z**2).sum(axis=1) - np.log(
                np.diagonal(root, axis1=1, axis2=2)
            ).sum(axis=1)
        return total

    rng = np.random.default_rng(3)
    start = np.array(
        [-0.3, -1.4, -1.5, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]
    ) + 0.05 * rng.standard_normal((60, 9))
    sampler = emcee.EnsembleSampler(60, 9, log_probability, vectorize=True)
    sampler._random.seed(4)
    sampler.run_mcmc(start, 6000)
    chain = sampler.get_chain(discard=1000, thin=5, flat=True)
    mine = {name: np.log(quantile(found, name, P)) for name in names}
    theta, factor, _ = joint_draws(found, 8000, rng)
    mine |= {
        each.name: np.quantile(own, P) for each, own in zip(units, factor, strict=True)
    }
    theirs = zip(mine, np.quantile(chain, P, axis=0).T, chain.std(axis=0), strict=True)
    off = {name: float(np.abs(mine[name] - q).max() / sd) for name, q, sd in theirs}
    together = np.corrcoef(np.hstack([theta, factor.T]).T) - np.corrcoef(chain.T)
    return off, float(np.abs(together).max())


@pytest.mark.slow
def test_five_units_agree_with_emcee():
    found, together = beside_emcee(pytest.importorskip("emcee"))
    assert len(found) == 9 and max(found.values()) < 0.1, found
    assert together < 0.1


def mixed():
    """A unit whose depth, mass and profile were measured.

    Its masses have a clock of their own.

    With it the model's values, what is worn at T of each, equal wear time, and own
    variance, in closed form.
    """
    factor, power, faster = 1.1, 0.9, 1.04
    cycles = (
        np.array([1e4, 3e4, 4e4]),
        np.array([1e4, 2e4]),
        np.repeat([1.5e4, 3e4], 2),
    )
    values = (
        np.array([1.1e-3, 3.6e-3, 4.9e-3]),
        np.array([0.028, 0.049]),
        np.array([1.5, 3.2, 3.1, 6.4]) * 1e-3,
    )
    errors = (ErrorModel(5e-5), ErrorModel(1e-3, offset_sd=2e-3), ErrorModel(8e-5))
    column = [np.zeros(3, int), np.zeros(2, int), np.array([0, 1, 0, 1])]
    ends = np.array([0.0, 1e5])
    # slope and bend of each column
    bends = [
        np.array([[RATE, 2.5e-6]]),
        np.array([[3e-6, -1.25e-6]]),
        np.array([[RATE, 0.0], [2 * RATE, 0.0]]),
    ]
    asked = []
    model = []
    worn = []
    equal = []
    own = []
    for n, (slope, bend) in enumerate(each.T for each in bends):
        run = RunCurve(
            ends,
            slope * ends[:, None] * (1.0 + bend * ends[:, None]),
            slope * (1.0 + 2.0 * bend * ends[:, None]),
        )
        clock = Clock(ends, faster * ends) if n == 1 else None
        asked.append(ObservationPoints(run, column[n], cycles[n], clock))
        x = factor * 1.5e4 * ((faster if clock else 1.0) * cycles[n] / 1.5e4) ** power
        s = slope[column[n]]
        c = bend[column[n]]
        model.append(s * x * (1.0 + c * x))
        worn.append(
            np.full(
                len(x), np.mean(slope * factor * 1.5e4 * (1.0 + bend * factor * 1.5e4))
            )
        )
        equal.append(1.5e4 * (cycles[n] / 1.5e4) ** power)
        own.append(np.full(len(x), errors[n].sd ** 2 + errors[n].offset_sd ** 2))
    one = unit("a", cycles[0], values[0])
    seen = tuple(observed(*each) for each in zip(cycles, values, errors, strict=True))
    one = replace(one, run=replace(one.run, points=tuple(asked)), blocks=blocks(seen))
    return one, *map(np.concatenate, (values, model, worn, equal, own))


def test_what_is_measured_of_a_unit_strays_together():
    """Against one normal law of all values: every file strayed by itself before."""
    one, value, model, worn, equal, own = mixed()
    rate = 0.2**2 / 1.5e4
    lane = np.ones((1, 1))
    shared = fleet_law.Shared(
        0.9 * lane, 0.2 * lane, (5e-5 * lane, 1e-3 * lane, 8e-5 * lane), 1.5e4
    )
    seen = unit_factors.unit_likelihood(one, shared, np.log([[1.1]]), steps=True)
    cov = rate * np.minimum(equal[:, None], equal) * worn[:, None] * worn + np.diag(own)
    exact = stats.multivariate_normal(model, cov).logpdf(value)
    assert seen.log_likelihood[0, 0] == pytest.approx(exact, abs=1e-9)
    gain = np.linalg.solve(cov, rate * equal * worn)
    assert seen.mean[0, 0] == pytest.approx(gain @ (value - model))
    assert seen.variance[0, 0] == pytest.approx(
        rate * (equal.max() - gain @ (equal * worn))
    )
    state = UnitState(
        one,
        shared,
        np.array([1.1]),
        0,
        seen.mean[:, 0],
        seen.variance[:, 0],
        equal.max(keepdims=True),
    )
    ahead = 1.5e4 * (5e4 / 1.5e4) ** 0.9
    mean, variance = state.wear(5e4, 1)
    x = 1.1 * 1.5e4 * (1.04 * 5e4 / 1.5e4) ** 0.9
    share = worn[3]
    with_it = rate * equal * worn * share
    assert mean[0] == pytest.approx(
        3e-6 * x * (1.0 - 1.25e-6 * x) + np.linalg.solve(cov, with_it) @ (value - model)
    )
    assert variance[0] == pytest.approx(
        rate * ahead * share**2 - with_it @ np.linalg.solve(cov, with_it)
    )
    times = [(number, each.cycle) for number, each in one.inspections]
    assert times == [
        (0, 1e4),
        (1, 1e4),
        (2, 1.5e4),
        (1, 2e4),
        (0, 3e4),
        (2, 3e4),
        (0, 4e4),
    ]
    assert replace(one, foreseen=1).inspected(np.array([1e4, 2e4, 3e4])).tolist() == [
        1,
        3,
        5,
    ]


def test_a_finer_lattice_changes_nothing(monkeypatch):
    units = simulated(8, 4, 5)
    names = ("straying", "spread", "median")
    coarse = fit_population(units, law("straying"), 0)
    known = [np.log(quantile(coarse, name, P)) for name in names]
    monkeypatch.setattr(room, "SPACING", {3: 0.3})
    monkeypatch.setattr(room, "RADIUS", 6.0)
    room.lattice.cache_clear()
    fine = fit_population(units, law("straying"), 0)
    exact = [np.log(quantile(fine, name, P)) for name in names]
    room.lattice.cache_clear()
    assert len(fine.theta) > 5 * len(coarse.theta)
    assert coarse.evidence == pytest.approx(fine.evidence, abs=5e-3)
    for mine, theirs in zip(known, exact, strict=True):
        assert np.abs(mine - theirs).max() < 0.05 * np.ptp(theirs)


def test_a_population_that_is_known_gives_each_unit_its_conjugate_law():
    """Narrow priors: y = f g with ln f ~ N(m, s²), small errors, against a quadrature
    of its own.
    """
    cycle = np.array([1e4, 2e4])
    value = np.array([1.25e-3, 2.55e-3])
    one = unit("a", cycle, value, 1e-4)
    tight = {
        "spread": (lognormal(0.3, 1e-3), 1.0),
        "median": (lognormal(1.0, 1e-3), 1.0),
    }
    known = law(sd=1e-4)._replace(
        parameters=tuple(Parameter(n, *tight[n]) for n in ("spread", "median"))
    )
    found = fit_population([one], known, 0)
    u = np.linspace(-1.0, 1.0, 200_001)
    logs = stats.norm(0.0, 0.3).logpdf(u)
    logs += (
        stats.norm(value[:, None], 1e-4)
        .logpdf(RATE * np.exp(u) * cycle[:, None])
        .sum(axis=0)
    )
    mass = np.exp(logs - logs.max())
    assert found.evidence == pytest.approx(
        np.log(np.trapezoid(mass, u)) + logs.max(), abs=1e-3
    )
    rng = np.random.default_rng(0)
    mine = np.quantile(
        factors(
            one, known, found.theta[equal_draws(found.weight(), 20_000, rng)], rng
        ).log_factor,
        P,
    )
    exact = np.interp(P, np.cumsum(mass) / mass.sum(), u)
    assert np.abs(mine - exact).max() < 0.05 * 0.02


def test_intervals_of_lives_hold_the_truth_as_often_as_they_say():
    """40 fleets of 6 drawn outside of the code: what they share,
    their walks, their lives.
    """
    sigma = {"straying": (0.2, 0.5), "spread": (0.3, 0.5), "median": (1.0, 0.3)}
    asked = law("straying")._replace(
        parameters=tuple(
            Parameter(name, lognormal(*prior)) for name, prior in sigma.items()
        )
    )
    rng = np.random.default_rng(9)
    ranks = []
    grid = np.linspace(0.0, 6e5, 12_001)
    at = np.array([50, 100, 200])
    for seed in range(40):
        cov = np.array([prior[1] for prior in sigma.values()])
        truth = np.log([prior[0] for prior in sigma.values()])
        straying, spread, median = np.exp(
            truth + np.sqrt(np.log1p(cov**2)) * rng.standard_normal(3)
        )
        units = []
        lives = []
        for factor in median * np.exp(spread * rng.standard_normal(6)):
            steps = (
                straying * factor * RATE * np.sqrt(1.5e4 * np.diff(grid, prepend=0.0))
            )
            worn = factor * RATE * grid + np.cumsum(
                steps * rng.standard_normal(len(grid))
            )
            over = worn >= LIMIT
            lives.append(grid[np.argmax(over)] if over.any() else np.inf)
            units.append(unit("a", grid[at], worn[at] + 5e-5 * rng.standard_normal(3)))
        found = fit_population(units, asked, seed)
        states = states_now(found, joint_draws(found, DRAWS, rng))
        ranks += [
            float(state.lives.life_below(life)[0])
            for state, life in zip(states, lives, strict=False)
        ]
    ranks = np.array(ranks)
    assert stats.kstest(ranks, "uniform").pvalue > 1e-3
    assert 0.85 <= np.mean(np.abs(ranks - 0.5) <= 0.45) <= 0.95
    assert 0.40 <= np.mean(np.abs(ranks - 0.5) <= 0.25) <= 0.60


def test_a_unit_that_was_not_measured_is_as_wide_as_the_population():
    units = [*simulated(10, 4, 6), unit("new", [], [])]
    found = fit_population(units, law("straying"), 0)
    rng = np.random.default_rng(0)
    states = states_now(found, joint_draws(found, DRAWS, rng))
    new = states[10]
    old = states[0]
    assert np.std(np.log(new.factor)) > 1.1 * quantile(found, "spread", np.array(0.5))
    assert np.ptp(new.lives.life(P[[0, 4]])) > 1.5 * np.ptp(old.lives.life(P[[0, 4]]))


def test_what_a_hundred_units_cost(monkeypatch):
    """How often the likelihood is asked, and of how many coefficients
    times errors at once.
    """
    units = simulated(100, 10, 7)
    work = []
    real = kalman.filtered

    def counted(*arguments, **options):
        seen = real(*arguments, **options)
        work.append(seen.log_likelihood.size)
        return seen

    monkeypatch.setattr(kalman, "filtered", counted)
    found = fit_population(units, law("straying"), 0)
    assert quantile(found, "spread", np.array([0.05, 0.95])) == pytest.approx(
        [0.3, 0.3], rel=0.3
    )
    assert len(work) < 16 * 100 and sum(work) < 100 * 17_000
    work.clear()
    rng = np.random.default_rng(0)
    states_after(found, 0, units[0].cycles, rng)
    assert (
        len(work) == 4
    )  # twice to find the top, its table, the states: for all inspections at once


def two_sheets(faster=1.0, wrong_mass=1.0):
    """Fourteen units whose depths and masses were measured three times.

    With their factors; a record says that wear has gone ``faster`` before the last time
    than it did, of masses by a clock of their own; one unit's masses are wrong.
    """
    rng = np.random.default_rng(14)
    change = np.array([0.0, 0.4e9, 1.2e9])
    clock = Clock(change, change + (faster - 1.0) * np.array([0.0, 0.0, 0.8e9]))
    more = np.array([0.0, 0.0, 0.85e9])
    clock_of_mass = Clock(change, change + (faster - 1.0) * more)
    states = np.linspace(0.0, 1.2e9, 60)
    depth = RunCurve(states, 5e-14 * states[:, None], np.full((60, 1), 5e-14))
    share = states[:, None] / 1.2e9
    mass = RunCurve(
        states, 1e-3 * share**0.9, 1e-3 * 0.9 * np.maximum(share, 1e-3) ** -0.1 / 1.2e9
    )
    members = []
    log_factor = 0.25 * rng.standard_normal(14)
    for k, factor in enumerate(np.exp(log_factor)):
        cycle = 1e9 * np.array([0.2, 0.4, 0.55]) * rng.uniform(0.9, 1.1)
        depths = depth.at(factor * cycle) + 2e-6 * rng.standard_normal(3)
        masses = mass.at(factor * cycle) + 1e-5 * rng.standard_normal(3)
        if k == 3:
            masses *= wrong_mass
        one = unit(f"G{k + 1:02d}", cycle, depths)
        seen = (
            observed(cycle, depths, ErrorModel(2e-6)),
            observed(cycle, masses, ErrorModel(1e-5), quantity="worn_mass"),
        )
        column = np.zeros(3, np.intp)
        points = (
            ObservationPoints(depth, column, cycle),
            ObservationPoints(mass, column, cycle, clock_of_mass),
        )
        run = replace(
            one.run,
            end=1.2e9,
            clock=clock,
            points=points,
            limit=depth,
            level=6e-5,
            limit_cycle=1.2e9,
        )
        members.append(replace(one, run=run, blocks=blocks(seen)))
    return members, log_factor


def law_of_two_sheets():
    asked = law("power", "straying", reference=5e8)
    parameters = asked.parameters[:-1]
    median = Parameter("median", lognormal(1.0, 3.0))
    return asked._replace(parameters=(*parameters, median), sd=(2e-6, 1e-5))


@pytest.mark.parametrize("faster", [1.0, 1.2, 1.4])
def test_a_load_that_contradicts_two_sheets_leaves_the_factors_right(faster):
    """A spline of a steep likelihood overshot by more than what stands at its top."""
    members, log_factor = two_sheets(faster)
    found = fit_population(members, law_of_two_sheets(), 0)
    assert found.resolved
    _, drawn, _ = joint_draws(found, 400, np.random.default_rng(0))
    low, middle, high = np.quantile(drawn, (0.05, 0.5, 0.95), axis=1)
    assert np.sum((low < log_factor) & (log_factor < high)) >= 11
    assert np.abs(middle - log_factor).mean() < 0.15


@pytest.mark.parametrize("wrong", [7.0, 12.0])
def test_a_unit_that_contradicts_itself_is_refused(wrong):
    """It made the wear of all stray by 50 times itself; without its masses there is an
    answer.
    """
    members, log_factor = two_sheets(wrong_mass=wrong)
    known = law("straying", reference=5e8)._replace(sd=(2e-6, 1e-5))
    with pytest.raises(UpdateError, match=r"update\.population: .* contradicts itself"):
        fit_population(members, known, 0)
    depths, masses = members[3].blocks
    without = replace(
        members[3], blocks=(depths, replace(masses, rows=masses.rows[:0]))
    )
    found = fit_population([*members[:3], without, *members[4:]], known, 0)
    _, drawn, _ = joint_draws(found, 400, np.random.default_rng(0))
    assert np.abs(np.median(drawn, axis=1) - log_factor).max() < 0.3


@pytest.mark.parametrize("wrong", [1.5, 6.0])
def test_all_units_that_contradict_themselves_are_refused(wrong):
    """Their wear would have had to stray back to almost new."""
    members, _ = two_sheets(1.2)
    for k, one in enumerate(members):
        depths, masses = one.blocks
        seen = replace(masses.observed, value=wrong * masses.observed.value)
        members[k] = replace(one, blocks=(depths, replace(masses, observed=seen)))
    with pytest.raises(UpdateError, match=r"update\.population: .*one of several"):
        fit_population(members, law_of_two_sheets(), 0)
