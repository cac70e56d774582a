"""The arrays of a gear set's steady responses, named as the dataset names them.

Its energy and its modes.

What a vibration monitor reads off the meshes is computed only when ``[store]
variables`` names it. The signal is the relative acceleration of both bodies along the
line of action of one mesh. What repeats every mesh period are the mesh harmonics; all
the rest, between them, are sidebands: slow errors that turn with their members
(``errors.slow = "hunting"``), subharmonic and aperiodic responses. A sensor on the ring
would also see planets pass; the signal of one mesh, in the carrier's frame, does not.

A spectrum ends where its steps do: the acceleration of the equation of motion and the
second derivative of the path are one as far as the steps carry them, and lines from
which on they differ are left out.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array, Complex, Index
from wearlab.dynamics.forces import energy, mesh_forces
from wearlab.dynamics.steady.response import Response, step_of
from wearlab.dynamics.supports import bearing_forces
from wearlab.gears.specification import GearError
from wearlab.life import coupled, history
from wearlab.life.loads.equivalent import equivalent_force
from wearlab.mesh import clock, excitation, force, gear_set, harmonics, stages
from wearlab.scene import Scene
from wearlab.simulation import label
from wearlab.simulation.label import Values


def dynamic_values(
    parts: assembly.GearModel, states: tuple[coupled.WearState, ...]
) -> Values:
    """Return the steady responses at the stored phases, and what is read off them.

    Averaged slow errors that the set answers to make one response an angle, along
    ``error_angle``.
    """
    lines = lines_of(parts.moving, states)
    asked = parts.scene.store.requested
    each = [
        [_values_of(parts, state, one, lines) for one in state.responses]
        for state in states
    ]
    values = {
        name: label.of_states([[own[name] for own in row] for row in each])
        for name in each[0][0]
    }
    return values | (
        {"order": lines} if any(name.endswith("_orders") for name in asked) else {}
    )


def _values_of(
    parts: assembly.GearModel,
    state: coupled.WearState,
    response: Response,
    lines: Array,
) -> Values:
    vibration = parts.moving
    kinds = state.flanks
    when = vibration.look(parts.phase)
    motions = vibration.motions(response, when)
    (position, velocity) = vibration.coordinates(response, when)
    meshes = [
        _mesh_response(parts, kinds, mesh, motions) for mesh in range(len(parts.meshes))
    ]
    values: Values = {
        name: label.padded([own[name] for own in meshes], fill=0.0)
        for name in meshes[0]
    }
    transmission = (
        transmission_error(vibration, position) + parts.constant_error[:, None]
    )
    each = values["dynamic_transmission_error"] = np.moveaxis(transmission, 1, 0)
    phase = (np.arange(len(position))[:, None] + parts.phase).ravel()
    equal = np.full(len(phase), 1.0 / len(phase))
    series = [
        harmonics.harmonics(phase, equal, own.ravel(), parts.harmonics) for own in each
    ]
    values["dte_harmonics"] = np.stack([own.amplitude for own in series])
    values["dte_rms"] = [own.rms for own in series]
    means = [mean_moments(parts, kinds, kind, response) for kind in range(len(kinds))]
    if parts.gears.shares:
        factors = list(map(mesh_forces.load_factors, parts.gears.kinds, means))
        values["mesh_load_factor"] = np.concatenate(factors)
    found = mesh_forces.extremes(response)
    of_kind = np.array([kind.analysis.load for kind in parts.kinds])
    load = of_kind[[mesh.kind for mesh in parts.meshes]]
    rubs = parts.friction is not None
    multipliers = np.full((2 * len(vibration.system.coordinates), 2), np.nan)
    known = response.multipliers
    multipliers[: len(known)] = np.stack([np.real(known), np.imag(known)], axis=-1)
    values |= {
        "mesh_force_min": found.least,
        "mesh_force_max": found.largest,
        "dynamic_factor": over(found.largest, load),
        "normal_force_factor": over(found.largest_normal, load),
        "separation_fraction": found.separated,
        "response_period": response.period * vibration.hunting,
        "floquet_multiplier": multipliers,
        "residual_mean_force": mesh_forces.mean_force_residual(
            parts.gears.kinds, list(of_kind), means, rubs
        ),
        "residual_orbit": response.residual,
    }
    if vibration.nominal is not None and rubs:
        balance = energy.energy_balance(response, vibration.nominal)
        values |= {f"energy_{name}": power for name, power in balance._asdict().items()}
        values |= {
            "residual_energy": balance.residual,
            "efficiency": balance.efficiency,
        }
    if (slope := parts.wohler_slope) is not None:
        equals = [
            equivalent_force(k.flanks.analysis, k.weight, k.drive, slope)
            for k in state.kind
        ]
        values["equivalent_load"] = [
            parts.gears.lever(m.kind) * equals[m.kind] for m in parts.meshes
        ]
    if has_bearings(parts):
        values["bearing_force"] = bearing_values(
            parts, position, velocity, values["normal_mesh_force"]
        )
    return values | of_response(parts, response, lines)


def bearing_values(
    parts: assembly.GearModel, position: Array, velocity: Array, normal: Array
) -> Array:
    """Return the forces of the bearings on the members, (n_members, 2 or 3, n_periods, n_instants) [N].

    Along x, y and, of helical gears, z. A bearing that does not give way holds what the
    meshes push at once.

    Parameters
    ----------
    parts : the physics
    position, velocity : (n_periods, n, n_instants) coordinates q [m] and q̇ [m/s]
    normal : (n_mesh, n_periods, n_instants) forces of the meshes in the plane of action
        [N]
    """
    gears = parts.gears
    supports = parts.moving.system.supports
    force = bearing_forces(supports, gears.members, position, velocity)
    force[:, 1] *= gears.sense  # y of a mirrored set points back
    slope = 0.0 if parts.face is None else parts.face.slope
    if not slope:
        return force[:, :2]
    moving = {(support.member, support.axis) for support in supports}
    rigid = [(member, "z") not in moving for member in gears.members]
    force[rigid, 2] = rigid_bearing_forces(gears, slope, normal)[rigid]
    if all(
        axis != "y" for _, axis in moving
    ):  # a pair that only turns and moves along its axes
        force[:, 1] = rigid_bearing_forces(gears, 1.0, normal)
    return force


def rigid_bearing_forces(gears: gear_set.GearSet, share: float, normal: Array) -> Array:
    """Return along one axis the forces of bearings that do not give way, ``± share F`` of the meshes [N].

    What the mesh pushes the bearing holds at once, along the axis on the pins of
    planets, too, and all of them at the carrier's.

    Parameters
    ----------
    gears : the gear set
    share : of the force in the plane of action: along the axis the signed tan β_b of
        :class:`wearlab.gears.helix.Helix`, along a pair's line of action 1 [1]
    normal : (n_mesh, n_periods, n_phases) force in the plane of action [N]

    Returns
    -------
    (n_members, n_periods, n_phases), along the axis towards positive face positions [N]

    References
    ----------
    ISO 21771:2007, 4.3, for the angle; the balance of forces.
    """
    total = np.zeros((len(gears.members), *normal.shape[1:]))
    for mesh, kind in enumerate(gears.mesh_kinds):
        for sign, gear in zip((1.0, -1.0), gears.kinds[kind].pair.gears, strict=True):
            columns = gears.columns_of(gear.name)
            total[columns[mesh % len(columns)]] += sign * share * normal[mesh]
    for carrier in gears.columns_of("carrier"):
        total[carrier] = total[gears.columns_of("planet")].sum(axis=0)
    return total


def phase_forces(
    parts: assembly.GearModel, state: coupled.WearState, response: Response
) -> Array:
    """Return the elastic force of every mesh at the stored phases, (n_periods, n_mesh, n_phases) [N]."""
    motions = parts.moving.motions(response, parts.moving.look(parts.phase))
    places = [parts.locate(mesh, parts.phase) for mesh in range(len(parts.meshes))]
    forces = [
        parts.forces(state.flanks, mesh, where, motions)
        for mesh, where in enumerate(places)
    ]
    return np.stack([own.elastic for own in forces], axis=1)


def _mesh_response(
    parts: assembly.GearModel,
    kinds: list[excitation.MeshFlanks],
    mesh: int,
    motions: force.Deflections,
) -> dict[str, Array]:
    """Return what one mesh does at the stored phases, the mesh periods first (the pairs before them)."""
    own_mesh = parts.meshes[mesh]
    where = parts.locate(mesh, parts.phase)
    mine = kinds[own_mesh.kind]
    forces = parts.forces(kinds, mesh, where, motions)
    deflection, rate = (each[:, mesh] for each in motions)
    values = {
        "dynamic_mesh_force": forces.elastic,
        "normal_mesh_force": forces.normal,
        "mesh_damping_force": forces.normal - forces.elastic,
        "mesh_deflection": deflection,
        "mesh_deflection_rate": rate,
        "poincare_deflection": deflection[:, 0],
        "poincare_rate": rate[:, 0],
    }
    if parts.face is None:
        for name, each in (
            ("pair_force", forces.pair),
            ("pair_normal_force", forces.pair_normal),
        ):
            values[name] = np.stack(
                [mine.analysis.grid.into_slots(row.T, 0.0) for row in each], axis=1
            )
    if parts.friction is not None:
        values["friction_force"] = mesh_forces.friction_force(
            forces, mine, where, parts.friction
        )
    if mine.series is not None:
        own = where.phase
        values["excitation_stiffness"] = mine.series.stiffness.value(own)
        values["excitation_error"] = mine.series.error.value(
            own
        ) + own_mesh.error.value(own)
    return values


def mean_moments(
    parts: assembly.GearModel,
    flanks: list[excitation.MeshFlanks],
    kind: int,
    of: Response,
) -> Array:
    """Return the mean moments of each mesh of a kind over base radius, (n_mesh, (driving, driven)) [N]."""
    mine = flanks[kind]
    moves = parts.moving
    means = []
    for mesh in map(int, clock.of_kind(parts.meshes, kind)):

        def moments(steps: stages.StageGrid, mesh: int = mesh) -> Array:
            phase, segment, _ = mesh_forces.within_steps(steps)
            middle = steps.start + 0.5 * steps.width
            lag = parts.meshes[mesh].lag
            where = clock.locate_within_steps(
                mine.analysis.grid, [lag], phase.reshape(len(middle), -1), middle
            )
            forces = parts.forces(
                flanks, mesh, where, moves.motions(of, clock.Instants(phase, segment))
            )
            return mesh_forces.moments(
                forces, mine, parts.kinds[kind].pair, where, parts.friction
            )

        means.append(
            mesh_forces.mean_over_period(moves.sampling.grid, moments).mean(axis=1)
        )
    return np.array(means)


def transmission_error(vibration: coupled.Vibration, position: Array) -> Array:
    """Return r_b1 θ1 − r_b2 θ2 of every mesh, (n_periods, n_mesh, n_phases) [m].

    What the rotations alone do along each line of action; in a planetary set those
    beside the carrier's.

    Parameters
    ----------
    vibration : the dynamics
    position : (n_periods, n, n_phases) coordinates [m]
    """
    system = vibration.system
    turns = [name == "mesh.x" or name.endswith(".u") for name in system.coordinates]
    return np.asarray(
        np.einsum("pi...,mi->pm...", position, np.where(turns, system.direction, 0.0))
    )


def has_bearings(parts: assembly.GearModel) -> bool:
    """Whether a member moves on its support."""
    return parts.vibration is not None and parts.vibration.system.on_bearings


def mode_values(parts: assembly.GearModel) -> Values:
    """Return natural frequencies and the speeds at which the mesh frequency meets them."""
    modes = assembly.build_modes(parts)
    values = {
        "natural_frequency": modes.modes.frequency,
        "critical_speed": modes.critical_speed[0],
    }
    values["mode_participation"] = modes.modes.participation.T
    return values if modes.kinds is None else values | {"mode_kind": list(modes.kinds)}


def attractor(lived: history.History) -> Array:
    """Return which branch each kept response is on, counted from 1 along the life, (n_updates,).

    The count rises where the wear rate jumped, and where the period of the response
    changes.
    """
    jumps = [] if lived.life is None else [jump.cycle for jump in lived.life.jumps]
    periods = [
        tuple(response.period for response in state.responses) for state in lived.state
    ]
    branch = [1]
    for (before, after), (start, end) in zip(
        pairwise(periods), pairwise(lived.cycle), strict=True
    ):
        passed = sum(start < jump <= end for jump in jumps)
        branch.append(branch[-1] + max(passed, int(before != after)))
    return np.array(branch, float)


def modes_table(scene: Scene) -> list[dict[str, Any]]:
    """Return one row a mode: frequency, what moves, whether the mesh excites it, and its critical speeds.

    A critical speed is that of the input member, as ``operation.speed`` is.

    Parameters
    ----------
    scene : a scene with dynamics

    Raises
    ------
    Refused
        When the scene has no dynamics, or no such gears can exist.
    """
    if scene.dynamics is None:
        raise label.Refused("the scene has no [dynamics]: nothing vibrates")
    try:
        table = assembly.build_modes(assembly.build(scene))
    except GearError as error:
        raise label.Refused(str(error)) from error
    modes = table.modes
    size = np.abs(table.modes.shape)
    moves = [np.asarray(table.coordinates)[own > 0.3 * own.max()] for own in size]
    columns: dict[str, Any] = {"mode": range(1, len(size) + 1)}
    columns["natural_frequency [Hz]"] = modes.frequency.tolist()
    if table.kinds is not None:
        columns["kind"] = table.kinds
    columns |= {
        "moves": map(", ".join, moves),
        "excited by the mesh": map(bool, modes.excited()),
    }
    columns["participation"] = modes.participation.max(axis=-1).tolist()
    for order, speeds in enumerate(table.critical_speed, 1):
        columns[f"critical speed, order {order} [rpm]"] = (
            speeds * 30.0 / np.pi
        ).tolist()
    return [
        dict(zip(columns, row, strict=True))
        for row in zip(*columns.values(), strict=True)
    ]


HARMONICS, LINES = 40, 200
"""Mesh orders that a spectrum covers at least, and lines that it has at least."""
ACCELERATION = "mesh_acceleration"
BAND = 10.0
"""Mesh orders that are looked at together for whether the steps carry them."""
APART = 0.1
"""Difference of the two spectra, over their size in a band, beyond which it is not
carried."""
ROUNDED = 1e-12
"""Round-off of a path, over its range."""
STATISTICS = {
    "rms": lambda a, w: np.sqrt(_mean(a**2, w)),
    "peak_to_peak": lambda a, w: np.ptp(a, axis=(0, 2)),
    "crest_factor": lambda a, w: over(
        np.abs(a).max(axis=(0, 2)), np.sqrt(_mean(a**2, w))
    ),
    "kurtosis": lambda a, w: over(_mean(a**4, w), _mean(a**2, w) ** 2),
    "harmonic_energy": lambda a, w: _mean(a.mean(axis=0, keepdims=True) ** 2, w),
    "sideband_energy": lambda a, w: _mean((a - a.mean(axis=0)) ** 2, w),
}
"""Of a signal (n_periods, n_mesh, n_nodes) and the weights of its nodes, (n_mesh,)
each."""


def lines_of(
    vibration: coupled.Vibration, states: Sequence[coupled.WearState]
) -> Array:
    """Return the orders of all lines of the spectra, those of the states' longest common period."""
    kept = math.lcm(
        *(
            len(one.state) * vibration.hunting
            for state in states
            for one in state.responses
        )
    )
    return np.arange(1, max(HARMONICS * kept, LINES) + 1) / kept


