"""What a vibration monitor reads off the meshes, computed only when ``[store] variables`` names it.

The signal is the relative acceleration of both bodies along the line of action of one mesh. What repeats
every mesh period are the mesh harmonics; all the rest, between them, are sidebands: slow errors that turn
with their members (``errors.slow = "hunting"``), subharmonic and aperiodic responses. A sensor on the ring
would also see planets pass; the signal of one mesh, in the carrier's frame, does not.

A spectrum ends where its steps do: the acceleration of the equation of motion and the second derivative of
the path are one as far as the steps carry them, and lines from which on they differ are left out.
"""

import math
from collections.abc import Sequence

import numpy as np

from wearlab.arrays import Array, Complex, Index
from wearlab.dynamics.forces.mesh_forces import NODES, mesh_acceleration_at, within_steps
from wearlab.dynamics.orbits.response import Response, step_of
from wearlab.life import coupled
from wearlab.life.vibration import Vibration
from wearlab.mesh import clock, stages
from wearlab.scene import build
from wearlab.simulation import label

HARMONICS, LINES = 40, 200
"""Mesh orders that a spectrum covers at least, and lines that it has at least."""
ACCELERATION, DEFLECTION = "mesh_acceleration", "mesh_deflection"
BAND = 10.0
"""Mesh orders that are looked at together for whether the steps carry them."""
APART = 0.1
"""Difference of the two spectra, over their size in a band, beyond which it is not carried."""
ROUNDED = 1e-12
"""Round-off of a path, over its range."""
STATISTICS = {
    "rms": lambda a, w: np.sqrt(_mean(a**2, w)),
    "peak_to_peak": lambda a, w: np.ptp(a, axis=(0, 2)),
    "crest_factor": lambda a, w: over(np.abs(a).max(axis=(0, 2)), np.sqrt(_mean(a**2, w))),
    "kurtosis": lambda a, w: over(_mean(a**4, w), _mean(a**2, w) ** 2),
    "harmonic_energy": lambda a, w: _mean(a.mean(axis=0, keepdims=True) ** 2, w),
    "sideband_energy": lambda a, w: _mean((a - a.mean(axis=0)) ** 2, w),
}
"""Of a signal (n_periods, n_mesh, n_nodes) and the weights of its nodes, (n_mesh,) each."""


def lines_of(vibration: Vibration, states: Sequence[coupled.WearState]) -> Array:
    """Return the orders of all lines of the spectra, those of the states' longest common period."""
    kept = math.lcm(*(len(one.state) * vibration.hunting for state in states for one in state.responses))
    return np.arange(1, max(HARMONICS * kept, LINES) + 1) / kept


def of_response(parts: build.Parts, response: Response, lines: Array) -> label.Values:
    """Return what was asked for by name of one response, spectra on lines (n_lines,) of the mesh order."""
    names, vibration = parts.scene.store.requested, parts.vibration
    if not names or vibration is None:
        return {}
    (when, weight), values = _nodes(vibration, lines), label.Values()
    acceleration = vibration.read(mesh_acceleration_at, response, when)
    spectra = [name for name in names if name.endswith("_orders")]
    beyond = lines >= carried_order(vibration, response, lines) if spectra else np.zeros(len(lines), bool)
    for name in names:
        what = name.removeprefix(f"{ACCELERATION}_")
        if name == ACCELERATION:
            stored = vibration.read(mesh_acceleration_at, response, vibration.look(parts.phase))
            values[name] = stored.transpose(1, 0, 2)
        elif name in spectra:
            signal = acceleration
            if name == f"{DEFLECTION}_orders":
                signal = vibration.motions(response, when).deflection
            values[name] = np.where(beyond, np.nan, np.abs(order_lines(signal, when.phase, weight, lines)))
        else:
            values[name] = STATISTICS[what](acceleration, weight)
    return values


def _nodes(vibration: Vibration, lines: Array) -> tuple[clock.Instants, Array]:
    """Return instants and weights of a mean, as many within a step as the highest line asks for."""
    grid = vibration.sampling.grid
    turn = 2.0 * np.pi * float(lines[-1]) * float(grid.width.max())
    phase, segment, weight = within_steps(grid, 2 * NODES + math.ceil(0.5 * turn))
    return clock.Instants(phase, segment), weight


def carried_order(vibration: Vibration, response: Response, lines: Array) -> float:
    """Return the mesh order up to which the steps of a response carry a spectrum, inf: all lines [1].

    On a periodic response every line of the acceleration is ``−(2π order/T)²`` times that of the path. Both
    come from the same steps: the one from the forces, the other from the polynomials between the steps.

    Parameters
    ----------
    vibration, response : the dynamics and a response; of an aperiodic one nothing is said
    lines : (n_lines,) orders, ascending [1]
    """
    if response.period == 0:
        return math.inf
    when, weight = _nodes(vibration, lines)
    spectra = [
        order_lines(vibration.read(read, response, when), when.phase, weight, lines)
        for read in (mesh_acceleration_at, _approach_at)
    ]
    twice = (2.0 * np.pi * lines / vibration.period) ** 2
    rounded = ROUNDED * np.ptp(response.approach.coefficient[0]) * twice
    apart = np.maximum(np.abs(spectra[0] + twice * spectra[1]) - rounded, 0.0)
    for low in np.arange(0.0, float(lines[-1]), BAND):
        band = (lines > low) & (lines <= low + BAND)
        size = np.linalg.norm(spectra[0][:, band], axis=1)
        if (np.linalg.norm(apart[:, band], axis=1) > APART * size).any():
            return float(low)
    return math.inf


def uncarried(parts: build.Parts, states: Sequence[coupled.WearState]) -> list[str]:
    """Return in words from where on the steps do not carry the accelerations that were asked for."""
    vibration = parts.vibration
    if vibration is None or not any(name.startswith(ACCELERATION) for name in parts.scene.store.requested):
        return []
    lines, responses = lines_of(vibration, states), [one for state in states for one in state.responses]
    lowest = min(carried_order(vibration, response, lines) for response in responses)
    if math.isinf(lowest):
        return []
    return [
        f"mesh acceleration: {len(vibration.sampling.grid.width)} steps a mesh period carry orders up to "
        f"{lowest:.3g}; spectra end there, while RMS, peak, crest factor and kurtosis hold more: raise "
        "numerics.steps_per_period"
    ]


def _approach_at(response: Response, grid: stages.StageGrid, phase: Array, segment: Index) -> Array:
    """Return the projections d·q of the meshes, (n_kept, n_mesh, n) [m]."""
    step = step_of(grid, phase, segment)
    position, _ = response.approach.at(step, (phase - grid.start[step]) / grid.width[step])
    return np.ascontiguousarray(position.transpose(0, 2, 1))


def order_lines(signal: Array, phase: Array, weight: Array, lines: Array) -> Complex:
    """Return the complex amplitudes of a signal on lines of the mesh order, (n_mesh, n_lines).

    A signal of P periods has lines at multiples of 1/P; on others it is 0. The integrals are taken over the
    nodes of the steps, so that a jump between two steps costs no accuracy.

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
    whole, wave = np.exp(-2j * np.pi * phase), np.ones(len(phase), complex)
    spectra = np.empty((int(count.max()) // periods + 1, periods, signal.shape[1]), complex)
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
