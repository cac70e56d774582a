"""The physics of one kind of mesh: contact, path, wear law and film."""

from collections.abc import Sequence
from typing import NamedTuple

from wearlab.arrays import Array
from wearlab.assembly import sets
from wearlab.assembly.wear_law import build_film, build_law
from wearlab.gears.gear import GearPair
from wearlab.mesh import contact, gear_set
from wearlab.scene import Scene
from wearlab.wear import films
from wearlab.wear.beyond import (
    ContactsBeyond,
    contacts_beyond,
    path_of_contacts_beyond,
)
from wearlab.wear.law import PreparedLaw
from wearlab.wear.path import WearPath, wear_path


class MeshKindModel(NamedTuple):
    """The physics of one kind of mesh; what the scene leaves out is ``None``.

    Parameters
    ----------
    pair : the gears in their operating position
    analysis : contact of the worn flanks
    modification : (2, n) material removed on purpose, (driving, driven) [m]
    path : velocities and radii along the path
    law, film : present parts of the wear law
    beyond : pairs beyond A and E that wear flanks, None: they wear none
    """

    pair: GearPair
    analysis: contact.ContactAnalysis
    modification: Array
    path: WearPath
    law: PreparedLaw | None
    film: films.Film | None
    beyond: ContactsBeyond | None = None


def build_kind(
    scene: Scene,
    gears: gear_set.GearSet,
    kind: gear_set.PairOfSet,
    analysis: contact.ContactAnalysis,
    flank_temperatures: Sequence[float] | None = None,
) -> MeshKindModel:
    """Return the physics of one kind of mesh; a helix flattens flanks.

    The face load factor K_Hβ puts the load on as much less of the face: wear is that of
    its busiest part.

    Parameters
    ----------
    scene, gears : the scene and its gear set
    kind, analysis : the kind of mesh and its contact
    flank_temperatures : of (driving, driven) [K], None: that of the surroundings
    """
    pair = kind.pair
    position = analysis.grid.position
    width = pair.face_width / scene.mesh.of(kind.section).face_load_factor
    path = wear_path(pair, position, kind.speed, kind.passes, width)
    path = path._replace(equivalent_radius=path.equivalent_radius / gears.helix.cosine)
    law = build_law(scene, pair, path, flank_temperatures)
    beyond = None
    if scene.sections.wears_beyond and analysis.grid.is_beyond.any():
        path_beyond = path_of_contacts_beyond(pair, analysis.grid, path)
        law_beyond = build_law(scene, pair, path_beyond, flank_temperatures)
        if law_beyond is not None:
            beyond = contacts_beyond(pair, analysis.grid, law_beyond, path)
    return MeshKindModel(
        pair=pair,
        analysis=analysis,
        modification=sets.modifications(pair, position),
        path=path,
        law=law,
        film=build_film(scene, pair),
        beyond=beyond,
    )
