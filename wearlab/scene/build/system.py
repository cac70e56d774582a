"""``[dynamics]`` → the system in its one form, by the builder of its model."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.dynamics import planetary
from wearlab.dynamics.balance import balance_of
from wearlab.dynamics.planetary_torsional import planetary_torsional
from wearlab.dynamics.spur import (
    GearSupport,
    PairFriction,
    effective_mass,
    mesh_damping_of,
    spur_3dof,
    torsional,
)
from wearlab.dynamics.system import System
from wearlab.gears.errors import GearError
from wearlab.gears.pair import GearPair
from wearlab.scene import Scene
from wearlab.scene.build.sets import GearSet, train_of

Array = NDArray[np.float64]

NEVER = 1.0
"""A backlash that no motion reaches, where the meshes of the other kind alone have a back flank [m]."""
ANY = 1e8
"""A mesh stiffness, where its size is of no account [N/m]."""
SECTIONS = ("sun_planet", "planet_ring")


def build_system(scene: Scene, gears: GearSet, stiffness: Array) -> System:
    """Return the system of ``dynamics.model``; damping ratios refer to mean stiffnesses (n_mesh,) [N/m]."""
    assert scene.dynamics is not None
    match scene.dynamics.model:
        case "planetary":
            return _planetary(scene, gears, stiffness)
        case "planetary-torsional":
            return _planetary_torsional(scene, gears, stiffness)
        case _:
            return _of_pair(scene, gears.kinds[0].pair, float(stiffness[0]))


def check_held(scene: Scene, gears: GearSet) -> None:
    """Refuse a planetary set of which anything floats: its meshes need no more than to be there.

    Raises
    ------
    GearError
        Naming what floats, or what the rotation of the carrier tears away.
    """
    if scene.dynamics is not None and gears.planetary is not None:
        build_system(scene, gears, np.full(2 * len(gears.planetary.planet_angles), ANY))


def _of_pair(scene: Scene, pair: GearPair, stiffness: float) -> System:
    assert scene.dynamics is not None
    gears = pair.gears
    inertia = (gears[0].inertia, gears[1].inertia)
    base_radius = (gears[0].base_radius, gears[1].base_radius)
    damping = scene.mesh.damping
    if damping is None:
        assert scene.mesh.damping_ratio is not None
        damping = mesh_damping_of(scene.mesh.damping_ratio, stiffness, effective_mass(inertia, base_radius))
    wave = scene.operation.torque_fluctuation
    common: dict[str, Any] = {
        "inertia": inertia,
        "base_radius": base_radius,
        "torque": scene.operation.torque,
        "mesh_damping": damping,
        "damping_always": scene.mesh.damping_in == "always",
        "backlash": scene.mesh.normal_backlash,
        "fluctuation": None if wave is None else wave.amplitude,
        "supports": tuple(
            _support(scene.dynamics.supports.get(gear.name), gear.base_radius) for gear in gears
        ),
        "names": (gears[0].name, gears[1].name),
        "friction": _pair_friction(scene, pair),
    }
    if scene.dynamics.model == "torsional":
        return torsional(**common)
    return spur_3dof(mass=(gears[0].mass, gears[1].mass), **common)


def _support(given: Any, base_radius: float) -> GearSupport:
    if given is None:
        return GearSupport()
    tangential = given.tangential_stiffness
    if given.torsional_stiffness is not None:
        tangential = given.torsional_stiffness / base_radius**2
    torsional_damping = given.torsional_damping
    return GearSupport(
        radial_stiffness=given.radial_stiffness,
        damping=given.damping,
        tangential_stiffness=tangential,
        torsional_damping=None if torsional_damping is None else torsional_damping / base_radius**2,
        damping_ratio=given.damping_ratio,
        preload=given.preload,
    )


def _pair_friction(scene: Scene, pair: GearPair) -> PairFriction | None:
    """Return where friction acts on a pair: arms that grow with s as the flanks' curvatures do."""
    if scene.dynamics is None or scene.dynamics.friction is None:
        return None
    one, two = (curvature[1] - curvature[0] for curvature in pair.curvature(np.array([0.0, 1.0])))
    return PairFriction(pair.working_pressure_angle, (float(one), float(two)))


