"""Flanks that are worn before the first cycle by the wear law itself (W23's "initial wear")."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.life.counted import Rate
from wearlab.life.limits import Limits
from wearlab.life.march import ELASTIC_SCALE, evolve


def worn(
    rate: Rate,
    initial: ArrayLike,
    flanks: Mapping[str, tuple[slice, float]],
    *,
    tolerance: float = 1e-3,
    scale: float = ELASTIC_SCALE,
    most_work: float = np.inf,
) -> Array:
    """Return the depths after wear by the law until each named flank is as deep as asked, (n,) [m].

    All flanks run and wear together until the named one has its depth; then only the named flank keeps its
    wear (its mate is taken as new). Several named flanks are worn one run each, all from ``initial``.

    Parameters
    ----------
    rate : h (n,) [m] -> dh/dN (n,) [m per cycle]
    initial : (n,) depths before [m]
    flanks : name -> (entries of h on that flank, largest depth wanted there [m])
    tolerance, scale, most_work : see :func:`wearlab.life.march.evolve`

    Raises
    ------
    ValueError
        When a flank cannot be worn to that depth, with the reason.
    """
    h0 = np.array(initial, float)
    h = h0.copy()
    for name, (flank, depth) in flanks.items():
        if depth == 0.0:
            continue
        limits = Limits(depth=depth, flank=flank)
        life = evolve(rate, h0, limits=limits, tolerance=tolerance, scale=scale, most_work=most_work)
        if not life.worn_out:
            raise ValueError(f"flank {name!r} cannot be worn to {depth:.3g} m by this law: {life.end_reason}")
        h[flank] = life.depth[-1][flank]
    return h
