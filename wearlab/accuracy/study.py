"""A campaign's scenes studied one by one, and all of it as one labelled dataset."""

from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from wearlab.accuracy import steady
from wearlab.accuracy.curves import (
    has_life,
    life_study,
    missing_peers,
    peers,
    steady_curves,
)
from wearlab.accuracy.ladder import Cost, Rung, WorkPrecision
from wearlab.scene import Scene
from wearlab.simulation.label import CONVENTIONS, provenance

TARGETS = (1e-3, 1e-6)
"""Relative errors at which wall times are compared."""


class Study(NamedTuple):
    """What was found of one scene.

    Parameters
    ----------
    label : the case
    scene : its scene
    curves : work–precision curves
    disagreement : by quantity, relative difference between the reference and the second
        method [1]
    multiplier : largest modulus of the Floquet multipliers; NaN without dynamics [1]
    notes : what could not be studied, and why
    """

    label: str
    scene: Scene
    curves: tuple[WorkPrecision, ...]
    disagreement: dict[str, float]
    multiplier: float
    notes: tuple[str, ...]

    def of(self, role: str, quantity: str) -> tuple[WorkPrecision, ...]:
        """Return the curves of a role and a quantity."""
        return tuple(
            c for c in self.curves if c.role == role and c.quantity == quantity
        )

    def uncertainty(self, quantity: str) -> float:
        """Return the relative uncertainty of the reference of a quantity [1]."""
        return self.disagreement.get(quantity, self.disagreement.get("mesh_force", 0.0))


def study(label: str, scene: Scene, report: Callable[[str], None]) -> Study:
    """Study one scene: its life where it wears until something, else its steady state.

    Parameters
    ----------
    label : its name
    scene : the scene; both may be absent, then there is nothing to tell
    report : told what comes next
    """
    curves: tuple[WorkPrecision, ...] = ()
    disagreement: dict[str, float] = {}
    multiplier = float("nan")
    notes = []
    if has_life(scene):
        curves, apart = life_study(scene, report)
        disagreement = {"life": apart, "wear_depth": apart}
    elif scene.dynamics is not None:
        try:
            problem = steady.steady(scene)
            report("reference")
            answer = steady.reference(problem)
            curves = tuple(steady_curves(problem, answer, report))
            disagreement["mesh_force"] = answer.disagreement
            multiplier = answer.multiplier
        except steady.Unsuited as unsuited:
            notes.append(f"steady state not studied: {unsuited}")
    return Study(label, scene, curves, disagreement, multiplier, tuple(notes))


def expected_reports(scene: Scene) -> int:
    """Return about how often a study reports, for a progress bar."""
    if has_life(scene):
        return 6
    return 9 + len(peers()) if scene.dynamics is not None else 0


class AgainstPeer(NamedTuple):
    """Wall times of our default method and of the fastest peer, both from a cold start [s], and its name."""

    ours: float
    peer: float
    name: str


def comparison(studies: Study, error: float) -> AgainstPeer | None:
    """Return ours against the fastest peer at one error.

    None without peers or out of reach.
    """
    ours = next(
        (
            c
            for c in studies.of("wearlab", "mesh_force")
            if c.knob == "steps_per_period"
        ),
        None,
    )
    times = [(c.cost_to(error), c.name) for c in studies.of("peer", "mesh_force")]
    reached = [time for time in times if np.isfinite(time[0])]
    if ours is None or not reached or not np.isfinite(ours.cost_to(error)):
        return None
    return AgainstPeer(ours.cost_to(error), *min(reached))


def cheapest_setting(
    studies: Study, quantity: str, error: float
) -> tuple[WorkPrecision, Rung] | None:
    """Return the fastest of our own settings whose error of a quantity is small enough, None: there is none.

    The numerical knobs of the same scene are compared, not those that change what the
    answer converges to.
    """
    known = list[tuple[WorkPrecision, Rung]]()
    for curve in studies.curves:
        ours = curve.knob in (
            "steps_per_period",
            "relative",
            "cycle_tolerance",
            "threshold",
        )
        if ours and curve.role != "peer" and curve.quantity == quantity:
            known += [
                (curve, rung) for rung in [curve.cheapest(error)] if rung is not None
            ]
    return min(known, key=lambda pair: pair[1].seconds, default=None)


def knob_settings(studies: Study, quantity: str, error: float) -> dict[str, float]:
    """Return for each of our knobs the cheapest setting that keeps a quantity within ``error``."""
    best = {
        curve.knob: curve.cheapest(error) for curve in studies.of("wearlab", quantity)
    }
    return {knob: rung.setting for knob, rung in best.items() if rung is not None}


