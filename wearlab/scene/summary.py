"""Which parts a scene has, and which it leaves out: not computed, compiled or stored.

And its oversights.
"""

import math
from collections.abc import Iterable, Iterator
from typing import Any

from wearlab.scene.gears import LEAD_KEYS
from wearlab.scene.scene import Scene
from wearlab.wear.coefficients.hardness import HardnessCoefficient

OF_OIL = {"lubricant", "lambda_ratio", "temperature"}
"""What a wear law may need that the oil says."""
MODIFYING = (
    "tip_relief",
    "root_relief",
    "profile_crowning",
    "profile_slope",
    *LEAD_KEYS,
)
"""Options of a gear that modify its flanks."""
REMEDY = (
    "for a life give wear.until, such as until = { hours = 20000 } or { depth = '20 "
    "um' }"
)
"""How flanks of one wear state are let wear on."""
DEEP = 0.3
"""Wear depth over the module above which a limit is told to be deep; teeth are pi/2
modules thick."""
ALIKE = 1.3
"""Ratio of Young's moduli up to which materials count as one, as all steels are."""


def _parts(scene: Scene) -> dict[str, str | None]:
    """Return every part by its name, with what is chosen of it.

    None when it is left out.
    """
    return {
        **_parts_of_gears(scene),
        **_parts_of_motion(scene),
        **_parts_of_wear(scene),
    }


def _parts_of_gears(scene: Scene) -> dict[str, str | None]:
    """Return what gears and meshes have, and which errors."""
    gears = scene.gears.gears().values()
    meshes = scene.meshes.values()
    modified = any(getattr(gear, key) for gear in gears for key in MODIFYING)
    return {
        "gears": scene.gears.kind,
        "flank modifications": _there(modified),
        "face": _face(scene),
        "rating": "ISO 6336-1" if scene.rating else None,
        "mesh stiffness": _chosen(mesh.stiffness.chosen for mesh in meshes),
        "contact": _chosen(mesh.contact.chosen for mesh in meshes),
        "contact beyond A and E": _there(any(mesh.extended_contact for mesh in meshes)),
        "errors": scene.errors.slow.chosen if scene.errors else None,
    }


def _parts_of_motion(scene: Scene) -> dict[str, str | None]:
    """Return what moves, and under which conditions of operation."""
    dynamics = scene.dynamics
    operation = scene.operation
    meshes = list(scene.meshes.values())
    response = dynamics and dynamics.response
    has_back_flank = any(mesh.normal_backlash is not None for mesh in meshes)
    fluctuates = operation.torque_fluctuation is not None
    return {
        "dynamics": f"{dynamics.chosen}, {dynamics.method}" if dynamics else None,
        "excitation": meshes[0].excitation.chosen if dynamics else None,
        "back flank": _there(dynamics and has_back_flank),
        "friction": _there(dynamics and dynamics.friction),
        "response over speed": response.direction if response else None,
        "torque fluctuation": _there(dynamics and fluctuates),
        "duty": f"{len(operation.blocks)} conditions" if operation.duty else None,
        "stages": f"{len(operation.stages)} in order" if operation.stage else None,
    }


def _parts_of_wear(scene: Scene) -> dict[str, str | None]:
    """Return the oil film, the wear a run starts with, the wear law and the life."""
    wear = scene.wear
    gears = scene.gears.gears().values()
    coefficients = scene.coefficients.values()
    models = sorted({coefficient.chosen for coefficient in coefficients})
    is_rough = all(gear.roughness_ra is not None for gear in gears)
    has_film = any(coefficient.film for coefficient in coefficients)
    law = None
    if wear and models:
        law = f"{' and '.join(models)} coefficient, {wear.load.chosen} load"
    parts = {
        "film": _there(scene.lubricant and is_rough),
        "film in the coefficient": _there(has_film),
        "initial wear": _there(wear and wear.initial),
        "start from another run": str(scene.start.run)[:10] if scene.start else None,
        "wear": law,
    }
    if scene.thermal:
        parts["temperature"] = scene.thermal.chosen
    if is_one_state(scene):
        parts["one wear state"] = f"no cycles pass; {REMEDY}"
    parts["life"] = wear.step.chosen if wear and not is_one_state(scene) else None
    return parts


def _there(part: object) -> str | None:
    """Return "" for a part that is there and has no choice, None for an absent part."""
    return "" if part else None


def is_one_state(scene: Scene) -> bool:
    """Say whether a scene has one wear state: nothing says until when wear grows."""
    return (
        scene.wear is not None
        and scene.wear.until is None
        and scene.operation.stage is None
    )


