"""A response between the ends of its steps: one polynomial over each two steps.

Position, velocity and acceleration are known at both ends and in the middle of two equal steps, the
acceleration from the equation of motion. The polynomial of degree eight through these nine values misses an
oscillation of frequency ω by ``1.5e-7 (ω h)⁹`` of its amplitude, h one step: less than the steps themselves.
"""

from typing import NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from wearlab.arrays import Array, Index

DEGREE = 8


def _basis() -> Array:
    """Return the coefficients (9, 9) of the polynomials that have one of the nine values each."""
    rows = [
        polyval(end, polyder(np.eye(DEGREE + 1), m=order, axis=0), tensor=True)
        for end in (-1.0, 0.0, 1.0)
        for order in (0, 1, 2)
    ]
    return np.asarray(np.linalg.inv(np.array(rows)), np.float64)


BASIS = _basis()
"""Row: power of the time from the middle in steps; column: value, slope, curvature at start, middle, end."""


class Path(NamedTuple):
    """Signals over the steps.

    Parameters
    ----------
    coefficient : (9, n_kept, n_steps / 2, n_signals) of the powers of the time from the middle of two steps,
        in steps
    length : (n_steps / 2,) duration of one step [s]
    """

    coefficient: Array
    length: Array

    def at(self, step: Index, fraction: Array) -> tuple[Array, Array]:
        """Return the signals and their rates at fractions of steps, both (n_kept, n, n_signals)."""
        two, x = step // 2, (step % 2 - 1 + fraction)[:, None]
        value = self.coefficient[DEGREE][:, two]
        rate = np.zeros_like(value)
        for coefficient in self.coefficient[DEGREE - 1 :: -1]:
            rate = rate * x + value
            value = value * x + coefficient[:, two]
        return value, rate / self.length[two, None]


def path(position: Array, velocity: Array, acceleration: Array, length: Array) -> Path:
    """Return the polynomials of signals.

    Parameters
    ----------
    position, velocity : (n_kept, n_steps + 1, n_signals) at the ends of the steps
    acceleration : (n_kept, n_steps, 2, n_signals) at the start and the end of every step
    length : (n_steps,) duration of the steps, two and two equal [s]
    """
    h = length[::2]
    first, second = acceleration[:, ::2], acceleration[:, 1::2]
    value, slope = (np.stack([x[:, :-1:2], x[:, 1::2], x[:, 2::2]]) for x in (position, velocity))
    bend = np.stack([first[:, :, 0], 0.5 * (first[:, :, 1] + second[:, :, 0]), second[:, :, 1]])
    nine = np.stack([value, slope * h[:, None], bend * (h * h)[:, None]], axis=1)
    nine = nine.reshape(DEGREE + 1, *value.shape[1:])
    return Path(np.tensordot(BASIS, nine, axes=1), h)
