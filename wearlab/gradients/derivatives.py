"""Derivatives of steady state, wear and life with respect to the numbers of a scene."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.dynamics.forces.mesh_forces import extremes
from wearlab.gradients.replayed_life import (
    Ends,
    GradientError,
    LivedSteps,
    Number,
    number,
)
from wearlab.life.coupled import WearState
from wearlab.scene import Scene
from wearlab.simulation import static, vibration

COARSER = (3.0, 10.0)
"""Tolerances of the twins that tell the error of derivatives, over that of the
scene."""
WEIGHT = 4.0
"""Of the largest difference of a twin's derivative: steps chosen anew scatter it, set
on the seed 31."""
NOT_COMPARED = {"phase", "profile"}
"""Dimensions along which twins have other places."""

MOTION, WEAR = "[dynamics]", "a wear law"
Reading = Callable[[assembly.GearModel, WearState], Array]
Names = str | Sequence[str]


class Value(NamedTuple):
    """Something a run says.

    Parameters
    ----------
    dims : its dimensions in each state
    unit : SI
    read : from a state; None: of the life as a whole
    needs : what a scene has to have, `MOTION` or `WEAR`
    """

    dims: tuple[str, ...]
    unit: str
    read: Reading | None
    needs: str = MOTION


def _largest(parts: assembly.GearModel, state: WearState) -> Array:
    return extremes(state.responses[0]).largest


def _dynamic_factor(parts: assembly.GearModel, state: WearState) -> Array:
    static_force = np.array(
        [parts.kinds[mesh.kind].analysis.load for mesh in parts.meshes]
    )
    return np.asarray(_largest(parts, state) / static_force)


def _force(parts: assembly.GearModel, state: WearState) -> Array:
    return vibration.phase_forces(parts, state, state.responses[0]).transpose(1, 0, 2)


def _deflection(parts: assembly.GearModel, state: WearState) -> Array:
    motions = parts.moving.motions(state.responses[0], parts.moving.look(parts.phase))
    return motions.deflection.transpose(1, 0, 2)


def _depth(parts: assembly.GearModel, state: WearState) -> Array:
    return static.by_flank(parts, list(state.wear))


def _rate(parts: assembly.GearModel, state: WearState) -> Array:
    return static.by_flank(parts, list(state.rate))


PHASES = ("mesh", "mesh_period", "phase")
NODES = ("flank", "profile")
VALUES = {
    "life": Value((), "1", None, WEAR),
    "dynamic_factor": Value(("mesh",), "1", _dynamic_factor),
    "mesh_force_max": Value(("mesh",), "N", _largest),
    "mesh_force_min": Value(
        ("mesh",), "N", lambda _, state: extremes(state.responses[0]).least
    ),
    "dynamic_mesh_force": Value(PHASES, "N", _force),
    "mesh_deflection": Value(PHASES, "m", _deflection),
    "wear_depth": Value(NODES, "m", _depth, WEAR),
    "wear_rate": Value(NODES, "m", _rate, WEAR),
    "max_wear_rate": Value(
        ("flank",), "m", lambda *of: np.nanmax(_rate(*of), axis=-1), WEAR
    ),
    "max_wear_depth": Value(
        ("flank",), "m", lambda *of: np.nanmax(_depth(*of), axis=-1), WEAR
    ),
}


def wanted(names: tuple[str, ...], lived: LivedSteps) -> dict[str, Value]:
    """Return the values of some names that a life has.

    Raises
    ------
    GradientError
        For a name that is not known, or nothing the scene has.
    """
    state = lived.ends.states[0]
    for name in names:
        if name not in VALUES:
            raise GradientError(
                f"of: {name!r} has no derivative here; there are {', '.join(VALUES)}"
            )
        needs = VALUES[name].needs
        if not (state.wears if needs == WEAR else state.responses):
            raise GradientError(f"of: {name} needs {needs}")
        if needs != WEAR and len(state.responses) > 1:
            raise GradientError(
                f"of: {name} has a value at every error angle; freeze the slow errors"
            )
        if name == "life" and not lived.reached:
            raise GradientError(
                "of: life needs wear.until.depth, and a life that reaches it"
            )
    return {name: VALUES[name] for name in names}


def read(value: Value, lived: LivedSteps, ends: Ends) -> Array:
    """Return a value in every state, (n_states, …), of the ends of a life.

    The life itself is one number.
    """
    if value.read is None:
        return np.asarray(lived.life_of(ends))
    return np.stack([value.read(ends.parts, state) for state in ends.states])


def gradient(
    scene: Scene | Mapping[str, Any], of: Names, wrt: Names, *, estimate: bool = True
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
    estimate : whether the derivatives get estimated errors, from two twins to rougher
        tolerances, on fewer nodes and steps; they take about as long again

    Returns
    -------
    For each name its values and, as ``d_NAME`` along ``parameter``, its derivatives,
    all in SI; along ``update`` those of the first and the last state, the latter at the
    cycle where the life of the scene ends. Depths and rates are those of nodes, which
    move with the shape of the gears. ``error_estimate_d_NAME`` is what the derivative
    may be off by, not of values along phases or nodes; NaN where a twin has no such
    derivative.

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
    ...     "wear": {"coefficient": {"model": "constant", "value": "1e-18 m^2/N"}, "load": "static",
    ...              "until": {"depth": "1 um", "flank": "pinion"}},
    ... })
    >>> found = wl.gradient(pair, of="life", wrt="wear.coefficient.value", estimate=False)
    >>> round(float(found.d_life[0] * found.parameter_value[0] / found.life), 4)
    -1.0
    """
    given = scene if isinstance(scene, Scene) else Scene.from_mapping(scene)
    keys = _names(wrt, "wrt")
    names = _names(of, "of")
    if given.operation.stages or given.operation.blocks:
        raise GradientError(
            "operation: derivatives are of scenes in one condition, without duty or "
            "stages"
        )
    own = _differences(given, names, keys)
    variables: dict[str, Any] = {}
    for name, value in own.values.items():
        dims = () if value.read is None else ("update", *value.dims)
        variables[name] = (dims, own.here[name], {"units": value.unit})
        said = {
            "units": value.unit,
            "long_name": f"derivative of {name} by the parameter, in SI",
        }
        variables[f"d_{name}"] = (("parameter", *dims), own.rows[name], said)
    compared = tuple(
        name for name, value in own.values.items() if not NOT_COMPARED & set(value.dims)
    )
    for name, error in (
        _errors(given, own, compared) if estimate and compared else {}
    ).items():
        dims, _, said = variables[f"d_{name}"]
        words = f"estimated error of the derivative of {name}, in SI"
        variables[f"error_estimate_d_{name}"] = (
            dims,
            error,
            {**said, "long_name": words},
        )
    coordinates: dict[str, Any] = {"parameter": list(keys)}
    for what in ("value", "unit"):
        coordinates[f"parameter_{what}"] = (
            "parameter",
            [getattr(each, what) for each in own.numbers],
        )
    parts = own.lived.ends.parts
    known = dict[str, Any]()
    known["cycle"] = "update", [0.0, own.lived.cycle][: len(own.lived.ends.states)]
    known |= {
        "mesh": list(parts.gears.mesh_names),
        "phase": parts.phase,
        "flank": list(parts.gears.flanks),
    }
    along = {
        dim
        for value in own.values.values()
        if value.read is not None
        for dim in ("cycle", *value.dims)
    }
    return xr.Dataset(
        variables,
        coordinates | {dim: labels for dim, labels in known.items() if dim in along},
    )


