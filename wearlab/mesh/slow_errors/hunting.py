"""Once-per-revolution errors, until the same teeth meet again."""

from collections.abc import Sequence
from math import lcm
from typing import TYPE_CHECKING, ClassVar, Literal

from wearlab.mesh.slow_errors import SlowErrorModel

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.mesh.clock import Mesh


class HuntingErrors(SlowErrorModel):
    """The full period, until the same teeth meet again."""

    turns: ClassVar[bool] = True

    model: Literal["hunting"] = "hunting"
    """the full period. Source: wearlab"""

    def periods(self, teeth: Sequence[int]) -> int:
        """Return the least common multiple of the numbers of teeth."""
        return lcm(*teeth)

    def rows(self, meshes: "Sequence[Mesh]", at_angles: "Array") -> None:
        """Return None: the errors are part of the motion."""
        return None