def of_response(parts: assembly.GearModel, response: Response, lines: Array) -> Values:
    """Return what was asked for by name of one response, spectra on lines (n_lines,) of the mesh order."""
    names = parts.scene.store.requested
    vibration = parts.vibration
    if not names or vibration is None:
        return {}
    (when, weight) = _nodes(vibration, lines)
    values = Values()
    acceleration = vibration.read(mesh_forces.mesh_acceleration_at, response, when)
    spectra = [name for name in names if name.endswith("_orders")]
    beyond = (
        lines >= carried_order(vibration, response, lines)
        if spectra
        else np.zeros(len(lines), bool)
    )
    for name in names:
        what = name.removeprefix(f"{ACCELERATION}_")
        if name == ACCELERATION:
            stored = vibration.read(
                mesh_forces.mesh_acceleration_at, response, vibration.look(parts.phase)
            )
            values[name] = stored.transpose(1, 0, 2)
        elif name in spectra:
            deflects = name == "mesh_deflection_orders"
            signal = (
                vibration.motions(response, when).deflection
                if deflects
                else acceleration
            )
            values[name] = np.where(
                beyond, np.nan, np.abs(order_lines(signal, when.phase, weight, lines))
            )
        else:
            values[name] = STATISTICS[what](acceleration, weight)
    return values


