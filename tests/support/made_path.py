"""Paths of contact as wear knows them, of curvatures given one by one."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from wearlab.gears.specification import Material
from wearlab.wear.path import WearPath, wear_path


def path_of(
    curvature: Any,
    *,
    base_radius: Any,
    teeth: Any,
    passes: Any,
    face_width: float,
    speed: float = 100.0,
    modulus: float = 1e11,
    internal: bool = False,
) -> WearPath:
    """Return the path of gears of which nothing else counts."""
    rho = np.asarray(curvature, float)
    steel = Material(youngs_modulus=1.0, poisson_ratio=0.0, density=1.0)
    gears = [
        SimpleNamespace(base_radius=float(radius), teeth=float(count), material=steel)
        for radius, count in zip(base_radius, teeth, strict=True)
    ]
    pair: Any = SimpleNamespace(gears=gears, curvature=lambda _: rho, internal=internal)
    return wear_path(pair, np.arange(rho.shape[1]), speed, passes, face_width)._replace(
        contact_modulus=modulus
    )
