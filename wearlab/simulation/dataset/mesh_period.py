"""Stiffness and transmission error over a mesh period: mean, RMS, harmonics."""

from collections.abc import Sequence

import numpy as np

from wearlab.arrays import Array
from wearlab.mesh.harmonics import harmonics


def over_period(
    stiffness: Sequence[Array],
    error: Sequence[Array],
    phase: Array,
    weight: Array,
    count: int,
) -> dict[str, Array]:
    """Return mean, RMS, harmonics and extremes of stiffness and transmission error.

    Parameters
    ----------
    stiffness : mesh stiffness of every state, (n,) at the phases [N/m]
    error : transmission error of every state, (n,) at the phases [m]
    phase : (n,) phases of the clock [1]
    weight : (n,) weights of a mean over these phases [1]
    count : number of harmonics

    Returns
    -------
    Variable → values (n_updates, …).
    """
    values = {
        "ste_peak_to_peak": np.ptp(error, axis=1),
        "ste_max": np.max(error, axis=1),
    }
    for name, samples in (("stiffness", stiffness), ("ste", error)):
        series = [harmonics(phase, weight, of_state, count) for of_state in samples]
        values[f"{name}_mean"] = np.array([state.mean for state in series])
        values[f"{name}_rms"] = np.array([state.rms for state in series])
        values[f"{name}_harmonics"] = np.array([state.amplitude for state in series])
        values[f"{name}_harmonics_phase"] = np.array([state.phase for state in series])
    return values
