"""What planets of one set have of their own: their shares of the load."""

import numpy as np
import xarray as xr

UNEQUAL = 1.2
"""Load of a planet over the mean of all, above which a run says so."""


def overload_flags(dataset: xr.Dataset) -> list[str]:
    """Return which planet carries much more than the mean, nothing where none does.

    Parameters
    ----------
    dataset : of the run
    """
    over_turn = "mesh_load_factor_max" in dataset
    name = "mesh_load_factor_max" if over_turn else "mesh_load_factor"
    if name not in dataset:
        return []
    factors = dataset[name]
    of_mesh = factors.max([dim for dim in factors.dims if dim != "mesh"])
    largest = float(of_mesh.max())
    if not largest > UNEQUAL:
        return []

    mesh = str(of_mesh["mesh"].values[np.argmax(of_mesh.values)])
    planet = mesh.rpartition("-")[2]
    turning = " at an angle of its turn" if over_turn else ""
    return [
        f"planet {planet} carries up to {largest:.3g} times the mean load of the "
        f"planets{turning}: they share it unequally"
    ]
