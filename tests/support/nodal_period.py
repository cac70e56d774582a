"""What a mesh period of unworn pairs comes to by the nodes of their profile alone.

Faces of spur gears are integrated on these nodes.
"""

import numpy as np

from wearlab.assembly import build
from wearlab.mesh.harmonics import harmonics
from wearlab.scene import Scene


def at_nodes(scene: Scene, kind: int) -> dict[str, np.ndarray | float]:
    """Return mean and harmonics of stiffness and error, and the largest error, SI.

    Parameters
    ----------
    scene : of spur gears without a face
    kind : number of the kind of mesh
    """
    model = build(scene)
    analysis = model.kinds[kind].analysis
    _, contact = analysis.unworn
    phase, weight = analysis.grid.phase_nodes

    values: dict[str, np.ndarray | float] = {"ste_max": contact.deflection.max()}
    for name, samples in (("stiffness", contact.tangent), ("ste", contact.deflection)):
        series = harmonics(phase, weight, samples, model.harmonics)
        values[f"{name}_mean"] = series.mean
        values[f"{name}_harmonics"] = series.amplitude
    return values
