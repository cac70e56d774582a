"""The response of one wear state over speed, upwards and downwards."""

from typing import Any, NamedTuple

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.dynamics.forces.mesh_forces import extremes
from wearlab.dynamics.steady import continuation, periodic
from wearlab.dynamics.steady.response import dashpot_of
from wearlab.life import coupled
from wearlab.life.vibration import Vibration
from wearlab.mesh import force
from wearlab.simulation import label
from wearlab.simulation.dataset.dynamics import transmission_error

SAMPLES = 64
"""Samples of a mesh period."""
LINES = 24
"""Order lines between two mesh orders: all subharmonics down to 1/24 that divide it
fall on lines."""
ORDERS = 5
"""Mesh orders that spectra cover."""
WITHOUT_MESH = ("orbit_period", "multiplier")
"""Variables that belong to no mesh; all others have the mesh first."""


class _Branches(NamedTuple):
    """The responses over speed.

    Parameters
    ----------
    points : responses in each direction, by rising speed
    jumps : speeds and extents of the jumps in each direction, with their brackets
    """

    points: list[list[continuation.ResponseAtSpeed]]
    jumps: list[Any]


def over_speed_values(
    model: assembly.GearModel, state: coupled.WearState
) -> label.Values:
    """Follow the response of one wear state over speed and return what is read off it.

    Parameters
    ----------
    model : the physics of a scene with ``dynamics.response``
    state : the wear state
    """
    account = model.coupling.account
    options: Any = model.scene.dynamics and model.scene.dynamics.response
    speeds = np.linspace(
        getattr(options.speed, "from"), options.speed.to, options.speed.points
    )
    values: label.Values = {
        "response_speed": speeds,
        "direction": list(options.directions),
        "order": np.arange(1, ORDERS * LINES + 1) / LINES,
    }

    with account.timed("dynamics"):
        branches = _follow(model, state, options, speeds)
        rows = [
            [_read_off(model, state, point) for point in points]
            for points in branches.points
        ]
    account.add(point.response for points in branches.points for point in points)

    for name in rows[0][0]:
        of_directions = np.array([[row[name] for row in points] for points in rows])
        of_directions = of_directions.astype(float)
        if name not in WITHOUT_MESH:
            of_directions = of_directions[None]
        values[f"response_{name}"] = of_directions
    if any(branches.jumps):
        jumps = label.padded([np.reshape(jump, (-1, 4)) for jump in branches.jumps])
        values["response_jump_speed"] = jumps[..., :2]
        values["response_jump_extent"] = jumps[..., 2:]
        values["edge"] = ["before", "after"]
    return values


def _follow(
    model: assembly.GearModel, state: coupled.WearState, options: Any, speeds: Array
) -> _Branches:
    """Follow the response in each direction.

    The first speed starts from the steady response there, each further direction where
    the last has ended.
    """
    method = model.moving.method
    assert isinstance(method, periodic.Periodic)

    def mesh_at(speed: float) -> tuple[Any, Any, float]:
        """Return system, tables and duration of a mesh period at a speed [rad/s]."""
        vibration = at_speed(model, state, speed)
        return vibration.system, vibration.tables(state.flanks), vibration.period

    way = continuation.Continuation(options.transient, options.strobe, method)
    speeds_of = {"up": list(speeds), "down": list(speeds[::-1])}
    first_speed = float(speeds_of[options.directions[0]][0])
    start = method.solve(*mesh_at(first_speed)).end
    branches = []
    for direction in options.directions:
        points = way.follow(mesh_at, speeds_of[direction], start)
        branches.append(points)
        start = points[-1].response.end
    jumps = [way.jumps(mesh_at, points) for points in branches]

    by_speed = [sorted(points, key=lambda point: point.speed) for points in branches]
    return _Branches(by_speed, jumps)


def at_speed(
    model: assembly.GearModel, state: coupled.WearState, speed: float
) -> Vibration:
    """Return the dynamics at a speed, with steps by the rule for that speed.

    Parameters
    ----------
    model : the physics of the scene
    state : the wear state, whose stiffest mesh decides on the steps
    speed : of the input member [rad/s]
    """
    assert model.scene.operation.speed is not None
    period = model.gears.period * model.scene.operation.speed / speed
    stiffest = np.array(
        [state.kind[mesh.kind].static.tangent.max() for mesh in model.meshes]
    )
    grid = assembly.steps.steps_grid(
        model.scene, model.on_clock, model.moving.system, stiffest, period
    )
    return model.with_steps(grid, 1, period)


def _read_off(
    model: assembly.GearModel,
    state: coupled.WearState,
    point: continuation.ResponseAtSpeed,
) -> label.Values:
    """Return the variables of the response at one speed, of its only mesh."""
    vibration = at_speed(model, state, point.speed)
    response = point.response
    phases = np.arange(SAMPLES) / SAMPLES
    instants = vibration.look(phases)
    position, _ = vibration.coordinates(response, instants)
    transmission = transmission_error(vibration, position)[:, 0]
    elastic = _elastic_force(model, state, vibration, point, phases)

    static = model.kinds[0].analysis.load
    forces = extremes(response)
    largest = forces.largest[0]
    deflection, rate = _strobe(vibration, point)
    return {
        "dynamic_factor": largest / static if static > 0.0 else np.nan,
        "force_peak_to_peak": largest - forces.least[0],
        "force_rms": elastic.std(),
        "dte_peak_to_peak": np.ptp(transmission),
        "dte_rms": transmission.std(),
        "separation_fraction": forces.separated[0],
        "orbit_period": response.period,
        "multiplier": abs(response.multipliers[0])
        if len(response.multipliers)
        else np.nan,
        "dte_orders": order_amplitudes(transmission),
        "force_orders": order_amplitudes(elastic),
        "poincare_deflection": deflection,
        "poincare_rate": rate,
    }


def _elastic_force(
    model: assembly.GearModel,
    state: coupled.WearState,
    vibration: Vibration,
    point: continuation.ResponseAtSpeed,
    phases: Array,
) -> Array:
    """Return the elastic force of the mesh at phases, (n_periods, n_phases) [N]."""
    where = model.locate(0, phases)
    motions = vibration.motions(point.response, vibration.look(phases))
    motion = force.Deflections(motions.deflection[:, 0], motions.rate[:, 0])
    dashpot = dashpot_of(vibration.system, 0)
    return force.flank_forces(
        state.flanks[0], where, motion, dashpot, vibration.period
    ).elastic


def _strobe(
    vibration: Vibration, point: continuation.ResponseAtSpeed
) -> tuple[Array, Array]:
    """Return deflection [m] and its rate [m/s] at phase 0 of the sampled periods."""
    direction = vibration.system.direction[0]
    tables = point.response.tables
    position, velocity = (
        coordinates @ direction for coordinates in np.split(point.strobe, 2, axis=1)
    )
    error_rate = tables.error_rate[0, 0, 0] / point.response.mesh_period
    return position - tables.error[0, 0, 0], velocity - error_rate


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
    spectra = [np.fft.rfft(piece) * 2.0 / len(piece) for piece in pieces]
    power = np.mean([np.abs(spectrum) ** 2 for spectrum in spectra], axis=0)

    amplitude = np.zeros(ORDERS * LINES + 1)
    last_line = min(len(power) - 1, ORDERS * periods, periods * phases // 2)
    for line in range(1, last_line + 1):
        amplitude[round(line * LINES / periods)] = np.sqrt(power[line])
    return amplitude[1:]