SECONDS = {"units": "s", "display_units": "ms"}
ATTRIBUTES: dict[str, dict[str, str]] = {
    "setting": {"long_name": "value of the knob"},
    "error": {"long_name": "relative error against the reference"},
    "run_time": {"long_name": "wall time, a median where it is short", **SECONDS},
    "run_time_warm": {
        "long_name": "wall time from the answer of a neighbouring wear state",
        **SECONDS,
    },
    "work": {
        "long_name": "right-hand sides of a steady state, contact analyses of a life"
    },
    "observed_order": {
        "long_name": "observed order: slope of the error over the setting, both "
        "logarithmic"
    },
    "time_to_error": {
        "long_name": "wall time to a relative error, between rungs interpolated",
        **SECONDS,
    },
    "warm_time_to_error": {
        "long_name": "as time_to_error, from the answer of a neighbour",
        **SECONDS,
    },
    "work_to_error": {"long_name": "as time_to_error, the work"},
    "reference_disagreement": {
        "long_name": "relative difference of reference and second method"
    },
    "largest_multiplier": {"long_name": "largest modulus of the Floquet multipliers"},
}
"""Of a variable without units they are 1."""
RUNG = dict(
    setting="setting",
    error="error",
    run_time="seconds",
    work="work",
    run_time_warm="warm_seconds",
)
REACHED: dict[str, Cost] = {
    "time_to_error": "seconds",
    "warm_time_to_error": "warm_seconds",
}
REACHED |= {"work_to_error": "work"}


KEYS = ("name", "knob", "quantity", "role")
"""What tells curves apart."""


def dataset(title: str, studies: Sequence[Study], begun: float) -> xr.Dataset:
    """Return studies as a dataset with dimensions case, curve and rung.

    Shorter ladders are padded with NaN.

    Parameters
    ----------
    title : of the campaign
    studies : the studies
    begun : start of the run, seconds since the epoch [s]
    """
    key_of = attrgetter(*KEYS)
    keys = list(
        dict.fromkeys(key_of(curve) for study in studies for curve in study.curves)
    )
    quantities = sorted({key[2] for key in keys})
    apart = [
        [study.disagreement.get(quantity, np.nan) for quantity in quantities]
        for study in studies
    ]
    longest = max(
        (len(curve.rungs) for study in studies for curve in study.curves), default=0
    )

    def table(
        width: int, values_of: Callable[[Study, WorkPrecision], list[float]]
    ) -> Any:
        whole = np.full((len(studies), len(keys), width), np.nan)
        for row, study in zip(whole, studies, strict=True):
            for curve in study.curves:
                values = values_of(study, curve)
                row[keys.index(key_of(curve)), : len(values)] = values
        return whole

    def costs(cost: Cost) -> Any:
        return table(
            len(TARGETS),
            lambda _, curve: [curve.cost_to(error, cost) for error in TARGETS],
        )

    def of_rungs(name: str) -> Any:
        return table(
            longest, lambda _, curve: [getattr(rung, name) for rung in curve.rungs]
        )

    orders = table(
        1, lambda study, curve: [curve.order(study.uncertainty(curve.quantity))]
    )
    made = xr.Dataset(
        {
            **{
                name: (("case", "curve", "rung"), of_rungs(own))
                for name, own in RUNG.items()
            },
            "observed_order": (("case", "curve"), orders[..., 0]),
            **{
                name: (("case", "curve", "requested_error"), costs(own))
                for name, own in REACHED.items()
            },
            "reference_disagreement": (("case", "quantity_compared"), apart),
            "largest_multiplier": (("case",), [study.multiplier for study in studies]),
        },
        coords={
            "case": [study.label for study in studies],
            "curve": [
                f"{name} ({knob}, {quantity})" for name, knob, quantity, _ in keys
            ],
            **{
                name: ("curve", [key[at] for key in keys])
                for at, name in enumerate(KEYS)
            },
            "run_id": ("case", [study.scene.id for study in studies]),
            "requested_error": list(TARGETS),
            "quantity_compared": quantities,
        },
    )
    for name, attributes in ATTRIBUTES.items():
        made[name].attrs = {"units": "1"} | attributes
    made.attrs = _attributes(title, studies, begun)
    return made


def _attributes(title: str, studies: Sequence[Study], begun: float) -> dict[str, str]:
    made_by = provenance(studies[0].scene, begun)
    kept = (
        "model_version",
        "source",
        "source_hash",
        "packages",
        "machine",
        "commit",
        "dirty",
    )
    return {
        "Conventions": CONVENTIONS,
        "title": title,
        **{key: made_by[key] for key in kept if key in made_by},
        "peers_missing": ", ".join(missing_peers()),
        "notes": "\n".join(
            f"{study.label}: {note}" for study in studies for note in study.notes
        ),
        "date_created": datetime.fromtimestamp(begun, UTC).isoformat(
            timespec="seconds"
        ),
    }


def netcdf(made: xr.Dataset) -> bytes:
    """Return the netCDF-4 file of a dataset."""
    return bytes(made.to_netcdf(engine="netcdf4"))
