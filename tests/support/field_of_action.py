"""Lines of contact in a rectangle, in closed form and as a series: what sums over
slices are held against.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array


class FieldOfAction(NamedTuple):
    """The rectangle in which the lines of contact lie.

    Parameters
    ----------
    transverse_ratio, overlap : ε_α and ε_β [1]
    face_width : b [m]
    base_angle : β_b [rad]
    """

    transverse_ratio: float
    overlap: float
    face_width: float
    base_angle: float

    def line_length(self, phase: ArrayLike) -> Array:
        """Return the length of all lines of contact at mesh phases, cut off at the
        edges of the field, [m].

        At y from mid-face a pair touches at ``τ + n − ε_β y/b`` base pitches after A,
        as long as that lies between 0 and ε_α.

        Parameters
        ----------
        phase : (n,) τ, mesh phase at mid-face [1]
        """
        tau = np.atleast_1d(np.asarray(phase, float))[:, None]
        reach = int(np.ceil(self.transverse_ratio + self.overlap)) + 2
        at_middle = tau + np.arange(-reach, reach + 1)
        if self.overlap == 0.0:
            touching = (at_middle >= 0.0) & (at_middle < self.transverse_ratio)
            return np.asarray(self.face_width * touching.sum(axis=1))
        low = np.maximum(-0.5, (at_middle - self.transverse_ratio) / self.overlap)
        high = np.minimum(0.5, at_middle / self.overlap)
        width = self.face_width * np.maximum(0.0, high - low).sum(axis=1)
        return np.asarray(width / np.cos(self.base_angle))

    def line_length_series(self, phase: ArrayLike, terms: int) -> Array:
        """Return the same by its Fourier series.

        ``L_m [1 + 2 Σ_k sinc(k ε_α) sinc(k ε_β) cos πk(ε_α − 2τ)]``, ``L_m = ε_α b/cos
        β_b``: the lines are counted from mid-face.

        Parameters
        ----------
        phase : (n,) τ, mesh phase at mid-face [1]
        terms : harmonics of the mesh frequency

        References
        ----------
        Velex 2012, On the modelling of spur and helical gear dynamic behaviour, for the
        series.
        """
        tau = np.atleast_1d(np.asarray(phase, float))[:, None]
        k = np.arange(1, terms + 1)
        waves = np.cos(np.pi * k * (self.transverse_ratio - 2.0 * tau))
        each = np.sinc(k * self.transverse_ratio) * np.sinc(k * self.overlap) * waves
        return np.asarray(self.mean_length * (1.0 + 2.0 * each.sum(axis=1)))

    @property
    def mean_length(self) -> float:
        """Mean length of all lines of contact, ``ε_α b/cos β_b`` [m]."""
        return self.transverse_ratio * self.face_width / math.cos(self.base_angle)
