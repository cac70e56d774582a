"""A stiffness from a file."""

from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import ConfigDict, ValidationInfo
from pydantic.json_schema import SkipJsonSchema

from wearlab.mesh.stiffness_file import with_stiffness_table
from wearlab.mesh.stiffnesses.prescribed import PrescribedStiffness
from wearlab.options import Part, option

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.mesh import profile
    from wearlab.mesh.stiffness import PairStiffness, PiecewiseCurve


class StiffnessUnits(Part):
    """Units of the columns of a table."""

    phase: Literal["1"] = "1"
    """the phase is a fraction of the mesh period"""
    path_position: str | None = None
    """unit of the path position [the one in the header]"""
    stiffness: str | None = None
    """unit of the stiffness, such as 'N/um' [the one in the header]"""


class TabulatedStiffness(PrescribedStiffness):
    """A stiffness read from a file.

    Its contents, not its path, are part of the scene.
    """

    model_config = ConfigDict(json_schema_extra={"required": ["file"]})

    model: Literal["tabulated"] = "tabulated"
    """stiffness from a file. Source: wearlab"""
    file: str | None = option(None, identity=False)
    """table with columns phase or path_position, and stiffness [required in a campaign
    file]"""
    sheet: str | None = option(None, identity=False)
    """sheet of a workbook [the only one that holds a table]"""
    decimal: Literal[".", ","] | None = option(None, identity=False)
    """decimal sign of the file [found out; refused where it has two meanings]"""
    units: StiffnessUnits | None = option(None, identity=False)
    """units of the columns [those in the headers]"""
    along: SkipJsonSchema[Literal["phase", "path_position"]]
    """what the abscissa is, read from the file"""
    abscissa: SkipJsonSchema[tuple[float, ...]]
    """phase [1] or path position [m], ascending, from the file"""
    stiffness: SkipJsonSchema[tuple[float, ...]]
    """stiffness [N/m], from the file"""

    @classmethod
    def _complete(cls, given: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        return with_stiffness_table(given, (info.context or {}).get("base_directory"))

    def curve(self, pair: "GearPair") -> "PiecewiseCurve":
        """Return the stiffness over phase, or over ``(s − s_A)/p_b`` [N/m].

        Parameters
        ----------
        pair : the gears in their operating position
        """
        from wearlab.mesh.stiffness import PiecewiseCurve

        x = np.asarray(self.abscissa, float)
        if self.along == "path_position":
            x = (x - pair.path.A) / pair.base_pitch
        return PiecewiseCurve(x, np.asarray(self.stiffness, float))

    def jumps(self, pair: "GearPair") -> tuple[float, ...]:
        """Return the phases at which the table has two values."""
        jumps = self.curve(pair).jumps
        return tuple(jumps) if self.of_mesh else tuple(x % 1.0 for x in jumps)

    def build(self, pair: "GearPair", grid: "profile.ProfileGrid") -> "PairStiffness":
        """Return the table's values at the nodes."""
        from wearlab.mesh.stiffness import GivenStiffness

        return GivenStiffness(self.curve(pair), self.of_mesh, grid)
