"""A stiffness read from a file; its contents, not its path, are part of the scene."""

from typing import TYPE_CHECKING, Any, Literal

from pydantic import ConfigDict, ValidationInfo, model_validator
from pydantic.json_schema import SkipJsonSchema

from wearlab.mesh.stiffnesses import PrescribedStiffness
from wearlab.options import Part, option
from wearlab.table_options import read_stiffness

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.mesh.curve import PiecewiseCurve
    from wearlab.mesh.pair_stiffness import PairStiffness
    from wearlab.mesh.profile import ProfileGrid


class StiffnessUnits(Part):
    """Units of the columns of a table."""

    phase: Literal["1"] = option("1", "the phase is a fraction of the mesh period")
    path_position: str | None = option(None, "unit of the path position", derived="the one in the header")
    stiffness: str | None = option(
        None, "unit of the stiffness, such as 'N/um'", derived="the one in the header"
    )


class TabulatedStiffness(PrescribedStiffness):
    """A stiffness read from a file; its contents, not its path, are part of the scene."""

    model_config = ConfigDict(json_schema_extra={"required": ["file"]})

    model: Literal["tabulated"] = option("tabulated", "stiffness from a file", source="wearlab")
    file: str | None = option(
        None,
        "CSV file with columns phase or path_position, and stiffness",
        derived="required in a campaign file",
        identity=False,
    )
    units: StiffnessUnits | None = option(
        None, "units of the columns", derived="those in the headers", identity=False
    )
    along: SkipJsonSchema[Literal["phase", "path_position"]] = option(
        ..., "what the abscissa is, read from the file"
    )
    abscissa: SkipJsonSchema[tuple[float, ...]] = option(
        ..., "phase [1] or path position [m], ascending, from the file"
    )
    stiffness: SkipJsonSchema[tuple[float, ...]] = option(..., "stiffness [N/m], from the file")

    @model_validator(mode="before")
    @classmethod
    def _contents(cls, given: Any, info: ValidationInfo) -> Any:
        if not isinstance(given, dict):
            return given
        return read_stiffness(given, (info.context or {}).get("base_directory"))

    def curve(self, pair: "GearPair") -> "PiecewiseCurve":
        """Return the stiffness over phase, or over ``(s − s_A)/p_b`` [N/m]."""
        import numpy as np

        from wearlab.mesh.curve import PiecewiseCurve

        x = np.asarray(self.abscissa, float)
        if self.along == "path_position":
            x = (x - pair.path.A) / pair.base_pitch
        return PiecewiseCurve(x, np.asarray(self.stiffness, float))

    def jumps(self, pair: "GearPair") -> tuple[float, ...]:
        """Return the phases at which the table has two values."""
        places = self.curve(pair).jumps
        return tuple(places) if self.of_mesh else tuple(x % 1.0 for x in places)

    def build(self, pair: "GearPair", grid: "ProfileGrid") -> "PairStiffness":
        """Return the table's values at the nodes."""
        from wearlab.mesh.stiffness import GivenStiffness

        return GivenStiffness(self.curve(pair), self.of_mesh, grid)
