"""Made-up runs of a small campaign, every number of which tells where it came from."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from fake_campaign import Axis

from wearlab.campaign.axes import Coordinate as Coordinate
from wearlab.schema import VARIABLES, attributes
from wearlab.store import Store
from wearlab.store.description import describe
from wearlab.store.netcdf import to_image
from wearlab.store.outcome import Outcome

SPEEDS = (800.0, 1100.0, 3720.0)
CYCLES = np.array([0.0, 3e6, 1e8])
PHASE = np.arange(16) / 16
S = np.array([-7.0, -3.0, -1.0, -1.0, 0.0, 1.0, 1.0, 4.0, 7.0]) * 1e-3
LETTERS = ["A", "", "B", "B", "C", "D", "D", "", "E"]
RATIO = 1.75
DYNAMIC = (
    "dynamic",
    "mesh_d",
    "pair_f",
    "dte",
    "poincare",
    "equivalent",
    "natural",
    "critical",
    "response",
)
SKIPPED = (
    "preset",
    "count",
    "run_time",
    "residual",
    "error",
    "floquet",
    "bearing",
    "steps",
    "slow",
    "excit",
    "ste_mean",
)


@dataclass(frozen=True)
class Case:
    label: str
    id: str
    position: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True)
class Campaign:
    cases: tuple[Case, ...]
    axes: tuple[Axis, ...] = ()
    title: str = "Three speeds · µ"
    reference: str | None = None
    figures: tuple[Any, ...] = ()
    path: Path | None = None


def run(speed: float | None, **sizes: int) -> xr.Dataset:
    """Return a run at a speed [rpm]; None: static, without dynamics."""
    rng = np.random.default_rng(int(speed or 1))
    length = {
        **{
            "update": 3,
            "flank": 2,
            "profile": len(S),
            "mesh": 1,
            "phase": 16,
            "mesh_period": 2,
            "pair": 3,
        },
        **{"member": 2, "harmonic": 5, "mode": 3, "face": 4},
        **{
            "response_speed": 6,
            "direction": 2,
            "strobe": 4,
            "order": 8,
            "jump": 1,
            "edge": 2,
        },
        **sizes,
    }
    made: dict[str, Any] = {}
    for name, variable in VARIABLES.items():
        known = all(dim in length for dim in variable.dims)
        if not known or variable.units == "" or name.startswith(SKIPPED):
            continue
        if speed is None and name.startswith(DYNAMIC):
            continue
        shape = [length[dim] for dim in variable.dims]
        size = 1e8 if variable.units == "N m-1" else 1.0
        made[name] = (variable.dims, size * (1.0 + rng.random(shape)), attributes(name))
    given: dict[str, Any] = {
        "cycle": CYCLES[: length["update"]],
        "phase": PHASE,
        "path_position": np.stack([S, S]),
        "operating_hours": 60.0 * CYCLES[: length["update"]] / (speed or 1000.0),
        "face_position": np.linspace(-7.5e-3, 7.5e-3, 4),
        "base_helix_angle": [0.2],
        "contact_ratio": [RATIO],
        "mesh_phase_offset": [0.0],
        "mesh_stiffness": 3e8 + 1e7 * np.arange(3)[:, None, None] + 1e6 * PHASE,
        "max_wear_depth": np.array([[0.0, 0.0], [1e-6, 2e-6], [4e-6, 5e-6]])
        * (speed or 1000.0)
        / 1000.0,
        "separation_fraction": 0.0,
        "static_mesh_force": [4800.0],
        "mesh_frequency": [50 * (speed or 0.0) / 60],
        "response_speed": np.linspace(80.0, 180.0, 6),
        "natural_frequency": [2000.0, 3000.0, 4000.0],
        "critical_speed": 2 * np.pi * np.array([2000.0, 3000.0, 4000.0]) / 50,
    }
    hunting = "hunting_transmission_error"  # apart: what is drawn above stays as it is
    shape = (length["update"], length["mesh"], 4, length["phase"])
    made[hunting] = (
        VARIABLES[hunting].dims,
        np.random.default_rng(5).random(shape),
        attributes(hunting),
    )
    for name, places in (("tooth_temperature", 2), ("limit_share", 3)):
        dims = VARIABLES[name].dims
        sizes_there = [length.get(dim, places) for dim in dims]
        share = np.random.default_rng(6).random(sizes_there)
        size = 300.0 if name == "tooth_temperature" else 0.5
        made[name] = (dims, size * (1.0 + 0.1 * share), attributes(name))
    for name, values in given.items():
        if name in made:
            dims, before, attrs = made[name]
            made[name] = (dims, np.broadcast_to(values, np.shape(before)), attrs)
    if speed is not None:
        for name, (dims, values, attrs) in made.items():
            if "mesh_period" in dims and name != "pair_force":
                made[name] = (dims, _twice_in_the_last_state(dims, values), attrs)
        dims, force, attrs = made["dynamic_mesh_force"]
        made["dynamic_mesh_force"] = (dims, speed * force, attrs)
    data = xr.Dataset(
        made
    )  # at once: variable by variable it would be merged anew each time
    labels = {
        "flank": ["pinion", "gear"],
        "member": ["pinion", "gear"],
        "mesh": ["pinion-gear"],
        "harmonic": np.arange(1, length["harmonic"] + 1),
        "pair": [1, 2, 3],
        "direction": ["up", "down"],
        "order": np.arange(1, 9) / 4,
        "place": ["root", "flank"],
        "limit": ["wear", "temperature", "backlash"],
    }
    data = data.assign_coords(labels | {"characteristic_point": ("profile", LETTERS)})
    coordinates = [
        n
        for n in (
            "cycle",
            "phase",
            "path_position",
            "diameter",
            "roll_angle",
            "response_speed",
        )
        if n in data
    ]
    return data.set_coords(coordinates)


def _twice_in_the_last_state(dims: tuple[str, ...], values: Any) -> Any:
    """Return values without those of a second period in all states but the last."""
    found = np.array(values, dtype=float)
    axes = [dims.index("mesh_period"), dims.index("update")]
    moved = np.moveaxis(found, axes, [0, 1])
    moved[1:, :-1] = np.nan
    return found


def put(store: Store, run_id: str, data: xr.Dataset | None, scene: str = "{}") -> None:
    with store.archive.presence() as here:
        store.archive.claim([run_id], here.token, lambda entry: False)
        if data is None:
            outcome = Outcome(run_id, "failed", "now", 1.0, "{}", reason="no")
        else:
            made = {"source_hash": "feed", "wearlab_version": "9.9", **describe(data)}
            outcome = Outcome(
                run_id, "done", "now", 1.0, scene, *to_image(data), **made
            )
        store.archive.save([outcome], here.token)