class _Differences(NamedTuple):
    """The numbers of a scene, its life and the values of that, and their derivatives by every number."""

    numbers: list[Number]
    lived: LivedSteps
    values: dict[str, Value]
    here: dict[str, Array]
    rows: dict[str, Array]


def _differences(
    given: Scene, names: tuple[str, ...], keys: tuple[str, ...]
) -> _Differences:
    """Return the derivatives of some values by some numbers, from the accepted steps of one life."""
    numbers = [number(given, key) for key in keys]
    lived = LivedSteps(given)
    values = wanted(names, lived)
    here = {name: read(value, lived, lived.ends) for name, value in values.items()}
    rows: dict[str, list[Array]] = {name: [] for name in values}
    for parameter in numbers:
        there, step = parameter.moved(given, lived.step)
        ends = lived.moved(there)
        for name, value in values.items():
            rows[name].append((read(value, lived, ends) - here[name]) / step)
    return _Differences(
        numbers,
        lived,
        values,
        here,
        {name: np.stack(each) for name, each in rows.items()},
    )


def _errors(
    given: Scene, own: _Differences, names: tuple[str, ...]
) -> dict[str, Array]:
    """Return what derivatives may be off by: the largest difference of those of rougher twins."""
    largest = {name: np.zeros_like(own.rows[name]) for name in names}
    keys = tuple(each.key for each in own.numbers)
    for factor in COARSER:
        try:
            twin = _differences(own.lived.frozen.rougher(given, factor), names, keys)
        except GradientError:
            return {name: np.full_like(own.rows[name], np.nan) for name in names}
        for name in names:
            fits = twin.rows[name].shape == own.rows[name].shape
            apart = np.abs(twin.rows[name] - own.rows[name]) if fits else np.nan
            largest[name] = np.maximum(largest[name], apart)
    return {name: WEIGHT * apart for name, apart in largest.items()}


def _names(given: Names, what: str) -> tuple[str, ...]:
    names = (given,) if isinstance(given, str) else tuple(given)
    if not names:
        raise GradientError(f"{what}: name at least one")
    if len(set(names)) < len(names):
        raise GradientError(f"{what}: names one twice")
    return names
