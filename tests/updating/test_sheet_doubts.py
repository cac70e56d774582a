"""Sheets that contradict each other: neither moves another unit before it is believed,
and each is answered for.
"""

from dataclasses import replace

import numpy as np
import pytest
from conftest import STATIC
from made import ErrorModel, blocks, observed, study
from scipy import stats
from units import RATE, law, unit

import wearlab as wl
from wearlab.updating.answers import answer_of
from wearlab.updating.fleet_members import FleetMember
from wearlab.updating.grids import Posterior
from wearlab.updating.population import fit_population
from wearlab.updating.report_text import text_of
from wearlab.updating.run_curves import ObservationPoints, RunCurve
from wearlab.updating.sheet_doubts import DOUBT, SCALE
from wearlab.updating.unit_factors import masses, masses_by_reading
from wearlab.updating.unit_states import joint_draws, state_of_reading, states_now

MASS_RATE = 1e-8  # kg a cycle at factor 1
DEPTH_SD = 4e-5
MASS_SD = 4e-6
ENDS = np.array([0.05, 0.5, 0.95])


def sheets_of(name, factor, rng, *, times=1.0, cycles=(8e3, 1.6e4, 2.4e4)):
    """Return a unit whose depths were gauged, and its masses ``times`` too high."""
    cycle = np.array(cycles)
    depth = factor * RATE * cycle + DEPTH_SD * rng.standard_normal(len(cycle))
    mass = times * factor * MASS_RATE * cycle
    mass = mass + MASS_SD * rng.standard_normal(len(cycle))
    one = unit(name, cycle, depth)
    ends = np.array([0.0, 5e4, 1e5])
    curve = RunCurve(ends, MASS_RATE * ends[:, None], np.full((3, 1), MASS_RATE))
    seen = (
        observed(
            cycle,
            depth,
            ErrorModel(DEPTH_SD),
            number=0,
            quantity="max_wear_depth",
            where=None,
        ),
        observed(cycle, mass, ErrorModel(MASS_SD), number=1, where=None),
    )
    column = np.zeros(len(cycle), np.intp)
    points = (one.run.points[0], ObservationPoints(curve, column, cycle))
    return replace(one, run=replace(one.run, points=points), blocks=blocks(seen))


def law_of_sheets(*names):
    return law(*names)._replace(sd=(DEPTH_SD, MASS_SD))


def five(times=1.45, seed=0):
    """Return five units and their factors; the third's weighings are too high."""
    rng = np.random.default_rng(seed)
    factors = np.exp(0.15 * rng.standard_normal(5))
    members = [
        sheets_of(f"G{k + 1:02d}", factor, rng, times=times if k == 2 else 1.0)
        for k, factor in enumerate(factors)
    ]
    return members, factors


def lives_of(members, seed=0):
    found = fit_population(members, law_of_sheets("straying"), seed)
    rng = np.random.default_rng(1)
    states = states_now(found, joint_draws(found, 2000, rng))
    return found, np.array([state.lives.life(ENDS) for state in states])


def without_masses(member: FleetMember) -> FleetMember:
    depths, masses = member.blocks
    return replace(member, blocks=(depths, replace(masses, rows=masses.rows[:0])))


@pytest.fixture(scope="module")
def fleet():
    members, factors = five()
    return members, factors, *lives_of(members)


def test_a_sheet_that_is_too_high_does_not_move_the_other_units(fleet):
    """They moved 9 to 13 months early, and all four 90 % intervals missed."""
    members, factors, _, lives = fleet
    truth = 4e-3 / (RATE * factors)
    others = [0, 1, 3, 4]
    assert (lives[others, 0] < truth[others]).all()
    assert (truth[others] < lives[others, 2]).all()
    sound = [*members]
    sound[2] = without_masses(members[2])
    _, without = lives_of(sound)
    assert lives[others, 1] == pytest.approx(without[others, 1], rel=0.01)
    widths = np.ptp(np.log(lives[others][:, [0, 2]]), axis=1)
    of_sound = np.ptp(np.log(without[others][:, [0, 2]]), axis=1)
    assert widths == pytest.approx(of_sound, rel=0.15)


def test_either_sheet_has_an_answer(fleet):
    _, factors, found, lives = fleet
    truth = 4e-3 / (RATE * factors[2])
    probabilities = found.reading_probabilities(2)
    assert probabilities.sum() == pytest.approx(1.0)
    assert probabilities[0] < 1e-3  # both sound
    # in the third reading the weighings have a scale of their own
    asides = [one.aside for one in found.units[2].readings]
    assert asides[0] is None and len(asides[2].blocks[1].rows) == 3
    rng = np.random.default_rng(2)
    if_gauge = state_of_reading(found, 2, 2, rng).lives.life(ENDS)
    if_weighed = state_of_reading(found, 2, 1, rng).lives.life(ENDS)
    assert if_gauge[0] < truth < if_gauge[2]
    assert if_weighed[1] == pytest.approx(truth / 1.45, rel=0.05)
    # by what the four others tell of how far units differ
    assert probabilities[2] > probabilities[1]
    assert min(if_gauge[0], if_weighed[0]) <= lives[2, 1] <= if_gauge[2]


