"""The gears of a scene on a sheet: a table with the symbols of ISO 21771, and their teeth in mesh."""

import math
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from wearlab.gears import drawing, helix, shifts
from wearlab.gears.gear import Gear, GearPair
from wearlab.scene import Scene
from wearlab.scene.build import face, sets
from wearlab.shop.materials import KGF_PER_MM2


class GearRow(NamedTuple):
    """One line: symbol, meaning, unit, and a value a gear (or one for all)."""

    symbol: str
    meaning: str
    unit: str
    values: tuple[str, ...]


ROWS: tuple[tuple[str, str, str, Callable[[Gear], float]], ...] = (
    ("z", "teeth", "", lambda g: g.teeth),
    ("x_E", "profile shift coefficient as cut", "", lambda g: g.profile_shift),
    ("d", "reference diameter", "mm", lambda g: 2e3 * g.reference_radius),
    ("d_b", "base diameter", "mm", lambda g: 2e3 * g.base_radius),
    ("d_a", "tip diameter", "mm", lambda g: 2e3 * g.tip_radius),
    ("d_Ff", "form diameter at the root", "mm", lambda g: 2e3 * g.form_radius),
    ("d_f", "root diameter", "mm", lambda g: 2e3 * g.root_radius),
    ("s_n", "tooth thickness at d", "mm", lambda g: 1e3 * thickness(g)),
    ("b", "face width", "mm", lambda g: 1e3 * g.face_width),
    ("E", "Young's modulus", "GPa", lambda g: 1e-9 * g.material.youngs_modulus),
    ("m", "mass", "kg", lambda g: g.mass),
    ("J", "moment of inertia", "kg·mm²", lambda g: 1e6 * g.inertia),
)


IN_NORMAL_SECTION = {"x_E": -1, "s_n": 1}
"""Power of cos β by which what a row says of the transverse section is that of the normal section."""


MODIFICATIONS: tuple[tuple[str, str, str, Callable[[Any], float]], ...] = (
    ("C_αa", "tip relief", "µm", lambda g: 1e6 * g.tip_relief.amount if g.tip_relief else 0.0),
    ("C_αf", "root relief", "µm", lambda g: 1e6 * g.root_relief.amount if g.root_relief else 0.0),
    ("C_α", "profile crowning", "µm", lambda g: 1e6 * (g.profile_crowning or 0.0)),
    ("C_Hα", "profile slope", "µm", lambda g: 1e6 * (g.profile_slope or 0.0)),
    ("C_β", "lead crowning", "µm", lambda g: 1e6 * (g.lead_crowning or 0.0)),
    ("C_Hβ", "lead slope", "µm", lambda g: 1e6 * (g.lead_slope or 0.0)),
    ("C_βe", "end relief", "µm", lambda g: 1e6 * g.end_relief.amount if g.end_relief else 0.0),
    ("", "bias", "µm", lambda g: 1e6 * (g.bias or 0.0)),
)
"""What a gear's options remove from its flanks; 0 where they do not."""


class Sheet(NamedTuple):
    """A gear set: its members, its table, and its meshes drawn with the names of the gears."""

    members: tuple[str, ...]
    rows: tuple[GearRow, ...]
    drawings: tuple[tuple[str, drawing.ToothDrawing], ...]


def sheet(scene: Scene) -> Sheet:
    """Return the sheet of a scene's gears.

    Raises
    ------
    GearError : there can be no such gears
    """
    gears = sets.build_set(scene)
    pairs = [kind.pair for kind in gears.kinds]
    drawn = tuple((" and ".join(gear.name for gear in pair.gears), drawing.drawing(pair)) for pair in pairs)
    return Sheet(tuple(gears.gears), tuple(gear_rows(scene, gears)), drawn)


def thickness(gear: Gear) -> float:
    """Return the tooth thickness on the reference circle [m]; of a ring what stands between two spaces."""
    half = gear.base_half_angle - shifts.involute(gear.pressure_angle)
    whole = math.pi / gear.teeth - half if gear.internal else half
    return 2.0 * gear.reference_radius * whole


