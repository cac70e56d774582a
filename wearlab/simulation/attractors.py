"""Responses beside those of a life: other attractors of its stored states, and the response over speed.

Other attractors are looked for in the stored states alone, never while wear is stepped.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.dynamics.forces.mesh_forces import extremes
from wearlab.dynamics.steady import coexisting, continuation, periodic
from wearlab.dynamics.steady.response import Response, dashpot_of
from wearlab.life import coupled
from wearlab.mesh import force, stages
from wearlab.simulation import label, life_run, vibration

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
    """Look for other attractors of each state, where released flanks do not return to the response stored.

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
    max_steps = life_run.max_searched(
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
    """The attractors found beside one response, with a bounded number of integration steps."""

    response: Response
    method: periodic.Periodic
    most: int
    search: coexisting.Search
    rivals: list[Response] = field(default_factory=list)
    steps: int = 0

    def forwards(
        self, neighbours: Sequence[Response], releases: int, first: int
    ) -> None:
        """Follow what a neighbour has, or release flanks until there are no more releases or steps."""
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
    """Whether two motions are one attractor: both aperiodic, or of one period and with the same forces."""
    if first.period != second.period or first.period == 0:
        return first.period == second.period
    first_forces, second_forces = (
        np.concatenate([extreme.least, extreme.largest])
        for extreme in (extremes(first), extremes(second))
    )
    return bool(
        np.abs(first_forces - second_forces).max() <= ALIKE * np.abs(first_forces).max()
    )


def attractor_values(searches: Sequence[Searched]) -> label.Values:
    """Return what was searched, and period, largest multiplier and range of force of the attractors found.

    Of the worst beside each state, and of all of them along ``rival``.
    """
    if not searches:
        return {}
    values: label.Values = {
        "attractor_search": [searched(beside.search) for beside in searches]
    }
    values["count_attractor_starts"] = sum(beside.search.starts for beside in searches)
    values["count_attractor_periods"] = sum(
        beside.search.periods for beside in searches
    )
    if not any(beside.rivals for beside in searches):
        return values
    rows = [[_described(rival) for rival in beside.rivals] for beside in searches]
    width = max(len(values_of_row) for row in rows for values_of_row in row)
    described = label.padded([np.reshape(row, (-1, width)) for row in rows])
    smallest, largest = (
        force.transpose(0, 2, 1) for force in np.split(described[..., 2:], 2, axis=-1)
    )
    by_rival = {
        "period": described[..., 0],
        "multiplier": described[..., 1],
        "force_min": smallest,
        "force_max": largest,
    }
    worst = {
        f"coexisting_{name}": values_of_row[..., 0]
        for name, values_of_row in by_rival.items()
    }
    return (
        values
        | worst
        | {f"rival_{name}": values_of_row for name, values_of_row in by_rival.items()}
    )


def searched(search: coexisting.Search) -> str:
    """Return in words what a search came to."""
    if search.rival is None and not search.cut_off:
        return "none found" if search.starts else "not looked for"
    return "cut off" if search.rival is None else "another found"


def _described(rival: Response) -> Array:
    """Return period, largest multiplier, and the smallest and largest force of every mesh."""
    described = extremes(rival)
    largest = float(abs(rival.multipliers[0])) if len(rival.multipliers) else np.nan
    return np.concatenate(
        [[float(rival.period), largest], described.least, described.largest]
    )


SAMPLES = 64
"""Samples of a mesh period."""
LINES = 24
"""Order lines between two mesh orders: all subharmonics down to 1/24 that divide it
fall on lines."""
ORDERS = 5
ORDER = {"up": slice(None), "down": slice(None, None, -1)}


def at_speed(
    parts: assembly.GearModel, state: coupled.WearState, speed: float
) -> coupled.Vibration:
    """Return the dynamics at a speed [rad/s], with steps by the rule for that speed."""
    assert parts.scene.operation.speed is not None
    period = parts.gears.period * parts.scene.operation.speed / speed
    stiffest = np.array(
        [state.kind[mesh.kind].static.tangent.max() for mesh in parts.meshes]
    )
    grid = assembly.vibration.steps_grid(
        parts.scene, parts.on_clock, parts.moving.system, stiffest, period
    )
    return parts.with_steps(grid, 1, period)


def over_speed_values(
    parts: assembly.GearModel, state: coupled.WearState
) -> label.Values:
    """Follow the response of one wear state over speed and return what is read off it.

    The first speed starts from the steady response there, each further direction where
    the last has ended.
    """
    account = parts.coupling.account
    method = parts.moving.method

    def mesh_at(speed: float) -> tuple[Any, stages.StageTables, float]:
        """Return system, tables and duration of a mesh period at a speed [rad/s]."""
        moving = at_speed(parts, state, speed)
        return moving.system, moving.tables(state.flanks), moving.period

    assert isinstance(method, periodic.Periodic)
    response: Any = parts.scene.dynamics and parts.scene.dynamics.response
    speeds = np.linspace(
        getattr(response.speed, "from"), response.speed.to, response.speed.points
    )
    way = continuation.Continuation(response.transient, response.strobe, method)
    branches = []
    values: label.Values = {
        "response_speed": speeds,
        "direction": list(response.directions),
    }
    values["order"] = np.arange(1, ORDERS * LINES + 1) / LINES
    with account.timed("dynamics"):
        start = method.solve(
            *mesh_at(float(speeds[ORDER[response.directions[0]]][0]))
        ).end
        for direction in response.directions:
            branches.append(way.follow(mesh_at, list(speeds[ORDER[direction]]), start))
            start = branches[-1][-1].response.end
        jumps = [way.jumps(mesh_at, points) for points in branches]
        ordered = [sorted(points, key=lambda point: point.speed) for points in branches]
        rows = [
            [_read_off(parts, state, point) for point in points] for points in ordered
        ]
    account.add(point.response for points in branches for point in points)
    for name in rows[0][0]:  # (direction, speed, …), of the mesh but for two
        rows_of = np.array([[row[name] for row in line] for line in rows], float)
        values[f"response_{name}"] = (
            rows_of if name in ("orbit_period", "multiplier") else rows_of[None]
        )
    if any(jumps):  # with their brackets
        rows_of = label.padded([np.reshape(place, (-1, 4)) for place in jumps])
        values |= {
            "response_jump_speed": rows_of[..., :2],
            "response_jump_extent": rows_of[..., 2:],
        }
        values["edge"] = ["before", "after"]
    return values


def _read_off(
    parts: assembly.GearModel, state: coupled.WearState, point: continuation.Point
) -> label.Values:
    moves = at_speed(parts, state, point.speed)
    response = point.response
    phases = np.arange(SAMPLES) / SAMPLES
    where = parts.locate(0, phases)
    when = moves.look(phases)
    motion = force.Deflections(
        *(values[:, 0] for values in moves.motions(response, when))
    )
    position, _ = moves.coordinates(response, when)
    dashpot = dashpot_of(moves.system, 0)
    elastic = force.flank_forces(
        state.flanks[0], where, motion, dashpot, moves.period
    ).elastic
    transmission = vibration.transmission_error(moves, position)[:, 0]
    static = parts.kinds[0].analysis.load
    extreme = extremes(response)
    tables = response.tables
    # at phase 0
    moved, moving = (
        coordinates @ moves.system.direction[0]
        for coordinates in np.split(point.strobe, 2, axis=1)
    )
    return {
        "dynamic_factor": extreme.largest[0] / static if static > 0.0 else np.nan,
        "force_peak_to_peak": extreme.largest[0] - extreme.least[0],
        "force_rms": elastic.std(),
        "dte_peak_to_peak": np.ptp(transmission),
        "dte_rms": transmission.std(),
        "separation_fraction": extreme.separated[0],
        "orbit_period": response.period,
        "multiplier": abs(response.multipliers[0])
        if len(response.multipliers)
        else np.nan,
        "dte_orders": order_amplitudes(transmission),
        "force_orders": order_amplitudes(elastic),
        "poincare_deflection": moved - tables.error[0, 0, 0],
        "poincare_rate": moving - tables.error_rate[0, 0, 0] / response.mesh_period,
    }


def order_amplitudes(values: Array) -> Array:
    """Return amplitudes on the lines 1/24, 2/24 … 5 of the mesh order, (120,).

    A response of m periods has exact lines at multiples of 1/m; each is written to the
    nearest of ours. An aperiodic one is cut into pieces of 24 periods, whose powers are
    averaged.

    Parameters
    ----------
    values : (m, n_phases) samples of m mesh periods
    """
    periods, phases = values.shape
    pieces = [values.ravel()]
    if periods > LINES:
        count = periods // LINES
        pieces = list(values[: count * LINES].reshape(count, -1))
        periods = LINES
    power = np.mean(
        [np.abs(np.fft.rfft(piece) * 2.0 / len(piece)) ** 2 for piece in pieces], axis=0
    )
    amplitude = np.zeros(ORDERS * LINES + 1)
    last_line = min(len(power) - 1, ORDERS * periods, periods * phases // 2)
    for line in range(1, last_line + 1):
        amplitude[round(line * LINES / periods)] = np.sqrt(power[line])
    return amplitude[1:]
