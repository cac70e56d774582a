"""What ISO 6336-1, -2 and -6 say of a pair, named as the dataset names it.

What one condition of operation says is along ``duty`` or ``stage`` where there are
several; the safety is that of the whole spectrum.
"""

import math
from typing import Any, NamedTuple

from wearlab.assembly import GearModel, sets
from wearlab.gears import helix, iso
from wearlab.mesh.gear_set import GearSet
from wearlab.scene import Scene

MAX_CONTACT_RATIO = 2.0
"""ε_α from which there is no point of single contact."""


class RatedCondition(NamedTuple):
    """A condition of operation, and how long it acts.

    Parameters
    ----------
    scene : in that condition alone
    gears : its gear set
    hours : operating time in it [h]
    """

    scene: Scene
    gears: GearSet
    hours: float


def condition_rating(model: GearModel) -> dict[str, Any]:
    """Return what ISO 6336 says of stiffness, load over the face and contact stress.

    Parameters
    ----------
    model : the physics in one condition of operation

    Returns
    -------
    Variable → values of the mesh (1,) or of the flanks (n_flank,); face load factors
    and stresses where a misalignment is known.
    """
    scene = model.scene
    if scene.rating is None:
        return {}
    values, mesh_stiffness = _stiffness_values(scene, model.gears)
    factor = _face_load_factor(scene, model.gears, mesh_stiffness)
    if factor is None:
        return values

    pair = model.gears.kinds[0].pair
    depth = max(abs(gear.tip_radius - gear.root_radius) for gear in pair.gears)
    root = iso.root_load_factor(factor, pair.face_width, depth)
    values["iso_face_load_factor"] = [factor]
    values["iso_root_load_factor"] = [root]
    if pair.contact_ratio < MAX_CONTACT_RATIO:
        nominal, stress = _contact_stress(scene, model.gears, factor)
        values["iso_nominal_contact_stress"] = [nominal]
        values["iso_contact_stress"] = [
            stress[gear] if model.gears.is_loaded(kind) else math.nan
            for kind, gear in model.gears.flank_places
        ]
    return values


def spectrum_rating(scene: Scene) -> dict[str, Any]:
    """Return the safety against pitting under all conditions of operation together.

    Of one condition it is the permissible stress over the stress; of several that by
    which all stresses may grow until the Palmgren-Miner sum is 1. The equivalent torque
    acts in all loaded cycles, with the factors of the heaviest condition, and has the
    same safety. Where the last of several stages has no end, nothing says how long each
    lasts: the safety is then that of all hours in the worst stage.

    Parameters
    ----------
    scene : the scene with all its conditions

    Returns
    -------
    Variable → values of the flanks (n_flank,), {} without limit or misalignment.

    References
    ----------
    ISO 6336-6: Palmgren-Miner sum over the bins, equivalent torque.
    """
    rated = _rated_conditions(scene)
    if not rated:
        return {}
    values: dict[str, list[float]] = {}
    for kind in range(len(rated[0].gears.kinds)):
        on_flanks = [
            condition for condition in rated if condition.gears.is_loaded(kind)
        ]
        unloaded = [math.nan, math.nan]
        of_flanks = {
            "iso_pitting_safety": unloaded,
            "iso_equivalent_torque": unloaded,
        }
        if on_flanks:
            of_flanks = _rating_of_flanks(scene, on_flanks)
        for name, of_gears in of_flanks.items():
            values.setdefault(name, []).extend(
                of_gears[gear]
                for of_kind, gear in rated[0].gears.flank_places
                if of_kind == kind
            )
    return values


def _rating_of_flanks(
    scene: Scene, conditions: list[RatedCondition]
) -> dict[str, list[float]]:
    """Return the safeties of (driving, driven) in the conditions that load them."""
    order = (0, 1)
    pair = conditions[0].gears.kinds[0].pair
    passes = (1.0, pair.ratio)
    stresses = [_stress_of(condition) for condition in conditions]
    turns = [
        3600.0 * condition.hours * condition.gears.kinds[0].speed / (2.0 * math.pi)
        for condition in conditions
    ]
    of_gears = [
        [turned * passes[gear] for turned in turns] for gear in range(len(passes))
    ]
    if not scene.operation.several or not lasts_are_known(scene):
        safety = [
            min(
                _permissible_stress(condition, cycles) / stress[gear]
                for condition, cycles, stress in zip(
                    conditions, of_gears[gear], stresses, strict=True
                )
            )
            for gear in order
        ]
        return {"iso_pitting_safety": safety}

    used = [
        [stress / _permissible_stress(condition) for stress in of_condition]
        for condition, of_condition in zip(conditions, stresses, strict=True)
    ]
    safety = [
        iso.spectrum_safety(
            of_gears[gear], [of_condition[gear] for of_condition in used]
        )
        for gear in order
    ]
    return {
        "iso_pitting_safety": safety,
        "iso_equivalent_torque": [
            _equivalent_torque(conditions, of_gears[gear], used, gear, margin)
            for gear, margin in zip(order, safety, strict=True)
        ],
    }


