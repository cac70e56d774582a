"""The benchmark pair: L16's masses and bearings with a prescribed
mesh stiffness, a fixed yardstick.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics.spur import Meshing, Paired, spur_3dof
from wearlab.dynamics.supports import MemberSupport
from wearlab.dynamics.system import System
from wearlab.mesh.gear_set import Body
from wearlab.mesh.stages import StageGrid, StageTables, stage_grid

Array = NDArray[np.float64]

TEETH = 50
BASE_RADIUS = 70.477e-3


class BenchmarkPair(NamedTuple):
    """L16's 50/50 pair; every value may be replaced with ``_replace``.

    Mesh stiffness ``single + (double − single) · number``, the number of the second
    pair rising from 0 to 1 around phase 0 (entry) and falling around contact ratio − 1
    (exit), by quintic ramps or sharply; mesh error ``amplitude · sin(2π φ)``.

    Parameters
    ----------
    torque : on the pinion [N m]
    mesh_damping, bearing_damping : [N s/m]
    amplitude : of the first harmonic of the error [m]
    backlash : j_bn [m], or None
    damping_always : mesh damping acts in separation too
    ramp : width of the ramps in phase, 0: sharp [1]
    double, single : mesh stiffness in double and single contact [N/m]
    contact_ratio : [1]
    """

    torque: float = 340.0
    mesh_damping: float = 1000.0
    bearing_damping: float = 5360.0
    amplitude: float = 3e-6
    backlash: float | None = 100e-6
    damping_always: bool = True
    ramp: float = 0.05
    double: float = 3.7e8
    single: float = 2.2e8
    contact_ratio: float = 1.75

    def system(self) -> System:
        """Return the 3-DOF system."""
        gears = dict.fromkeys(("pinion", "gear"), Body(2.8, 7.3e-3, BASE_RADIUS))
        bearing = MemberSupport(
            radial_stiffness=1150e6, radial_damping=self.bearing_damping
        )
        mesh = Meshing(self.mesh_damping, self.damping_always, self.backlash)
        return spur_3dof(
            Paired(
                gears, dict.fromkeys(gears, bearing), mesh, self.torque / BASE_RADIUS
            )
        )

    @property
    def breaks(self) -> Array:
        """Phases at which the stiffness is not smooth [1]."""
        leaves = self.contact_ratio - 1.0
        half = 0.5 * self.ramp
        if half == 0.0:
            return np.array([0.0, leaves])
        return np.array([0.0, half, leaves - half, leaves + half, 1.0 - half])

    def grid(self, steps: int) -> StageGrid:
        """Return about ``steps`` steps that land on the breaks."""
        return stage_grid(self.breaks, steps)

    def stiffness(self, phase: Array, middle: Array) -> Array:
        """Return the mesh stiffness [N/m] at ``phase``.

        A sharp jump is decided by ``middle`` of the step.
        """
        leaves = self.contact_ratio - 1.0
        if self.ramp == 0.0:
            second = (middle < leaves) * np.ones_like(phase)
        else:
            enters = _quintic(phase / self.ramp + 0.5) + _quintic(
                (phase - 1.0) / self.ramp + 0.5
            )
            second = enters - _quintic((phase - leaves) / self.ramp + 0.5)
        return self.single + (self.double - self.single) * second

    def tables(self, grid: StageGrid) -> StageTables:
        """Tabulate the mesh on ``grid``: one pair that bears all, and
        a second that never does.
        """
        phase = grid.phase
        stiffness = np.zeros((*phase.shape, 1, 2))
        stiffness[:, :, 0, 0] = self.stiffness(
            phase, (grid.start + 0.5 * grid.width)[:, None]
        )
        angle = 2.0 * np.pi * phase[:, :, None]
        return StageTables(
            grid.width,
            stiffness,
            np.zeros_like(stiffness),
            self.amplitude * np.sin(angle),
            2.0 * np.pi * self.amplitude * np.cos(angle),
            None,
        )


def mesh_period(rpm: float, teeth: int = TEETH) -> float:
    """Return the duration of a mesh period at a pinion speed in rpm [s]."""
    return 60.0 / (rpm * teeth)


def _quintic(x: Array) -> Array:
    x = np.clip(x, 0.0, 1.0)
    rise: Array = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    return rise
