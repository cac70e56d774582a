"""The response over speed, named as the dataset names it."""

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.forces import extremes, mesh_forces
from wearlab.dynamics.orbits.continuation import Continuation, JumpOfResponse, Point
from wearlab.dynamics.orbits.periodic import Periodic
from wearlab.dynamics.system import System
from wearlab.life.coupled import WearState
from wearlab.life.vibration import Vibration
from wearlab.mesh import stages, tabulation
from wearlab.mesh.force import Deflections
from wearlab.scene.build import Parts
from wearlab.scene.build.vibration import steps_grid
from wearlab.simulation.vibration import transmission_error

Values = dict[str, Any]

SAMPLES = 64
"""Samples of a mesh period."""
LINES = 24
"""Order lines between two mesh orders: all subharmonics down to 1/24 that divide it fall on lines."""
ORDERS = 5


@dataclass(frozen=True)
class OverSpeed:
    """What a continuation over speed needs of one wear state.

    Parameters
    ----------
    parts, state : the physics of the scene, and the wear state
    speeds : (n,) ascending speeds of the input member [rad/s]
    directions : names of the directions, in the order in which they are followed
    continuation : how
    """

    parts: Parts
    state: WearState
    speeds: Array
    directions: tuple[str, ...]
    continuation: Continuation

    def vibration(self, speed: float) -> Vibration:
        """Return the dynamics at a speed [rad/s], with steps by the rule for that speed."""
        scene, parts = self.parts.scene, self.parts
        assert parts.vibration is not None and scene.operation.speed is not None
        period = parts.gears.period * scene.operation.speed / speed
        stiffest = np.array([self.state.kind[mesh.kind].static.tangent.max() for mesh in parts.meshes])
        grid = steps_grid(scene, parts.on_clock, parts.vibration.system, stiffest, period)
        return parts.with_steps(grid, 1, period)

    def mesh_at(self, speed: float) -> tuple[System, stages.StageTables, float]:
        """Return system, tables and duration of a mesh period at a speed [rad/s]."""
        moving = self.vibration(speed)
        tables = tabulation.stage_tables(
            self.parts.coupling.flanks_of(self.state), moving.sampling, moving.fluctuation
        )
        return moving.system, tables, moving.period


def _over_speed(parts: Parts, state: WearState) -> OverSpeed:
    """Return the continuation that ``dynamics.response`` asks for, at one wear state."""
    assert parts.vibration is not None and isinstance(parts.vibration.method, Periodic)
    given: Any = parts.scene.dynamics and parts.scene.dynamics.response
    speeds = np.linspace(getattr(given.speed, "from"), given.speed.to, given.speed.points)
    return OverSpeed(
        parts, state, speeds, given.directions,
        Continuation(given.transient, given.strobe, parts.vibration.method),
    )  # fmt: skip


def over_speed_values(parts: Parts, state: WearState) -> Values:
    """Follow the response of one wear state over speed and return what is read off it."""
    clock = time.perf_counter()
    wanted = _over_speed(parts, state)
    branches = _branches(wanted)
    jumps = [wanted.continuation.jumps(wanted.mesh_at, points) for points in branches]
    ordered = [sorted(points, key=lambda point: point.speed) for points in branches]
    rows = [[_described(wanted, point) for point in points] for points in ordered]
    values = {
        f"response_{name}": _stacked([[row[name] for row in line] for line in rows], name)
        for name in rows[0][0]
    }
    account = parts.coupling.account
    account.seconds["dynamics"] += time.perf_counter() - clock
    for point in (point for points in branches for point in points):
        account.counts["period_maps"] += point.response.counts.period_maps
        account.counts["right_hand_sides"] += point.response.counts.right_hand_sides
    labels: Values = {
        "response_speed": wanted.speeds,
        "direction": list(wanted.directions),
        "order": np.arange(1, ORDERS * LINES + 1) / LINES,
    }
    return values | labels | _jump_values(jumps)


ORDER = {"up": slice(None), "down": slice(None, None, -1)}


def _branches(wanted: OverSpeed) -> list[list[Point]]:
    """Follow each direction; the second one starts where the first has ended."""
    start = _first_state(wanted)
    branches: list[list[Point]] = []
    for direction in wanted.directions:
        speeds = wanted.speeds[ORDER[direction]]
        branches.append(wanted.continuation.follow(wanted.mesh_at, list(speeds), start))
        start = branches[-1][-1].response.end
    return branches


