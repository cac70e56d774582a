"""The response over speed, named as the dataset names it."""

from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.forces import extremes
from wearlab.dynamics.orbits import continuation, periodic
from wearlab.dynamics.orbits.response import dashpot_of
from wearlab.life import coupled
from wearlab.life.vibration import Vibration
from wearlab.mesh import force, stages
from wearlab.scene import build
from wearlab.simulation import label
from wearlab.simulation.vibration import transmission_error

SAMPLES = 64
"""Samples of a mesh period."""
LINES = 24
"""Order lines between two mesh orders: all subharmonics down to 1/24 that divide it fall on lines."""
ORDERS = 5


def at_speed(parts: build.Parts, state: coupled.WearState, speed: float) -> Vibration:
    """Return the dynamics at a speed [rad/s], with steps by the rule for that speed."""
    assert parts.scene.operation.speed is not None
    period = parts.gears.period * parts.scene.operation.speed / speed
    stiffest = np.array([state.kind[mesh.kind].static.tangent.max() for mesh in parts.meshes])
    grid = build.vibration.steps_grid(parts.scene, parts.on_clock, parts.moving.system, stiffest, period)
    return parts.with_steps(grid, 1, period)


ORDER = {"up": slice(None), "down": slice(None, None, -1)}


def over_speed_values(parts: build.Parts, state: coupled.WearState) -> label.Values:
    """Follow the response of one wear state over speed and return what is read off it.

    The first speed starts from the steady response there, each further direction where the last has ended.
    """
    account, method = parts.coupling.account, parts.moving.method

    def mesh_at(speed: float) -> tuple[Any, stages.StageTables, float]:
        """Return system, tables and duration of a mesh period at a speed [rad/s]."""
        moving = at_speed(parts, state, speed)
        return moving.system, moving.tables(state.flanks), moving.period

    assert isinstance(method, periodic.Periodic)
    given: Any = parts.scene.dynamics and parts.scene.dynamics.response
    speeds = np.linspace(getattr(given.speed, "from"), given.speed.to, given.speed.points)
    way, branches = continuation.Continuation(given.transient, given.strobe, method), []
    values: label.Values = {"response_speed": speeds, "direction": list(given.directions)}
    values["order"] = np.arange(1, ORDERS * LINES + 1) / LINES
    with account.timed("dynamics"):
        start = method.solve(*mesh_at(float(speeds[ORDER[given.directions[0]]][0]))).end
        for direction in given.directions:
            branches.append(way.follow(mesh_at, list(speeds[ORDER[direction]]), start))
            start = branches[-1][-1].response.end
        jumps = [way.jumps(mesh_at, points) for points in branches]
        ordered = [sorted(points, key=lambda point: point.speed) for points in branches]
        rows = [[_described(parts, state, point) for point in points] for points in ordered]
    account.add(point.response for points in branches for point in points)
    for name in rows[0][0]:  # (direction, speed, …), of the mesh but for two
        each = np.array([[row[name] for row in line] for line in rows], float)
        values[f"response_{name}"] = each if name in ("orbit_period", "multiplier") else each[None]
    if any(jumps):  # with their brackets
        each = label.padded([np.reshape(place, (-1, 4)) for place in jumps])
        values |= {"response_jump_speed": each[..., :2], "response_jump_extent": each[..., 2:]}
        values["edge"] = ["before", "after"]
    return values


def _described(parts: build.Parts, state: coupled.WearState, point: continuation.Point) -> label.Values:
    vibration, response = at_speed(parts, state, point.speed), point.response
    phases = np.arange(SAMPLES) / SAMPLES
    where, when = parts.look(0, phases), vibration.look(phases)
    motion = force.Deflections(*(values[:, 0] for values in vibration.motions(response, when)))
    position, _ = vibration.coordinates(response, when)
    dashpot = dashpot_of(vibration.system, 0)
    elastic = force.flank_forces(state.flanks[0], where, motion, dashpot, vibration.period).elastic
    transmission = transmission_error(vibration, position)[:, 0]
    static, extreme, tables = parts.kinds[0].analysis.load, extremes.extremes(response), response.tables
    strobed = np.split(point.strobe, 2, axis=1)  # at phase 0
    moved, moving = (each @ vibration.system.direction[0] for each in strobed)
    return {
        "dynamic_factor": extreme.largest[0] / static if static > 0.0 else np.nan,
        "force_peak_to_peak": extreme.largest[0] - extreme.least[0],
        "force_rms": elastic.std(),
        "dte_peak_to_peak": np.ptp(transmission),
        "dte_rms": transmission.std(),
        "separation_fraction": extreme.separated[0],
        "orbit_period": response.period,
        "multiplier": abs(response.multipliers[0]) if len(response.multipliers) else np.nan,
        "dte_orders": order_amplitudes(transmission),
        "force_orders": order_amplitudes(elastic),
        "poincare_deflection": moved - tables.error[0, 0, 0],
        "poincare_rate": moving - tables.error_rate[0, 0, 0] / response.mesh_period,
    }


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
