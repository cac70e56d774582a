"""The gears of a scene on a sheet: a table with the symbols of ISO 21771, and their teeth in mesh."""

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from wearlab.gears import drawing, shifts
from wearlab.gears.gear import Gear, GearPair
from wearlab.gears.helix import overlap_ratio
from wearlab.scene import Scene
from wearlab.scene.build.face import helix_of
from wearlab.scene.build.sets import GearSet, build_set
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
    gears = build_set(scene)
    pairs = [kind.pair for kind in gears.kinds]
    drawn = tuple((" and ".join(gear.name for gear in pair.gears), drawing.drawing(pair)) for pair in pairs)
    return Sheet(tuple(gears.gears), tuple(gear_rows(scene, gears)), drawn)


def thickness(gear: Gear) -> float:
    """Return the tooth thickness on the reference circle [m]; of a ring what stands between two spaces."""
    half = gear.base_half_angle - shifts.involute(gear.pressure_angle)
    whole = math.pi / gear.teeth - half if gear.internal else half
    return 2.0 * gear.reference_radius * whole


def gear_rows(scene: Scene, gears: GearSet) -> Iterator[GearRow]:
    """Yield the table of a gear set, what all share first."""
    shared = [
        ("m_n", "module", "mm", 1e3 * scene.gears.module),
        ("α_n", "pressure angle", "°", math.degrees(scene.gears.pressure_angle)),
    ]
    turned = helix_of(scene)
    if turned.angle:
        overlap = overlap_ratio(gears.kinds[0].pair.face_width, turned.angle, scene.gears.module)
        shared += [
            ("β", "helix angle", "°", math.degrees(turned.angle)),
            ("β_b", "base helix angle", "°", math.degrees(turned.base_angle)),
            ("ε_β", "overlap ratio", "", overlap),
        ]
    for kind in gears.kinds:
        tail = "" if len(gears.kinds) == 1 else f", {' and '.join(gear.name for gear in kind.pair.gears)}"
        shared += [
            ("a_w", f"working centre distance{tail}", "mm", 1e3 * kind.pair.centre_distance),
            ("α_wt", f"working pressure angle{tail}", "°", math.degrees(kind.pair.working_pressure_angle)),
            ("ε_α", f"transverse contact ratio{tail}", "", kind.pair.contact_ratio),
            ("j_bn", f"normal backlash{tail}", "mm", 1e3 * turned.cosine * (kind.pair.drawn_backlash or 0.0)),
        ]
    for symbol, meaning, unit, value in shared:
        yield GearRow(symbol, meaning, unit, (_said(value, unit),))
    for kind in gears.kinds:
        yield from _sliding(kind.pair)
    for symbol, meaning, unit, of in ROWS:
        factor = math.cos(turned.angle) ** IN_NORMAL_SECTION.get(symbol, 0)
        each = tuple(_said(factor * of(gear), unit) for gear in gears.gears.values())
        yield GearRow(symbol, meaning, unit, each)
    given: dict[str, Any] = scene.gears.gears()
    materials = [given[name].material or scene.gears.material for name in gears.gears]
    yield GearRow("", "material", "", tuple(material.name or "as given" for material in materials))
    if any(material.hardness for material in materials):
        values = (
            f"{material.hardness / KGF_PER_MM2:.0f}" if material.hardness else "" for material in materials
        )
        yield GearRow("HV", "hardness of the flanks", "HV", tuple(values))
    if any(given[name].roughness_ra for name in gears.gears):
        values = (f"{1e6 * r:.3g}" if (r := given[name].roughness_ra) else "" for name in gears.gears)
        yield GearRow("Ra", "roughness of the flanks", "µm", tuple(values))


def _sliding(pair: GearPair) -> Iterator[GearRow]:
    """Yield the specific sliding of either flank where it is most negative: at its root."""
    for number, (gear, letter) in enumerate(zip(pair.gears, "AE", strict=True)):
        value = float(pair.specific_sliding(np.array([getattr(pair.path, letter)]))[number, 0])
        mate = pair.gears[1 - number].name
        meaning = f"specific sliding of {gear.name} at {letter}, on {mate}"
        yield GearRow("ζ", meaning, "", (_said(value, ""),))


def _said(value: float, unit: str) -> str:
    """Return a length to the micrometre and an angle to a thousandth; of anything else four digits."""
    if unit in ("mm", "°"):
        return f"{value:.3f}".rstrip("0").rstrip(".")
    return f"{value:.4g}" if value else "0"
