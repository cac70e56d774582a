"""The gears of a scene on a sheet: a table with symbols of ISO 21771, and a drawing."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

from wearlab.assembly import sets
from wearlab.gears import helix, outline, shifts
from wearlab.gears.gear import Gear, GearPair
from wearlab.materials.grades import KGF_PER_MM2
from wearlab.mesh.gear_set import PairOfSet
from wearlab.scene import Scene


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
"""Power of cos β by which what a row says of the transverse section is that of the
normal section."""


MODIFICATIONS = {
    "tip_relief": ("C_αa", "tip relief"),
    "root_relief": ("C_αf", "root relief"),
    "profile_crowning": ("C_α", "profile crowning"),
    "profile_slope": ("C_Hα", "profile slope"),
    "lead_crowning": ("C_β", "lead crowning"),
    "lead_slope": ("C_Hβ", "lead slope"),
    "end_relief": ("C_βe", "end relief"),
    "bias": ("", "bias"),
}
"""Options of a gear that remove something from its flanks: symbol and meaning."""
Row = tuple[str, str, str, Sequence[float | str]]
"""A row as it is computed: symbol, meaning, unit, and a number or text a gear (or one
for all)."""


class Sheet(NamedTuple):
    """A gear set: its members, its table, and drawings of its meshes by their names."""

    members: tuple[str, ...]
    rows: tuple[GearRow, ...]
    drawings: tuple[tuple[str, outline.ToothDrawing], ...]


def sheet(scene: Scene) -> Sheet:
    """Return the sheet of a scene's gears.

    Parameters
    ----------
    scene : the scene

    Raises
    ------
    GearError : there can be no such gears
    """
    gears = sets.build_set(scene.in_heaviest_condition)
    pairs = [kind.pair for kind in gears.kind_of_each_section]
    drawn = tuple(
        (" and ".join(gear.name for gear in pair.gears), outline.drawing(pair))
        for pair in pairs
    )
    rows = []
    for symbol, meaning, unit, values in _rows(scene, gears):
        texts = tuple(
            value if isinstance(value, str) else _as_text(value, unit)
            for value in values
        )
        rows.append(GearRow(symbol, meaning, unit, texts))
    return Sheet(tuple(gears.gears), tuple(rows), drawn)


def thickness(gear: Gear) -> float:
    """Return the tooth thickness on the reference circle [m].

    Of a ring what stands between two spaces.

    Parameters
    ----------
    gear : the gear
    """
    half = gear.base_half_angle - shifts.involute(gear.pressure_angle)
    return (
        2.0
        * gear.reference_radius
        * (math.pi / gear.teeth - half if gear.internal else half)
    )


def _rows(scene: Scene, gears: sets.GearSet) -> Iterator[Row]:
    """Yield the table of a gear set, what all share first."""
    yield from _shared_rows(scene, gears)
    for kind in gears.kind_of_each_section:
        yield from _mesh_rows(gears, kind.pair)
    for kind in gears.kind_of_each_section:
        yield _backlash_row(scene, gears, kind)
    for kind in gears.kind_of_each_section:
        yield from _sliding_rows(kind.pair)
    for symbol, meaning, unit, value_of in ROWS:
        factor = math.cos(gears.helix.angle) ** IN_NORMAL_SECTION.get(symbol, 0)
        values = [factor * value_of(gear) for gear in gears.gears.values()]
        yield symbol, meaning, unit, values
        if symbol == "d_a":
            yield from _usable_tips(gears)
            yield from _tips(scene, gears)
            for kind in gears.kind_of_each_section:
                tail = _tail(gears, kind.pair)
                yield from _rolling(kind.pair, tuple(gears.gears), tail)
    yield from _modifications(scene, gears)
    yield from _surfaces(scene)


def _shared_rows(scene: Scene, gears: sets.GearSet) -> Iterator[Row]:
    """Yield module, pressure angle and helix, which all gears share."""
    module = scene.gears.module
    turned = gears.helix
    yield "m_n", "module", "mm", [1e3 * module]
    yield "α_n", "pressure angle", "°", [math.degrees(scene.gears.pressure_angle)]
    if turned.angle:
        face_width = gears.kinds[0].pair.face_width
        overlap = helix.overlap_ratio(face_width, turned.angle, module)
        yield "β", "helix angle", "°", [math.degrees(turned.angle)]
        yield "β_b", "base helix angle", "°", [math.degrees(turned.base_angle)]
        yield "ε_β", "overlap ratio", "", [overlap]


def _mesh_rows(gears: sets.GearSet, pair: GearPair) -> Iterator[Row]:
    """Yield how the gears of one mesh stand to each other."""
    tail = _tail(gears, pair)
    distance = 1e3 * pair.centre_distance
    angle = math.degrees(pair.working_pressure_angle)
    yield "a_w", f"working centre distance{tail}", "mm", [distance]
    yield "α_wt", f"working pressure angle{tail}", "°", [angle]
    yield "ε_α", f"transverse contact ratio{tail}", "", [pair.contact_ratio]
    if gears.helix.angle:
        total = pair.total_contact_ratio(gears.helix.base_angle)
        yield "ε_γ", f"total contact ratio{tail}", "", [total]


def _backlash_row(scene: Scene, gears: sets.GearSet, kind: sets.PairOfSet) -> Row:
    """Return the normal backlash of one mesh, as stated or as the gears leave it."""
    meaning = f"normal backlash{_tail(gears, kind.pair)}"
    stated = scene.mesh.of(kind.section).normal_backlash
    backlash = gears.transverse_backlash(kind, stated)
    if backlash is None:
        return "j_bn", meaning, "", ["none given"]
    return "j_bn", meaning, "mm", [1e3 * gears.helix.cosine * backlash]


def _sliding_rows(pair: GearPair) -> Iterator[Row]:
    """Yield the specific sliding of each gear where its root touches the mate's tip."""
    for number, (gear, end) in enumerate(zip(pair.gears, "AE", strict=True)):
        position = getattr(pair.path, end)
        sliding = float(pair.specific_sliding([position])[number, 0])
        mate = pair.gears[1 - number].name
        meaning = f"specific sliding of {gear.name} at {end}, on {mate}"
        yield "ζ", meaning, "", [sliding]


