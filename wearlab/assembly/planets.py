"""Planets that differ: whether they do, and how they are joined."""

from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.assembly import errors
from wearlab.dynamics.system import System
from wearlab.life.planets import PlanetsApart, StaticBalance
from wearlab.mesh import clock, gear_set
from wearlab.scene import Scene


def planets_differ(scene: Scene, gears: gear_set.GearSet) -> bool:
    """Return whether planets of a set wear each in its own way.

    Those with errors of their own do, or with pins that are off, those of one drawn
    angle of any errors, and those that begin with other wear. Flanks with a width have
    planets alike.

    Parameters
    ----------
    scene, gears : the scene and its gear set
    """
    if len(gears.angles) < 2 or scene.wear is None or scene.face_keys:
        return False
    if begin_differently(scene, gears):
        return True
    return scene.wear.coefficient is not None and errors.differ(scene, gears)


def begin_differently(scene: Scene, gears: gear_set.GearSet) -> bool:
    """Return whether planets begin with wear of their own.

    Parameters
    ----------
    scene, gears : the scene and its gear set
    """
    start = scene.start_wear
    if start is not None and start.planet_depth:
        return True
    flanks = [scene.initial_of(name) for name in gears.flanks]
    return any(getattr(flank, "planet", None) is not None for flank in flanks)


def planets_apart(
    scene: Scene,
    gears: gear_set.GearSet,
    meshes: tuple[clock.Mesh, ...],
    system: System | None,
) -> PlanetsApart:
    """Return what the kinds of mesh of planets apart have to do with one another.

    Parameters
    ----------
    scene, gears : the scene, and its set with planets apart
    meshes : on their clock
    system : in motion; None: pins and bearings are rigid, and the sun floats in no
        plane
    """
    met_by_all = [
        tuple(gears.places_of(name))
        for name in gears.flanks
        if not name.startswith("planet")
    ]
    at_angles = errors.at_angles(scene, gears, meshes)
    balance = (
        _on_rigid_pins(gears, at_angles)
        if system is None
        else _on_supports(system, at_angles)
    )
    return PlanetsApart(tuple(met_by_all), balance)


def _on_supports(system: System, errors_at_angles: Array) -> StaticBalance:
    """Return the balance of a set whose members are held as the dynamics say."""
    return StaticBalance(
        stiffness=system.total_stiffness,
        direction=system.direction,
        load=system.load,
        held=system.balance,
        errors=errors_at_angles,
    )


def _on_rigid_pins(gears: gear_set.GearSet, errors_at_angles: Array) -> StaticBalance:
    """Return the balance of a set in which the sun and the planets turn alone.

    ``δ_sn = u_s + u_n − e_sn``, ``δ_rn = −u_n − e_rn``: two meshes in series a planet.
    """
    planets = len(gears.angles)
    direction: Any = np.zeros((2 * planets, 1 + planets))
    direction[:planets, 0] = 1.0
    direction[:planets, 1:] = np.eye(planets)
    direction[planets:, 1:] = -np.eye(planets)
    load = np.zeros(1 + planets)
    load[0] = sum(kind.load for kind in gears.kinds[:planets])
    no_support = np.zeros((1 + planets, 1 + planets))
    return StaticBalance(no_support, direction, load, None, errors_at_angles)
