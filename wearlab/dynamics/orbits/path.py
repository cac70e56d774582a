"""A response between the ends of its steps: one polynomial over each two steps.

Position, velocity and acceleration are known at both ends and in the middle of two equal steps, the
acceleration from the equation of motion. The polynomial of degree eight through these nine values misses an
oscillation of frequency ω by ``1.5e-7 (ω h)⁹`` of its amplitude, h one step: less than the steps themselves.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from wearlab.arrays import Array, Index
from wearlab.compiled import jit

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
    coefficient : (n_powers, n_kept, n_steps / together, n_signals) of the powers of the time from the middle
        of some steps, in halves of their number
    length : (n_steps / together,) duration of one step [s]
    together : steps of one polynomial
    """

    coefficient: Array
    length: Array
    together: int = 2

    def at(self, step: Index, fraction: Array) -> tuple[Array, Array]:
        """Return the signals and their rates at fractions of steps, both (n_kept, n, n_signals)."""
        half = 0.5 * self.together
        some, x = step // self.together, (step % self.together + fraction) / half - 1.0
        value, rate = np.empty((2, self.coefficient.shape[1], len(x), self.coefficient.shape[3]))
        evaluate(np.ascontiguousarray(self.coefficient), some, x, half * self.length, value, rate)
        return value, rate


@jit
def evaluate(coefficient: Any, some: Any, x: Any, unit: Any, value: Any, rate: Any) -> None:
    """Fill polynomials number ``some`` and their rates at ``x``, (n_kept, n, n_signals), by Horner's rule.

    ``unit``: (n_polynomials,) duration that x counts [s]
    """
    powers, periods, _, signals = coefficient.shape
    for period in range(periods):
        for point in range(len(x)):
            at, u = some[point], x[point]
            for signal in range(signals):
                total, slope = coefficient[powers - 1, period, at, signal], 0.0
                for power in range(powers - 2, -1, -1):
                    slope = slope * u + total
                    total = total * u + coefficient[power, period, at, signal]
                value[period, point, signal], rate[period, point, signal] = total, slope / unit[at]


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
