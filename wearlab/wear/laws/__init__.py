"""``wear.law``: how much of a flank is worn away in a cycle.

A file beside this one adds another.
"""

from collections.abc import Callable
from typing import ClassVar, Literal

from wearlab.arrays import Array
from wearlab.slots import Slot, Variant
from wearlab.wear.setting import NEEDS, FlankState, Setting


class LawModel(Variant):
    """Any wear law.

    ``needs`` names what the scene must say for it, as of a `CoefficientModel`;
    ``proportional`` says whether its rate is proportional to the wear coefficient, so
    that one life tells the coefficient.
    """

    slot: ClassVar[Slot] = Slot("wear.law", __name__, default="archard")
    may_need: ClassVar[tuple[str, ...]] = NEEDS
    needs: ClassVar[tuple[str, ...]] = ()
    proportional: ClassVar[bool] = False

    def build(self, setting: Setting) -> Callable[[FlankState], Array] | None:
        """Return the wear depth per cycle as a function of a flank's state.

        None for Archard's own kernel.

        Parameters
        ----------
        setting : the flank, its mate and the oil

        Returns
        -------
        a function of a `FlankState` to the depth along the normal at every node, (n,)
        [m per cycle], ≥ 0
        """
        raise NotImplementedError(f"{type(self).__name__} has no build")
