"""The search for other attractors beside the stored responses of a life.

It looks at the stored states alone, never while wear is stepped.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from wearlab import assembly
from wearlab.dynamics.forces.mesh_forces import extremes
from wearlab.dynamics.steady import coexisting, periodic
from wearlab.dynamics.steady.response import Response
from wearlab.life import coupled
from wearlab.simulation import work

ALIKE = 1e-3
"""Relative difference of least and largest forces below which two attractors of a
period are one."""


class Searched(NamedTuple):
    """What was found beside one state.

    Parameters
    ----------
    search : what the search came to; its rival is the one with the largest force
    rivals : every other attractor found, by falling largest force
    """

    search: coexisting.Search
    rivals: tuple[Response, ...] = ()


def other_attractors(
    parts: assembly.GearModel, states: Sequence[coupled.WearState]
) -> list[Searched]:
    """Look for other attractors of each state, by releases of its flanks.

    The methods of the papers integrate from one start alone, and so do errors that turn
    with their members; among the angles of averaged errors nothing is looked for, nor
    in sets of several meshes, where an integration of hundreds of periods costs more
    than a whole life. The bound on the work is shared by the states; what one leaves
    over is the next ones'. States of a life are alike: each tries other releases than
    those before it, and what one has found is looked for in the next, and then in the
    one before. The first state in which a release finds one tries all its others, too:
    the first that is found need not be the worst.
    """
    moves = parts.vibration
    account = parts.coupling.account
    if moves is None or not isinstance(moves.method, periodic.Periodic):
        return []
    if moves.hunting > 1 or moves.slow is not None or len(parts.meshes) > 1:
        return []
    max_steps = work.max_searched(
        moves.system, parts.scene.numerics.most_right_hand_sides
    )
    with account.timed("dynamics"):
        searches = _searches(
            [state.responses[0] for state in states], moves.method, max_steps
        )
    account.counts["period_maps"] += sum(
        searched.search.periods for searched in searches
    )
    return searches


def _searches(
    responses: Sequence[Response], method: periodic.Periodic, left: int
) -> list[Searched]:
    """Search one state after another with ``left`` integration steps, then back."""
    searched = list[Searched]()
    first = 0
    for number, response in enumerate(responses):
        hunt = _Beside(
            response,
            method,
            max(left // (len(responses) - number), 0),
            coexisting.Search(),
        )
        neighbours = searched[-1].rivals if searched else ()
        hunt.forwards(
            neighbours, coexisting.FURTHER if first else coexisting.RELEASES, first
        )
        searched.append(hunt.result())
        left = left - hunt.steps
        first = first + hunt.search.starts
    for number in reversed(range(len(searched) - 1)):
        neighbours = searched[number + 1].rivals
        if neighbours and not searched[number].rivals:
            hunt = _Beside(
                responses[number], method, max(left, 0), searched[number].search
            )
            hunt.follow(neighbours)
            searched[number] = hunt.result()
            left = left - hunt.steps
    return searched


@dataclass
class _Beside:
    """The attractors beside one response, found with a bounded number of steps."""

    response: Response
    method: periodic.Periodic
    most: int
    search: coexisting.Search
    rivals: list[Response] = field(default_factory=list)
    steps: int = 0

    def forwards(
        self, neighbours: Sequence[Response], releases: int, first: int
    ) -> None:
        """Follow what a neighbour has, or release flanks while the bounds allow."""
        self._look(coexisting.Tries(releases, first, next(iter(neighbours), None)))
        self.follow(neighbours[1:])
        while (
            self.rivals
            and not neighbours
            and self.search.starts < releases
            and not self.search.cut_off
        ):
            self._look(
                coexisting.Tries(
                    releases - self.search.starts, first + self.search.starts
                )
            )

    def follow(self, neighbours: Sequence[Response]) -> None:
        """Look for what each attractor of a neighbour becomes."""
        for near in neighbours:
            self._look(coexisting.Tries(0, 0, near))

    def _look(self, tries: coexisting.Tries) -> None:
        result = coexisting.coexisting(
            self.response, self.method, max(self.most - self.steps, 0), tries
        )
        self.steps += int(result.spent * len(self.response.tables.width))
        starts = self.search.starts + result.starts
        periods = self.search.periods + result.periods
        self.search = coexisting.Search(None, starts, periods, result.cut_off)
        if result.rival is not None and not any(
            _alike(result.rival, rival) for rival in self.rivals
        ):
            self.rivals.append(result.rival)

    def result(self) -> Searched:
        """Return what was found, the worst first."""
        if len(self.rivals) > 1:
            self.rivals.sort(key=lambda rival: -float(extremes(rival).largest.max()))
        return Searched(
            self.search._replace(rival=next(iter(self.rivals), None)),
            tuple(self.rivals),
        )


def _alike(first: Response, second: Response) -> bool:
    """Whether two motions are one attractor: of one period, with the same forces."""
    if first.period != second.period or first.period == 0:
        return first.period == second.period
    first_forces, second_forces = (
        np.concatenate([extreme.least, extreme.largest])
        for extreme in (extremes(first), extremes(second))
    )
    return bool(
        np.abs(first_forces - second_forces).max() <= ALIKE * np.abs(first_forces).max()
    )