def _row(symbol: str, meaning: str, unit: str, values: Iterable[float | str]) -> GearRow:
    """Return a row of texts, and of numbers as they are said in a unit."""
    said = (value if isinstance(value, str) else _said(value, unit) for value in values)
    return GearRow(symbol, meaning, unit, tuple(said))


def gear_rows(scene: Scene, gears: sets.GearSet) -> Iterator[GearRow]:
    """Yield the table of a gear set, what all share first."""
    module, turned = scene.gears.module, face.helix_of(scene, gears)
    pairs = [(kind.pair, _tail(gears, kind.pair)) for kind in gears.kinds]
    yield _row("m_n", "module", "mm", [1e3 * module])
    yield _row("α_n", "pressure angle", "°", [math.degrees(scene.gears.pressure_angle)])
    if turned.angle:
        yield _row("β", "helix angle", "°", [math.degrees(turned.angle)])
        yield _row("β_b", "base helix angle", "°", [math.degrees(turned.base_angle)])
        yield _row(
            "ε_β", "overlap ratio", "", [helix.overlap_ratio(pairs[0][0].face_width, turned.angle, module)]
        )
    for pair, tail in pairs:
        yield _row("a_w", f"working centre distance{tail}", "mm", [1e3 * pair.centre_distance])
        yield _row("α_wt", f"working pressure angle{tail}", "°", [math.degrees(pair.working_pressure_angle)])
        yield _row("ε_α", f"transverse contact ratio{tail}", "", [pair.contact_ratio])
    for kind, (pair, tail) in zip(gears.kinds, pairs, strict=True):
        free = scene.mesh.of(kind.section).normal_backlash
        free = pair.drawn_backlash if free is None else free
        unit, said = ("", "none given") if free is None else ("mm", 1e3 * turned.cosine * free)
        yield _row("j_bn", f"normal backlash{tail}", unit, [said])
    for pair, _ in pairs:
        yield from _sliding(pair)
    for symbol, meaning, unit, of in ROWS:
        factor = math.cos(turned.angle) ** IN_NORMAL_SECTION.get(symbol, 0)
        yield _row(symbol, meaning, unit, [factor * of(gear) for gear in gears.gears.values()])
        if symbol == "d_a":
            yield from _tips(scene, gears)
            for pair, tail in pairs:
                yield from _rolling(pair, tuple(gears.gears), tail)
    yield from _modifications(scene, gears)
    yield from _surfaces(scene)


def _surfaces(scene: Scene) -> Iterator[GearRow]:
    """Yield what the gears are made of, how hard and how rough they are."""
    given = scene.gears.gears().values()
    materials = [gear.material or scene.gears.material for gear in given]
    yield _row("", "material", "", [material.name or "as given" for material in materials])
    hardness = [material.hardness or 0.0 for material in materials]
    if any(hardness):
        vickers = [f"{pressure / KGF_PER_MM2:.0f}" if pressure else "" for pressure in hardness]
        yield _row("HV", "hardness of the flanks", "HV", vickers)
    roughness = [1e6 * (gear.roughness_ra or 0.0) for gear in given]
    if any(roughness):
        yield _row("Ra", "roughness of the flanks", "µm", [f"{r:.3g}" if r else "" for r in roughness])


def _tail(gears: sets.GearSet, pair: GearPair) -> str:
    """Return whose mesh a row is of, where there are several."""
    return "" if len(gears.kinds) == 1 else f", {' and '.join(gear.name for gear in pair.gears)}"


def _sliding(pair: GearPair) -> Iterator[GearRow]:
    """Yield the specific sliding of either flank where it is most negative: at its root."""
    for number, (gear, letter) in enumerate(zip(pair.gears, "AE", strict=True)):
        value = float(pair.specific_sliding(np.array([getattr(pair.path, letter)]))[number, 0])
        mate = pair.gears[1 - number].name
        yield _row("ζ", f"specific sliding of {gear.name} at {letter}, on {mate}", "", [value])


