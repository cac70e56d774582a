"""``wear.load``: which force wears the flanks, one variant a file."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, ClassVar

from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.life.load import Load


class LoadModel(Variant):
    """Any force that wears; ``needs_slope`` says whether it counts damage along a Wöhler line."""

    slot: ClassVar[Slot] = Slot("wear.load", __name__, words=True)
    needs_slope: ClassVar[bool] = False

    def problems(self, scene: Any) -> Iterator[tuple[str, str]]:
        """Yield what it asks of a scene, as (key, reason)."""
        if scene.dynamics is None:
            yield "wear.load", f"{self.chosen!r} needs [dynamics]; without it the load is 'static'"
        if self.needs_slope and scene.wear.wohler_slope is None:
            yield "wear.load", f"{self.chosen!r} needs 'wohler_slope', such as 6.61"

    def build(self, wohler_slope: float | None) -> "Load":
        """Return which force wears the flanks; ``wohler_slope`` is that of ``[wear]`` [1]."""
        raise NotImplementedError(f"{type(self).__name__} has no build")
