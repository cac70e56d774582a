"""What a vibration monitor reads off the meshes, if ``[store] variables`` names it.

The signal is the relative acceleration of both bodies along the line of action of one
mesh. What repeats every mesh period are the mesh harmonics; all the rest, between them,
are sidebands: slow errors that turn with their members (``errors.slow = "hunting"``),
subharmonic and aperiodic responses. A sensor on the ring would also see planets pass;
the signal of one mesh, in the carrier's frame, does not.

A spectrum ends where its steps do: the acceleration of the equation of motion and the
second derivative of the path are one as far as the steps carry them, and lines from
which on they differ are left out.
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array, Complex, Index
from wearlab.dynamics.forces import mesh_forces
from wearlab.dynamics.steady.response import Response, step_of
from wearlab.life import coupled
from wearlab.life.vibration import Vibration
from wearlab.mesh import clock, stages
from wearlab.simulation.label import Values, ratio

MIN_ORDERS = 40
"""Mesh orders that a spectrum covers at least."""
MIN_LINES = 200
"""Lines that a spectrum has at least."""
ACCELERATION = "mesh_acceleration"
DEFLECTION_ORDERS = "mesh_deflection_orders"
BAND = 10.0
"""Mesh orders that are looked at together for whether the steps carry them."""
APART = 0.1
"""Difference of the two spectra, over their size in a band, beyond which it is not
carried."""
ROUNDED = 1e-12
"""Round-off of a path, over its range."""
ON_LINE = 1e-6
"""Distance of an order from a line of a signal within which it is that line."""


def _mean(values: Array, weight: Array) -> Array:
    """Return the mean over periods and nodes, (n_mesh,)."""
    return np.asarray((values @ weight).mean(axis=0))


def _rms(signal: Array, weight: Array) -> Array:
    """Return the root mean square."""
    return np.asarray(np.sqrt(_mean(signal**2, weight)))


def _peak_to_peak(signal: Array, weight: Array) -> Array:
    """Return the range."""
    return np.asarray(np.ptp(signal, axis=(0, 2)))


def _crest_factor(signal: Array, weight: Array) -> Array:
    """Return the largest amplitude over the root mean square."""
    return ratio(np.abs(signal).max(axis=(0, 2)), _rms(signal, weight))


def _kurtosis(signal: Array, weight: Array) -> Array:
    """Return the fourth moment over the square of the second."""
    return ratio(_mean(signal**4, weight), _mean(signal**2, weight) ** 2)


def _harmonic_energy(signal: Array, weight: Array) -> Array:
    """Return the mean square of what repeats every mesh period."""
    return _mean(signal.mean(axis=0, keepdims=True) ** 2, weight)


def _sideband_energy(signal: Array, weight: Array) -> Array:
    """Return the mean square of what does not repeat every mesh period."""
    return _mean((signal - signal.mean(axis=0)) ** 2, weight)


STATISTICS: dict[str, Callable[[Array, Array], Array]] = {
    "rms": _rms,
    "peak_to_peak": _peak_to_peak,
    "crest_factor": _crest_factor,
    "kurtosis": _kurtosis,
    "harmonic_energy": _harmonic_energy,
    "sideband_energy": _sideband_energy,
}
"""Of a signal (n_periods, n_mesh, n_nodes) and the weights of its nodes, (n_mesh,)
each."""


class _Nodes(NamedTuple):
    """Nodes of a mean over a mesh period.

    Parameters
    ----------
    instants : phases and segments of the nodes
    weight : (n_nodes,) their weights [1]
    """

    instants: clock.Instants
    weight: Array


def spectrum_lines(vibration: Vibration, states: Sequence[coupled.WearState]) -> Array:
    """Return the orders of all lines of the spectra, (n_lines,) [1].

    They are the lines of the longest common period of all responses.

    Parameters
    ----------
    vibration : the dynamics
    states : the wear states that are stored
    """
    periods = [
        len(response.state) * vibration.hunting
        for state in states
        for response in state.responses
    ]
    common = math.lcm(*periods)
    count = max(MIN_ORDERS * common, MIN_LINES)
    return np.arange(1, count + 1) / common


def requested_values(
    model: assembly.GearModel, response: Response, lines: Array
) -> Values:
    """Return the variables of one response that ``[store] variables`` names.

    Parameters
    ----------
    model : the physics of the scene
    response : a steady response
    lines : (n_lines,) mesh orders of the lines of spectra [1]
    """
    names = model.scene.store.requested
    vibration = model.vibration
    if not names or vibration is None:
        return {}
    nodes = _nodes(vibration, lines)
    acceleration = _acceleration(vibration, response, nodes.instants)
    spectra = [name for name in names if name.endswith("_orders")]
    beyond = np.zeros(len(lines), bool)
    if spectra:
        beyond = lines >= carried_order(vibration, response, lines)

    values = Values()
    for name in names:
        if name == ACCELERATION:
            stored_instants = vibration.look(model.phase)
            stored = _acceleration(vibration, response, stored_instants)
            values[name] = stored.transpose(1, 0, 2)
        elif name in spectra:
            signal = acceleration
            if name == DEFLECTION_ORDERS:
                signal = vibration.motions(response, nodes.instants).deflection
            amplitude = order_lines(signal, nodes.instants.phase, nodes.weight, lines)
            values[name] = np.where(beyond, np.nan, np.abs(amplitude))
        else:
            statistic = STATISTICS[name.removeprefix(f"{ACCELERATION}_")]
            values[name] = statistic(acceleration, nodes.weight)
    return values


def _acceleration(
    vibration: Vibration, response: Response, instants: clock.Instants
) -> Array:
    """Return the relative acceleration of the meshes, (n_periods, n_mesh, n) [m/s²]."""
    return vibration.read(mesh_forces.mesh_acceleration_at, response, instants)


def _nodes(vibration: Vibration, lines: Array) -> _Nodes:
    """Return nodes of a mean, as many within a step as the highest line asks for."""
    grid = vibration.sampling.grid
    turn = 2.0 * np.pi * float(lines[-1]) * float(grid.width.max())
    count = 2 * mesh_forces.NODES + math.ceil(0.5 * turn)
    phase, segment, weight = mesh_forces.within_steps(grid, count)
    return _Nodes(clock.Instants(phase, segment), weight)


def carried_order(vibration: Vibration, response: Response, lines: Array) -> float:
    """Return the mesh order up to which the steps carry a spectrum, inf: all lines [1].

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
    instants, weight = _nodes(vibration, lines)
    signals = [
        vibration.read(quantity, response, instants)
        for quantity in (mesh_forces.mesh_acceleration_at, _approach_at)
    ]
    of_acceleration, of_path = (
        order_lines(signal, instants.phase, weight, lines) for signal in signals
    )
    derived_twice = (2.0 * np.pi * lines / vibration.period) ** 2
    rounding = ROUNDED * np.ptp(response.approach.coefficient[0]) * derived_twice
    difference = np.abs(of_acceleration + derived_twice * of_path)
    difference = np.maximum(difference - rounding, 0.0)
    for low in np.arange(0.0, float(lines[-1]), BAND):
        band = (lines > low) & (lines <= low + BAND)
        size = np.linalg.norm(of_acceleration[:, band], axis=1)
        if (np.linalg.norm(difference[:, band], axis=1) > APART * size).any():
            return float(low)
    return math.inf


