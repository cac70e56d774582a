"""Once-per-revolution errors that turn with their members, over the full period."""

from collections.abc import Sequence
from math import lcm
from typing import TYPE_CHECKING, ClassVar, Literal

from wearlab.mesh.slow_errors import SlowErrorModel
from wearlab.options import option

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.mesh.clock import Mesh


class HuntingErrors(SlowErrorModel):
    """The full period, until the same teeth meet again."""

    turns: ClassVar[bool] = True

    model: Literal["hunting"] = option("hunting", "the full period", source="wearlab")

    def periods(self, teeth: Sequence[int]) -> int:
        """Return the least common multiple of the numbers of teeth."""
        return lcm(*teeth)

    def rows(self, meshes: "Sequence[Mesh]", at_angles: "Array") -> None:
        """Return nothing: the errors are part of the motion."""
        return None
