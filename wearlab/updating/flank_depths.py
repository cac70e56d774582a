"""Depths of wear along the path, from a flank that a machine measured."""

import numpy as np

from wearlab.arrays import Array
from wearlab.assembly import sets
from wearlab.campaign.update_options import DESCRIPTION, Data
from wearlab.gears.specification import GearError
from wearlab.scene import Scene
from wearlab.tables import TableError
from wearlab.tables.measured_flank import ABSCISSAE, read_measured_flank
from wearlab.updating.measurements import UpdateError
from wearlab.updating.removed_material import removed
from wearlab.wear.measured_profile import MeasuredProfile, measured, path_position

MAX_POINTS = 25
"""Points of a curve that count: those beside one another tell the same."""
NODES = 201
"""Places along the path at which the unworn line is looked for."""


def depths_of(data: Data, scene: Scene) -> tuple[Array, Array]:
    """Return places on the path and the depths there, (n,) each [m].

    Parameters
    ----------
    data : the block that describes the flank
    scene : whose gears were measured

    Raises
    ------
    UpdateError : the file cannot be read, or is no flank of these gears
    """
    gears = sets.build_set(scene.in_heaviest_condition)
    if data.flank not in gears.flanks:
        raise UpdateError(
            f"{data.place}.flank: {data.flank!r} is not one of "
            f"{', '.join(gears.flanks)}"
        )
    kind, gear = gears.flank(data.flank)
    pair = gears.kinds[kind].pair

    stated = data.model_dump(include={"sheet", "decimal", "units", *DESCRIPTION})
    options = {key: value for key, value in stated.items() if value not in (None, {})}
    try:
        flank = read_measured_flank({"file": str(data.file), **options})
        if flank.x not in ABSCISSAE or flank.across is not None:
            raise UpdateError(
                f"{data.place}.file: {data.file.name} was measured over the face: "
                "give a profile"
            )
        abscissa = np.array(flank.abscissa)
        depth = np.array(flank.ordinate)
        along = path_position(pair, gear, flank.x, abscissa)  # type: ignore[arg-type]
        begin, end = pair.path.A, pair.path.E
        if flank.y == "deviation":
            on_path = np.clip(along, begin, end)
            depth = -depth - removed(data, scene, gears, (kind, gear), on_path)
        profile = MeasuredProfile(
            flank.x,  # type: ignore[arg-type]
            abscissa,
            depth,
            data.direction == "tooth-thickness",
            data.zero or "as-measured",
            None,
            data.continuation or "refuse",
        )
        inside = np.unique(along[(along >= begin) & (along <= end)])
        chosen = np.linspace(0, len(inside) - 1, min(len(inside), MAX_POINTS))
        place = inside[np.round(chosen).astype(np.intp)]
        nodes = np.union1d(np.linspace(begin, end, NODES), place)
        worn = measured(profile, pair, gear, nodes)
    except (TableError, GearError, OSError) as error:
        raise UpdateError(f"{data.place}: {error}") from None
    if len(place) < 2:
        raise UpdateError(
            f"{data.place}.file: {data.file.name} has no two points on the active "
            "flank: look at its unit"
        )
    return place, worn[np.searchsorted(nodes, place)]
