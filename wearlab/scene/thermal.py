"""What ``[thermal]`` asks of the other sections, and what asks for ``[thermal]``."""

from collections.abc import Iterator
from typing import Any

from wearlab.materials import grades
from wearlab.mesh.stiffnesses.prescribed import PrescribedStiffness
from wearlab.scene import sections
from wearlab.scene.materials import MaterialOptions
from wearlab.wear.coefficients.calibrated import CalibratedCoefficient

Problems = Iterator[tuple[str, str]]
TABLE = (
    "youngs_modulus = { temperature = ['20 degC', '60 degC'], value = ['2.9 GPa', "
    "'1.9 GPa'] }"
)
"""An example of a table over temperature."""


def materials_of(scene: sections.Sections) -> dict[str, tuple[str, MaterialOptions]]:
    """Return the material of every member with teeth, with the key that states it.

    Parameters
    ----------
    scene : all sections
    """
    materials = {}
    for name, gear in scene.gears.gears().items():
        is_of_set = gear.material is None
        key = "gears.material" if is_of_set else f"gears.{name}.material"
        materials[name] = (key, gear.material or scene.gears.material)
    return materials


def tables_need_thermal(scene: sections.Sections, gear_set: Any) -> Problems:
    """Yield that a modulus over temperature needs a temperature."""
    if scene.thermal is not None:
        return
    for key, material in dict.fromkeys(materials_of(scene).values()):
        if material.softens:
            yield (
                f"{key}.youngs_modulus",
                "a table over temperature needs [thermal] with ambient and friction, "
                "or give one value",
            )


def thermal_rules(scene: sections.Sections, thermal: Any) -> Problems:
    """Yield what [thermal] cannot be computed of, or not without more.

    Parameters
    ----------
    scene : all sections
    thermal : options of [thermal]
    """
    if scene.gears.kind != "external-pair":
        yield (
            "thermal",
            f"is of external pairs, and this is {scene.gears.kind!r}: leave it out",
        )
        return
    if scene.face_keys:
        yield (
            "thermal",
            "is of spur gears that share the load evenly over the face: leave it out, "
            f"or {' and '.join(scene.face_keys)}",
        )
    if scene.operation.reverses:
        yield (
            "thermal",
            "knows the heat of front flanks only: leave rows of operation.duty with "
            "negative torque out",
        )
    yield from _materials(scene, thermal)
    yield from _friction(scene, thermal)
    yield from _stiffness(scene)
    if thermal.relative_duty != 1.0 and scene.operation.blocks:
        yield (
            "thermal.relative_duty",
            "counts pauses that the rows of operation.duty count already: leave it out",
        )
    if isinstance(scene.wear and scene.wear.coefficient, CalibratedCoefficient):
        yield (
            "wear.coefficient",
            "'calibrated' needs a life in proportion to 1/k, and with [thermal] wear "
            "changes the temperature: give a value, or 'over-temperature'",
        )


def _materials(scene: sections.Sections, thermal: Any) -> Problems:
    """Yield that a plastic is known at one temperature only, or that there is none."""
    materials = materials_of(scene)
    for key, material in dict.fromkeys(materials.values()):
        if material.is_plastic and material.modulus_of_catalogue:
            name = material.name or ""
            treatment = grades.MATERIALS[name].treatment.removeprefix("dry, ")
            yield (
                f"{key}.youngs_modulus",
                f"{name}: E is known at {treatment} only; give a table, such as "
                f"{TABLE}, or one value, which is then held",
            )
    transfers = thermal.heat_transfer
    stated = any(getattr(transfers, name) is not None for name in materials)
    if not stated and not any(of.is_plastic for _, of in materials.values()):
        yield (
            "thermal.heat_transfer",
            "is known of plastics only, and both gears are of metal: give it, such as "
            "gear = { flank = 6300, root = 895 }, or leave [thermal] out",
        )


def _friction(scene: sections.Sections, thermal: Any) -> Problems:
    """Yield that flanks have one coefficient of friction."""
    rubbing = scene.dynamics and scene.dynamics.friction
    if rubbing and rubbing.coefficient != thermal.friction:
        yield (
            "thermal.friction",
            f"must be that of dynamics.friction.coefficient, {rubbing.coefficient:g}, "
            "one number: give both the same",
        )


def _stiffness(scene: sections.Sections) -> Problems:
    """Yield that a prescribed stiffness knows no temperature."""
    stiffness = scene.mesh.stiffness
    softens = any(of.softens for _, of in materials_of(scene).values())
    if not isinstance(stiffness, PrescribedStiffness) or not softens:
        return
    if not stiffness.follows_modulus:
        yield (
            "mesh.stiffness.follows_modulus",
            f"{stiffness.chosen!r} knows no temperature, and Young's modulus is a "
            "table: give true to let it fall with the moduli, or another stiffness",
        )
