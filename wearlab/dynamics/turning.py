"""Finding by what a planetary set is turned into itself, see `wearlab.dynamics.symmetry`."""

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.dynamics.symmetry import SAME, Symmetry
from wearlab.dynamics.system import System


def symmetry_of(system: System, angles: Array, lags: Array) -> Symmetry | None:
    """Return what turns a planetary set into itself, over the shortest section; None: nothing does.

    Parameters
    ----------
    system : the one form, coordinates and meshes named as the planetary models name them
    angles : (N,) of the planets, in the order of their numbers; none in a pair [rad]
    lags : (n_mesh,) of the meshes, sun–planet 1 … N, planet–ring 1 … N [1]

    References
    ----------
    Parker & Lin, J. Mech. Des. 126 (2004) 365–370; their phases, here for the whole motion.
    """
    planets = len(angles)
    if planets < 2 or system.fluctuation_direction is not None:
        return None
    later = (np.asarray(lags)[:planets] - lags[0]) % 1.0 * planets
    following = int(((np.asarray(angles) - angles[0]) % (2.0 * np.pi)).argsort()[1])
    for sections in range(planets, 0, -1):
        if planets % sections == 0:
            ahead = following if sections == 1 else int(np.abs(later - planets / sections).argmin())
            mesh = np.concatenate([_next(angles, ahead) + kind * planets for kind in (0, 1)])
            given = Symmetry(sections, turned(system.coordinates, angles, ahead), mesh)
            passed = (np.asarray(lags)[mesh] - lags - 1.0 / sections + 0.5) % 1.0 - 0.5
            if np.abs(passed).max() <= SAME and turns_into_itself(system, given):
                return given
    return None


def _next(angles: Array, ahead: int) -> Index:
    """Return which planet each one comes to stand at when the first comes to stand at planet ``ahead``."""
    by = angles[ahead] - angles[0]
    apart = (np.asarray(angles)[:, None] + by - np.asarray(angles) + np.pi) % (2.0 * np.pi) - np.pi
    return np.asarray(np.abs(apart).argmin(axis=1), np.int64)


def turned(coordinates: tuple[str, ...], angles: Array, ahead: int) -> Array:
    """Return R (n, n), which turns the set by the angle from the first planet to planet ``ahead``.

    Parameters
    ----------
    coordinates : names, ``member.axis`` with axis x, y or u; planets are numbered from 1
    angles : (N,) of the planets [rad]
    ahead : a planet, counted from 0
    """
    index, to = {name: at for at, name in enumerate(coordinates)}, _next(angles, ahead)
    by = angles[ahead] - angles[0]
    turn = np.zeros((len(coordinates), len(coordinates)))
    for name, at in index.items():
        member, _, axis = name.rpartition(".")
        if member.startswith("planet-"):
            member = f"planet-{to[int(member.removeprefix('planet-')) - 1] + 1}"
        if axis == "u":
            turn[index[f"{member}.u"], at] = 1.0
        else:
            along = np.array([np.cos(by), np.sin(by)]) if axis == "x" else np.array([-np.sin(by), np.cos(by)])
            turn[[index[f"{member}.x"], index[f"{member}.y"]], at] = along
    return turn


def turns_into_itself(system: System, symmetry: Symmetry) -> bool:
    """Whether the system, turned, is the same but for the numbers of its meshes."""
    turn, mesh = symmetry.turn, symmetry.mesh
    if len(np.unique(mesh)) < len(mesh):
        return False
    matrices = (system.mass, system.total_stiffness, system.total_damping)
    vectors = (system.load, system.balance)
    of_meshes = (system.direction, system.friction_constant, system.friction_slope)
    values = (system.mesh_damping, system.backlash)
    return (
        all(_same(turn @ matrix, matrix @ turn) for matrix in matrices)
        and all(_same(turn @ vector, vector) for vector in vectors if vector is not None)
        and all(_same(rows @ turn.T, rows[mesh]) for rows in of_meshes if rows is not None)
        and all(_same(value, value[mesh]) for value in values if value is not None)
    )


def _same(first: Array, second: Array) -> bool:
    return bool(np.abs(first - second).max() <= SAME * np.abs(second).max())
