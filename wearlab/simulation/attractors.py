"""Other attractors of the stored states: looked for there alone, never while wear is stepped."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.forces.extremes import extremes
from wearlab.dynamics.orbits import coexisting, periodic
from wearlab.dynamics.orbits.response import Response
from wearlab.life import coupled
from wearlab.scene import build
from wearlab.simulation import label, living

ALIKE = 1e-3
"""Relative difference of least and largest forces below which two attractors of a period are one."""


class Searched(NamedTuple):
    """What was found beside one state.

    Parameters
    ----------
    search : what the search came to; its rival is the one with the largest force
    rivals : every other attractor found, by falling largest force
    """

    search: coexisting.Search
    rivals: tuple[Response, ...] = ()


def other_attractors(parts: build.Parts, states: Sequence[coupled.WearState]) -> list[Searched]:
    """Look for other attractors of each state, where released flanks do not return to the response stored.

    The methods of the papers integrate from one start alone, and so do errors that turn with their members;
    among the angles of averaged errors nothing is looked for, nor in sets of several meshes, where an
    integration of hundreds of periods costs more than a whole life. The bound on the work is shared by the
    states; what one leaves over is the next ones'. States of a life are alike: each tries other releases than
    those before it, and what one has found is looked for in the next, and then in the one before. The first
    state in which a release finds one tries all its others, too: the first that is found need not be the
    worst.
    """
    vibration, account = parts.vibration, parts.coupling.account
    if vibration is None or not isinstance(vibration.method, periodic.Periodic):
        return []
    if vibration.hunting > 1 or vibration.slow is not None or len(parts.meshes) > 1:
        return []
    most = living.most_searched(vibration.system, parts.scene.numerics.most_right_hand_sides)
    with account.timed("dynamics"):
        searches = _searches([state.responses[0] for state in states], vibration.method, most)
    account.counts["period_maps"] += sum(one.search.periods for one in searches)
    return searches


def _searches(responses: Sequence[Response], method: periodic.Periodic, left: int) -> list[Searched]:
    """Search one state after another with ``left`` integration steps, then back."""
    found, first = list[Searched](), 0
    for number, response in enumerate(responses):
        most = max(left // (len(responses) - number), 0)
        hunt = _Beside(response, method, most, coexisting.Search())
        known = found[-1].rivals if found else ()
        hunt.forwards(known, coexisting.FURTHER if first else coexisting.RELEASES, first)
        found.append(hunt.result())
        left, first = left - hunt.steps, first + hunt.search.starts
    for number in reversed(range(len(found) - 1)):
        known = found[number + 1].rivals
        if known and not found[number].rivals:
            hunt = _Beside(responses[number], method, max(left, 0), found[number].search)
            hunt.follow(known)
            found[number], left = hunt.result(), left - hunt.steps
    return found


@dataclass
class _Beside:
    """The attractors found beside one response, with a bounded number of integration steps."""

    response: Response
    method: periodic.Periodic
    most: int
    search: coexisting.Search
    rivals: list[Response] = field(default_factory=list)
    steps: int = 0

    def forwards(self, known: Sequence[Response], releases: int, first: int) -> None:
        """Follow what a neighbour has, or release flanks until there are no more releases or steps."""
        self._look(coexisting.Tries(releases, first, next(iter(known), None)))
        self.follow(known[1:])
        while self.rivals and not known and self.search.starts < releases and not self.search.cut_off:
            self._look(coexisting.Tries(releases - self.search.starts, first + self.search.starts))

    def follow(self, known: Sequence[Response]) -> None:
        """Look for what each attractor of a neighbour becomes."""
        for near in known:
            self._look(coexisting.Tries(0, 0, near))

    def _look(self, tries: coexisting.Tries) -> None:
        again = coexisting.coexisting(self.response, self.method, max(self.most - self.steps, 0), tries)
        self.steps += int(again.spent * len(self.response.tables.width))
        self.search = coexisting.Search(
            None, self.search.starts + again.starts, self.search.periods + again.periods, again.cut_off
        )
        if again.rival is not None and not any(_alike(again.rival, other) for other in self.rivals):
            self.rivals.append(again.rival)

    def result(self) -> Searched:
        """Return what was found, the worst first."""
        if len(self.rivals) > 1:
            self.rivals.sort(key=lambda other: -float(extremes(other).largest.max()))
        return Searched(self.search._replace(rival=next(iter(self.rivals), None)), tuple(self.rivals))


def _alike(one: Response, other: Response) -> bool:
    """Whether two motions are one attractor: both aperiodic, or of one period and with the same forces."""
    if one.period != other.period or one.period == 0:
        return one.period == other.period
    first, second = (np.concatenate([own.least, own.largest]) for own in (extremes(one), extremes(other)))
    return bool(np.abs(first - second).max() <= ALIKE * np.abs(first).max())


def attractor_values(found: Sequence[Searched]) -> label.Values:
    """Return what was searched, and period, largest multiplier and range of force of the attractors found.

    Of the worst beside each state, and of all of them along ``rival``.
    """
    if not found:
        return {}
    searches = [one.search for one in found]
    values: label.Values = {"attractor_search": list(map(searched, searches))}
    for what in ("starts", "periods"):
        values[f"count_attractor_{what}"] = sum(getattr(search, what) for search in searches)
    if not any(one.rivals for one in found):
        return values
    rows = [np.array([_described(other) for other in one.rivals]) for one in found]
    width = max(own.shape[-1] for own in rows)
    each = label.padded([own.reshape(-1, width) for own in rows])
    least, largest = (force.transpose(0, 2, 1) for force in np.split(each[..., 2:], 2, axis=-1))
    told = {"period": each[..., 0], "multiplier": each[..., 1], "force_min": least, "force_max": largest}
    worst = {f"coexisting_{name}": own[..., 0] for name, own in told.items()}
    return values | worst | {f"rival_{name}": own for name, own in told.items()}


def searched(search: coexisting.Search) -> str:
    """Return in words what a search came to."""
    if search.rival is None and not search.cut_off:
        return "none found" if search.starts else "not looked for"
    return "cut off" if search.rival is None else "another found"


def _described(other: Response) -> Array:
    """Return period, largest multiplier, and the smallest and largest force of every mesh."""
    described = extremes(other)
    largest = float(abs(other.multipliers[0])) if len(other.multipliers) else np.nan
    return np.concatenate([[float(other.period), largest], described.least, described.largest])
