"""Planetary systems from tables of numbers by member, as papers print them and tests
change one at a time.
"""

from collections.abc import Mapping
from typing import Any

from wearlab.dynamics.planetary import MemberTorques, assemble, planetary_torsional
from wearlab.dynamics.rigid import MESHES, RigidSet
from wearlab.dynamics.spur import Meshing
from wearlab.dynamics.supports import MemberSupport
from wearlab.dynamics.system import System
from wearlab.mesh.gear_set import Body

Table = Mapping[str, float]
SUPPORTS = (
    "radial_stiffness",
    "tangential_stiffness",
    "radial_damping",
    "tangential_damping",
)
NONE: Table = {}


def rigid_set(
    mass: Table,
    inertia: Table,
    base_radius: Table,
    pin: float,
    alpha: Table,
    angles: Any,
) -> RigidSet:
    """Return the rigid set of these tables."""
    radius = {**base_radius, "carrier": pin}
    bodies = {
        name: Body(mass.get(name, 0.0), inertia[name], radius[name]) for name in inertia
    }
    return RigidSet(bodies, alpha, angles)


def held_by(given: dict[str, Any]) -> dict[str, MemberSupport]:
    """Take the tables of supports out of what is given and return them by member."""
    tables = {name: given.pop(name, NONE) for name in SUPPORTS}
    members = {member: None for table in tables.values() for member in table}
    return {
        member: MemberSupport(
            **{name: table.get(member, 0.0) for name, table in tables.items()}
        )
        for member in members
    }


def meshing_of(given: dict[str, Any]) -> dict[str, Meshing]:
    """Take damping and backlash out of what is given and return them
    by kind of mesh.
    """
    damping = given.pop("mesh_damping", NONE)
    backlash = given.pop("backlash", NONE)
    always = given.pop("damping_always", False)
    return {
        mesh: Meshing(damping.get(mesh, 0.0), always, backlash.get(mesh))
        for mesh in MESHES
    }


def translating(rigid: RigidSet, **given: Any) -> System:
    """Return W23's model."""
    held = held_by(given)
    meshing = meshing_of(given)
    torque = given.pop("torque", NONE)
    balanced = given.pop("balanced", None)
    torques = MemberTorques(torque, balanced, given.pop("carrier_speed", 0.0))
    return assemble(rigid, held, meshing, torques, **given)


def rotating(rigid: RigidSet, sun_torque: float, **given: Any) -> System:
    """Return B23's model."""
    held = held_by(given)
    meshing = meshing_of(given)
    return planetary_torsional(rigid, held, meshing, sun_torque, **given)
