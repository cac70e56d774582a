"""Physics arrays become variables of a dataset, by the one table of variables.

What fails is said.

Attributes of a dataset: what it is of, and where it comes from (scene, code, packages,
machine, time).
"""

import platform
import subprocess
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from wearlab import results, schema, sources
from wearlab.scene import Scene, identity
from wearlab.variable import Result
from wearlab.version import __version__
from wearlab.wear.coefficients.calibrated import CalibrationLife


class Refused(ValueError):
    """A scene that cannot be: its gears cannot exist, or cannot run as told."""


Values = dict[str, Any]
"""Variable → its values, in the order of dimensions of the table of variables."""


def diagnosed(
    name: str,
    failures: list[str] | None,
    instead: Any,
    find: Callable[..., Any],
    *of: Any,
) -> Any:
    """Return what a function finds of a run, or what stands for it where it fails.

    Any error counts: hours of life are not lost for a number that describes them.

    Parameters
    ----------
    name : what is found, in words
    failures : gets a line that names what is missing and why; None: the error is raised
    instead : what stands for it after a failure
    find, of : finds it, and of what
    """
    try:
        return find(*of)
    except Exception as error:
        if failures is None:
            raise
        reason = str(error).split("\n")[0] or type(error).__name__
        failures.append(f"not computed: {name}: {reason}")
        return instead


CONVENTIONS = "CF-1.11, ACDD-1.3"


class Labelled(NamedTuple):
    """Variables with dimensions, unit and name, and which of them are coordinates.

    Parts of a dataset: a dataset itself takes twenty times as long to make, and is made
    once.
    """

    variables: Mapping[str, xr.Variable]
    coordinates: frozenset[str]


def labelled(values: Mapping[str, Any], coordinates: Mapping[str, Any]) -> Labelled:
    """Return the values, each with the dimensions, unit and name of the table.

    Parameters
    ----------
    values : name → array in the table's order of dimensions
    coordinates : name → labels of a dimension, or a coordinate variable of the table
    """
    variables = {}
    for name, value in {**values, **coordinates}.items():
        array = np.asarray(value)
        declared = name in schema.VARIABLES
        dims = (
            schema.VARIABLES[name].dims
            if declared or name not in coordinates
            else (name,)
        )
        has_more = array.ndim == len(dims) + 1
        if name in coordinates:  # what all flanks share lies along the profile alone
            dims = dims[-array.ndim :] if array.ndim else (name,)
        elif (
            has_more and name in schema.OVER_FACE
        ):  # flanks with a width have one more, before the profile
            dims = (*dims[:-1], "face", dims[-1])
        elif has_more:  # and what slow errors move, after the updates
            dims = (dims[0], "error_angle", *dims[1:])
        attributes = (
            schema.attributes(name)
            if declared
            else {"long_name": name.replace("_", " ")}
        )
        if not declared and array.dtype.kind in "iuf":
            attributes["units"] = "1"
        variables[name] = xr.Variable(dims, array, attributes)
    return Labelled(variables, frozenset(coordinates))


def parts_of(dataset: xr.Dataset) -> Labelled:
    """Return a dataset's variables."""
    variables = {str(name): variable for name, variable in dataset.variables.items()}
    return Labelled(variables, frozenset(map(str, dataset.coords)))


def joined(*parts: Labelled) -> xr.Dataset:
    """Return the dataset of variables whose shared dimensions have the same labels."""
    variables = {
        name: variable for part in parts for name, variable in part.variables.items()
    }
    coordinates = frozenset[str]().union(*(part.coordinates for part in parts))
    return xr.Dataset(variables).set_coords(
        [name for name in variables if name in coordinates]
    )


def padded(
    arrays: Sequence[np.ndarray], axis: int = 0, fill: float = np.nan
) -> np.ndarray:
    """Stack arrays along a new axis, ``fill`` where one is shorter than another."""
    shapes = np.array([array.shape for array in arrays])
    beyond = shapes.max(axis=0) - shapes
    longer = [
        np.pad(array, [(0, n) for n in missing], constant_values=fill)
        if any(missing)
        else array
        for array, missing in zip(arrays, beyond, strict=True)
    ]
    return np.stack(longer, axis)


def of_states(rows: Sequence[Sequence[Any]]) -> np.ndarray:
    """Return values of every state at every error angle, (n_updates, …).

    Shorter responses are padded with NaN.
    """
    values = padded([np.asarray(value) for row in rows for value in row])
    angles = len(rows[0])
    return (
        values if angles == 1 else values.reshape(len(rows), angles, *values.shape[1:])
    )