def _planetary(scene: Scene, gears: GearSet, stiffness: Array) -> System:
    """Return W23's model; a set whose sun is driven is the mirrored set (angles and speeds change sign)."""
    built = gears.planetary
    given: Any = scene.dynamics
    assert built is not None
    mirrored = 1.0 if built.sun_drives else -1.0
    inertia, base_radius = _inertias(scene, gears), _base_radii(gears)
    radius = {**base_radius, "carrier": float(built.carrier.pin_circle_radius or 0.0)}
    mass = {name: gear.mass for name, gear in gears.gears.items()} | {"carrier": built.carrier.mass}
    held = given.supports.given
    tangential = {name: _tangential(one, radius[name]) for name, one in held.items()}
    speeds = train_of(scene).speeds(scene.operation.speed)
    turn = mirrored * np.sign(speeds.sun_relative)
    try:
        system = planetary.assemble(
            mass=mass,
            inertia=inertia,
            base_radius=base_radius,
            pin_circle_radius=radius["carrier"],
            pressure_angle=_pressure_angles(gears),
            planet_angles=mirrored * np.asarray(built.planet_angles),
            radial_stiffness={name: one.radial_stiffness or 0.0 for name, one in held.items()},
            tangential_stiffness=tangential,
            carrier_speed=float(turn * speeds.carrier) if given.rotation else 0.0,
            torque=_torques(scene, gears, grounded={name for name, k in tangential.items() if k > 0.0}),
            radial_damping={
                name: _damping(one.damping, one.damping_ratio, one.radial_stiffness, mass[name])
                for name, one in held.items()
            },
            tangential_damping=_tangential_damping(held, tangential, inertia, radius),
            mesh_damping=_mesh_damping(scene, planetary.effective_masses(inertia, base_radius), stiffness),
            damping_always=scene.mesh.of("sun_planet").damping_in == "always",
            backlash=_backlash(scene),
            friction=given.friction is not None,
            balanced=_balanced(scene, grounded={name for name, k in tangential.items() if k > 0.0}),
        )
    except ValueError as error:
        raise GearError(f"scene.dynamics.supports: {error}") from error
    try:
        balance_of(system, 1.0)
    except ValueError as error:
        raise GearError(f"scene.dynamics.supports: {error}, by a torsional_stiffness of its own") from error
    return system


def _planetary_torsional(scene: Scene, gears: GearSet, stiffness: Array) -> System:
    """Return B23's model of a set whose ring is at rest."""
    built = gears.planetary
    given: Any = scene.dynamics
    assert built is not None
    mirrored = 1.0 if built.sun_drives else -1.0
    inertia, base_radius = _inertias(scene, gears), _base_radii(gears)
    radius = {**base_radius, "carrier": float(built.carrier.pin_circle_radius or 0.0)}
    held = {name: one for name, one in given.supports.given.items() if name != "ring"}
    tangential = {name: _tangential(one, radius[name]) for name, one in held.items()}
    try:
        system = planetary_torsional(
            inertia={name: inertia[name] for name in ("sun", "planet", "carrier")},
            planet_mass=built.planet.mass,
            base_radius=base_radius,
            pin_circle_radius=radius["carrier"],
            pressure_angle=_pressure_angles(gears),
            planet_angles=mirrored * np.asarray(built.planet_angles),
            sun_torque=abs(train_of(scene).torques(scene.operation.torque).sun),
            tangential_stiffness=tangential,
            tangential_damping=_tangential_damping(held, tangential, inertia, radius),
            mesh_damping=_mesh_damping(
                scene, planetary.effective_masses({**inertia, "ring": np.inf}, base_radius), stiffness
            ),
            damping_always=scene.mesh.of("sun_planet").damping_in == "always",
            backlash=_backlash(scene),
            friction=given.friction is not None,
        )
    except ValueError as error:
        raise GearError(f"scene.dynamics.supports: {error}") from error
    if scene.operation.input == "sun" or system.balance is None:
        return system
    carrier = _torques(scene, gears, set())["carrier"] / radius["carrier"]
    return system._replace(
        load=np.where(_of(system, "carrier.u"), carrier, 0.0), balance=_of(system, "sun.u").astype(float)
    )