def _nodes(vibration: coupled.Vibration, lines: Array) -> tuple[clock.Instants, Array]:
    """Return instants and weights of a mean, as many within a step as the highest line asks for."""
    grid = vibration.sampling.grid
    turn = 2.0 * np.pi * float(lines[-1]) * float(grid.width.max())
    phase, segment, weight = mesh_forces.within_steps(
        grid, 2 * mesh_forces.NODES + math.ceil(0.5 * turn)
    )
    return clock.Instants(phase, segment), weight


def carried_order(
    vibration: coupled.Vibration, response: Response, lines: Array
) -> float:
    """Return the mesh order up to which the steps of a response carry a spectrum, inf: all lines [1].

    On a periodic response every line of the acceleration is ``−(2π order/T)²`` times
    that of the path. Both come from the same steps: the one from the forces, the other
    from the polynomials between the steps.

    Parameters
    ----------
    vibration, response : the dynamics and a response; of an aperiodic one nothing is
        said
    lines : (n_lines,) orders, ascending [1]
    """
    if response.period == 0:
        return math.inf
    when, weight = _nodes(vibration, lines)
    signals = [
        vibration.read(of, response, when)
        for of in (mesh_forces.mesh_acceleration_at, _approach_at)
    ]
    spectra = [order_lines(signal, when.phase, weight, lines) for signal in signals]
    twice = (2.0 * np.pi * lines / vibration.period) ** 2
    rounded = ROUNDED * np.ptp(response.approach.coefficient[0]) * twice
    apart = np.maximum(np.abs(spectra[0] + twice * spectra[1]) - rounded, 0.0)
    for low in np.arange(0.0, float(lines[-1]), BAND):
        band = (lines > low) & (lines <= low + BAND)
        size = np.linalg.norm(spectra[0][:, band], axis=1)
        if (np.linalg.norm(apart[:, band], axis=1) > APART * size).any():
            return float(low)
    return math.inf


