"""How far the teeth of one gear yield under loads on their flanks, sampled along the flank."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.gears.gear import Gear
from wearlab.mesh.finite_element.flank import LoadedFlank, Wear
from wearlab.mesh.finite_element.half_plane import half_plane_compliance
from wearlab.mesh.finite_element.options import Options

KEPT_SPLINES = 8


@dataclass(frozen=True)
class GearCompliance:
    """Compliance of a gear along the line of action, per unit face width, without the local indentation.

    Parameters
    ----------
    parameter : (m,) sampled positions on the flank, ascending; 1 where the involute begins, 2 at the tip
    own : (m,) of a tooth under its own load [1/Pa]
    across : (n_apart, m, m) of the tooth 1, 2 … pitches further on towards the loaded flank's side, observed
        × loaded position [1/Pa]
    """

    parameter: Array
    own: Array
    across: Array

    def weights(self, parameter: ArrayLike) -> Array:
        """Return the weights of the samples at positions, (n, m) [1]: a cubic spline, straight beyond."""
        q = np.asarray(parameter, dtype=float)
        spline = _spline(tuple(self.parameter))
        inside = np.clip(q, self.parameter[0], self.parameter[-1])
        weights: Array = spline(inside) + (q - inside)[:, None] * spline(inside, 1)
        return weights


@lru_cache(KEPT_SPLINES)
def _spline(samples: tuple[float, ...]) -> Any:
    """Return the cubic splines that are 1 at one sample and 0 at the others."""
    from scipy.interpolate import CubicSpline

    return CubicSpline(samples, np.eye(len(samples)))


def solve_gear(gear: Gear, options: Options, wear: Wear | None = None) -> GearCompliance:
    """Compute the compliance of a gear with finite elements.

    Teeth, root and body of the whole wheel yield, clamped at the bore. The local indentation is the
    half plane's against the tooth's centre line and is taken off the tooth's own compliance. The outermost
    load touches the tip edge with its patch; beyond, towards the edge itself, the samples are continued
    straight, since no half plane is left there.

    Parameters
    ----------
    gear : the gear
    options : of mesh and load
    wear : of every tooth's loaded flank; the other flank wears alike

    Returns
    -------
    GearCompliance
    """
    from wearlab.mesh.finite_element.chart import chart
    from wearlab.mesh.finite_element.sector import sector
    from wearlab.mesh.finite_element.wheel import flank_loads, wheel_compliance

    flank, half_width = LoadedFlank(gear, wear), options.patch * gear.module
    shape = chart(flank)
    last = float(shape.measured.at(shape.measured.length[-1] - half_width))
    q = 1.0 + 0.5 * (last - 1.0) * (1.0 - np.cos(np.linspace(0.0, np.pi, options.samples)))
    cut = sector(shape, gear.material, options.plane, options.refinement)
    work = wheel_compliance(cut, flank_loads(cut, q, half_width), options.teeth_apart)
    local = half_plane_compliance(gear.material, options.plane, half_width, flank.depth(q))
    return GearCompliance(q, np.diag(work[0]) - local, work[1:])
