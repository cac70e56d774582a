"""States to let flanks go from: phases and amplitudes of the modes that the mesh drives, evenly spread."""

from collections.abc import Iterator

import numpy as np

from wearlab.arrays import Array
from wearlab.dynamics.orbits.response import Response

AMPLITUDE = (4.0, 120.0)
"""Force of the mode released over the mean mesh force: less hardly parts flanks, more flies through gaps."""
PLASTIC = 1.32471795724474602596
"""Real root of x³ = x + 1: multiples of its inverse and of the square of that fill a plane most evenly."""


def releases(response: Response, deflection: float, first: int = 0) -> Iterator[Array]:
    """Yield states (2n,) to release flanks from, without end: mode after mode, each at another phase.

    About the mean state of the response, a mode vibrates with ``x = a cos θ``, ``ẋ = −a ω sin θ``. Amplitudes
    a, by their logarithm, and phases θ follow an additive recurrence, which leaves no gap wherever it ends.

    Parameters
    ----------
    response : the response beside which others are looked for
    deflection : its mean mesh deflection [m]
    first : number of the first release: what a neighbouring state has tried need not be tried again

    References
    ----------
    Roberts, The unreasonable effectiveness of quasirandom sequences, 2018: the plastic number.
    """
    shapes, rates, largest = _driven(response, deflection)
    n = shapes.shape[1]
    mean = response.state[:, :-1].mean(axis=(0, 1))
    low, high = np.log(AMPLITUDE)
    number = first
    while True:
        turn, mode = divmod(number, len(shapes))
        spread, phase = (0.5 + turn / PLASTIC) % 1.0, 2.0 * np.pi * ((0.5 + turn / PLASTIC**2) % 1.0)
        moved = np.exp(low + (high - low) * spread) * largest[mode] * shapes[mode]
        state = mean.copy()
        state[:n] += np.cos(phase) * moved
        state[n:] -= np.sin(phase) * rates[mode] * moved
        yield state
        number += 1


def _driven(response: Response, deflection: float) -> tuple[Array, Array, Array]:
    """Return shapes (n_driven, n), rates [rad/s] and amplitudes of the modes that the mesh drives.

    A mode has the amplitude by which its mesh force equals the load's, or its energy that of the deflection
    under load, whichever is less: some hardly move the mesh.
    """
    system = response.system
    every = response.modes
    driven = every.excited() & (every.frequency > 0.0)
    shapes, rates = every.shape[driven], 2.0 * np.pi * every.frequency[driven]
    felt = np.abs(shapes @ system.direction.sum(axis=0))
    held = np.linalg.norm(shapes @ system.load / rates)
    return shapes, rates, np.minimum(deflection / felt, held / rates)
