"""Updates of whole campaigns against lives simulated anew at every k: own likelihood,
own quadrature.

The update stretches one stored run over every k and interpolates between its states.
Here each k, and each torque, has a run of its own, whose states are at the inspections.
"""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from scenes import CAMPAIGNS
from scipy import stats
from scipy.interpolate import CubicSpline
from scipy.special import logsumexp

import wearlab as wl
from wearlab.updating.sheet_doubts import DOUBT, SCALE

P = np.array([0.05, 0.25, 0.5, 0.75, 0.95])
PRIOR_SD = np.sqrt(np.log1p(14.13**2))  # of ln k, in all three campaigns
FACTOR = "wear.coefficient.factor"


def table(name):
    """Return the columns of a file of measurements."""
    path = CAMPAIGNS / "measured" / f"{name}.csv"
    rows = [
        line.split(",")
        for line in path.read_text().splitlines()
        if not line.startswith("#")
    ]
    return {head: np.array(column, float) for head, *column in zip(*rows, strict=True)}


def error(name, number, key):
    """Return an error of a block as the campaign has it, without its unit."""
    told = tomllib.loads((CAMPAIGNS / f"{name}.toml").read_text())["update"]["data"][
        number
    ]["error"][key]
    return float(str(told).split()[0])


def life_at(scene, depth, inspections, changes):
    """Return a life to a depth simulated anew, with states at the
    inspections, and those states.
    """
    often = {
        "wear.snapshots": {"cycles": sorted({float(at) for at in inspections})},
        "wear.until.depth": depth,
    }
    run = wl.simulate(scene.replace({**changes, **often}))
    places = [int(np.argmin(np.abs(run["cycle"].values - at))) for at in inspections]
    np.testing.assert_allclose(run["cycle"].values[places], inspections, rtol=1e-9)
    return run, run.isel(update=places)


def quantiles(value, density):
    """Return quantiles of a function that rises or falls with evenly spaced ln k, by
    its density there.
    """
    mass = density / density.sum()
    order = np.argsort(value)
    return np.interp(P, np.cumsum(mass[order]) - 0.5 * mass[order], value[order])


def fine(factors):
    return np.linspace(np.log(factors[0]), np.log(factors[-1]), 20_001)


@pytest.mark.slow
def test_a_coupled_life_is_that_of_lives_simulated_at_every_k(tmp_path):
    """Wear changes the loads that wear: one run a k, where the update
    has one run for all.
    """
    name = "update_planetary_life"
    weighed = table("planetary_life_weighings")
    campaign = wl.load(CAMPAIGNS / f"{name}.toml")
    found = wl.update(campaign, wl.Store(tmp_path), progress=False)["predictions"]
    factors = np.geomspace(0.95, 1.5, 7)
    masses = []
    lives = []
    for factor in factors:
        run, states = life_at(
            campaign.cases[0].scene,
            "400 um",
            weighed["cycles_1"],
            {FACTOR: float(factor)},
        )
        masses.append(1e3 * states["worn_mass"].sel(member="sun").values)
        lives.append(float(run["life"]))
    u = fine(factors)
    model = CubicSpline(np.log(factors), np.array(masses))(u)
    logs = stats.norm.logpdf(weighed["mass_loss_g"], model, error(name, 0, "sd")).sum(
        axis=1
    )
    density = np.exp(logs - logs.max() + stats.norm.logpdf(u, 0.0, PRIOR_SD))
    assert density[[0, -1]].max() < 1e-4 * density.max()
    life = np.exp(CubicSpline(np.log(factors), np.log(lives))(u))
    np.testing.assert_allclose(
        found["factor_quantile"], quantiles(np.exp(u), density), rtol=1e-3
    )
    np.testing.assert_allclose(
        found["life_quantile"], quantiles(life, density), rtol=1e-3
    )


def with_doubts(u, log_mass, log_depth):
    """Return the log likelihood of two sheets of which each may have its own scale."""
    away = stats.cauchy.pdf(u[:, None] - u, scale=SCALE) * (u[1] - u[0])

    def scaled(log):
        top = log.max(axis=1, keepdims=True)
        return top + np.log(np.exp(log - top) @ away)

    readings = [
        np.log(1.0 - 2.0 * DOUBT) + log_mass + log_depth,
        np.log(DOUBT) + scaled(log_mass) + log_depth,
        np.log(DOUBT) + log_mass + scaled(log_depth),
    ]
    return logsumexp(readings, axis=0)


