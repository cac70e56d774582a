"""Initial wear as it was measured."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import ConfigDict, ValidationInfo
from pydantic.json_schema import SkipJsonSchema

from wearlab.arrays import Array
from wearlab.options import POSITIVE, Count, Length, Part, option
from wearlab.tables import measured_flank
from wearlab.wear.initials import InitialModel

if TYPE_CHECKING:
    from wearlab.gears.gear import GearPair
    from wearlab.gears.helix import SlicedFlank
    from wearlab.wear.measured_profile import MeasuredProfile


class ProfileUnits(Part):
    """Units of the columns of a measured flank."""

    diameter: str | None = None
    """unit of the diameter [that of the header]"""
    roll_angle: str | None = None
    """unit of the roll angle [that of the header]"""
    roll_length: str | None = None
    """unit of the length of roll [that of the header]"""
    path_position: str | None = None
    """unit of the path position [that of the header]"""
    face_position: str | None = None
    """unit of the place on the face [that of the header]"""
    depth: str | None = None
    """unit of the wear depth [that of the header]"""
    deviation: str | None = None
    """unit of the deviation [that of the header]"""


class MeasuredWear(InitialModel):
    """Wear of one gear's flanks as measured.

    The file's contents, not its path, are part of the scene.
    """

    model_config = ConfigDict(json_schema_extra={"required": ["file"]})
    implied_by: ClassVar[frozenset[str]] = frozenset({"file", "ordinate"})

    shape: Literal["measured"] = option("measured", identity=False)
    """as a file says"""
    file: str | None = option(None, identity=False)
    """table with columns diameter, roll_angle, roll_length or path_position, and depth
    or deviation, as machines write it: any separator, decimal sign, encoding and
    preamble (see `wearlab profile`), or a measuring machine's .mka; with face_position,
    from mid-face, a topography, profile after profile, and with that alone a lead
    [required in a campaign file]"""
    sheet: str | None = option(None, identity=False)
    """sheet of a workbook [the only one that holds a table]"""
    decimal: Literal[".", ","] | None = option(None, identity=False)
    """decimal sign of the file [found out; refused where it has two meanings]"""
    x: Literal[
        "diameter", "roll_angle", "roll_length", "path_position", "face_position"
    ] = option(None)
    """column that says where on the flank [the one the file has]"""
    y: Literal["depth", "deviation"] = option(None)
    """column that says how much: wear depth, positive; or the deviation a measuring
    machine prints, −(modifications + wear) [the one the file has]"""
    direction: Literal["normal", "tooth-thickness"] = "normal"
    """direction of the values: along the flank normal, or across the tooth. Source: Y23
    Eq. 19"""
    units: ProfileUnits | None = option(None, identity=False)
    """units of the columns [those in the file's headers]"""
    columns: dict[str, str] | None = option(None, identity=False)
    """headers of the file where they are others, such as { deviation = 'Abweichung' }
    [by their names]"""
    side: Literal["left", "right"] | None = option(None, identity=False)
    """of a measuring machine's file (.mka): which side of the teeth [required there];
    operation.drive_flank says which side carries the load"""
    teeth: Literal["mean"] | Count = option("mean", identity=False)
    """of a measuring machine's file: the mean of all teeth, or the number of one"""
    continuation: Literal["refuse", "hold", "slope", "zero"] = "refuse"
    """beyond what was measured, where that is less than the active flank: refused, the
    last value, the last slope, or unworn. Source: wearlab"""
    zero: Literal["as-measured", "max", "pitch", "tip", "root", "line"] = "as-measured"
    """what counts as unworn: the values as they are; the highest point; the pitch
    point; the tip or root end of the active flank; the line along the path that touches
    the profile on both sides of the pitch point, which takes out a tilt"""
    smooth: Annotated[Length, POSITIVE] | None = None
    """window along the path of a local parabola [through every point]. Source:
    Cleveland 1979"""
    abscissa: SkipJsonSchema[tuple[float, ...]]
    """x in SI, from the file"""
    ordinate: SkipJsonSchema[tuple[float, ...]]
    """y in SI, from the file"""
    across: SkipJsonSchema[tuple[float, ...] | None] = None
    """place on the face in SI, from the file [a profile or a lead]"""

    @classmethod
    def _complete(cls, options: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        return measured_flank.with_measured_flank(
            options, (info.context or {}).get("base_directory")
        )

    def flags(self, flank: str) -> Iterator[str]:
        """Yield what a run must say of it, in words."""
        yield from super().flags(flank)
        if self.file is not None:
            yield f"initial wear of {flank}: as measured in {Path(self.file).name}"
        if self.continuation != "refuse":
            yield (
                f"initial wear of {flank}: beyond what was measured continued by "
                f"{self.continuation!r}"
            )

    @property
    def over_the_face(self) -> bool:
        """Whether it was measured over the face: a lead or a topography."""
        return self.across is not None or self.x == "face_position"

    def at_nodes(self, pair: "GearPair", gear: int, position: Array) -> Array:
        """Return the measured depth less what was taken off on purpose, (n,) [m]."""
        from wearlab.wear.measured_profile import measured

        return measured(self._profile(pair, gear, slice(None)), pair, gear, position)

    def over_face(
        self, pair: "GearPair", gear: int, position: Array, flank: "SlicedFlank"
    ) -> Array:
        """Return the depth at slices less what was taken off, (n_face, n) [m]."""
        from wearlab.wear.measured_profile import nodal, over_face

        if not self.over_the_face:
            return super().over_face(pair, gear, position, flank)
        if self.x == "face_position":
            rising = np.argsort(self.abscissa, kind="stable")
            y = np.asarray(self.abscissa, float)[rising]
            depth = np.asarray(self.ordinate, float)[rising]
            if self.y == "deviation":
                depth = -depth - flank.lead.removed(y, [0.5], flank.width)[:, 0]
            depths = np.repeat(depth[:, None], len(position), axis=1)
        else:
            rows = measured_flank.traces(self.across, len(self.abscissa))
            profiles = [
                self._profile(pair, gear, of_trace, flank, place)
                for place, of_trace in rows.items()
            ]
            y = np.array(list(rows))
            depths = np.stack(
                [nodal(profile, pair, gear, position) for profile in profiles]
            )
        return over_face(
            y, depths, pair.gears[gear].name, flank, (self.zero, self.continuation)
        )

    def _profile(
        self,
        pair: "GearPair",
        gear: int,
        rows: Any,
        flank: "SlicedFlank | None" = None,
        place: float = 0.0,
    ) -> "MeasuredProfile":
        """Return the rows of one profile, of a topography at a place on the face."""
        from wearlab.wear.measured_profile import (
            MeasuredProfile,
            path_position,
            removed_on_purpose,
        )

        abscissa = np.asarray(self.abscissa, float)[rows]
        depth = np.asarray(self.ordinate, float)[rows]
        x: Any = self.x
        if self.y == "deviation":
            where = np.clip(
                path_position(pair, gear, x, abscissa), pair.path.A, pair.path.E
            )
            depth = -depth - removed_on_purpose(pair, gear, where, flank, place)
        across = self.direction == "tooth-thickness"
        return MeasuredProfile(
            x, abscissa, depth, across, self.zero, self.smooth, self.continuation
        )
