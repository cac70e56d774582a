"""What a run may do: bounds on its right-hand sides, by what one of them costs. Never on seconds."""

import numpy as np

from wearlab.dynamics.steps.kernel import is_small
from wearlab.dynamics.system import System
from wearlab.scene import Scene
from wearlab.scene.build import Parts

MOST_WORK = 2e9
"""Bound on the work of a march over cycles, units of about 15 ns. Kept states, estimates and the search for
other attractors come on top."""
KEPT_SHARE = 0.1
"""Work on kept states that nobody asked for, over the former; what is read off them takes as long again."""
SEARCH_SHARE = 0.4
"""Work of all searches for other attractors in one condition of operation, over the former."""
RHS_PER_STEP = 4
USUAL = 1e-4
"""Tolerance below which a march may do more, as it has to."""
IN_REGISTERS = 8.0
"""Units of a right-hand side of a system in registers, of one coordinate or four: 0.04 µs where flanks hardly
part, 0.25 µs where they chatter."""
OF_A_LARGE_STEP, LARGE = 90.0, 0.1
"""The same for a system too large for registers, and its units for the square, which goes by whole vectors:
measured on planetary sets of 6, 18 and 21 coordinates whose teeth part; of 6 that chatter 1.5 µs."""
FRICTIONAL = 2.0
"""What tooth friction multiplies a right-hand side by: two more channels a mesh, 1.3 to 1.7 times as long."""


def most_work(scene: Scene, parts: Parts) -> float:
    """Return the right-hand sides after which a life ends."""
    if scene.numerics.most_right_hand_sides is not None:
        return float(scene.numerics.most_right_hand_sides)
    if parts.vibration is None:
        return np.inf
    return MOST_WORK / units(parts.vibration.system) * max(1.0, (USUAL / scene.numerics.tolerance) ** 0.5)


def most_searched(system: System) -> int:
    """Return the integration steps of all searches for other attractors in one condition of operation."""
    return int(SEARCH_SHARE * MOST_WORK / (RHS_PER_STEP * units(system)))


def units(system: System) -> float:
    """Return the work of a right-hand side."""
    work = IN_REGISTERS if is_small(system) else LARGE * len(system.load) ** 2 + OF_A_LARGE_STEP
    return work if system.friction_constant is None else FRICTIONAL * work
