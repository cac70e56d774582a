"""What was taken off a flank on purpose, where a profile of it was measured."""

import numpy as np

from wearlab import units
from wearlab.arrays import Array
from wearlab.assembly import face
from wearlab.campaign.update_options import Data
from wearlab.mesh.gear_set import GearSet
from wearlab.scene import Scene
from wearlab.updating.measurements import UpdateError


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
    of_profile = pair.modification(gear, position)
    if not scene.face_keys:
        return of_profile

    flank = face.sliced_flank(scene, gears, of, [_face_position(data)])
    assert flank is not None
    share = pair.from_root(gear, position)
    lead = flank.lead.removed(flank.position, share, flank.width)[0]
    return np.asarray(of_profile * flank.cosine + lead)


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
