"""How deep flanks are pressed where they are pressed hardest across a face."""

import numpy as np

from wearlab.arrays import Array

BISECTIONS = 60


def deepest_deflection(gap: Array, deflection: float) -> float:
    """Return the deflection of slices where they are pressed hardest [m].

    Slices that yield alike and apart carry the force of a whole face together where
    ``mean max(0, δ − g) = δ_0``; the deepest is ``δ − min g``, and δ_0 where all touch
    alike.

    Parameters
    ----------
    gap : (n_face,) g of equal slices [m]
    deflection : δ_0 of flanks that touch over the whole face [m]

    Examples
    --------
    Flanks that open by 30 µm, under a force that presses even ones by 5 µm: 42 % of
    the face touch no more, and ``δ² / (2 · 30 µm) = 5 µm``.

    >>> gap = np.linspace(0.0, 30e-6, 2001)
    >>> round(1e6 * deepest_deflection(gap, 5e-6), 2)
    17.32
    """
    raised = gap - gap.min()
    low = deflection
    high = deflection + float(raised.max())
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        carried = np.maximum(0.0, middle - raised).mean()
        if carried < deflection:
            low = middle
        else:
            high = middle
    return high
