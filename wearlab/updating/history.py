"""What one stored run says of every wear coefficient: h(N; f k0) = h(f N; k0), see `scaling`."""

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from wearlab.arrays import Array, Flags
from wearlab.campaign.measured import Limit
from wearlab.updating.asking import TINY, Asked, asked_of, curve_of, per_cycle
from wearlab.updating.curve import RunCurve
from wearlab.updating.errors import UpdateError
from wearlab.updating.observations import Observed
from wearlab.updating.scaling import refuse_what_does_not_scale
from wearlab.updating.stored import StoredRun

WHOLE = ("max_wear_depth", "worn_mass")  # quantities that are one number of a gear


@dataclass(frozen=True)
class RunHistory:
    """A stored run as an update needs it.

    Parameters
    ----------
    id : of the run
    factor : the factor on the wear coefficient that it was made with
    coefficient : largest wear coefficient along the flank at its first state, at factor 1 [m²/N]
    start, end : first and last stored cycle
    seconds_per_cycle : operating time of one cycle [s]
    asked : by block of observations
    limit : the quantity that ends the life
    level : of it at which it does [SI]
    limit_cycle : cycle of this run at which it does, ∞ never
    beside : what else is predicted over the cycles: max_wear_depth, worn_mass
    numerical : relative error of the depth anywhere along the flanks, as the run estimates it
    numerical_whole : of the largest depth and of masses, where the run tells the error of its life
    """

    id: str
    factor: float
    coefficient: float
    start: float
    end: float
    seconds_per_cycle: float
    asked: tuple[Asked, ...]
    limit: RunCurve
    level: float
    limit_cycle: float
    beside: Mapping[str, RunCurve]
    numerical: float
    numerical_whole: float

    def numerical_of(self, quantity: str) -> float:
        """Return the relative numerical error of a quantity: of one number, or of any place of a profile."""
        return self.numerical_whole if quantity in WHOLE else self.numerical

    def own_cycle(self, cycle: Array, factor: Array) -> Array:
        """Return the cycle of this run at which wear is as after ``cycle`` with another factor."""
        return self.start + (cycle - self.start) * (factor / self.factor)

    def life(self, factor: Array) -> Array:
        """Return the cycles to the limit with a factor on the wear coefficient."""
        with np.errstate(divide="ignore"):
            return np.asarray(self.start + (self.limit_cycle - self.start) * (self.factor / factor))


def history_of(
    run: StoredRun, run_id: str, scene: Mapping[str, Any], seen: tuple[Observed, ...], limit: Limit
) -> RunHistory:
    """Return what a stored run says over the cycles.

    Parameters
    ----------
    run : a stored run
    run_id, scene : its identity, and the canonical scene that it is of
    seen : the observations that it is compared with
    limit : what ends the life

    Raises
    ------
    UpdateError : the run lacks a quantity, or what happens in it does not scale with k
    """
    refuse_what_does_not_scale(scene)
    if "cycle" not in run or len(run["cycle"].values) < 2:
        raise UpdateError("the stored run has one wear state: wear.until is required, and k > 0")
    cycle = np.asarray(run["cycle"].values, float)
    keep = np.concatenate([[True], np.diff(cycle) > TINY * max(cycle[-1], 1.0)])
    ended = curve_of(run, limit.quantity, limit.where, {}, keep, "update.limit")
    factor, limit_cycle = _factor(scene), float(ended.first_above(np.array(limit.value)))
    return RunHistory(
        id=run_id,
        factor=factor,
        coefficient=_coefficient(run, limit.where) / factor,
        start=float(cycle[0]),
        end=float(cycle[-1]),
        seconds_per_cycle=per_cycle(run, "operating_hours"),
        asked=tuple(asked_of(run, inspection, keep, limit, ended) for inspection in seen),
        limit=ended,
        level=limit.value,
        limit_cycle=limit_cycle,
        beside=_beside(run, limit, ended, keep),
        numerical=_numerical(run, limit_cycle),
        numerical_whole=_numerical_whole(run, limit_cycle),
    )


def _beside(run: StoredRun, limit: Limit, ended: RunCurve, keep: Flags) -> dict[str, RunCurve]:
    """Return depth and mass of the gear that ends the life, where the run has them."""
    curves: dict[str, RunCurve] = {}
    member = None if limit.where is None else limit.where.split("-")[0]
    flank = limit.where if limit.quantity == "max_wear_depth" else member
    for name, dim, where in (("max_wear_depth", "flank", flank), ("worn_mass", "member", member)):
        if name == limit.quantity and where == limit.where:
            curves[name] = ended
        elif name in run and (where is None or where in run[name].labels.get(dim, ())):
            with suppress(UpdateError):
                curves[name] = curve_of(run, name, where, {}, keep, "")
    return curves


def _factor(scene: Mapping[str, Any]) -> float:
    coefficient = (scene.get("wear") or {}).get("coefficient") or {}
    return float(coefficient.get("factor", 1.0)) if isinstance(coefficient, dict) else 1.0


def _coefficient(run: StoredRun, where: str | None) -> float:
    """Return the largest wear coefficient along the flank at the first state [m²/N]."""
    name = "effective_wear_coefficient"
    if name not in run:
        return math.nan
    values = run[name].at("update", 0)
    member = None if where is None else where.split("-")[0]
    mine = [i for i, label in enumerate(values.known("flank")) if str(label).split("-")[0] == member]
    values = values.at("flank", mine) if mine else values
    return float(np.nanmax(values.values))


def _numerical(run: StoredRun, limit_cycle: float) -> float:
    """Return the largest relative error of the wear depth that the run tells of, late before the limit."""
    if "error_estimate_wear_depth" not in run or "max_wear_depth" not in run:
        return 0.0
    depth = run["max_wear_depth"].largest("flank").values
    error = run["error_estimate_wear_depth"].values
    cycle = run["cycle"].values
    before = cycle <= max(limit_cycle, cycle[1]) * (1.0 + 1e-9)
    late = before & (depth > 0.05 * depth[before][-1])
    ratio = error[late] / depth[late]
    return float(np.nanmax(ratio)) if np.isfinite(ratio).any() else 0.0


def _numerical_whole(run: StoredRun, limit_cycle: float) -> float:
    """Return the relative error of the run's life, which is that of the depth that ends it and of masses."""
    if "life" not in run or "error_estimate_life" not in run:
        return _numerical(run, limit_cycle)
    ratio = float(run["error_estimate_life"].values) / float(run["life"].values)
    return ratio if np.isfinite(ratio) else _numerical(run, limit_cycle)