def _equivalent_torque(
    conditions: list[RatedCondition],
    cycles: list[float],
    used: list[list[float]],
    gear: int,
    safety: float,
) -> float:
    """Return the torque that in all cycles of a gear has the same safety [N m]."""
    heaviest = max(range(len(used)), key=lambda number: used[number][gear])
    equivalent = iso.life_factor(sum(cycles)) / safety
    torque = float(conditions[heaviest].scene.operation.torque)
    return torque * (equivalent / used[heaviest][gear]) ** 2


def lasts_are_known(scene: Scene) -> bool:
    """Say whether a scene tells how long each of its conditions lasts.

    Parameters
    ----------
    scene : the scene
    """
    return all(stage.cycles is not None for stage in scene.operation.stages)


def _rated_conditions(scene: Scene) -> list[RatedCondition]:
    """Return the loaded conditions with their hours, [] where no safety is asked for.

    Of stages that do not say how long they last, each has all hours.
    """
    rating = scene.rating
    scenes = scene.in_conditions()
    if rating is None or rating.hours is None or rating.viscosity_40 is None:
        return []
    gear_sets = [sets.build_set(condition) for condition in scenes]
    time = [1.0] * len(scenes)
    if scene.operation.blocks:
        total = sum(block.share for block in scene.operation.blocks)
        time = [block.share / total for block in scene.operation.loaded_blocks]
    elif scene.operation.stages and lasts_are_known(scene):
        lasts = [stage.cycles or 0.0 for stage in scene.operation.stages]
        time = [
            cycles / gears.speed for cycles, gears in zip(lasts, gear_sets, strict=True)
        ]
        time = [part / sum(time) for part in time]
    pair = gear_sets[0].kinds[0].pair
    if (
        pair.contact_ratio >= MAX_CONTACT_RATIO
        or _misalignment(scenes[0], gear_sets[0]) is None
    ):
        return []
    return [
        RatedCondition(condition, gears, share * rating.hours)
        for condition, gears, share in zip(scenes, gear_sets, time, strict=True)
        if specific_load(gears) > 0.0 and share > 0.0
    ]


def _stress_of(condition: RatedCondition) -> tuple[float, float]:
    """Return the contact stress of (driving, driven) in a condition [Pa]."""
    scene = condition.scene
    gears = condition.gears
    _, mesh_stiffness = _stiffness_values(scene, gears)
    factor = _face_load_factor(scene, gears, mesh_stiffness)
    assert factor is not None
    return _contact_stress(scene, gears, factor)[1]


def _misalignment(scene: Scene, gears: GearSet) -> float | None:
    """Return the misalignment in the condition of a scene, None where none is known."""
    assert scene.rating is not None
    of_mesh = scene.mesh.misalignment
    if scene.rating.equivalent_misalignment is not None:
        return scene.rating.equivalent_misalignment
    if of_mesh is None:
        return None
    pair = gears.kinds[0].pair
    torque = scene.operation.torque
    return abs(of_mesh.over_face(pair.working_pressure_angle, torque))


def _face_load_factor(
    scene: Scene, gears: GearSet, mesh_stiffness: float
) -> float | None:
    """Return K_Hβ [1], None without a misalignment or a load."""
    rating = scene.rating
    assert rating is not None
    load = specific_load(gears) * rating.application_factor
    misaligned = _misalignment(scene, gears)
    if misaligned is None or load == 0.0:
        return None
    remaining = (1.0 - rating.running_in) * misaligned
    return iso.face_load_factor(remaining, load, mesh_stiffness)