def ratio(values: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Return values over a size, NaN where there is none.

    Parameters
    ----------
    values : of any shape
    size : what they are divided by, positive where there is one
    """
    return np.divide(values, size, out=np.full_like(values, np.nan), where=size > 0.0)


def with_results(
    run: xr.Dataset, failures: list[str] | None = None, added: Iterable[str] = ()
) -> xr.Dataset:
    """Return the dataset with what `wearlab.results` finds from its variables.

    Parameters
    ----------
    run : the dataset
    failures : gets a line for each result that fails, which is missing then; None: its
        error is raised
    added : names of the results of plug-ins that the run has besides
    """
    found: dict[str, xr.Variable] = {}  # assigned at once: that takes milliseconds
    for result in (
        *results.RESULTS.values(),
        *(results.OF_PLUGINS[name] for name in added),
    ):
        if not found.keys().isdisjoint(result.needs):
            run = run.assign(found)
            found = {}
        if all(name in run for name in result.needs):
            variable = diagnosed(result.name, failures, None, _variable, result, run)
            if variable is not None:
                found[result.name] = variable
    return run.assign(found) if found else run


BESIDE = ("duty", "stage", "error_angle", "face")
"""Dimensions that a result may have besides those declared: conditions, errors, the
width of flanks."""


def _variable(result: Result, run: xr.Dataset) -> xr.Variable:
    """Return a result as declared.

    What conditions or errors move has their dimension after the first.
    """
    dims = result.variable.dims
    values = result.of(run)
    beside = [dim for dim in values.dims if dim not in dims]
    if not set(dims) <= set(values.dims) or not set(beside) <= set(BESIDE):
        present = ", ".join(map(str, values.dims))
        declared = ", ".join(map(str, dims))
        raise ValueError(f"its dimensions are ({present}), declared are ({declared})")
    if any(
        values.sizes[dim] != run.sizes.get(dim, values.sizes[dim])
        for dim in values.dims
    ):
        raise ValueError(f"its sizes are {dict(values.sizes)}, not those of the run")
    if values.dtype.kind not in "biuf":
        raise ValueError(f"its values are no numbers, but {values.dtype}")
    order = (*dims[:1], *beside, *dims[1:])
    return xr.Variable(
        order,
        np.asarray(values.transpose(*order).values),
        schema.attributes(result.name),
    )


PACKAGES = ("numpy", "scipy", "numba", "xarray", "netCDF4")


def provenance(
    scene: Scene, begun: float, calibration: CalibrationLife | None = None
) -> dict[str, str]:
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
        "source_hash": sources.used_hash(scene.dynamics is not None),
        **_circumstances(),
        "date_created": datetime.fromtimestamp(begun, UTC).isoformat(
            timespec="seconds"
        ),
    }


@cache
def _circumstances() -> dict[str, str]:
    """Return commit of the checkout, whether it was changed, packages and machine.

    An installed copy has no commit: there the hash of its sources tells the code. It
    takes milliseconds.
    """
    top = Path(__file__).resolve().parents[2]
    commit = _git(top, "rev-parse", "HEAD") if (top / ".git").exists() else ""
    changed = commit and _git(
        top, "status", "--porcelain", "--", "wearlab", "pyproject.toml"
    )
    return {
        "commit": commit or "unknown",
        "dirty": ("true" if changed else "false") if commit else "unknown",
        "packages": ", ".join(f"{name} {version(name)}" for name in PACKAGES),
        "machine": f"{platform.machine()} {platform.system()} Python "
        f"{platform.python_version()}",
    }


def _lineage(scene: Scene, calibration: CalibrationLife | None) -> dict[str, str]:
    """Return the runs that calibrate and precede this one, and its first cycle."""
    attributes = {"parents": ""}
    if calibration is not None:
        attributes |= {
            "calibration": calibration.run,
            "calibration_life": repr(calibration.cycles),
        }
    if scene.start is not None:
        attributes |= {
            "parents": scene.start.run or "",
            "replaced_members": ", ".join(scene.start.replace),
        }
    if scene.start is not None and scene.start_wear is not None:
        attributes["parent_cycle"] = repr(scene.start_wear.cycle)
        attributes["parent_interpolation_error"] = f"{scene.start_wear.error:.3g} m"
        attributes["parent_error"] = f"{scene.start_wear.estimate:.3g} m"
    return {key: text for key, text in attributes.items() if text or key == "parents"}


def _git(top: Path, *words: str) -> str:
    try:
        process = subprocess.run(
            ["git", "-C", str(top), *words], capture_output=True, text=True, timeout=10
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return process.stdout.strip() if process.returncode == 0 else ""


SUBJECTS = dict(
    dynamics="gear dynamics",
    wear="tooth wear",
    errors="gear errors",
    lubricant="lubricant film",
)
ALWAYS = ("gears", "mesh stiffness", "static transmission error")


def discovery(scene: Scene, begun: float) -> dict[str, str]:
    """Return title, summary, keywords and history of a run, told from its scene alone.

    Parameters
    ----------
    scene : the scene
    begun : start of the run, seconds since the epoch [s]
    """
    gears: Any = scene.gears
    kind = str(getattr(gears, "kind", "gear set")).replace("-", " ")
    present = [
        subject
        for name, subject in SUBJECTS.items()
        if getattr(scene, name, None) is not None
    ]
    about = ", ".join(["contact and mesh stiffness", *present])
    when = datetime.fromtimestamp(begun, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    return {
        "title": f"{kind[0].upper()}{kind[1:]}: {about}",
        "summary": f"One computed run of a gear set ({kind}): {about}. "
        "The attribute 'scene' holds all that was asked for, as JSON in SI units.",
        "keywords": ", ".join([kind, *ALWAYS, *present]),
        "processing_level": "model output: computed, not measured",
        "product_version": f"model version {identity.MODEL_VERSION}",
        "comment": "The variables 'validity' and 'model_error' say what was assumed "
        "and how far the models "
        "are known to be off.",
        "history": f"{when} wearlab {__version__}: computed from its scene",
    }