def _of(system: System, coordinate: str) -> NDArray[np.bool_]:
    """Return which coordinate has a name, (n,)."""
    return np.array([name == coordinate for name in system.coordinates])


def _tangential_damping(
    held: dict[str, Any], tangential: dict[str, float], inertia: dict[str, float], radius: dict[str, float]
) -> dict[str, float]:
    """Return the damping of torsional supports at the members' radii [N s/m]."""
    return {
        name: _damping(
            None if one.torsional_damping is None else one.torsional_damping / radius[name] ** 2,
            one.damping_ratio, tangential[name], inertia[name] / radius[name] ** 2,
        )
        for name, one in held.items()
    }  # fmt: skip


def _inertias(scene: Scene, gears: GearSet) -> dict[str, float]:
    assert gears.planetary is not None
    return {name: gear.inertia for name, gear in gears.gears.items()} | {
        "carrier": gears.planetary.carrier.inertia
    }


def _base_radii(gears: GearSet) -> dict[str, float]:
    return {name: gear.base_radius for name, gear in gears.gears.items()}


def _pressure_angles(gears: GearSet) -> dict[str, float]:
    return {one.section: one.pair.working_pressure_angle for one in gears.kinds}


def _tangential(given: Any, radius: float) -> float:
    """Return the torsional support as a spring at a radius [N/m], 0 without."""
    if given.torsional_stiffness is not None:
        return float(given.torsional_stiffness / radius**2)
    return float(given.tangential_stiffness or 0.0)


def _damping(value: float | None, ratio: float | None, stiffness: float | None, mass: float) -> float:
    """Return a damping that is given, or from its ratio on √(k m) [N s/m]."""
    return (
        float(value) if value is not None else planetary.support_damping(ratio or 0.0, stiffness or 0.0, mass)
    )


def _torques(scene: Scene, gears: GearSet, grounded: set[str]) -> dict[str, float]:
    """Return the torques on the members that are not held, positive where they load drive flanks [N m]."""
    built = gears.planetary
    assert built is not None
    sun = abs(train_of(scene).torques(scene.operation.torque).sun)
    torques = planetary.balanced_torques(
        sun, _base_radii(gears), float(built.carrier.pin_circle_radius or 0.0), _pressure_angles(gears)
    )
    idle = {scene.operation.fixed}
    if load_torque(scene, grounded) == "zero":
        idle.add(scene.operation.output)
    return {member: torque for member, torque in torques.items() if member not in idle}


def load_torque(scene: Scene, grounded: set[str]) -> str:
    """Return whether a torque on the output balances the input, or its support alone does."""
    given = scene.operation.load_torque
    if given is not None:
        return str(given)
    return "zero" if scene.operation.output in grounded else "balance"


def _balanced(scene: Scene, grounded: set[str]) -> str | None:
    """Return the member whose torque is solved for: an output that nothing grounds."""
    if load_torque(scene, grounded) == "zero" or scene.operation.output in grounded:
        return None
    return str(scene.operation.output)


def _mesh_damping(scene: Scene, masses: dict[str, float], stiffness: Array) -> dict[str, float]:
    """Return c of both kinds of mesh, given or 2 ζ √(k̄ m) [N s/m]."""
    half = len(stiffness) // 2
    found = {}
    for section, mean in zip(SECTIONS, (stiffness[0], stiffness[half]), strict=True):
        mesh = scene.mesh.of(section)
        ratio = mesh.damping_ratio or 0.0
        given = mesh.damping
        found[section] = mesh_damping_of(ratio, float(mean), masses[section]) if given is None else given
    return found


def _backlash(scene: Scene) -> dict[str, float] | None:
    """Return the backlash of both kinds of mesh, None where neither has a back flank [m]."""
    given = {section: scene.mesh.of(section).normal_backlash for section in SECTIONS}
    if all(value is None for value in given.values()):
        return None
    return {section: NEVER if value is None else value for section, value in given.items()}
