"""What ISO 6336-1 and -2 say of a pair, named as the dataset names it."""

import math
from typing import Any

from wearlab.assembly import GearModel
from wearlab.gears import helix, iso
from wearlab.scene import Scene, sections

MAX_CONTACT_RATIO = 2.0
"""ε_α from which there is no point of single contact."""


def rated(scene: Scene, parts: GearModel) -> dict[str, Any]:
    """Return what ISO 6336 says of stiffness, load over the face and pitting.

    Parameters
    ----------
    scene : the scene
    parts : its physics

    Returns
    -------
    Variable → values of the mesh (1,) or of the flanks (n_flank,); face load factors
    where a misalignment is known, the safety where a limit is given.
    """
    if scene.rating is None:
        return {}
    rating = scene.rating
    pair = parts.kinds[0].pair
    values, mesh_stiffness = _stiffness_values(scene, parts)

    misaligned = rating.equivalent_misalignment
    of_mesh = scene.mesh.misalignment
    if misaligned is None and of_mesh is not None:
        torque = scene.operation.torque
        misaligned = abs(of_mesh.over_face(pair.working_pressure_angle, torque))
    load = specific_load(parts) * rating.application_factor
    if misaligned is None or load == 0.0:
        return values

    remaining = (1.0 - rating.running_in) * misaligned
    flank = iso.face_load_factor(remaining, load, mesh_stiffness)
    depth = max(abs(gear.tip_radius - gear.root_radius) for gear in pair.gears)
    root = iso.root_load_factor(flank, pair.face_width, depth)
    values["iso_face_load_factor"] = [flank]
    values["iso_root_load_factor"] = [root]
    return values | _pitting(rating, scene, parts, flank)


def _stiffness_values(scene: Scene, parts: GearModel) -> tuple[dict[str, Any], float]:
    """Return the stiffnesses of a pair, and c_γβ among them [N/(m m)]."""
    rating = scene.rating
    assert rating is not None
    pair = parts.kinds[0].pair
    turned = parts.gears.helix
    cosine = math.cos(turned.angle)
    gears = sorted(pair.gears, key=lambda gear: gear.teeth)
    first, second = (  # a ring has endless teeth there
        iso.Tooth(
            math.inf if gear.internal else gear.teeth, gear.profile_shift / cosine
        )
        for gear in gears
    )
    dedendum = sum(gear.dedendum for gear in gears) / (2.0 * scene.gears.module)
    rack = iso.Rack(scene.gears.pressure_angle, dedendum, turned.angle)
    modulus = 2.0 / sum(1.0 / gear.material.youngs_modulus for gear in gears)
    single = iso.single_stiffness(
        first, second, rack, body_factor=rating.body_factor, modulus=modulus
    )
    mesh = iso.mesh_stiffness(single, pair.contact_ratio)
    values: dict[str, Any] = {
        "iso_theoretical_stiffness": [iso.theoretical_stiffness(first, second, rack)],
        "iso_single_stiffness": [single],
        "iso_mesh_stiffness_alpha": [mesh.alpha],
        "iso_mesh_stiffness_beta": [mesh.beta],
    }
    return values, mesh.beta


def _pitting(
    rating: sections.Rating, scene: Scene, parts: GearModel, face_load_factor: float
) -> dict[str, Any]:
    """Return contact stresses and, where a limit is given, safety against pitting."""
    turned = parts.gears.helix
    pair = parts.gears.kinds[0].pair
    if pair.contact_ratio >= MAX_CONTACT_RATIO:
        return {}
    overlap = helix.overlap_ratio(pair.face_width, turned.angle, scene.gears.module)
    nominal = iso.nominal_stress(
        pair, turned, overlap, specific_load(parts) * pair.face_width
    )
    load = rating.application_factor * face_load_factor * rating.transverse_load_factor
    stress = [
        factor * nominal * math.sqrt(load)
        for factor in iso.single_contact_factors(pair, overlap)
    ]
    order = [gear for _, gear in parts.gears.flank_places]
    values: dict[str, Any] = {"iso_nominal_contact_stress": [nominal]}
    values["iso_contact_stress"] = [stress[gear] for gear in order]
    strength = _pitting_strength(rating, scene, parts)
    if strength is not None:
        safety = [strength[gear] / stress[gear] for gear in order]
        values["iso_pitting_safety"] = safety
    return values


def _pitting_strength(
    rating: sections.Rating, scene: Scene, parts: GearModel
) -> list[float] | None:
    """Return the contact stress that each gear bears [Pa], None without all values."""
    kind = parts.gears.kinds[0]
    pair = kind.pair
    limit = rating.allowable_contact_stress
    viscosity = rating.viscosity_40
    hours = rating.hours
    if limit is None or viscosity is None or hours is None:
        return None
    roughness = [getattr(scene.gears, gear.name).roughness_ra for gear in pair.gears]
    mean = sum(roughness) / 2.0
    speed = kind.speed * pair.driving.reference_radius
    curvature = float(pair.equivalent_curvature(0.0))
    # R_z is six times R_a, as ISO 6336-2 converts them
    film = iso.film_factors(limit, viscosity, speed, 6.0 * mean, curvature)
    turns = 3600.0 * hours * kind.speed / (2.0 * math.pi)
    lives = [iso.life_factor(cycles) for cycles in (turns, turns * pair.ratio)]
    return [limit * life * math.prod(film) for life in lives]


def specific_load(parts: GearModel) -> float:
    """Return F_t/b at the reference circle [N/m]."""
    pair = parts.kinds[0].pair
    ratio = pair.driving.base_radius / pair.driving.reference_radius
    return parts.gears.kinds[0].load * ratio / pair.face_width


def rating_flags(scene: Scene, parts: GearModel) -> list[str]:
    """Return where the rating leaves its range, and where its equations come from."""
    if scene.rating is None:
        return []
    flags = [
        "rating: equations of ISO 6336-1 second-hand, checked against printed values "
        "of others"
    ]
    load = specific_load(parts) * scene.rating.application_factor
    if load < iso.VALID_LOAD:
        flags.append(
            "rating: single stiffness of loads from 100 N/mm on, and this is "
            f"{1e-3 * load:.3g} N/mm"
        )
    pair = parts.kinds[0].pair
    if any(gear.internal for gear in pair.gears):
        flags.append("rating: a ring is taken as a rack")
    if pair.contact_ratio >= MAX_CONTACT_RATIO:
        flags.append(
            "rating: no contact stress, since two pairs and more touch always (ε_α of "
            "2 and more)"
        )
    elif scene.rating.allowable_contact_stress is not None:
        flags.append(
            "rating: safety against pitting by ISO 6336-2:2006, second-hand, checked "
            "against printed values; of hardened steel, no pitting allowed, Z_W = Z_X "
            "= 1, R_z = 6 R_a, K_A K_v = application_factor"
        )
    return flags