def _face(scene: Scene) -> str | None:
    """Return how slices of a face hold each other, None where flanks have no width."""
    if not scene.face_keys:
        return None
    beta = scene.gears.helix_angle
    helical = "" if beta is None else f"helix angle {math.degrees(beta):.4g} deg, "
    return (
        f"{helical}coupling "
        f"{_chosen(mesh.coupling.chosen for mesh in scene.meshes.values())}"
    )


def _chosen(models: Iterable[str]) -> str:
    """Return what each kind of mesh has, once where they have the same."""
    return " and ".join(dict.fromkeys(models))


def parts_present(scene: Scene) -> list[str]:
    """Return the parts a scene has, each with what is chosen of it."""
    present = {
        word: chosen for word, chosen in _parts(scene).items() if chosen is not None
    }
    return [f"{word}: {chosen}" if chosen else word for word, chosen in present.items()]


def parts_left_out(scene: Scene) -> list[str]:
    """Return the parts a scene leaves out."""
    return [word for word, chosen in _parts(scene).items() if chosen is None]


def oversights(scene: Scene) -> list[str]:
    """Return what a scene says and hardly means, each with a remedy.

    Numbers of a load spectrum that may be a thousand times as large, ranges in it, a
    limit as deep as a tooth is thick, an oil that changes no life, one wear coefficient
    for gears of
    different materials.
    """
    duty = scene.duty_table
    doubts = [*([] if duty is None else duty.doubts), *_deep_limit(scene)]
    doubts += [
        f"operation.duty: {range_used}; where wear over it is not linear, split it"
        for range_used in scene.duty_ranges
    ]
    if scene.coefficients:
        doubts += [*_idle_oil(scene), *_shared_coefficient(scene)]
    return doubts


def _deep_limit(scene: Scene) -> Iterator[str]:
    """Yield that a life is to end where little is left of the teeth."""
    until = scene.wear and scene.wear.until
    module = scene.gears.module
    if until and until.depth and until.depth > DEEP * module:
        yield (
            f"wear.until.depth = {1e3 * until.depth:.4g} mm is "
            f"{until.depth / module:.2g} modules of teeth "
            f"that are some {math.pi / 2:.2g} thick: look at its unit; above "
            f"{1e3 * DEEP * module:.3g} mm, "
            f"{DEEP:g} modules, depths and lives are those of teeth that would long "
            "have been changed"
        )


def _idle_oil(scene: Scene) -> Iterator[str]:
    """Yield that the oil does not change the life.

    Nothing where it does, or where a plug-in may ask it.
    """
    if scene.lubricant is None or _asks_the_oil(scene):
        return
    first = next(iter(scene.coefficients.values()))
    without_roughness = [
        f"gears.{name}.roughness_ra"
        for name, gear in scene.gears.gears().items()
        if gear.roughness_ra is None
    ]
    further = f" (and {', '.join(without_roughness)})" if without_roughness else ""
    yield (
        f"the oil does not change this life: wear.coefficient = {first.chosen!r} takes "
        "no notice of [lubricant]; let its film count with film = true in "
        f"[wear.coefficient]{further}, or leave it out"
    )


def _asks_the_oil(scene: Scene) -> bool:
    """Say whether something of a scene that wears may depend on the oil."""
    coefficients = list(scene.coefficients.values())
    if scene.mesh.damping_law.needs_oil or any(model.film for model in coefficients):
        return True
    models: list[Any] = [*coefficients, scene.wear and scene.wear.law]
    return any(
        model.origin or OF_OIL.intersection(getattr(model, "needs", ()))
        for model in models
    )


def _shared_coefficient(scene: Scene) -> Iterator[str]:
    """Yield that gears of different materials have one coefficient."""
    coefficients = list(scene.coefficients.values())
    first = coefficients[0]
    is_shared = all(coefficient is first for coefficient in coefficients)
    by_hardness = isinstance(first, HardnessCoefficient) and first.hardness is None
    materials = {
        name: gear.material or scene.gears.material
        for name, gear in scene.gears.gears().items()
    }
    moduli = [material.cold_modulus for material in materials.values()]
    if is_shared and not by_hardness and max(moduli) > ALIKE * min(moduli):
        made_of = ", ".join(
            f"{name} {material.name or f'E = {material.cold_modulus:.3g} Pa'}"
            for name, material in materials.items()
        )
        tables = ", ".join(f"{name} = {{…}}" for name in materials)
        yield (
            f"one wear coefficient for two materials ({made_of}): the harder flank "
            "wears as the softer one "
            f"does; give each its own, [wear.coefficient] {tables} (values: "
            "docs/shop_words.md)"
        )