def _surfaces(scene: Scene) -> Iterator[Row]:
    """Yield what the gears are made of, how hard and how rough they are."""
    gear_options = scene.gears.gears().values()
    materials = [gear.material or scene.gears.material for gear in gear_options]
    yield "", "material", "", [material.name or "as given" for material in materials]
    hardness = [material.hardness or 0.0 for material in materials]
    if any(hardness):
        vickers = [
            f"{pressure / KGF_PER_MM2:.0f}" if pressure else "" for pressure in hardness
        ]
        yield "HV", "hardness of the flanks", "HV", vickers
    roughness = [1e6 * (gear.roughness_ra or 0.0) for gear in gear_options]
    if any(roughness):
        yield (
            "Ra",
            "roughness of the flanks",
            "µm",
            [f"{r:.3g}" if r else "" for r in roughness],
        )


def _tail(gears: sets.GearSet, pair: GearPair) -> str:
    """Return whose mesh a row is of, where there are several."""
    return (
        ""
        if len(gears.kinds) == 1
        else f", {' and '.join(gear.name for gear in pair.gears)}"
    )


def _rolling(pair: GearPair, members: tuple[str, ...], tail: str) -> Iterator[Row]:
    """Yield the diameters that roll on each other, and the clearance of each tip."""
    cosine = math.cos(pair.working_pressure_angle)
    working: dict[str, float | str] = {}
    clearance: dict[str, float | str] = {}
    for gear, mate in (pair.gears, pair.gears[::-1]):
        working[gear.name] = 2e3 * gear.base_radius / cosine
        reach = abs(
            gear.tip_radius + (-1.0 if pair.internal else 1.0) * mate.root_radius
        )
        clearance[gear.name] = 1e3 * abs(pair.centre_distance - reach)
    yield (
        "d_w",
        f"working pitch diameter{tail}",
        "mm",
        [working.get(name, "") for name in members],
    )
    root = f"clearance of the tip from the mate's root{tail}"
    yield "c", root, "mm", [clearance.get(name, "") for name in members]