def test_two_unknowns_are_those_of_lives_simulated_on_a_grid(tmp_path):
    """Factor and torque from profiles with a common datum error, and weighings."""
    name = "update_spur_twin"
    depths = table("spur_twin_profiles")
    weighed = table("spur_twin_weighings")
    campaign = wl.load(CAMPAIGNS / f"{name}.toml")
    campaign = replace(
        campaign, update=campaign.update.model_copy(update={"draws": 128})
    )
    tree = wl.update(campaign, wl.Store(tmp_path), progress=False)
    inspections = weighed["cycles_1"]
    factors = np.geomspace(1.15, 1.9, 7)
    torques = np.linspace(280.0, 400.0, 9)
    u = fine(factors)
    own = error(name, 0, "sd") ** 2 * np.eye(25) + error(name, 0, "offset_sd") ** 2
    root = np.linalg.inv(np.linalg.cholesky(own))
    of_masses = []
    of_depths = []
    lives = []
    for torque in torques:
        models = []
        ends = []
        for factor in factors:
            changes = {FACTOR: float(factor), "operation.torque": f"{torque} N*m"}
            run, states = life_at(
                campaign.cases[0].scene, "30 um", inspections, changes
            )
            flank = states.sel(flank="pinion").transpose("update", ...)
            at = np.argsort(flank["diameter"].values)
            x = 1e3 * flank["diameter"].values[at]
            rows = [
                1e6
                * np.interp(
                    depths["diameter_mm"][depths["cycles_1"] == cycle], x, h[at]
                )
                for cycle, h in zip(
                    inspections, flank["wear_depth"].values, strict=True
                )
            ]
            mass = 1e6 * states["worn_mass"].sel(member="pinion").values
            models.append(np.concatenate([*rows, mass]))
            ends.append(float(run["life"]))
        model = CubicSpline(np.log(factors), np.array(models))(u)
        log_mass = stats.norm.logpdf(
            weighed["mass_loss_mg"], model[:, -3:], error(name, 1, "sd")
        ).sum(axis=1)
        log_depth = np.zeros(len(u))
        for k, cycle in enumerate(inspections):
            off = (
                depths["depth_um"][depths["cycles_1"] == cycle]
                - model[:, 25 * k : 25 * k + 25]
            )
            log_depth -= 0.5 * np.sum((off @ root.T) ** 2, axis=1)
        of_masses.append(log_mass)
        of_depths.append(log_depth)
        lives.append(np.exp(CubicSpline(np.log(factors), np.log(ends))(u)))
    # between nine torques, cubic: ln of the density and the life are smooth in it
    dense = np.linspace(torques[0], torques[-1], 241)
    some = slice(None, None, 20)
    log = with_doubts(
        u[some],
        CubicSpline(torques, np.array(of_masses)[:, some])(dense),
        CubicSpline(torques, np.array(of_depths)[:, some])(dense),
    )
    log += stats.norm.logpdf(u[some], 0.0, PRIOR_SD)
    log += stats.norm.logpdf(dense, 340.0, 17.0)[:, None]
    life = CubicSpline(torques, np.array(lives)[:, some])(dense)
    density = np.exp(log - log.max())
    assert density[:, [0, -1]].max() < 1e-3
    torque = np.broadcast_to(dense[:, None], log.shape)
    factor = np.broadcast_to(np.exp(u[some]), log.shape)
    got = {
        "life": tree["predictions"]["life_quantile"].values,
        "factor": tree["predictions"]["factor_quantile"].values,
        "torque": np.quantile(tree["posterior"]["torque"].values, P),
    }
    for key, values in (("life", life), ("factor", factor), ("torque", torque)):
        true = quantiles(values.ravel(), density.ravel())
        # the tails of the posterior over runs are those of some 100 draws; the life
        # hardly knows which it was
        np.testing.assert_allclose(
            got[key], true, atol=(0.02 if key == "life" else 0.1) * (true[4] - true[0])
        )


@pytest.mark.slow
def test_a_sensor_with_an_unknown_gain_tells_what_fresh_lives_tell(tmp_path):
    """Three mesh harmonics, each with a gain of its own, integrated here on a grid.

    And one weighing.

    A tenth of a micrometre between states of the run: amplitudes have sharp minima. As
    the campaign has them, the quantiles are within a twentieth of the interval.
    """
    name = "update_vibration_twin"
    weighed = table("vibration_twin_weighing")
    heard = table("vibration_twin_harmonics")
    campaign = wl.load(CAMPAIGNS / f"{name}.toml")
    both = [case for case in campaign.cases if case.label == "both"]
    often = {"wear.snapshots.depth": [f"{0.1 * n:g} um" for n in range(1, 380)]}
    dense = [replace(case, scene=case.scene.replace(often)) for case in both]
    campaign = replace(campaign, cases=tuple(dense))
    tree = wl.update(campaign, wl.Store(tmp_path), progress=False)
    factors = np.geomspace(1.1, 1.6, 25)
    inspections = heard["cycles_1"]
    masses = []
    levels = []
    lives = []
    for factor in factors:
        run, states = life_at(
            both[0].scene, "30 um", inspections, {FACTOR: float(factor)}
        )
        masses.append(
            1e6
            * float(
                states["worn_mass"].sel(member="pinion")[
                    list(inspections).index(weighed["cycles_1"][0])
                ]
            )
        )
        amplitudes = states["mesh_acceleration_orders"].transpose(
            "update", "order", ...
        )
        levels.append(amplitudes.values.reshape(len(inspections), -1)[:, :3])
        lives.append(float(run["life"]))
    u = fine(factors)[::10]
    mass = CubicSpline(np.log(factors), masses)(u)
    log = stats.norm.logpdf(
        weighed["mass_loss_mg"][0], mass, error(name, 0, "sd")
    ) + stats.norm.logpdf(u, 0.0, PRIOR_SD)
    model = CubicSpline(np.log(factors), np.array(levels))(u)
    gain = np.linspace(0.2, 1.8, 641)
    for k in range(3):
        m = model[:, :, k]
        value = heard[f"order_{k + 1}_m_s2"]
        sd = np.hypot(
            error(name, k + 1, "sd"),
            error(name, k + 1, "relative") * gain * m[:, :, None],
        )
        each = stats.norm.logpdf(value[:, None], gain * m[:, :, None], sd).sum(axis=1)
        each = each + stats.norm.logpdf(gain, 1.0, error(name, k + 1, "gain_sd"))
        log = log + np.logaddexp.reduce(each, axis=1)
    density = np.exp(log - log.max())
    assert density[[0, -1]].max() < 1e-4
    life = np.exp(CubicSpline(np.log(factors), np.log(lives))(u))
    for key, values in (("factor", np.exp(u)), ("life", life)):
        got = tree["predictions"][f"{key}_quantile"].values
        true = quantiles(values, density)
        np.testing.assert_allclose(
            got, true, atol=0.02 * (true[4] - true[0]), err_msg=key
        )
