"""What a dataset says of itself to people and catalogues that know no wearlab: CF and ACDD attributes."""

from datetime import UTC, datetime
from typing import Any

from wearlab.scene import Scene
from wearlab.version import __version__

SUBJECTS = {
    "dynamics": "gear dynamics",
    "wear": "tooth wear",
    "errors": "gear errors",
    "lubricant": "lubricant film",
}
ALWAYS = ("gears", "mesh stiffness", "static transmission error")


def discovery(scene: Scene, begun: float) -> dict[str, str]:
    """Return title, summary, keywords and history of a run, told from its scene alone.

    Parameters
    ----------
    scene : the scene
    begun : start of the run, seconds since the epoch [s]
    """
    kind = _kind(scene)
    present = [subject for name, subject in SUBJECTS.items() if getattr(scene, name, None) is not None]
    about = ", ".join(["contact and mesh stiffness", *present])
    when = datetime.fromtimestamp(begun, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    return {
        "title": f"{kind[0].upper()}{kind[1:]}: {about}",
        "summary": f"One computed run of a gear set ({kind}): {about}. "
        "The attribute 'scene' holds all that was asked for, as JSON in SI units.",
        "keywords": ", ".join([kind, *ALWAYS, *present]),
        "history": f"{when} wearlab {__version__}: computed from its scene",
    }


def _kind(scene: Scene) -> str:
    gears: Any = scene.gears
    return str(getattr(gears, "kind", "gear set")).replace("-", " ")