def _usable_tips(gears: sets.GearSet) -> Iterator[Row]:
    """Yield where chamfers, or the edges of undercut mates, end the active flanks."""
    useful: dict[str, float | str] = {
        name: 2e3 * gear.active_tip_radius
        for name, gear in gears.gears.items()
        if gear.usable_tip_radius is not None
    }
    for kind in gears.kind_of_each_section:
        for number, gear in enumerate(kind.pair.gears):
            if kind.pair.overreach[number] > 0.0:
                useful[gear.name] = 1e3 * kind.pair.useful_tip_diameter(number)
    if useful:
        diameters = [useful.get(name, "") for name in gears.gears]
        yield "d_Na", "tip diameter where contact ends", "mm", diameters


def _tips(scene: Scene, gears: sets.GearSet) -> Iterator[Row]:
    """Yield tip alteration and tooth thickness at the tip, in the normal section."""
    module = scene.gears.module
    beta = gears.helix.angle
    options: dict[str, Any] = scene.gears.gears()
    alterations = []
    thicknesses = []
    for name, gear in gears.gears.items():
        allowance = options[name].tooth_thickness_allowance
        outwards = -1.0 if gear.internal else 1.0
        thinned = (
            0.0
            if allowance is None
            else allowance.mean / (2.0 * math.tan(scene.gears.pressure_angle))
        )
        shift = gear.profile_shift * gear.module - outwards * thinned
        height = outwards * (gear.tip_radius - gear.reference_radius - shift) / module
        addendum = options[name].addendum_coefficient or 1.0
        alterations.append(f"{round(height - addendum, 4) + 0.0:.4f}")
        at_tip = math.atan(math.tan(beta) * gear.tip_radius / gear.reference_radius)
        thicknesses.append(
            2e3 * gear.tip_radius * gear.half_angle(gear.tip_radius) * math.cos(at_tip)
        )
    yield "k", "tip alteration coefficient", "", alterations
    yield "s_an", "tooth thickness at the tip", "mm", thicknesses


def _modifications(scene: Scene, gears: sets.GearSet) -> Iterator[Row]:
    """Yield what is removed from the flanks on purpose, and how the axes deviate."""
    gear_options = scene.gears.gears().values()
    for key, (symbol, meaning) in MODIFICATIONS.items():
        removed = [getattr(gear, key) for gear in gear_options]
        amounts = [
            1e6 * (getattr(amount, "amount", amount) or 0.0) for amount in removed
        ]
        if any(amounts):
            yield symbol, meaning, "µm", [amount or "" for amount in amounts]
    starts: list[float | str] = []
    for gear in gears.gears.values():
        relief = gear.modification and gear.modification.tip_relief
        length = relief.length * (-1.0 if gear.internal else 1.0) if relief else 0.0
        starts.append(
            2e3 * math.hypot(gear.base_radius, gear.tip_curvature - length)
            if relief
            else ""
        )
    if any(starts):
        yield "d_Ca", "diameter where the tip relief starts", "mm", starts
    for kind in gears.kind_of_each_section:
        yield from _misalignment(scene, gears, kind)


def _misalignment(scene: Scene, gears: sets.GearSet, kind: PairOfSet) -> Iterator[Row]:
    """Yield the misalignment of a kind of mesh, at the least and largest torque."""
    axes = scene.mesh.of(kind.section).misalignment
    if axes is None:
        return
    torques = [condition.torque for condition in scene.operation.in_conditions()]
    angle = kind.pair.working_pressure_angle
    of_torque = {
        torque: axes.over_face(angle, torque) for torque in (min(torques), max(torques))
    }
    meaning = f"misalignment over the face{_tail(gears, kind.pair)}"
    if len(set(of_torque.values())) == 1:
        yield "F_βy", meaning, "µm", [1e6 * next(iter(of_torque.values()))]
        return
    for torque, over_face in of_torque.items():
        yield "F_βy", f"{meaning}, at {torque:.4g} N·m", "µm", [1e6 * over_face]


def _as_text(value: float, unit: str) -> str:
    """Return a length to the micrometre and an angle to a thousandth.

    Of anything else four digits.
    """
    if unit in ("mm", "°"):
        return f"{value:.3f}".rstrip("0").rstrip(".")
    return f"{value:.4g}" if value else "0"
