"""Initial wear by the wear law of the scene itself."""

from typing import Any, ClassVar, Literal

from wearlab.wear.initials import ShapedWear


class WornByLaw(ShapedWear):
    """Wear by this wear law: what a table that names no shape means."""

    by_law: ClassVar[bool] = True

    shape: Literal["worn"] = "worn"
    """by this wear law. Source: W23"""

    def identifying(self) -> dict[str, Any]:
        """Leave out the shape, which goes without saying."""
        return {
            key: value
            for key, value in super().identifying().items()
            if key != self.chooser
        }
