"""Sheets that contradict each other: each may have a scale of its own.

Where several sheets tell of one gear set, each has with a probability of π a scale of
its own: it sees ln f + δ, with δ a Cauchy law. Of q sheets, with likelihoods L_b,

    L(u) = (1 − qπ) Π_b L_b(u) + π Σ_b c_b(u) Π_{a≠b} L_a(u),   c_b(u) = ∫ L_b(x) t(x −
    u) dx.

The closer two sheets agree, the more both count; what no other sheet bears out moves
nothing else. All of it is continuous in every reading: nothing is switched.
"""

import numpy as np

from wearlab.arrays import Array

DOUBT = 0.1  # probability that a sheet has a scale of its own
LARGEST_DOUBT = 0.5  # probability that any has
SCALE = 0.1  # of the Cauchy law of ln of the scale
FAR = 7.0  # in ln f, that a sheet's scale may be off by: units a thousand apart


def log_of_doubt(sheets: int) -> tuple[float, float]:
    """Return the logs of how probably all sheets are sound, and one is not.

    Parameters
    ----------
    sheets : number of them; of one none is doubted
    """
    if sheets < 2:
        return 0.0, -np.inf
    doubt = min(DOUBT, LARGEST_DOUBT / sheets)
    return float(np.log1p(-sheets * doubt)), float(np.log(doubt))


def log_density_of_scale(log_scale: Array) -> Array:
    """Return the log of the prior density of ln of a sheet's own scale.

    Parameters
    ----------
    log_scale : by how much ln f differs
    """
    return np.asarray(-np.log(np.pi * SCALE) - np.log1p((log_scale / SCALE) ** 2))


def log_with_scale(at: Array, log_factor: Array, log_mass: Array) -> Array:
    """Return ln c(u) of a sheet with a scale of its own, (…, q).

    Parameters
    ----------
    at : u, (q,)
    log_factor : x, where the sheet's likelihood is known, (n,)
    log_mass : log of that likelihood times the spacing of x, (…, n)
    """
    top = log_mass.max(axis=-1, keepdims=True)
    density = np.exp(log_density_of_scale(log_factor[:, None] - at))
    return np.asarray(top + np.log(np.exp(log_mass - top) @ density))
