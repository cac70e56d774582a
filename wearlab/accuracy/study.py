"""A campaign's scenes studied one by one: error against run time of every knob, method and peer."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wearlab.accuracy.ladder import Rung, WorkPrecision
from wearlab.accuracy.life_ladders import life_study
from wearlab.accuracy.lives import has_life
from wearlab.accuracy.peers import peers
from wearlab.accuracy.reference import Unsuited
from wearlab.accuracy.steady_ladders import steady_study
from wearlab.scene import Scene

TARGETS = (1e-3, 1e-6)
"""Relative errors at which wall times are compared."""


@dataclass(frozen=True)
class Study:
    """What was found of one scene.

    Parameters
    ----------
    label : the case
    scene : its scene
    curves : work–precision curves
    disagreement : by quantity, relative difference between the reference and the second method [1]
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
        return tuple(c for c in self.curves if c.role == role and c.quantity == quantity)

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
    multiplier, notes = float("nan"), []
    if has_life(scene):
        curves, apart = life_study(scene, report)
        disagreement = {"life": apart, "wear_depth": apart}
    elif scene.dynamics is not None:
        try:
            curves, disagreement["mesh_force"], multiplier = steady_study(scene, report)
        except Unsuited as unsuited:
            notes.append(f"steady state not studied: {unsuited}")
    return Study(label, scene, curves, disagreement, multiplier, tuple(notes))


def expected_reports(scene: Scene) -> int:
    """Return about how often a study reports, for a progress bar."""
    if has_life(scene):
        return 6
    return 9 + len(list(peers())) if scene.dynamics is not None else 0


class AgainstPeer(NamedTuple):
    """Wall times of our default method and of the fastest peer, both from a cold start [s], and its name."""

    ours: float
    peer: float
    name: str


def comparison(studies: Study, error: float) -> AgainstPeer | None:
    """Return ours against the fastest peer at one error; None without peers or out of reach."""
    ours = next((c for c in studies.of("wearlab", "mesh_force") if c.knob == "steps_per_period"), None)
    times = [(c.seconds_to(error), c.name) for c in studies.of("peer", "mesh_force")]
    reached = [time for time in times if np.isfinite(time[0])]
    if ours is None or not reached or not np.isfinite(ours.seconds_to(error)):
        return None
    return AgainstPeer(ours.seconds_to(error), *min(reached))


def cheapest_setting(studies: Study, quantity: str, error: float) -> tuple[WorkPrecision, Rung] | None:
    """Return the fastest of our own settings whose error of a quantity is small enough, None: there is none.

    The numerical knobs of the same scene are compared, not those that change what the answer converges to.
    """
    known = [
        (curve, rung)
        for curve in studies.curves
        if curve.role != "peer" and curve.quantity == quantity
        for rung in [curve.cheapest(error)]
        if rung is not None and curve.knob in ("steps_per_period", "relative", "cycle_tolerance", "threshold")
    ]
    return min(known, key=lambda pair: pair[1].seconds, default=None)


def knob_settings(studies: Study, quantity: str, error: float) -> dict[str, float]:
    """Return for each of our knobs the cheapest setting that keeps a quantity within ``error``."""
    settings = {}
    for curve in studies.of("wearlab", quantity):
        rung = curve.cheapest(error)
        if rung is not None:
            settings[curve.knob] = rung.setting
    return settings