def _rolling(pair: GearPair, members: tuple[str, ...], tail: str) -> Iterator[GearRow]:
    """Yield the diameters that roll on each other, and what each tip keeps from the mate's root."""
    cosine = math.cos(pair.working_pressure_angle)
    working: dict[str, float | str] = {}
    clearance: dict[str, float | str] = {}
    for gear, mate in (pair.gears, pair.gears[::-1]):
        working[gear.name] = 2e3 * gear.base_radius / cosine
        reach = abs(gear.tip_radius + (-1.0 if pair.internal else 1.0) * mate.root_radius)
        clearance[gear.name] = 1e3 * abs(pair.centre_distance - reach)
    root = "clearance of the tip from the mate's root"
    yield _row("d_w", f"working pitch diameter{tail}", "mm", [working.get(name, "") for name in members])
    yield _row("c", f"{root}{tail}", "mm", [clearance.get(name, "") for name in members])


def _tips(scene: Scene, gears: sets.GearSet) -> Iterator[GearRow]:
    """Yield tip alteration, over a normal module, and tooth thickness at the tip, in the normal section."""
    module, beta = scene.gears.module, face.helix_of(scene, gears).angle
    given: dict[str, Any] = scene.gears.gears()
    alterations, thicknesses = [], []
    for name, gear in gears.gears.items():
        allowance = given[name].tooth_thickness_allowance
        outwards = -1.0 if gear.internal else 1.0
        thinned = 0.0 if allowance is None else allowance.mean / (2.0 * math.tan(scene.gears.pressure_angle))
        shift = gear.profile_shift * gear.module - outwards * thinned
        height = outwards * (gear.tip_radius - gear.reference_radius - shift) / module
        over_rack = round(height - (given[name].addendum_coefficient or 1.0), 4)
        alterations.append(f"{over_rack + 0.0:.4f}")
        at_tip = math.atan(math.tan(beta) * gear.tip_radius / gear.reference_radius)
        thicknesses.append(2e3 * gear.tip_radius * gear.half_angle(gear.tip_radius) * math.cos(at_tip))
    yield _row("k", "tip alteration coefficient", "", alterations)
    yield _row("s_an", "tooth thickness at the tip", "mm", thicknesses)


def _modifications(scene: Scene, gears: sets.GearSet) -> Iterator[GearRow]:
    """Yield what is removed from the flanks on purpose, along their normal, and how the axes deviate."""
    given = scene.gears.gears().values()
    for symbol, meaning, unit, of in MODIFICATIONS:
        values = [of(member) for member in given]
        if any(values):
            yield _row(symbol, meaning, unit, [value or "" for value in values])
    if any(starts := [_start(gear) for gear in gears.gears.values()]):
        yield _row("d_Ca", "diameter where the tip relief starts", "mm", starts)
    for kind in gears.kinds:
        axes = scene.mesh.of(kind.section).misalignment
        if axes is not None:
            over = axes.over_face(kind.pair.working_pressure_angle, scene.operation.torque)
            yield _row("F_βy", f"misalignment over the face{_tail(gears, kind.pair)}", "µm", [1e6 * over])


def _start(gear: Gear) -> str:
    """Return the diameter where the tip relief of a gear begins, nothing where it has none."""
    relief = None if gear.modification is None else gear.modification.tip_relief
    if relief is None:
        return ""
    length = -relief.length if gear.internal else relief.length
    tip = math.sqrt(gear.tip_radius**2 - gear.base_radius**2)
    return _said(2e3 * math.hypot(gear.base_radius, tip - length), "mm")


def _said(value: float, unit: str) -> str:
    """Return a length to the micrometre and an angle to a thousandth; of anything else four digits."""
    if unit in ("mm", "°"):
        return f"{value:.3f}".rstrip("0").rstrip(".")
    return f"{value:.4g}" if value else "0"
