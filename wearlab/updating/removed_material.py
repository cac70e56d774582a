"""What was taken off a flank on purpose, where a profile of it was measured."""

from wearlab import units
from wearlab.arrays import Array
from wearlab.assembly import face
from wearlab.campaign.update_options import Data
from wearlab.mesh.gear_set import GearSet
from wearlab.scene import Scene
from wearlab.updating.measurements import UpdateError
from wearlab.wear.measured_profile import removed_on_purpose


def removed(
    data: Data, scene: Scene, gears: GearSet, of: tuple[int, int], position: Array
) -> Array:
    """Return the material removed on purpose where a profile was measured, (n,) [m].

    Normal to the flank; of gears with a face at the place that the block selects.

    Parameters
    ----------
    data : the block
    scene, gears : whose gears were measured
    of : kind of mesh, and 0 for its driving gear or 1
    position : (n,) on the path [m]
    """
    kind, gear = of
    pair = gears.kinds[kind].pair
    if not scene.face_keys:
        return removed_on_purpose(pair, gear, position)

    place = _face_position(data)
    flank = face.sliced_flank(scene, gears, of, [place])
    return removed_on_purpose(pair, gear, position, flank, place)


def _face_position(data: Data) -> float:
    """Return the place across the face that a block selects [m]."""
    place = f"{data.place}.select.face_position"
    stated = data.select.get("face_position")
    if stated is None:
        raise UpdateError(
            f"{place}: required: where across the face the profile was measured, such "
            'as select = { face_position = "0 mm" } at mid-face'
        )
    try:
        return units.quantity(str(stated), "length")
    except units.UnitError as error:
        raise UpdateError(f"{place}: {error}") from None
