"""What ISO 6336-1 says of a pair, named as the dataset names it."""

import math
from typing import Any

from wearlab.gears import iso_6336_1 as iso
from wearlab.gears.gear import Gear
from wearlab.scene import Scene
from wearlab.scene.build import Parts
from wearlab.scene.build.face import helix_of

Values = dict[str, Any]


def rated(scene: Scene, parts: Parts) -> Values:
    """Return the stiffnesses and, where a misalignment is known, the face load factors, (n_mesh,) each."""
    if scene.rating is None:
        return {}
    asked, pair, turned = scene.rating, parts.kinds[0].pair, helix_of(scene, parts.gears)
    module, cosine = scene.gears.module, math.cos(turned.angle)
    gears = sorted(pair.gears, key=lambda gear: gear.teeth)
    first, second = (tooth(gear, cosine) for gear in gears)
    dedendum = sum(gear.dedendum for gear in gears) / (2.0 * module)
    rack = iso.Rack(scene.gears.pressure_angle, dedendum, turned.angle)
    E1, E2 = (gear.material.youngs_modulus for gear in gears)
    single = iso.single_stiffness(
        first, second, rack, body_factor=asked.body_factor, modulus=2.0 * E1 * E2 / (E1 + E2)
    )
    mesh = iso.mesh_stiffness(single, pair.contact_ratio)
    values: Values = {
        "iso_theoretical_stiffness": [iso.theoretical_stiffness(first, second, rack)],
        "iso_single_stiffness": [single],
        "iso_mesh_stiffness_alpha": [mesh.alpha],
        "iso_mesh_stiffness_beta": [mesh.beta],
    }
    misaligned = misalignment(scene, parts)
    load = specific_load(scene, parts) * asked.application_factor
    if misaligned is None or load == 0.0:
        return values
    flank = iso.face_load_factor((1.0 - asked.running_in) * misaligned, load, mesh.beta)
    depth = max(abs(gear.tip_radius - gear.root_radius) for gear in gears)
    root = iso.root_load_factor(flank, pair.face_width, depth)
    return {**values, "iso_face_load_factor": [flank], "iso_root_load_factor": [root]}


def tooth(gear: Gear, cosine: float) -> iso.Tooth:
    """Return a gear as the single stiffness knows it; a ring has endless teeth there."""
    return iso.Tooth(math.inf if gear.internal else gear.teeth, gear.profile_shift / cosine)


def misalignment(scene: Scene, parts: Parts) -> float | None:
    """Return F_βx as said, or that of the mesh; None where neither is known [m]."""
    assert scene.rating is not None
    if scene.rating.equivalent_misalignment is not None:
        return scene.rating.equivalent_misalignment
    of_mesh = scene.mesh.misalignment
    if of_mesh is None:
        return None
    pair = parts.kinds[0].pair
    return abs(of_mesh.over_face(pair.working_pressure_angle, scene.operation.torque))


def specific_load(scene: Scene, parts: Parts) -> float:
    """Return F_t/b at the reference circle [N/m]."""
    pair = parts.kinds[0].pair
    ratio = pair.driving.base_radius / pair.driving.reference_radius
    return parts.gears.kinds[0].load * ratio / pair.face_width


def rating_flags(scene: Scene, parts: Parts) -> list[str]:
    """Return where the rating leaves its range, and where its equations come from."""
    if scene.rating is None:
        return []
    told = ["rating: equations of ISO 6336-1 second-hand, checked against printed values of others"]
    load = specific_load(scene, parts) * scene.rating.application_factor
    if load < iso.VALID_LOAD:
        told.append(f"rating: single stiffness of loads from 100 N/mm on, and this is {1e-3 * load:.3g} N/mm")
    if any(gear.internal for gear in parts.kinds[0].pair.gears):
        told.append("rating: a ring is taken as a rack")
    return told
