"""A simulation whose run is one life over cycles, slow enough to be
killed under way.
"""

import os
import time
from pathlib import Path
from unittest.mock import patch

import numpy as np
import xarray as xr
from fake_campaign import Scene

from wearlab.life.integrate import integrate
from wearlab.life.limits import Limits
from wearlab.runner import worker

SIMULATE = "fake_life:simulate"


@patch.object(
    worker, "EVERY", 0.0
)  # while it lives alone: other lives would be kept at every step, too
def simulate(scene: Scene) -> xr.Dataset:
    """March to a depth.

    ``act`` = "die" kills the process after ten states, unless ``gate`` is there.
    """
    rates, states = 0, 0

    def rate(h):
        nonlocal rates
        rates += 1
        time.sleep(0.002)
        return 1e-9 * scene.speed / 800.0 * (
            1.0 + np.linspace(0.0, 1.0, h.size)
        ) - 1e-4 * (h - h.mean())

    def shown(node):
        nonlocal states
        states += 1
        if (
            scene.act in ("die", "interrupt")
            and states == 10
            and not os.path.exists(scene.gate)
        ):
            Path(scene.gate).touch()
            if scene.act == "interrupt":
                raise KeyboardInterrupt
            time.sleep(0.3)  # what was told is still on its way
            os._exit(9)

    life = integrate(
        rate, np.zeros(7), limits=Limits(depth=2e-5), tolerance=1e-6, progress=shown
    )
    if scene.log:
        with open(scene.log, "a") as file:
            file.write(f"{scene.speed:g} {rates}\n")
    return xr.Dataset(
        {
            "wear_depth": (("update", "profile"), life.depth, {"units": "m"}),
            "life": ((), life.cycle[-1]),
        },
        coords={"cycle": ("update", life.cycle)},
        attrs={"source_hash": "abc"},
    )