def _first_state(wanted: OverSpeed) -> Array:
    """Return the state from which the first speed starts: the steady response there, (2n,)."""
    first = wanted.speeds[ORDER[wanted.directions[0]]][0]
    return wanted.continuation.method.solve(*wanted.mesh_at(float(first))).end


def _described(wanted: OverSpeed, point: Point) -> Values:
    parts, response = wanted.parts, point.response
    vibration = wanted.vibration(point.speed)
    phases = np.arange(SAMPLES) / SAMPLES
    where, when = parts.look(0, phases), vibration.look(phases)
    motion = Deflections(*(values[:, 0] for values in vibration.motions(response, when)))
    position, _ = vibration.coordinates(response, when)
    kinds = parts.coupling.flanks_of(wanted.state)
    force = mesh_forces.mesh_forces(vibration.system, 0, kinds[0], where, motion, vibration.period).elastic
    transmission = transmission_error(vibration, position)[:, 0]
    static, extreme = parts.kinds[0].analysis.load, extremes.extremes(response)
    poincare = _strobed(vibration, point)
    multiplier = abs(response.multipliers[0]) if len(response.multipliers) else np.nan
    return {
        "dynamic_factor": extreme.largest[0] / static if static > 0.0 else np.nan,
        "force_peak_to_peak": extreme.largest[0] - extreme.least[0],
        "force_rms": force.std(),
        "dte_peak_to_peak": np.ptp(transmission),
        "dte_rms": transmission.std(),
        "separation_fraction": extreme.separated[0],
        "orbit_period": response.period,
        "multiplier": multiplier,
        "dte_orders": order_amplitudes(transmission),
        "force_orders": order_amplitudes(force),
        "poincare_deflection": poincare[0],
        "poincare_rate": poincare[1],
    }


def _strobed(vibration: Vibration, point: Point) -> tuple[Array, Array]:
    """Return δ and its rate at phase 0 of the strobed states, (n_strobe,) each."""
    response, direction = point.response, vibration.system.direction[0]
    n = len(direction)
    error, rate = response.tables.error[0, 0, 0], response.tables.error_rate[0, 0, 0]
    deflection = point.strobe[:, :n] @ direction - error
    return deflection, point.strobe[:, n:] @ direction - rate / response.mesh_period


def order_amplitudes(values: Array) -> Array:
    """Return amplitudes on the lines 1/24, 2/24 … 5 of the mesh order, (120,).

    A response of m periods has exact lines at multiples of 1/m; each is written to the nearest of ours. An
    aperiodic one is cut into pieces of 24 periods, whose powers are averaged.

    Parameters
    ----------
    values : (m, n_phases) samples of m mesh periods
    """
    periods, phases = values.shape
    pieces = [values.ravel()]
    if periods > LINES:
        count = periods // LINES
        pieces, periods = list(values[: count * LINES].reshape(count, -1)), LINES
    power = np.mean([np.abs(np.fft.rfft(piece) * 2.0 / len(piece)) ** 2 for piece in pieces], axis=0)
    amplitude = np.zeros(ORDERS * LINES + 1)
    most = min(len(power) - 1, ORDERS * periods, periods * phases // 2)
    for line in range(1, most + 1):
        amplitude[round(line * LINES / periods)] = np.sqrt(power[line])
    return amplitude[1:]


def _stacked(rows: list[list[Any]], name: str) -> Array:
    """Return (direction, speed, …), with the mesh before it where the schema has one."""
    values = np.array(rows, float)
    return values if name in ("orbit_period", "multiplier") else values[None]


def _jump_values(jumps: list[list[JumpOfResponse]]) -> Values:
    """Return the brackets of the jumps, padded with NaN; nothing when there is none."""
    most = max(map(len, jumps))
    if not most:
        return {}
    speed, extent = np.full((2, len(jumps), most, 2), np.nan)
    for row, place in enumerate(jumps):
        for column, jump in enumerate(place):
            speed[row, column] = jump.before, jump.after
            extent[row, column] = jump.extent_before, jump.extent_after
    return {
        "response_jump_speed": speed,
        "response_jump_extent": extent,
        "edge": ["before", "after"],
    }
