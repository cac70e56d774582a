"""``[estimates]``: scenes that are drawn, to score the error estimates of their runs against references.

A file with this section writes no scene. ``wearlab accuracy`` scores it, everything else refuses it.
"""

from dataclasses import dataclass

from pydantic import BaseModel, ConfigDict

from wearlab.options import Count, Time, option

SECTION = "estimates"
BESIDE = ("title", "reference", "metadata", SECTION)
"""Keys of such a file."""
ELSEWHERE = (
    f"{SECTION}: the scenes of this file are drawn, none is written: `wearlab accuracy FILE` scores the "
    "error estimates of their runs, nothing else can be done with it"
)
MOST_SCENES = 10_000


class DrawnScenes(BaseModel):
    """Scenes that are drawn, to score the error estimates of their runs; such a file writes no scene."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    scenes: Count = option(..., f"how many scenes are drawn, 1 to {MOST_SCENES}")
    seed: Count = option(..., "seed; the same seed draws the same scenes, more of them begin with the same")
    longest: Time = option(60.0, "processor time after which a run is given up: it counts as missed")
    longest_reference: Time = option(
        120.0, "processor time after which the reference of a run is given up: it counts as missed"
    )


@dataclass(frozen=True)
class Drawing:
    """What a file with ``[estimates]`` asks for.

    Parameters
    ----------
    title : its title
    estimates : scenes, seed and time
    """

    title: str
    estimates: DrawnScenes
