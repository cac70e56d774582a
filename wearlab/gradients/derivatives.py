"""Derivatives of steady state, wear and life with respect to the numbers of a scene."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from wearlab.arrays import Array
from wearlab.gradients.numbers import GradientError, Number, number
from wearlab.gradients.replayed_life import ReplayedLife
from wearlab.gradients.values import Value, read, values_of
from wearlab.scene import Scene

COARSER = (3.0, 10.0)
"""Tolerances of the rougher runs that estimate the error of derivatives, over that of
the scene."""
WEIGHT = 4.0
"""Of the largest difference of a rougher run's derivative: steps chosen anew scatter
it. It was chosen on the seed 31."""
NOT_COMPARED = {"phase", "profile"}
"""Dimensions along which rougher runs have other places."""

Names = str | Sequence[str]


class Differences(NamedTuple):
    """Values of a life, and their derivatives by numbers of its scene.

    Parameters
    ----------
    numbers : of the scene
    life : whose steps were taken again for every number
    values : by their names
    results : of every value, (n_states, …)
    derivatives : of every value, (n_numbers, n_states, …)
    """

    numbers: list[Number]
    life: ReplayedLife
    values: dict[str, Value]
    results: dict[str, Array]
    derivatives: dict[str, Array]


def gradient(
    scene: Scene | Mapping[str, Any],
    of: Names,
    wrt: Names,
    *,
    estimate: bool = True,
) -> xr.Dataset:
    """Return derivatives of what a run says with respect to numbers of its scene.

    The scene runs once. Then for every number its accepted steps over cycles are taken
    again, on the same nodes and stages, with the number moved a little, by 1e-7 of
    itself (1e-6 for planetary sets). Each response starts from the orbit x* at the same
    place, so that ``∂x* = (I − M)⁻¹ ∂P`` is Newton's first step: exact where contact
    does not change. Steps are neither chosen nor rejected anew, so what is
    differentiated is smooth wherever the physics is.

    Parameters
    ----------
    scene : in one condition of operation; or a table as a campaign file writes it
    of : one name or several: life, dynamic_factor, mesh_force_max, mesh_force_min,
        dynamic_mesh_force, mesh_deflection, wear_depth, wear_rate, max_wear_rate,
        max_wear_depth
    wrt : dotted keys, such as ``"gears.pinion.tip_relief.amount"``
    estimate : whether the derivatives get estimated errors, from two runs to rougher
        tolerances, on fewer nodes and steps; they take about as long again

    Returns
    -------
    For each name its values and, as ``d_NAME`` along ``parameter``, its derivatives,
    all in SI; along ``update`` those of the first and the last state, the latter at the
    cycle where the life of the scene ends. Depths and rates are those of nodes, which
    move with the shape of the gears. ``error_estimate_d_NAME`` is what the derivative
    may be off by, not of values along phases or nodes; NaN where a rougher run has no
    such derivative.

    Raises
    ------
    GradientError
        When there is no such number or value, or where no derivative exists: at a jump
        of the response, without a response that repeats.

    Examples
    --------
    Archard's depth is proportional to k, so that a life falls as 1/k:

    >>> import wearlab as wl
    >>> pair = wl.Scene.from_mapping({
    ...     "gears": {"kind": "external-pair", "module": "3 mm", "face_width": "20 mm",
    ...               "pinion": {"teeth": 25}, "gear": {"teeth": 30}},
    ...     "operation": {"torque": "100 N*m", "speed": "1100 rpm"},
    ...     "wear": {
    ...         "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
    ...         "load": "static",
    ...         "until": {"depth": "1 um", "flank": "pinion"},
    ...     },
    ... })
    >>> wrt = "wear.coefficient.value"
    >>> result = wl.gradient(pair, of="life", wrt=wrt, estimate=False)
    >>> round(float(result.d_life[0] * result.parameter_value[0] / result.life), 4)
    -1.0
    """
    if not isinstance(scene, Scene):
        scene = Scene.from_mapping(scene)
    keys = _unique_names(wrt, "wrt")
    names = _unique_names(of, "of")
    if scene.operation.stages or scene.operation.blocks:
        raise GradientError(
            "operation: derivatives are of scenes in one condition, without duty or "
            "stages"
        )

    differences = _differences(scene, names, keys)
    compared = tuple(
        name
        for name, value in differences.values.items()
        if not NOT_COMPARED & set(value.dims)
    )
    errors: dict[str, Array] = {}
    if estimate and compared:
        errors = _estimated_errors(scene, differences, compared)
    return _dataset(differences, errors)


def _unique_names(names: Names, option: str) -> tuple[str, ...]:
    """Return names as a tuple, refused where there are none or one comes twice."""
    result = (names,) if isinstance(names, str) else tuple(names)
    if not result:
        raise GradientError(f"{option}: name at least one")
    if len(set(result)) < len(result):
        raise GradientError(f"{option}: names one twice")
    return result


def _differences(
    scene: Scene, names: tuple[str, ...], keys: tuple[str, ...]
) -> Differences:
    """Return derivatives of values by numbers, from the accepted steps of a life."""
    numbers = [number(scene, key) for key in keys]
    life = ReplayedLife(scene)
    values = values_of(names, life)
    results = {name: read(value, life, life.ends) for name, value in values.items()}

    rows: dict[str, list[Array]] = {name: [] for name in values}
    for parameter in numbers:
        moved_scene, step = parameter.moved(scene, life.step)
        ends = life.moved(moved_scene)
        for name, value in values.items():
            change = read(value, life, ends) - results[name]
            rows[name].append(change / step)
    derivatives = {name: np.stack(of_numbers) for name, of_numbers in rows.items()}
    return Differences(numbers, life, values, results, derivatives)


def _estimated_errors(
    scene: Scene, differences: Differences, names: tuple[str, ...]
) -> dict[str, Array]:
    """Return what derivatives may be off by, from those of rougher runs.

    NaN where a rougher run has no derivative.
    """
    derivatives = {name: differences.derivatives[name] for name in names}
    largest = {name: np.zeros_like(values) for name, values in derivatives.items()}
    keys = tuple(parameter.key for parameter in differences.numbers)
    numerics = differences.life.numerics
    for factor in COARSER:
        try:
            rougher = _differences(numerics.rougher(scene, factor), names, keys)
        except GradientError:
            return {
                name: np.full_like(values, np.nan)
                for name, values in derivatives.items()
            }
        for name, values in derivatives.items():
            rougher_values = rougher.derivatives[name]
            difference: Array | float = np.nan
            if rougher_values.shape == values.shape:
                difference = np.abs(rougher_values - values)
            largest[name] = np.maximum(largest[name], difference)
    return {name: WEIGHT * difference for name, difference in largest.items()}


def _dataset(differences: Differences, errors: dict[str, Array]) -> xr.Dataset:
    """Return values, derivatives and their estimated errors as a labelled dataset."""
    variables: dict[str, Any] = {}
    for name, value in differences.values.items():
        dims = () if value.read is None else ("update", *value.dims)
        variables[name] = (dims, differences.results[name], {"units": value.unit})
        attributes = {
            "units": value.unit,
            "long_name": f"derivative of {name} by the parameter, in SI",
        }
        derivative_dims = ("parameter", *dims)
        derivative = differences.derivatives[name]
        variables[f"d_{name}"] = (derivative_dims, derivative, attributes)

    for name, error in errors.items():
        derivative_dims, _, attributes = variables[f"d_{name}"]
        long_name = f"estimated error of the derivative of {name}, in SI"
        attributes = {**attributes, "long_name": long_name}
        variables[f"error_estimate_d_{name}"] = (derivative_dims, error, attributes)
    return xr.Dataset(variables, _coordinates(differences))


def _coordinates(differences: Differences) -> dict[str, Any]:
    """Return the parameters, and the coordinates of the dimensions of the values."""
    numbers = differences.numbers
    life = differences.life
    parts = life.ends.parts
    known_labels: dict[str, Any] = {
        "cycle": ("update", [0.0, life.cycle][: len(life.ends.states)]),
        "mesh": list(parts.gears.mesh_names),
        "phase": parts.phase,
        "flank": list(parts.gears.flanks),
    }
    dims = {
        dim
        for value in differences.values.values()
        if value.read is not None
        for dim in ("cycle", *value.dims)
    }
    return {
        "parameter": [parameter.key for parameter in numbers],
        "parameter_value": ("parameter", [parameter.value for parameter in numbers]),
        "parameter_unit": ("parameter", [parameter.unit for parameter in numbers]),
        **{dim: labels for dim, labels in known_labels.items() if dim in dims},
    }
