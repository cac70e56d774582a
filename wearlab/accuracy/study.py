"""A campaign's scenes studied one by one, and all of it as one labelled dataset."""

from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from typing import NamedTuple

import numpy as np
import xarray as xr

from wearlab.accuracy.ladder import Cost, Rung, WorkPrecision
from wearlab.accuracy.life import has_life
from wearlab.accuracy.life_curves import life_study
from wearlab.accuracy.peer_curves import missing_peers, peers
from wearlab.accuracy.reference import Unsuited, reference
from wearlab.accuracy.steady import steady
from wearlab.accuracy.steady_curves import steady_curves
from wearlab.arrays import Array
from wearlab.scene import Scene
from wearlab.simulation.label import CONVENTIONS, provenance

TARGETS = (1e-3, 1e-6)
"""Relative errors at which processor times are compared."""


SECONDS = {"units": "s", "display_units": "ms"}
ATTRIBUTES: dict[str, dict[str, str]] = {
    "setting": {"long_name": "value of the knob"},
    "error": {"long_name": "relative error against the reference"},
    "run_time": {"long_name": "processor time, a median where it is short", **SECONDS},
    "run_time_warm": {
        "long_name": "processor time from the answer of a neighbouring wear state",
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
        "long_name": "processor time to a relative error, between rungs interpolated",
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
RUNG_FIELDS = {
    "setting": "setting",
    "error": "error",
    "run_time": "seconds",
    "work": "work",
    "run_time_warm": "warm_seconds",
}
"""Variables along the rungs, and the fields of `Rung` that they hold."""
COSTS: dict[str, Cost] = {
    "time_to_error": "seconds",
    "warm_time_to_error": "warm_seconds",
    "work_to_error": "work",
}
"""Variables along the requested errors, and the fields of `Rung` that they hold."""
KEYS = ("name", "knob", "quantity", "role")
"""Fields that tell curves apart."""
PROVENANCE = (
    "model_version",
    "source",
    "source_hash",
    "packages",
    "machine",
    "commit",
    "dirty",
)
"""Attributes of a run that a dataset of studies has, too."""
ACCURACY_KNOBS = ("steps_per_period", "relative", "cycle_tolerance", "threshold")
"""Knobs that do not change what an answer converges to."""

CurveKey = tuple[str, ...]
Variables = dict[str, tuple[tuple[str, ...], Array]]


class Study(NamedTuple):
    """Work–precision curves of one scene.

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
        """Return the curves of a role and a quantity.

        Parameters
        ----------
        role : "wearlab", "as published" or "peer"
        quantity : whose error is drawn, such as "mesh_force"
        """
        return tuple(
            curve
            for curve in self.curves
            if curve.role == role and curve.quantity == quantity
        )

    def uncertainty(self, quantity: str) -> float:
        """Return the relative uncertainty of the reference of a quantity [1]."""
        of_force = self.disagreement.get("mesh_force", 0.0)
        return self.disagreement.get(quantity, of_force)


def study(label: str, scene: Scene, report: Callable[[str], None]) -> Study:
    """Study one scene: its life where it wears until something, else its steady state.

    Parameters
    ----------
    label : its name
    scene : without a life and without dynamics there are no curves
    report : called with the name of the curve that comes next
    """
    curves: tuple[WorkPrecision, ...] = ()
    disagreement: dict[str, float] = {}
    multiplier = float("nan")
    notes = []
    if has_life(scene):
        curves, difference = life_study(scene, report)
        disagreement = {"life": difference, "wear_depth": difference}
    elif scene.dynamics is not None:
        try:
            problem = steady(scene)
            report("reference")
            answer = reference(problem)
            curves = tuple(steady_curves(problem, answer, report))
            disagreement["mesh_force"] = answer.disagreement
            multiplier = answer.multiplier
        except Unsuited as unsuited:
            notes.append(f"steady state not studied: {unsuited}")
    return Study(label, scene, curves, disagreement, multiplier, tuple(notes))


def expected_reports(scene: Scene) -> int:
    """Return about how often a study reports, for a progress bar."""
    if has_life(scene):
        return 6
    return 9 + len(peers()) if scene.dynamics is not None else 0


class AgainstPeer(NamedTuple):
    """Our default method and the fastest peer, both from a cold start.

    Parameters
    ----------
    ours, peer : processor times [s]
    name : of the peer
    """

    ours: float
    peer: float
    name: str


def comparison(study: Study, error: float) -> AgainstPeer | None:
    """Return ours against the fastest peer at one error.

    Parameters
    ----------
    study : of a scene
    error : relative error of the mesh force [1]

    Returns
    -------
    processor times; None without peers, or where the error is out of reach
    """
    our_curves = [
        curve
        for curve in study.of("wearlab", "mesh_force")
        if curve.knob == "steps_per_period"
    ]
    peer_times = [
        (curve.cost_to(error), curve.name) for curve in study.of("peer", "mesh_force")
    ]
    reached = [(time, name) for time, name in peer_times if np.isfinite(time)]
    if not our_curves or not reached:
        return None

    ours = our_curves[0].cost_to(error)
    if not np.isfinite(ours):
        return None
    fastest, name = min(reached)
    return AgainstPeer(ours=ours, peer=fastest, name=name)


def cheapest_setting(
    study: Study, quantity: str, error: float
) -> tuple[WorkPrecision, Rung] | None:
    """Return the fastest of our settings that is accurate enough.

    The numerical knobs of the same scene are compared, not those that change what the
    answer converges to.

    Parameters
    ----------
    study : of a scene
    quantity : whose error counts, such as "mesh_force"
    error : relative error allowed [1]

    Returns
    -------
    the curve and its rung; None where there is none
    """
    settings: list[tuple[WorkPrecision, Rung]] = []
    for curve in study.curves:
        is_ours = curve.knob in ACCURACY_KNOBS and curve.role != "peer"
        if is_ours and curve.quantity == quantity:
            rung = curve.cheapest(error)
            if rung is not None:
                settings.append((curve, rung))
    return min(settings, key=lambda setting: setting[1].seconds, default=None)


def knob_settings(
    study: Study,
    quantity: str,
    error: float,
) -> dict[str, float]:
    """Return for each of our knobs the cheapest setting that is accurate enough.

    Parameters
    ----------
    study : of a scene
    quantity : whose error counts, such as "mesh_force"
    error : relative error allowed [1]
    """
    best = {
        curve.knob: curve.cheapest(error) for curve in study.of("wearlab", quantity)
    }
    return {knob: rung.setting for knob, rung in best.items() if rung is not None}


def dataset(title: str, studies: Sequence[Study], begun: float) -> xr.Dataset:
    """Return studies as a dataset with dimensions case, curve and rung.

    Shorter ladders are padded with NaN.

    Parameters
    ----------
    title : of the campaign
    studies : the studies
    begun : start of the run, seconds since the epoch [s]
    """
    curves = [curve for study in studies for curve in study.curves]
    keys = list(dict.fromkeys(_key_of(curve) for curve in curves))
    quantities = sorted({key[KEYS.index("quantity")] for key in keys})
    disagreements = [
        [study.disagreement.get(quantity, np.nan) for quantity in quantities]
        for study in studies
    ]

    result = xr.Dataset(
        {
            **_rung_variables(studies, keys),
            "observed_order": (("case", "curve"), _orders(studies, keys)),
            **_cost_variables(studies, keys),
            "reference_disagreement": (("case", "quantity_compared"), disagreements),
            "largest_multiplier": (("case",), [study.multiplier for study in studies]),
        },
        coords={
            "case": [study.label for study in studies],
            "curve": [
                f"{name} ({knob}, {quantity})" for name, knob, quantity, _ in keys
            ],
            **{
                name: ("curve", [key[index] for key in keys])
                for index, name in enumerate(KEYS)
            },
            "run_id": ("case", [study.scene.id for study in studies]),
            "requested_error": list(TARGETS),
            "quantity_compared": quantities,
        },
    )
    for name, attributes in ATTRIBUTES.items():
        result[name].attrs = {"units": "1"} | attributes
    result.attrs = _attributes(title, studies, begun)
    return result


def _key_of(curve: WorkPrecision) -> CurveKey:
    """Return what tells a curve apart, in the order of `KEYS`."""
    return tuple(getattr(curve, name) for name in KEYS)


def _table(
    studies: Sequence[Study],
    keys: list[CurveKey],
    width: int,
    values_of: Callable[[Study, WorkPrecision], list[float]],
) -> Array:
    """Return values of the curves of all studies, (n_cases, n_curves, width)."""
    table = np.full((len(studies), len(keys), width), np.nan)
    for row, study in zip(table, studies, strict=True):
        for curve in study.curves:
            values = values_of(study, curve)
            row[keys.index(_key_of(curve)), : len(values)] = values
    return table


def _rung_variables(studies: Sequence[Study], keys: list[CurveKey]) -> Variables:
    """Return the variables along the rungs."""
    curves = [curve for study in studies for curve in study.curves]
    longest = max((len(curve.rungs) for curve in curves), default=0)
    variables: Variables = {}
    for name, field in RUNG_FIELDS.items():

        def values_of(
            _: Study, curve: WorkPrecision, field: str = field
        ) -> list[float]:
            return [getattr(rung, field) for rung in curve.rungs]

        values = _table(studies, keys, longest, values_of)
        variables[name] = (("case", "curve", "rung"), values)
    return variables


def _cost_variables(studies: Sequence[Study], keys: list[CurveKey]) -> Variables:
    """Return the variables along the requested errors."""
    variables: Variables = {}
    for name, cost in COSTS.items():

        def values_of(
            _: Study,
            curve: WorkPrecision,
            cost: Cost = cost,
        ) -> list[float]:
            return [curve.cost_to(error, cost) for error in TARGETS]

        values = _table(studies, keys, len(TARGETS), values_of)
        variables[name] = (("case", "curve", "requested_error"), values)
    return variables


def _orders(studies: Sequence[Study], keys: list[CurveKey]) -> Array:
    """Return the observed orders, (n_cases, n_curves)."""

    def order(study: Study, curve: WorkPrecision) -> list[float]:
        return [curve.order(study.uncertainty(curve.quantity))]

    return _table(studies, keys, 1, order)[..., 0]


def _attributes(
    title: str,
    studies: Sequence[Study],
    begun: float,
) -> dict[str, str]:
    """Return the attributes of the dataset."""
    origin = provenance(studies[0].scene, begun)
    created = datetime.fromtimestamp(begun, UTC)
    notes = [f"{study.label}: {note}" for study in studies for note in study.notes]
    return {
        "Conventions": CONVENTIONS,
        "title": title,
        **{key: origin[key] for key in PROVENANCE if key in origin},
        "peers_missing": ", ".join(missing_peers()),
        "notes": "\n".join(notes),
        "date_created": created.isoformat(timespec="seconds"),
    }


def netcdf(studies: xr.Dataset) -> bytes:
    """Return the netCDF-4 file of a dataset."""
    return bytes(studies.to_netcdf(engine="netcdf4"))
