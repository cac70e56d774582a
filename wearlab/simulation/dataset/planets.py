"""What planets that differ have of their own: load, wear and life of each."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.assembly.life import flank_entries
from wearlab.life import history, integrate, limits, step
from wearlab.simulation import label
from wearlab.simulation.dataset.path import depths

UNEQUAL = 1.2
"""Load of a planet over the mean of all, above which a run says so."""

MEAN = "of planet flanks that of the mean planet"
"""What is said of variables along the flanks where planets differ."""


def planet_numbers(model: assembly.GearModel) -> label.Values:
    """Return the numbers of planets that differ, nothing where they are alike.

    Parameters
    ----------
    model : the physics of the scene
    """
    if not model.gears.planets_are_apart:
        return {}
    return {"planet": np.arange(1, len(model.gears.angles) + 1)}


def planet_values(
    model: assembly.GearModel, life_history: history.History, loaded_share: Array
) -> label.Values:
    """Return load, wear and life of every planet, nothing where planets are alike.

    Parameters
    ----------
    model : the physics of the scene
    life_history : the wear states that are stored
    loaded_share : (n_flanks,) share of the cycles in which each flank is loaded [1]
    """
    if not model.gears.planets_are_apart:
        return {}
    gears = model.gears
    states = life_history.state
    number = len(gears.angles)

    of_kind = [depths(kind, states) for kind in range(len(model.kinds))]
    of_flanks = []
    for name in gears.flanks:
        rows = [of_kind[kind][:, gear] for kind, gear in gears.places_of(name)]
        of_flank = np.stack(rows, axis=1)
        if not name.startswith("planet"):
            of_flank = np.full_like(of_flank, np.nan)
        of_flanks.append(of_flank)
    depth = label.padded(of_flanks, 2)
    deepest = np.stack([flank.max(axis=-1) for flank in of_flanks], axis=2)

    kind, gear = gears.flank("planet-sun")
    is_loaded = np.ravel(loaded_share)[list(gears.flanks).index("planet-sun")]
    passes = np.full(number, is_loaded * gears.kinds[kind].passes[gear])
    return {
        "planet_load_factor": _static_factors(model, life_history),
        "planet_wear_depth": depth,
        "planet_max_wear_depth": deepest,
        "planet_load_cycles": life_history.cycle[:, None] * passes,
    } | _lives(model, life_history.life)


def _static_factors(model: assembly.GearModel, life_history: history.History) -> Array:
    """Return the static load of each planet over the mean, (n_updates, n_planets)."""
    planets = model.coupling.planets
    assert planets is not None
    number = len(model.gears.angles)
    rows = []
    for state in life_history.state:
        at_sun = planets.balance.forces(state.flanks).mean(axis=0)[:number]
        rows.append(label.ratio(at_sun, np.full(number, at_sun.mean())))
    return np.array(rows)


def _lives(model: assembly.GearModel, life: integrate.Life | None) -> label.Values:
    """Return the life of every planet to the depth limit, nothing without such a limit.

    Parameters
    ----------
    model : the physics of the scene
    life : the integration over cycles, None: nothing wears on
    """
    until = None if model.scene.wear is None else model.scene.wear.until
    if life is None or until is None or until.depth is None:
        return {}
    number = len(model.gears.angles)
    watched = [
        name
        for name in model.gears.flanks
        if name.startswith("planet") and until.flank in (None, name)
    ]
    lives = np.full(number, np.nan)
    if watched and life.worn_out:
        for planet in range(number):
            flanks = [
                flank_entries(name, model.gears, model.coupling, planet + 1)
                for name in watched
            ]
            of_flanks = [_life_of(life, until.depth, flank) for flank in flanks]
            lives[planet] = min(of_flanks)
    return {"planet_life": lives}


def _life_of(life: integrate.Life, depth: float, flank: limits.Flanks) -> float:
    """Return the cycle at which a flank has a depth [1].

    Within the life it lies on the steps that were taken; beyond its end
    ``h + r t + ½ r′ t²`` goes on, r′ the trend of the last step.

    Parameters
    ----------
    life : the integration over cycles
    depth : the depth [m]
    flank : entries of the flank
    """
    nodes = [
        step.Node(float(cycle), of_node, rate)
        for cycle, of_node, rate in zip(life.cycle, life.depth, life.rate, strict=True)
    ]
    largest = np.array([node.depth[flank].max() for node in nodes])
    deep = np.flatnonzero(largest >= depth * (1.0 - limits.LANDED))
    if deep.size and deep[0] == 0:
        return nodes[0].cycle
    if deep.size:
        reached = min(depth, float(nodes[deep[0]].depth[flank].max()))
        return step.crossing(life.steps[deep[0] - 1], reached, flank)
    return nodes[-1].cycle + _cycles_beyond(nodes, depth, flank)


def _cycles_beyond(
    nodes: Sequence[step.Node], depth: float, flank: limits.Flanks
) -> float:
    """Return the cycles from the end of a life until a flank has a depth [1].

    Parameters
    ----------
    nodes : accepted states of the life
    depth : the depth [m]
    flank : entries of the flank
    """
    last = nodes[-1]
    missing = depth - last.depth[flank]
    rate = last.rate[flank]
    trend = np.zeros_like(rate)
    if len(nodes) > 1:
        cycles = last.cycle - nodes[-2].cycle
        trend = (rate - nodes[-2].rate[flank]) / cycles
    ahead = rate + np.sqrt(np.maximum(0.0, rate**2 + 2.0 * trend * missing))
    due = np.divide(
        2.0 * missing, ahead, out=np.full_like(missing, np.inf), where=rate > 0.0
    )
    soonest = float(due.min(initial=np.inf))
    return soonest if np.isfinite(soonest) else np.nan


def told_of_the_mean(dataset: xr.Dataset) -> xr.Dataset:
    """Return the dataset whose variables along flanks say that planets differ.

    Parameters
    ----------
    dataset : of the run
    """
    if "planet_wear_depth" not in dataset:
        return dataset
    told = {}
    for name, variable in dataset.data_vars.items():
        if "flank" in variable.dims and "planet" not in variable.dims:
            said = filter(None, [variable.attrs.get("comment"), MEAN])
            told[name] = variable.assign_attrs(comment="; ".join(said))
    return dataset.assign(told)


def wear_flags(model: assembly.GearModel, dataset: xr.Dataset) -> list[str]:
    """Return which planet is worn deepest, and which fails first, where they differ.

    Parameters
    ----------
    model : the physics of the scene
    dataset : of the run
    """
    if "planet_max_wear_depth" not in dataset:
        return []
    last = dataset["planet_max_wear_depth"].isel(update=-1)
    place = last.where(last == last.max(), drop=True)
    planet = int(place["planet"].values[0])
    flank = str(place["flank"].values[0])
    mean = float(last.sel(flank=flank).mean())
    flags = [
        f"planets differ: {flank} of planet {planet} is worn "
        f"{1e6 * float(last.max()):.4g} µm at the end, the mean of the planets "
        f"{1e6 * mean:.4g} µm"
    ]
    if "planet_life" in dataset and np.isfinite(dataset["planet_life"].values).any():
        lives = dataset["planet_life"].values
        first = int(np.nanargmin(lives))
        listed = ", ".join(f"{life:.4g}" for life in lives)
        flags.append(
            f"planet {first + 1} fails first, after {lives[first]:.4g} cycles; the "
            f"set's life is {float(dataset['life']):.4g}, those of planets 1 to "
            f"{len(lives)} are {listed}, after the end of the run by its last rates"
        )
    return flags + _teeth_flags(model)


def _teeth_flags(model: assembly.GearModel) -> list[str]:
    """Return where a tooth of a central gear meets only some teeth of the planets."""
    teeth = {name: gear.teeth for name, gear in model.gears.gears.items()}
    flags = []
    for name in ("sun", "ring"):
        common = int(np.gcd(teeth[name], teeth["planet"]))
        if common > 1:
            flags.append(
                f"{name} and planet have the common factor {common} in their teeth: a "
                f"tooth of the {name} meets one in {common} teeth of a planet; wear is "
                "that of the mean tooth"
            )
    planets = len(model.gears.angles)
    common = int(np.gcd(teeth["sun"], planets))
    if common > 1:
        flags.append(
            f"{teeth['sun']} teeth of the sun and {planets} planets have the common "
            f"factor {common}: planets mesh in phase in groups; the sun wears by the "
            "mean over all planets"
        )
    return flags


def overload_flags(dataset: xr.Dataset) -> list[str]:
    """Return which planet carries much more than the mean, nothing where none does.

    Parameters
    ----------
    dataset : of the run
    """
    over_turn = "mesh_load_factor_max" in dataset
    name = "mesh_load_factor_max" if over_turn else "mesh_load_factor"
    if name not in dataset:
        return []
    factors = dataset[name]
    of_mesh = factors.max([dim for dim in factors.dims if dim != "mesh"])
    largest = float(of_mesh.max())
    if not largest > UNEQUAL:
        return []

    mesh = str(of_mesh["mesh"].values[np.argmax(of_mesh.values)])
    planet = mesh.rpartition("-")[2]
    turning = " at an angle of its turn" if over_turn else ""
    return [
        f"planet {planet} carries up to {largest:.3g} times the mean load of the "
        f"planets{turning}: they share it unequally"
    ]
