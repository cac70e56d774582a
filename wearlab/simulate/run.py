"""A scene becomes its dataset."""

import time
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from wearlab.gears.errors import GearError
from wearlab.life.history import History, history, single_state, worn_by_law
from wearlab.life.limits import StopWear
from wearlab.life.state import Wear
from wearlab.scene import Scene
from wearlab.scene.build import Parts, build
from wearlab.scene.build.contact import measured_wear
from wearlab.scene.build.modes import build_modes
from wearlab.scene.build.wear import build_limits, build_snapshots, build_step
from wearlab.simulate import static as named
from wearlab.simulate import vibration as vibrating
from wearlab.simulate.attractors import attractor_values, other_attractors
from wearlab.simulate.continued import continued_wear
from wearlab.simulate.errors import Refused
from wearlab.simulate.exact import exact_values
from wearlab.simulate.label import CONVENTIONS, labelled
from wearlab.simulate.provenance import provenance
from wearlab.simulate.response import response_values
from wearlab.simulate.trust import trust_values
from wearlab.wear.initial import quadratic, uniform

Array = NDArray[np.float64]
ALONG_SPEED = ("response_speed", "direction", "order", "edge", "end")


def simulate(scene: Scene) -> xr.Dataset:
    """Simulate one scene.

    Parameters
    ----------
    scene : the scene

    Returns
    -------
    Dataset of the run (SCENE §4).

    Raises
    ------
    Refused
        When no such gears can exist or run, with the reason.
    """
    begun, clock = time.time(), time.perf_counter()
    try:
        parts = build(scene)
        lived = live(scene, parts)
    except GearError as error:
        raise Refused(str(error)) from error
    except StopWear as stop:
        raise Refused(f"the gears cannot run in their first state: {stop.reason}") from stop
    values = _values(scene, parts, lived)
    coordinates = {"cycle": lived.cycle, **named.coordinates(parts)}
    coordinates |= {name: values.pop(name) for name in ("mesh_cycles", "operating_hours") if name in values}
    if "natural_frequency" in values:
        coordinates["mode"] = np.arange(1, len(values["natural_frequency"]) + 1)
    if "bearing_force" in values:
        coordinates["axis"] = ["x", "y"]
    if "floquet_multiplier" in values:
        coordinates["part"] = ["real", "imaginary"]
    coordinates |= {name: values.pop(name) for name in ALONG_SPEED if name in values}
    values["run_time_total"] = time.perf_counter() - clock
    dataset = labelled(values, coordinates, None)
    dataset = dataset[[name for name in dataset.data_vars if scene.store.keeps(str(name))]]
    dataset.attrs = {"Conventions": CONVENTIONS, **provenance(scene, begun)}
    return dataset


def live(scene: Scene, parts: Parts) -> History:
    """March the wear of a scene to its end, or evaluate its one state."""
    wear, worn_first = initial_wear(scene, parts)
    if scene.wear is None or scene.wear.until is None:
        return single_state(parts.coupling, wear)._replace(worn_first=worn_first)
    lived = history(
        parts.coupling,
        wear,
        limits=build_limits(scene, parts.gears, parts.coupling),
        method=build_step(scene),
        snapshots=build_snapshots(scene, parts.gears, parts.coupling),
        tolerance=scene.numerics.cycle_tolerance or scene.numerics.tolerance,
    )
    return lived._replace(worn_first=worn_first)


def initial_wear(scene: Scene, parts: Parts) -> tuple[Wear, tuple[Any, ...]]:
    """Return the wear before the first cycle, of every kind of mesh [m], and the lives that made it."""
    if scene.start is not None:
        return continued_wear(scene, parts), ()
    wear = parts.coupling.unworn()
    given = scene.wear
    by_law: dict[str, tuple[slice, float]] = {}
    for name in parts.gears.flanks:
        flank = given.initial_of(name) if given is not None else None
        if flank is None:
            continue
        kind, gear = parts.gears.flank(name)
        position = parts.kinds[kind].analysis.grid.position
        match getattr(flank, "shape", "measured"):
            case "measured":
                wear[kind][gear] = measured_wear(flank, parts.kinds[kind].pair, gear, position)
            case "uniform":
                wear[kind][gear] = uniform(position, flank.depth)
            case "quadratic":
                wear[kind][gear] = quadratic(position, flank.depth)
            case _:
                by_law[name] = parts.coupling.entries(kind, gear), flank.depth
    if not by_law:
        return wear, ()
    try:
        return worn_by_law(parts.coupling, wear, by_law, tolerance=scene.numerics.tolerance)
    except ValueError as error:
        raise Refused(str(error)) from error


def _values(scene: Scene, parts: Parts, lived: History) -> dict[str, Any]:
    states = lived.state
    values = named.mesh_values(parts, states) | named.path_values(parts, states)
    values |= exact_values(scene, parts, states)
    if scene.wear is not None:
        values |= named.wear_values(parts, lived.cycle, states)
    if parts.vibration is not None:
        values |= vibrating.dynamic_values(parts, states)
        values |= vibrating.mode_values(build_modes(parts))
        values["attractor"] = vibrating.attractor(lived)
    others = other_attractors(parts, states)
    values |= attractor_values(others)
    if scene.dynamics is not None and scene.dynamics.response is not None:
        values |= response_values(scene, parts, states[0])
    return values | named.life_values(scene, parts, lived) | trust_values(scene, parts, lived, others)