def spectrum_flags(
    model: assembly.GearModel, states: Sequence[coupled.WearState]
) -> list[str]:
    """Return from which order on the steps do not carry the accelerations asked for.

    Parameters
    ----------
    model : the physics of the scene
    states : the wear states that are stored

    Returns
    -------
    One message, or none where the steps carry all lines or nobody asked.
    """
    vibration = model.vibration
    if vibration is None:
        return []
    names = model.scene.store.requested
    if not any(name.startswith(ACCELERATION) for name in names):
        return []
    lines = spectrum_lines(vibration, states)
    lowest = min(
        carried_order(vibration, response, lines)
        for state in states
        for response in state.responses
    )
    if math.isinf(lowest):
        return []
    steps = len(vibration.sampling.grid.width)
    return [
        f"mesh acceleration: {steps} steps a mesh period carry orders up to "
        f"{lowest:.3g}; spectra end there, while RMS, peak, crest factor and kurtosis "
        "hold more: raise numerics.steps_per_period"
    ]


def _approach_at(
    response: Response, grid: stages.StageGrid, phase: Array, segment: Index
) -> Array:
    """Return the projections d·q of the meshes, (n_kept, n_mesh, n) [m]."""
    step = step_of(grid, phase, segment)
    within = (phase - grid.start[step]) / grid.width[step]
    position, _ = response.approach.at(step, within)
    return np.ascontiguousarray(position.transpose(0, 2, 1))


def order_lines(signal: Array, phase: Array, weight: Array, lines: Array) -> Complex:
    """Return the complex amplitudes of a signal on lines of the mesh order.

    A signal of P periods has lines at multiples of 1/P; on others it is 0. The
    integrals are taken over the nodes of the steps, so that a jump between two steps
    costs no accuracy.

    Parameters
    ----------
    signal : (P, n_mesh, n_nodes)
    phase, weight : (n_nodes,) phases in a mesh period and weights of a mean over it [1]
    lines : (n_lines,) orders [1]

    Returns
    -------
    (n_mesh, n_lines), in the unit of the signal
    """
    periods, meshes, _ = signal.shape
    number = np.rint(lines * periods).astype(int)
    on_line = np.abs(number - lines * periods) < ON_LINE

    within_order = np.outer(np.arange(periods), phase)
    rest = np.exp(-2j * np.pi / periods * within_order)
    turned = np.fft.fft(signal, axis=0) / periods * (rest * weight)[:, None]
    turn = np.exp(-2j * np.pi * phase)
    wave = np.ones(len(phase), complex)
    orders = int(number.max()) // periods + 1
    spectra = np.empty((orders, periods, meshes), complex)
    for order in spectra:
        order[:] = 2.0 * (turned @ wave)
        wave *= turn

    amplitude = np.zeros((meshes, len(lines)), complex)
    amplitude[:, on_line] = spectra.reshape(-1, meshes)[number[on_line]].T
    return amplitude
