"""Bounds on the work of a run, by the cost of its right-hand sides, not by seconds."""

import numpy as np

from wearlab import assembly
from wearlab.dynamics.integrators.kernel import is_small
from wearlab.dynamics.steady.shooting import RHS_PER_STEP
from wearlab.dynamics.system import System
from wearlab.scene import Scene

MAX_WORK = 2e9
"""Bound on the work of an integration over cycles, units of about 15 ns. Kept states,
estimates and the search for other attractors come on top."""
MORE_IF_LARGE = 2.0
"""How many times as much the life of a large system may do: where its flanks strike,
places that are struck move on within a micrometre, and steps have to follow them."""
SEARCH_SHARE = 0.4
"""Work of all searches for other attractors in one condition of operation, over the
former."""
USUAL = 1e-4
"""Tolerance below which an integration may do more, as it has to."""
FINEST = 1e-6
"""Tolerance below which it may do no more: nodes along the profile do not grow
either."""
IN_REGISTERS = 12.0
"""Units of a right-hand side of a system in registers, of one coordinate or four: 0.04
µs where flanks hardly part; 0.26 µs where they chatter, for it is such lives that reach
the bound."""
OF_A_LARGE_STEP = 180.0
"""The same for a system too large for registers: 11 µs a step of a planetary set of 6
coordinates, 13 µs of 18, where flanks chatter 18 to 27 µs."""
LARGE = 0.1
"""Units of such a system for the square of its coordinates, which goes by whole
vectors."""
FRICTIONAL = 1.5
"""What tooth friction multiplies a right-hand side by: two more channels a mesh, 1.3 to
1.7 times as long."""


MANY_PERIODS = 100
"""Mesh periods of hunting teeth from which tables no longer stay in the processor's
cache."""
OUT_OF_CACHE = 10.0
"""By what work is dearer then: 0.67 µs a right-hand side over 1,633 periods, and the
forces that wear take as long again."""


def max_work(scene: Scene, parts: assembly.GearModel) -> float:
    """Return the number of right-hand sides after which a life ends.

    Parameters
    ----------
    scene : the scene, which may name the number
    parts : its physics
    """
    if scene.numerics.most_right_hand_sides is not None:
        return float(scene.numerics.most_right_hand_sides)
    if parts.vibration is None:
        return np.inf
    system = parts.vibration.system
    allowed = MAX_WORK if is_small(system) else MORE_IF_LARGE * MAX_WORK
    work = units(system)
    if parts.vibration.hunting > MANY_PERIODS:
        work *= OUT_OF_CACHE
    return allowed / work * more_work(USUAL, scene.numerics.tolerance)


def more_work(usual: float, tolerance: float) -> float:
    """Return how many times as much work a life may do at its tolerance.

    Parameters
    ----------
    usual : tolerance from which on it may do more [1]
    tolerance : of the life [1]
    """
    return float((usual / np.clip(tolerance, FINEST, usual)) ** 0.5)


def max_searched(system: System, requested: float | None = None) -> int:
    """Return the steps of all searches for other attractors in one condition.

    Who asks for more right-hand sides of a life than it may have by itself has more of
    these, too.

    Parameters
    ----------
    system : whose motions are searched
    requested : right-hand sides that a scene asks for, None: it does not
    """
    right_hand_sides = max(MAX_WORK / units(system), requested or 0.0)
    return int(SEARCH_SHARE * right_hand_sides / RHS_PER_STEP)


def units(system: System) -> float:
    """Return the work of a right-hand side, in units of about 15 ns.

    Parameters
    ----------
    system : its system
    """
    work = IN_REGISTERS
    if not is_small(system):
        work = LARGE * len(system.load) ** 2 + OF_A_LARGE_STEP
    return work if system.friction_constant is None else FRICTIONAL * work