def uncarried(
    parts: assembly.GearModel, states: Sequence[coupled.WearState]
) -> list[str]:
    """Return in words from where on the steps do not carry the accelerations that were asked for."""
    vibration = parts.vibration
    if vibration is None or not any(
        name.startswith(ACCELERATION) for name in parts.scene.store.requested
    ):
        return []
    lines = lines_of(vibration, states)
    responses = [one for state in states for one in state.responses]
    lowest = min(carried_order(vibration, response, lines) for response in responses)
    if math.isinf(lowest):
        return []
    return [
        f"mesh acceleration: {len(vibration.sampling.grid.width)} steps a mesh period "
        "carry orders up to "
        f"{lowest:.3g}; spectra end there, while RMS, peak, crest factor and kurtosis "
        "hold more: raise "
        "numerics.steps_per_period"
    ]


def _approach_at(
    response: Response, grid: stages.StageGrid, phase: Array, segment: Index
) -> Array:
    """Return the projections d·q of the meshes, (n_kept, n_mesh, n) [m]."""
    step = step_of(grid, phase, segment)
    position, _ = response.approach.at(
        step, (phase - grid.start[step]) / grid.width[step]
    )
    return np.ascontiguousarray(position.transpose(0, 2, 1))


def order_lines(signal: Array, phase: Array, weight: Array, lines: Array) -> Complex:
    """Return the complex amplitudes of a signal on lines of the mesh order, (n_mesh, n_lines).

    A signal of P periods has lines at multiples of 1/P; on others it is 0. The
    integrals are taken over the nodes of the steps, so that a jump between two steps
    costs no accuracy.

    Parameters
    ----------
    signal : (P, n_mesh, n_nodes)
    phase, weight : (n_nodes,) phases in a mesh period and weights of a mean over it [1]
    lines : (n_lines,) orders [1]
    """
    periods = len(signal)
    count = np.rint(lines * periods).astype(int)
    own = np.abs(count - lines * periods) < 1e-6
    rest = np.exp(-2j * np.pi / periods * np.outer(np.arange(periods), phase))
    turned = np.fft.fft(signal, axis=0) / periods * (rest * weight)[:, None]
    whole = np.exp(-2j * np.pi * phase)
    wave = np.ones(len(phase), complex)
    spectra = np.empty(
        (int(count.max()) // periods + 1, periods, signal.shape[1]), complex
    )
    for order in spectra:
        order[:] = 2.0 * (turned @ wave)
        wave *= whole
    amplitude = np.zeros((signal.shape[1], len(lines)), complex)
    amplitude[:, own] = spectra.reshape(-1, signal.shape[1])[count[own]].T
    return amplitude


def _mean(values: Array, weight: Array) -> Array:
    return np.asarray((values @ weight).mean(axis=0))


def over(values: Array, size: Array) -> Array:
    """Return values over a size, NaN where there is none."""
    return np.divide(values, size, out=np.full_like(values, np.nan), where=size > 0.0)