def test_what_is_known_of_a_unit_agrees_with_a_quadrature():
    rng = np.random.default_rng(3)
    one = sheets_of("a", 1.1, rng, times=1.03, cycles=(2e4,))
    known = law_of_sheets()
    theta = np.log([[0.3, 1.0]])
    by_reading = masses_by_reading(one, known, theta)
    depth = one.blocks[0].observed.value[0]
    mass = one.blocks[1].observed.value[0]

    def of_depth(u):
        return stats.norm.pdf(depth, RATE * 2e4 * np.exp(u), DEPTH_SD)

    def of_mass(u):
        return stats.norm.pdf(mass, MASS_RATE * 2e4 * np.exp(u), MASS_SD)

    u = np.linspace(-0.6, 0.8, 2801)
    prior = stats.norm.pdf(u, 0.0, 0.3)
    step = u[1] - u[0]
    away = stats.cauchy.pdf(u[:, None] - u, scale=SCALE)
    tables = {
        0: (1.0 - 2.0 * DOUBT) * of_depth(u) * of_mass(u),
        1: DOUBT * of_mass(u) * (away @ of_depth(u)) * step,
        2: DOUBT * of_depth(u) * (away @ of_mass(u)) * step,
    }
    for number, likelihood in tables.items():
        expected = np.log(np.sum(prior * likelihood) * step)
        assert by_reading[number].log_marginal[0] == pytest.approx(expected, abs=2e-3)


def test_a_unit_with_one_sheet_is_as_it_was():
    rng = np.random.default_rng(3)
    one = without_masses(sheets_of("a", 1.1, rng))
    theta = np.log([[0.3, 1.0], [0.2, 1.1]])
    (only,) = masses_by_reading(one, law_of_sheets(), theta)
    plain = masses(one, law_of_sheets(), theta)
    assert (only.log_marginal == plain.log_marginal).all()


@pytest.mark.parametrize("times", [1.0, 1.45, 7.0, 1000.0])
def test_sheets_that_agree_are_believed_and_wrong_units_are_not(times):
    members, _ = five(times)
    found = fit_population(members, law_of_sheets("straying"), 0)
    sound = [found.reading_probabilities(k)[0] for k in range(5)]
    assert min(np.delete(sound, 2)) > 0.7
    assert (sound[2] > 0.8) == (times == 1.0)


def test_belief_in_a_sheet_is_continuous():
    """It was switched at three standard deviations."""
    known = law_of_sheets("straying")
    sound = []
    for times in np.linspace(1.03, 1.09, 13):
        members, _ = five(times)
        found = fit_population(members, known, 0)
        sound.append(found.reading_probabilities(2)[0])
    assert sound[0] > 0.8 and sound[-1] < 0.2
    assert np.max(np.abs(np.diff(sound))) < 0.25


SHEETS = """
[[update.data]]
file     = "weighings.csv"
quantity = "worn_mass"
member   = "pinion"
columns  = { date = "date", hours = "hours", value = "loss" }
units    = { hours = "h", loss = "mg" }
error    = { sd = "8 mg" }
[[update.data]]
file     = "gauge.csv"
quantity = "max_wear_depth"
flank    = "pinion"
columns  = { hours = "hours", value = "depth" }
units    = { hours = "h", depth = "um" }
error    = { sd = "0.3 um" }
"""


def test_one_gear_set_is_told_by_either_sheet_in_dates(tmp_path):
    """It was in hours, without the odds."""
    (tmp_path / "weighings.csv").write_text(
        "date,hours,loss\n2025-07-02,420,281\n2026-01-01,840,560\n"
    )
    (tmp_path / "gauge.csv").write_text("hours,depth\n420,9.1\n840,17.6\n")
    head = STATIC.partition("[[update.data]]")[0]
    (tmp_path / "study.toml").write_text(head + SHEETS)
    campaign = wl.load(tmp_path / "study.toml")
    tree = wl.update(campaign, wl.Store(tmp_path / "store"), progress=False)
    text = [line.strip() for line in text_of(tree)]
    (note,) = (line for line in text if "two files contradict" in line)
    assert "weighings.csv with a probability of" in note
    (without,) = (line for line in text if line.startswith("without worn mass"))
    assert ", until 2026-" in without
    robust = [line for line in text if "Student-t" in line]
    assert all("all sheets taken as sound" in line for line in robust)
    assert "if that source has a scale of its own, with a probability of" in without


def test_other_observations_are_compared_without_copies_of_runs_by_doubt():
    """Evidence with doubts was compared with one without, of three times the runs."""
    member = sheets_of("G1", 1.0, np.random.default_rng(3))
    seen = tuple(block.observed for block in member.blocks)
    asked = study({"lognormal": {"median": 1.0, "cov": 1.0}}, seen)
    post = answer_of(asked, [member.run], member.blocks).posterior
    assert len(post.histories) == 3
    again = post.updated_with(post.blocks)
    plain = Posterior([member.run], member.blocks, post.prior)
    assert len(again.histories) == 1
    assert again.evidence == pytest.approx(plain.evidence)