def _stiffness_values(scene: Scene, gears: GearSet) -> tuple[dict[str, Any], float]:
    """Return the stiffnesses of a pair, and c_γβ among them [N/(m m)]."""
    rating = scene.rating
    assert rating is not None
    pair = gears.kinds[0].pair
    turned = gears.helix
    cosine = math.cos(turned.angle)
    by_size = sorted(pair.gears, key=lambda gear: gear.teeth)
    first, second = (  # a ring has endless teeth there
        iso.Tooth(
            math.inf if gear.internal else gear.teeth, gear.profile_shift / cosine
        )
        for gear in by_size
    )
    dedendum = sum(gear.dedendum for gear in by_size) / (2.0 * scene.gears.module)
    rack = iso.Rack(scene.gears.pressure_angle, dedendum, turned.angle)
    modulus = 2.0 / sum(1.0 / gear.material.youngs_modulus for gear in by_size)
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


def _contact_stress(
    scene: Scene, gears: GearSet, face_load_factor: float
) -> tuple[float, tuple[float, float]]:
    """Return nominal contact stress, and that of (driving, driven) [Pa]."""
    rating = scene.rating
    assert rating is not None
    turned = gears.helix
    pair = gears.kinds[0].pair
    overlap = helix.overlap_ratio(pair.face_width, turned.angle, scene.gears.module)
    nominal = iso.nominal_stress(
        pair, turned, overlap, specific_load(gears) * pair.face_width
    )
    load = rating.application_factor * face_load_factor * rating.transverse_load_factor
    first, second = (
        factor * nominal * math.sqrt(load)
        for factor in iso.single_contact_factors(pair, overlap)
    )
    return nominal, (first, second)


def _permissible_stress(
    condition: RatedCondition, cycles: float | None = None
) -> float:
    """Return the contact stress borne for so many cycles [Pa].

    Without cycles it is that of a life factor of 1.
    """
    scene = condition.scene
    rating = scene.rating
    kind = condition.gears.kinds[0]
    pair = kind.pair
    assert rating is not None
    limit = rating.allowable_contact_stress
    viscosity = rating.viscosity_40
    assert limit is not None and viscosity is not None
    roughness = [getattr(scene.gears, gear.name).roughness_ra for gear in pair.gears]
    mean = sum(roughness) / 2.0
    speed = kind.speed * pair.driving.reference_radius
    curvature = float(pair.equivalent_curvature(0.0))
    # R_z is six times R_a, as ISO 6336-2 converts them
    film = iso.film_factors(limit, viscosity, speed, 6.0 * mean, curvature)
    life = 1.0 if cycles is None else iso.life_factor(cycles)
    return limit * life * math.prod(film)


def specific_load(gears: GearSet) -> float:
    """Return F_t/b at the reference circle [N/m]."""
    kind = gears.kinds[0]
    ratio = kind.pair.driving.base_radius / kind.pair.driving.reference_radius
    return kind.load * ratio / kind.pair.face_width


def rating_flags(scene: Scene) -> list[str]:
    """Return where the rating leaves its range, and where its equations come from."""
    if scene.rating is None:
        return []
    flags = [
        "rating: equations of ISO 6336-1 second-hand, checked against printed values "
        "of others"
    ]
    gear_sets = [sets.build_set(condition) for condition in scene.in_conditions()]
    factor = scene.rating.application_factor
    loads = [factor * specific_load(gears) for gears in gear_sets]
    load = min([load for load in loads if load > 0.0], default=0.0)
    if load < iso.VALID_LOAD:
        flags.append(
            "rating: single stiffness of loads from 100 N/mm on, and this is "
            f"{1e-3 * load:.3g} N/mm"
        )
    if scene.operation.several and scene.rating.allowable_contact_stress is not None:
        flags.append(_how_several_are_rated(scene))
    pair = gear_sets[0].kinds[0].pair
    if any(gear.internal for gear in pair.gears):
        flags.append("rating: a ring is taken as a rack")
    if pair.contact_ratio < 1.0:
        flags.append(
            f"rating: outside ISO 6336, which asks for a transverse contact ratio of "
            f"1 at least, not {pair.contact_ratio:.4g}"
        )
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


def _how_several_are_rated(scene: Scene) -> str:
    """Return how the safety of several conditions follows from theirs."""
    if lasts_are_known(scene):
        return (
            "rating: safety of all conditions together, by the Palmgren-Miner sum over "
            "them (ISO 6336-6), K_Hβ of each its own; stresses below 0.85 of the limit "
            "harm nothing"
        )
    return (
        "rating: the last stage has no cycles, and nothing says how long each stage "
        "lasts: the safety is that of all hours in the worst of them"
    )
