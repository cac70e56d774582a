"""The meshes of a set on its clock, and the friction of their flanks."""

from collections.abc import Sequence
from typing import NamedTuple

from wearlab.arrays import Array
from wearlab.mesh import contact, gear_set, stages
from wearlab.mesh.clock import Friction, Mesh, Sampling, sampling
from wearlab.scene import Scene


class OnClock(NamedTuple):
    """The meshes of a set on its clock.

    Parameters
    ----------
    analyses : contact of every kind of mesh
    meshes : the meshes
    edges : phases between which every mesh is smooth, 0 first and 1 last [1]
    """

    analyses: Sequence[contact.ContactAnalysis]
    meshes: tuple[Mesh, ...]
    edges: Array

    def of_kinds(self, kinds: Sequence[int]) -> "OnClock":
        """Return the meshes of some kinds alone, numbered anew.

        Parameters
        ----------
        kinds : their numbers, among them those of all meshes
        """
        analyses = [self.analyses[kind] for kind in kinds]
        meshes = [mesh._replace(kind=kinds.index(mesh.kind)) for mesh in self.meshes]
        return OnClock(analyses, tuple(meshes), self.edges)

    def sampled(
        self, scene: Scene, gears: gear_set.GearSet, grid: stages.StageGrid
    ) -> Sampling:
        """Return what is read off the meshes at every step."""
        grids = [analysis.grid for analysis in self.analyses]
        return sampling(
            grids, self.meshes, self.edges, grid, build_friction(scene, gears)
        )


def build_friction(scene: Scene, gears: gear_set.GearSet) -> Friction | None:
    """Return the friction of the flanks, None without.

    A mirrored set counts path positions backwards.
    """
    friction = scene.dynamics and scene.dynamics.friction
    return (
        Friction(friction.coefficient, (gears.sense,) * len(gears.kinds))
        if friction
        else None
    )
