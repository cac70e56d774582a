"""Material worn off a gear."""

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.wear.path import WearPath


def worn_area(depth: ArrayLike, path: WearPath) -> Array:
    """Return the transverse area worn off one flank, ``∫ h dL``, (..., 2) [m²].

    The involute's arc element is ``dL = ρ dφ = ρ dρ/r_b`` (ρ = r_b φ along the roll angle φ).

    Parameters
    ----------
    depth : (..., 2, n) wear depth along the normal, (driving, driven) [m]
    path : WearPath

    References
    ----------
    Litvin & Fuentes, for the curvature of an involute.
    """
    return np.asarray(np.sum(np.asarray(depth, float) * path.arc_weight, axis=-1))


def worn_mass(
    depth: ArrayLike,
    path: WearPath,
    *,
    density: ArrayLike,
    teeth: ArrayLike,
    face_width: ArrayLike | None = None,
) -> Array:
    """Return the mass worn off each gear, ``ρ B z ∫ h dL``, every tooth alike, (..., 2) [kg].

    Parameters
    ----------
    depth : (..., 2, n) wear depth along the normal, (driving, driven) [m]
    path : WearPath
    density : (2,) [kg/m³]
    teeth : (2,) [1]
    face_width : width of contact [m]; the path's when not given
    """
    width = path.face_width if face_width is None else np.asarray(face_width, float)
    return np.asarray(np.asarray(density) * np.asarray(teeth) * width * worn_area(depth, path))
