"""Nodes and steps of a scene that stay as they are while its numbers move."""

from dataclasses import replace
from typing import NamedTuple

from wearlab import assembly
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.gears.specification import GearError
from wearlab.gradients.numbers import GradientError
from wearlab.mesh.profile import ExtensionInPitches
from wearlab.scene import Scene

CLOSED = 1e-13
"""Distance of an orbit from closing, over its size, that differences of moved scenes do
not see."""
LOOSEST = 0.5
"""Tolerance of a rougher scene, at most [1]."""
MIN_PROFILE_POINTS = 9
MIN_STEPS = 4


class HeldNumerics(NamedTuple):
    """Nodes and steps of a scene, held while its numbers move.

    Parameters
    ----------
    profile_points : nodes asked for on the path
    steps_per_period : of the dynamics, None without
    reach : how far beyond A and E the nodes of every kind of mesh reach, in base
        pitches
    """

    profile_points: int
    steps_per_period: int | None
    reach: tuple[ExtensionInPitches, ...]

    def built(self, scene: Scene) -> tuple[Scene, assembly.GearModel]:
        """Return a scene with these numerics, and its physics.

        Its orbits close to round-off.

        Parameters
        ----------
        scene : whose nodes and steps are replaced

        Raises
        ------
        GradientError
            When no such gears can exist or run.
        """
        numerics = scene.numerics.model_copy(
            update={
                "profile_points": self.profile_points,
                "steps_per_period": self.steps_per_period,
            }
        )
        scene = scene.with_sections(numerics=numerics)
        try:
            parts = assembly.build(scene, self.reach)
        except GearError as error:
            raise GradientError(f"no such gears: {error}") from error

        vibration = parts.vibration
        if vibration is not None and isinstance(vibration.method, Periodic):
            method = replace(vibration.method, closed=CLOSED)
            vibration = vibration._replace(method=method)
            coupling = replace(parts.coupling, vibration=vibration)
            parts = replace(parts, coupling=coupling)
        return scene, parts

    def rougher(self, scene: Scene, factor: float) -> Scene:
        """Return the scene to a rougher tolerance, with fewer nodes and steps.

        Both are fewer than these by the cube root of the factor. A tolerance alone
        leaves them as they are where the meshes or the motion ask for more than it
        does, and their errors would show in no difference.

        Parameters
        ----------
        scene : whose numerics these are
        factor : of the tolerance [1]
        """
        share = factor ** (-1.0 / 3.0)
        points = round(share * self.profile_points)
        changes: dict[str, float] = {
            "numerics.tolerance": min(LOOSEST, factor * scene.numerics.tolerance),
            "numerics.profile_points": max(MIN_PROFILE_POINTS, points),
        }
        if self.steps_per_period is not None:
            steps = round(share * self.steps_per_period)
            changes["numerics.steps_per_period"] = max(MIN_STEPS, steps)
        return scene.replace(changes)


def held_numerics(scene: Scene) -> HeldNumerics:
    """Return the nodes and steps that a scene is computed on.

    Parameters
    ----------
    scene : which may leave them to its tolerance
    """
    parts = assembly.build(scene)
    steps = scene.numerics.steps_per_period
    if parts.vibration is not None and steps is None:
        steps = len(parts.vibration.sampling.grid.width)

    reach = []
    for kind in parts.kinds:
        grid = kind.analysis.grid
        pitch = kind.pair.base_pitch
        beyond_a = grid.position[0] - grid.contact_position[0]
        beyond_e = grid.contact_position[-1] - grid.position[-1]
        reach.append(
            ExtensionInPitches(float(beyond_a / pitch), float(beyond_e / pitch))
        )
    return HeldNumerics(assembly.mesh.profile_points(scene), steps, tuple(reach))
