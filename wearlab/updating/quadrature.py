"""A grid whose weights integrate: panels of Gauss–Legendre points, and the integral up to anywhere.

A density that is smooth within the panels is integrated to round-off by a few points each, with or without
tails at its ends, so that halving the panels tells whether there are enough.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.polynomial import legendre

from wearlab.arrays import Array
from wearlab.updating.curve import cubic

POINTS = 12  # of a panel


@dataclass(frozen=True)
class Quadrature:
    """Points of a coordinate with their weights.

    Parameters
    ----------
    edges : (panels + 1,) of the panels
    points, weights : (panels · POINTS,)
    """

    edges: Array
    points: Array
    weights: Array

    def __len__(self) -> int:
        return len(self.points)

    def below(self, density: Array) -> tuple[Array, Array]:
        """Return where the integral of a density is known, and it there: edges and points, rising.

        Parameters
        ----------
        density : (…, n) at the points

        Returns
        -------
        (m,) places and (…, m) integrals up to them.
        """
        panels = len(self.edges) - 1
        inside = density.reshape(*density.shape[:-1], panels, POINTS)
        half = 0.5 * np.diff(self.edges)[:, None]
        within = (inside @ _integrals().T) * half
        whole = (inside @ _rule()[1]) * half[:, 0]
        before = np.concatenate([np.zeros((*whole.shape[:-1], 1)), np.cumsum(whole, axis=-1)], axis=-1)
        at_points = before[..., :-1, None] + within
        at = np.concatenate([self.edges[:-1, None], self.points.reshape(panels, POINTS)], axis=1)
        weights = np.concatenate([before[..., :-1, None], at_points], axis=-1)
        return (
            np.concatenate([at.ravel(), self.edges[-1:]]),
            np.concatenate([weights.reshape(*density.shape[:-1], -1), before[..., -1:]], axis=-1),
        )


def grid(low: float, high: float, panels: int) -> Quadrature:
    """Return equal panels from ``low`` to ``high``."""
    return at_edges(np.linspace(low, high, panels + 1))


def at_edges(edges: Array) -> Quadrature:
    """Return the panels between edges, rising."""
    nodes, weights = _rule()
    half = 0.5 * np.diff(edges)[:, None]
    middle = 0.5 * (edges[1:] + edges[:-1])[:, None]
    return Quadrature(edges, (middle + half * nodes).ravel(), (half * weights).ravel())


def quantile(places: Array, below: Array, density: Array, p: Array) -> Array:
    """Return where a distribution reaches probabilities: its cubic pieces inverted by bisection.

    Parameters
    ----------
    places, below : (m,) as `Grid.below` returns them, the integral normed to 1
    density : (m,) the density at the places
    p : (q,) probabilities
    """
    i = np.clip(np.searchsorted(below, p, side="right") - 1, 0, len(places) - 2)
    x0, x1, y0, y1 = places[i], places[i + 1], below[i], below[i + 1]
    width = x1 - x0
    d0, d1 = density[i] * width, density[i + 1] * width
    low, high = np.zeros_like(p), np.ones_like(p)
    for _ in range(60):
        t = 0.5 * (low + high)
        under = cubic(t, y0, y1, d0, d1) < p
        low, high = np.where(under, t, low), np.where(under, high, t)
    return np.asarray(x0 + 0.5 * (low + high) * width)


@cache
def _rule() -> tuple[Array, Array]:
    return legendre.leggauss(POINTS)


@cache
def _integrals() -> Array:
    """Return the matrix from values at the points to integrals from −1 up to each of them."""
    nodes, weights = _rule()
    orders = np.arange(POINTS)
    basis = legendre.legvander(nodes, POINTS)  # (points, order)
    to_coefficients = (2 * orders[:, None] + 1) / 2 * (basis[:, :POINTS] * weights[:, None]).T
    integral = np.empty((POINTS, POINTS))
    integral[:, 0] = nodes + 1.0
    for n in orders[1:]:
        integral[:, n] = (basis[:, n + 1] - basis[:, n - 1]) / (2 * n + 1)
    return np.asarray(integral @ to_coefficients)
