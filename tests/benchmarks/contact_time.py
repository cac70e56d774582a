"""How long one contact analysis takes: TVMS, static transmission error and load sharing
of a worn pair.

``python tests/benchmarks/contact_time.py FILE`` prints it for the first case of a
campaign file.
"""

import sys
from typing import NamedTuple

import numpy as np

from wearlab.accuracy.ladder import timing
from wearlab.assembly import build
from wearlab.scene import Scene
from wearlab.wear.initials.quadratic import quadratic

PHASES, NODES = 256, 201
DEPTH = 5e-6
TARGET = 0.3e-3


class ContactTime(NamedTuple):
    """Wall times of one contact analysis.

    Parameters
    ----------
    phases, nodes : where the mesh is evaluated, nodes on the path
    compliance : teeth, bodies and contact at every node [s]
    sharing : stiffness, transmission error and load sharing at every phase [s]
    """

    phases: int
    nodes: int
    compliance: float
    sharing: float

    @property
    def total(self) -> float:
        """Both [s]."""
        return self.compliance + self.sharing


def contact_time(scene: Scene) -> ContactTime:
    """Measure the contact analysis of a scene whose flanks are both
    worn by 5 µm, quadratically.
    """
    for key, value in (
        ("numerics.profile_points", NODES),
        ("numerics.phase_points", PHASES),
    ):
        scene = scene.replace(key, value)
    parts = build(scene)
    analysis = parts.kinds[0].analysis
    where = parts.locate(0, parts.phase)
    worn = np.stack([quadratic(analysis.grid.position, DEPTH)] * 2)
    nodes = analysis.nodes(worn)
    return ContactTime(
        len(parts.phase),
        len(analysis.grid.position),
        timing(lambda: analysis.nodes(worn), max_repetitions=200),
        timing(lambda: analysis.quasistatic(nodes, where), max_repetitions=200),
    )


def contact_text(time: ContactTime) -> str:
    """Return the measurement in a sentence."""
    return (
        f"contact analysis: {1e3 * time.total:.3f} ms "
        f"(compliance {1e3 * time.compliance:.3f}, sharing {1e3 * time.sharing:.3f}) "
        f"for {time.phases} phases and {time.nodes} nodes; the target is "
        f"{1e3 * TARGET:.1f} ms"
    )


def main(arguments: list[str]) -> None:
    """Print the time for the first case of a campaign file."""
    from wearlab.campaign import load

    if not arguments:
        print("usage: python tests/benchmarks/contact_time.py FILE", file=sys.stderr)
        sys.exit(2)
    print(contact_text(contact_time(load(arguments[0]).cases[0].scene)))


if __name__ == "__main__":
    main(sys.argv[1:])
