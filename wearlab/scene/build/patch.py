"""``wear.contact_patch`` → over which width wear is spread, felt and levelled."""

import numpy as np

from wearlab.mesh.contact import ContactAnalysis
from wearlab.scene import Scene
from wearlab.wear.archard import contact_half_width
from wearlab.wear.law import PreparedLaw, wear_rate
from wearlab.wear.levelling import elastic
from wearlab.wear.patch import OneWay, TwoWay, one_way, patch_force, two_way
from wearlab.wear.path import WearPath


def build_patch(
    scene: Scene, analysis: ContactAnalysis, path: WearPath, law: PreparedLaw | None
) -> OneWay | None:
    """Return the contact patch of one kind of mesh, None where wear is taken point by point."""
    if scene.wear is None or scene.wear.contact_patch == "none":
        return None
    unworn = np.zeros((2, len(analysis.grid.position)))
    static = analysis.force_at_nodes(analysis.quasistatic(analysis.nodes(unworn), analysis.at_nodes).force)
    reference = patch_force(static, analysis.load)
    half_width = contact_half_width(reference, path)
    match scene.wear.contact_patch:
        case "one-way":
            return one_way(half_width, path)
        case "two-way":
            return two_way(half_width, path)
        case _:
            return _elastic(half_width, path, law, static, reference)


def _elastic(
    half_width: np.ndarray, path: WearPath, law: PreparedLaw | None, static: np.ndarray, reference: np.ndarray
) -> TwoWay:
    if law is None:  # nothing wears on: what is worn is felt all the same
        return two_way(half_width, path)
    sliding = wear_rate(law, reference) * path.face_width / reference
    return elastic(half_width, reference, sliding, wear_rate(law, static), path)
