"""Attributes of a dataset: what it is of, and where it comes from (scene, code, packages, machine, time)."""

import platform
import subprocess
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from wearlab.scene import Scene, identity
from wearlab.sources import used_hash
from wearlab.version import __version__
from wearlab.wear.coefficients import CalibrationLife

UNKNOWN = {"commit": "unknown", "dirty": "unknown"}
PACKAGES = ("numpy", "scipy", "numba", "xarray", "netCDF4")


def provenance(scene: Scene, begun: float, calibration: CalibrationLife | None = None) -> dict[str, str]:
    """Return the attributes that tell how a run was made.

    Parameters
    ----------
    scene : the scene
    begun : start of the run, seconds since the epoch [s]
    calibration : the life that calibrated its wear coefficient, None where none did
    """
    return {
        "scene": scene.canonical(),
        "id": scene.id,
        **_lineage(scene, calibration),
        "model_version": str(identity.MODEL_VERSION),
        "source": f"wearlab {__version__}",
        "wearlab_version": __version__,
        "source_hash": used_hash(scene.dynamics is not None),
        **_commit(),
        **_circumstances(),
        "date_created": datetime.fromtimestamp(begun, UTC).isoformat(timespec="seconds"),
    }


@cache
def _circumstances() -> dict[str, str]:
    """Return packages and machine; looking the versions up takes milliseconds."""
    return {
        "packages": ", ".join(f"{name} {version(name)}" for name in PACKAGES),
        "machine": f"{platform.machine()} {platform.system()} Python {platform.python_version()}",
    }


def _lineage(scene: Scene, calibration: CalibrationLife | None) -> dict[str, str]:
    """Return the runs that calibrate and precede this one, from which cycle, and what is known of it."""
    by: dict[str, str] = {}
    if calibration is not None:
        by = {"calibration": calibration.run, "calibration_life": repr(calibration.cycles)}
    if scene.start is None:
        return {"parents": "", **by}
    told = by | {"parents": scene.start.run or "", "replaced_members": ", ".join(scene.start.replace)}
    if scene.start_wear is not None:
        told["parent_cycle"] = repr(scene.start_wear.cycle)
        told["parent_interpolation_error"] = f"{scene.start_wear.error:.3g} m"
        told["parent_error"] = f"{scene.start_wear.estimate:.3g} m"
    return {key: text for key, text in told.items() if text or key == "parents"}


@cache
def _commit() -> dict[str, str]:
    """Return the commit of the checkout this code runs from, and whether it was changed since.

    An installed copy has none: there the hash of its sources tells the code.
    """
    top = Path(__file__).resolve().parents[2]
    if not (top / ".git").exists():
        return UNKNOWN
    commit = _git(top, "rev-parse", "HEAD")
    if not commit:
        return UNKNOWN
    dirty = _git(top, "status", "--porcelain", "--", "wearlab", "pyproject.toml")
    return {"commit": commit, "dirty": "true" if dirty else "false"}


def _git(top: Path, *words: str) -> str:
    try:
        done = subprocess.run(["git", "-C", str(top), *words], capture_output=True, text=True, timeout=10)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""


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
        "processing_level": "model output: computed, not measured",
        "product_version": f"model version {identity.MODEL_VERSION}",
        "comment": "The variables 'validity' and 'model_error' say what was assumed and how far the models "
        "are known to be off.",
        "history": f"{when} wearlab {__version__}: computed from its scene",
    }


def _kind(scene: Scene) -> str:
    gears: Any = scene.gears
    return str(getattr(gears, "kind", "gear set")).replace("-", " ")
