"""Which scenes one stored run serves for every wear coefficient, and which not.

Archard's law is linear in k, and under constant conditions nothing else knows how long a cycle takes in wear,

    h(N; f k0) = h(f N; k0),

under static and under instant loads, with a film or a regression whose k depends on the load, with loads of a
duty mixed within each cycle. It ends where something happens at a given cycle: stages of operation.
"""

from collections.abc import Mapping
from typing import Any

from wearlab.updating.errors import UpdateError


def refuse_what_does_not_scale(scene: Mapping[str, Any]) -> None:
    """Refuse a scene in which something happens at a given cycle, so that wear is no function of k·N.

    Raises
    ------
    UpdateError : it has stages of operation
    """
    if scene.get("operation", {}).get("stage"):
        raise UpdateError(
            "operation.stage: stages begin at given cycles, so that the wear is no function of k·N and one "
            "run does not serve every k; update a campaign with operation.duty, mixed within each cycle"
        )
