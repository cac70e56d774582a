"""A gear's compliance is computed once: kept in the process, and on disk beside the compiled code."""

import hashlib
import os
import tempfile
from dataclasses import replace
from functools import cache, lru_cache
from pathlib import Path
from zipfile import BadZipFile

import numba
import numpy as np

from wearlab import gears
from wearlab.gears.gear import Gear
from wearlab.mesh.finite_element.gear_compliance import GearCompliance, solve_gear
from wearlab.mesh.finite_element.options import Options

KEPT_IN_PROCESS = 64
UNIT_MODULUS = 1e11
"""Young's modulus at which shapes are computed: compliance is proportional to its reciprocal [Pa]."""


def gear_compliance(gear: Gear, options: Options) -> GearCompliance:
    """Return the compliance of an unworn gear, from memory or disk when the same shape was solved before.

    Parameters
    ----------
    gear : the gear; its name, face width, Young's modulus, mass and modifications do not matter
    options : of mesh and load
    """
    shape = replace(gear, name="", face_width=1.0, mass=0.0, inertia=0.0, assumed=(), modification=None)
    modulus = gear.material.youngs_modulus
    unit = gear.material._replace(youngs_modulus=UNIT_MODULUS, density=1.0)
    compliance = _remembered(replace(shape, material=unit), options)
    softer = UNIT_MODULUS / modulus
    return GearCompliance(compliance.parameter, softer * compliance.own, softer * compliance.across)


@lru_cache(KEPT_IN_PROCESS)
def _remembered(shape: Gear, options: Options) -> GearCompliance:
    file = _folder() / f"{_key(shape, options)}.npz"
    compliance = _read(file)
    if compliance is None:
        compliance = solve_gear(shape, options)
        _write(file, compliance)
    return compliance


def _folder() -> Path:
    """Return the folder of this build's results: it goes when the build's compiled code goes."""
    return Path(numba.config.CACHE_DIR) / "finite-element"  # type: ignore[attr-defined]


def _key(shape: Gear, options: Options) -> str:
    return hashlib.sha256(f"{_sources()} {shape!r} {options!r}".encode()).hexdigest()[:32]


@cache
def _sources() -> str:
    """Return the hash of what decides the numbers: this room and the shapes of gears."""
    folders = (Path(__file__).parent, Path(gears.__file__).parent)
    digest = hashlib.sha256()
    for file in (file for folder in folders for file in sorted(folder.glob("*.py"))):
        digest.update(file.read_bytes())
    return digest.hexdigest()


def _read(file: Path) -> GearCompliance | None:
    try:
        with file.open("rb") as stream, np.load(stream) as stored:
            return GearCompliance(stored["parameter"], stored["own"], stored["across"])
    except (OSError, ValueError, KeyError, EOFError, BadZipFile):
        return None  # not there, or not whole: compute it


def _write(file: Path, compliance: GearCompliance) -> None:
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=file.parent, suffix=".part")
        with os.fdopen(handle, "wb") as stream:
            np.savez(stream, parameter=compliance.parameter, own=compliance.own, across=compliance.across)
        os.replace(temporary, file)
    except OSError:
        pass  # an unwritable folder: computed again next time
