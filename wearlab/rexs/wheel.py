"""One gear of a file: its teeth, tool, material and bodies, found by relations."""

import math
from collections.abc import Iterator
from typing import NamedTuple

from wearlab.rexs.document import Component, Document
from wearlab.rexs.draft import Draft, with_unit
from wearlab.rexs.quantities import Read, number, position, size, text

GEARS = ("cylindrical_gear", "ring_gear")
MAX_PRESSURE_ANGLE = 45.0
MAX_HELIX_ANGLE = 60.0
"""Angles [deg] beyond which no gear is made."""
RIGID = 1e3
"""Young's modulus [GPa] from which a material is that of a dummy shaft."""
FIRST_WITH_MIDDLE = (1, 1)
"""From this version on ``u_coordinate_on_shaft`` is the middle of a gear."""
MODULES_BEYOND_SHIFT = 3.0
"""How far, in modules, a tip or root circle may lie from the reference circle."""


class Wheel(NamedTuple):
    """A gear of a file with what belongs to it.

    Parameters
    ----------
    document : the file, in one load case
    gear : the gear itself
    flank : the flank whose values hold; None where the file has none
    """

    document: Document
    gear: Component
    flank: Component | None

    @property
    def teeth(self) -> float | None:
        """Its number of teeth, positive also for rings; None where it has none."""
        read = size(self.gear, "number_of_teeth")
        return None if read is None else read.value

    @property
    def pressure_angle(self) -> float:
        """Pressure angle of the normal section [rad], 20° where none can be."""
        read = number(self.flank, "normal_pressure_angle", "deg")
        if read is None or not 0.0 < read.value < MAX_PRESSURE_ANGLE:
            return math.radians(20.0)
        return math.radians(read.value)

    @property
    def helix_angle(self) -> float:
        """Helix angle at the reference circle, without sign [rad]; 0 if none can be."""
        read = self.helix
        if read is None or not abs(read.value) < MAX_HELIX_ANGLE:
            return 0.0
        return math.radians(abs(read.value))

    @property
    def is_ring(self) -> bool:
        """Whether its teeth point inwards."""
        read = number(self.gear, "number_of_teeth")
        return self.gear.type == "ring_gear" or (read is not None and read.value < 0)

    @property
    def helix(self) -> Read | None:
        """Its helix angle at the reference circle, positive for a right hand [deg]."""
        return number(self.gear, "helix_angle_reference_diameter", "deg")

    @property
    def shaft(self) -> Component | None:
        """The shaft that it sits on."""
        shafts = self.document.partners("assembly", "part", self.gear.id, "assembly")
        return next((part for part in shafts if part.type == "shaft"), None)

    @property
    def middle(self) -> float | None:
        """The place of its middle along the axes of the gear unit [mm]."""
        vector = position(self.gear, "support_vector")
        return None if vector is None else vector[0]


def wheel_of(document: Document, gear: Component, draft: Draft) -> Wheel:
    """Return a gear with the flank whose values hold.

    Where left and right differ, the loaded one holds, or the right one where the file
    does not say which is loaded.

    Parameters
    ----------
    document : the file
    gear : one of its gears
    draft : takes a remark where the flanks differ
    """
    relation = next(document.related("flank", "gear", gear.id), None)
    members = relation.members if relation is not None else {}
    left = document.components.get(members.get("left", ""))
    right = document.components.get(members.get("right", ""))
    if left is None or right is None or _same(left, right):
        return Wheel(document, gear, right or left)

    loaded = _loaded_flank(document, gear)
    side = loaded or "right"
    reason = "loaded" if loaded else "the file does not say which one is loaded"
    draft.left_out.append(
        f"component {gear.id}: left and right flank differ; the {side} one is taken "
        f"({reason})"
    )
    return Wheel(document, gear, left if side == "left" else right)


def _same(left: Component, right: Component) -> bool:
    """Tell whether two flanks have the same values."""
    return dict(left.attributes) == dict(right.attributes)


def _loaded_flank(document: Document, gear: Component) -> str | None:
    """Return "left" or "right" where the data of the gear in its stage say so."""
    for relation in document.related("stage_gear_data", "gear", gear.id):
        data = document.components.get(relation.members.get("stage_gear_data", ""))
        stated = text(data, "loaded_tooth_flank") or ""
        for side in ("left", "right"):
            if side in stated.lower():
                return side
    return None


def put_gear(draft: Draft, member: str, wheel: Wheel, module: float) -> None:
    """Write the keys of one gear.

    Parameters
    ----------
    draft : the campaign file
    member : such as ``pinion``
    wheel : the gear
    module : normal module [mm]
    """
    section = f"gears.{member}"
    gear = wheel.gear
    if not draft.take(section, "teeth", size(gear, "number_of_teeth")):
        draft.missing.append(f"{section}.teeth (component {gear.id}, number_of_teeth)")

    draft.take(
        section,
        "profile_shift_coefficient",
        number(wheel.flank, "addendum_modification_coefficient"),
    )
    _put_circles(draft, section, wheel, module)
    _put_tool(draft, section, wheel, module)
    _put_bodies(draft, section, wheel)
    _put_material(draft, section, wheel)
    _put_thickness(draft, section, wheel)
    _put_roughness(draft, section, wheel)
    _put_flank_shape(draft, section, wheel)


def _put_circles(draft: Draft, section: str, wheel: Wheel, module: float) -> None:
    """Write tip and root diameters that can be; leave the others out with a remark."""
    teeth = wheel.teeth or 0.0
    reference = module * teeth / math.cos(wheel.helix_angle)
    reach = 2.0 * MODULES_BEYOND_SHIFT * module

    for key in ("tip_diameter", "root_diameter"):
        read = number(wheel.gear, key, "mm")
        if read is None:
            continue
        read = read._replace(value=abs(read.value))
        if abs(read.value - reference) > reach:
            draft.left_out.append(
                f"{read.source} = {read.value:g} mm: no {key.replace('_', ' ')} at a "
                f"reference diameter of {reference:.6g} mm"
            )
            continue
        draft.take(section, key, read, "mm")

    entries = draft.entries.get(section, {})
    if "tip_diameter" not in entries:
        draft.take(
            section,
            "addendum_coefficient",
            number(wheel.gear, "addendum_coefficient_basic_profile")
            or number(wheel.flank, "addendum_coefficient_basic_profile"),
        )
    if "tip_diameter" not in entries and "addendum_coefficient" not in entries:
        draft.missing.append(
            f"{section}.tip_diameter: an addendum_coefficient of 1 is assumed"
        )


def _tools(wheel: Wheel) -> Iterator[Component]:
    """Yield the tools of a gear, by the relations of every version."""
    document = wheel.document
    yield from document.partners(
        "ordered_reference", "origin", wheel.gear.id, "referenced"
    )
    for piece in (wheel.flank, wheel.gear):
        if piece is not None:
            yield from document.partners(
                "manufacturing_step", "workpiece", piece.id, "tool"
            )


def _put_tool(draft: Draft, section: str, wheel: Wheel, module: float) -> None:
    """Write what the tool leaves at the root: its own addendum and its rounding."""
    tool = next((part for part in _tools(wheel) if part.type.endswith("_tool")), None)
    if tool is None:
        if "root_diameter" not in draft.entries.get(section, {}):
            draft.missing.append(
                f"{section}: no tool; dedendum 1.25 and root rounding 0.38 are assumed"
            )
        return

    addendum = number(tool, "addendum_coefficient_reference_profile")
    if tool.type == "cutter_wheel_tool":
        _put_cutter_root(draft, section, wheel, tool, module)
    elif "root_diameter" not in draft.entries.get(section, {}):
        draft.take(section, "dedendum_coefficient", addendum)

    if "fillet_radius_coefficient" not in draft.entries.get(section, {}):
        rounding = _rounding(tool, module)
        draft.take(section, "fillet_radius_coefficient", rounding)

    if number(tool, "protuberance_height_coefficient") or number(tool, "protuberance"):
        draft.left_out.append(f"component {tool.id}: protuberance of the tool")


def _rounding(tool: Component, module: float) -> Read | None:
    """Return the rounding of a tool's tip, in modules; None where it has none."""
    rounding = number(tool, "tip_corner_radius_factor_reference_profile")
    radius = number(tool, "tip_corner_radius_reference_profile", "mm")
    if rounding is None and radius is not None:
        return radius._replace(value=radius.value / module)
    return rounding


def _put_cutter_root(
    draft: Draft, section: str, wheel: Wheel, tool: Component, module: float
) -> None:
    """Write the root diameter that a cutter wheel makes, and the fillet of a ring.

    The cutter works at ``a_0 = (z − z_0) m cos α / (2 cos α_w0)`` from the axis of a
    ring (plus, of an external gear); its tip makes the root. The involute of a ring
    ends where that of the cutter does, ``ρ_Ff = a_0 sin α_w0 + ρ_F0``, with ``ρ_F0 = ρ
    + √((r_a0 − ρ)² − r_b0²)`` of a tip rounded by ρ. A circle that touches the root
    circle and the involute there has the radius ``(r_f² − r_Ff²) / (2 (r_f − ρ_Ff))``.
    """
    from wearlab.gears.shifts import inverse_involute, involute

    teeth = wheel.teeth
    cutter_teeth = size(tool, "number_of_teeth")
    addendum = number(tool, "addendum_coefficient_reference_profile")
    shift = number(wheel.flank, "addendum_modification_coefficient")
    if (
        "root_diameter" in draft.entries.get(section, {})
        or teeth is None
        or cutter_teeth is None
        or addendum is None
        or wheel.helix_angle != 0.0
        or (wheel.is_ring and teeth <= cutter_teeth.value)
    ):
        draft.left_out.append(f"component {tool.id}: the cutter wheel")
        return

    alpha = wheel.pressure_angle
    ring_shift = shift.value if shift is not None else 0.0
    sign = -1.0 if wheel.is_ring else 1.0
    sum_of_teeth = teeth + sign * cutter_teeth.value
    working = inverse_involute(
        involute(alpha) + 2.0 * ring_shift * math.tan(alpha) / sum_of_teeth
    )
    distance = 0.5 * module * sum_of_teeth * math.cos(alpha) / math.cos(working)
    cutter_tip = module * (0.5 * cutter_teeth.value + addendum.value)
    root = 2.0 * (distance - sign * cutter_tip)

    draft.put(
        section,
        "root_diameter",
        with_unit(float(f"{root:.12g}"), "mm"),
        f"derived from component {tool.id}, a cutter wheel of "
        f"{cutter_teeth.value:g} teeth",
    )
    draft.derived.append(f"{section}.root_diameter from the tip of the cutter wheel")
    if not wheel.is_ring:
        return

    rounding = _rounding(tool, module)
    rho = module * (rounding.value if rounding is not None else 0.0)
    cutter_base = 0.5 * module * cutter_teeth.value * math.cos(alpha)
    square = (cutter_tip - rho) ** 2 - cutter_base**2
    if square <= 0.0:
        return
    curvature = distance * math.sin(working) + rho + math.sqrt(square)
    form_radius = math.hypot(0.5 * module * teeth * math.cos(alpha), curvature)
    fillet = ((0.5 * root) ** 2 - form_radius**2) / (root - 2.0 * curvature)
    if fillet <= 0.0:
        return
    draft.put(
        section,
        "fillet_radius_coefficient",
        float(f"{fillet / module:.9g}"),
        f"derived from component {tool.id}: the involute ends at "
        f"{2.0 * form_radius:.6g} mm",
    )
    draft.derived.append(
        f"{section}.fillet_radius_coefficient from where the cutter's involute ends"
    )


def _put_bodies(draft: Draft, section: str, wheel: Wheel) -> None:
    """Write the bore, of a ring the rim: the gear's own, or its shaft's section."""
    shaft_section = _section_at(wheel)
    outside = _largest(shaft_section, "outer_diameter")
    if wheel.is_ring:
        rim = number(wheel.gear, "outer_diameter", "mm") or outside
        if not draft.take(section, "rim_diameter", rim, "mm"):
            draft.missing.append(f"{section}.rim_diameter, which a ring needs")
        return

    bore = number(wheel.gear, "inner_diameter", "mm") or outside
    if bore is not None and bore.value > 0.0:
        draft.take(section, "bore_diameter", bore, "mm")


def _section_at(wheel: Wheel) -> Component | None:
    """Return the section of the shaft that the middle of the gear stands on."""
    shaft = wheel.shaft
    start = number(wheel.gear, "u_coordinate_on_shaft", "mm")
    if shaft is None or start is None:
        return None

    middle = start.value
    if version_of(wheel.document) < FIRST_WITH_MIDDLE:
        width = number(wheel.gear, "face_width", "mm")
        middle += 0.5 * width.value if width is not None else 0.0

    for part in wheel.document.partners("assembly", "assembly", shaft.id, "part"):
        begin = number(part, "u_coordinate_on_shaft", "mm")
        length = number(part, "length", "mm")
        if part.type != "shaft_section" or length is None:
            continue
        offset = middle - (begin.value if begin is not None else 0.0)
        if 0.0 <= offset <= length.value:
            return part
    return None


def version_of(document: Document) -> tuple[int, ...]:
    """Return the version of the format as numbers.

    Parameters
    ----------
    document : the file
    """
    parts = document.version.split(".")
    return tuple(int(part) for part in parts if part.isdigit())


def _largest(section: Component | None, attribute: str) -> Read | None:
    """Return the larger one of a section's two end diameters [mm]."""
    ends = [number(section, f"{attribute}_{end}", "mm") for end in ("begin", "end")]
    stated = [read for read in ends if read is not None]
    return max(stated, key=lambda read: read.value) if stated else None


def _put_material(draft: Draft, section: str, wheel: Wheel) -> None:
    """Write the elastic constants of a gear's material, else of its shaft's."""
    for origin in (wheel.gear, wheel.shaft):
        material = _material_of(wheel.document, origin)
        if material is None or origin is None:
            continue

        modulus = number(material, "elastic_modulus", "GPa")
        if modulus is not None and modulus.value >= RIGID:
            draft.left_out.append(
                f"component {material.id}: a rigid material ({modulus.value:g} GPa) of "
                "a dummy shaft"
            )
            continue

        table = _material_table(draft, section, material)
        if table is not None:
            draft.put(section, "material", table, f"component {material.id}")
            return

    draft.missing.append(f"{section}.material: steel is assumed")


def _material_of(document: Document, origin: Component | None) -> Component | None:
    """Return the material that a component refers to."""
    if origin is None:
        return None
    partners = document.partners("reference", "origin", origin.id, "referenced")
    return next((part for part in partners if part.type == "material"), None)


def _material_table(
    draft: Draft, section: str, material: Component
) -> dict[str, object] | None:
    """Return a material as a campaign file writes it, None without a modulus."""
    modulus = number(material, "elastic_modulus", "GPa")
    ratio = number(material, "poisson_ratio")
    if modulus is None or ratio is None:
        return None

    density = number(material, "density", "kg/m^3")
    if density is None:
        draft.missing.append(f"{section}.material.density: 7850 kg/m^3 is assumed")

    table: dict[str, object] = {
        "youngs_modulus": with_unit(modulus.value, "GPa"),
        "poisson_ratio": ratio.value,
        "density": with_unit(
            density.value if density is not None else 7850.0, "kg/m^3"
        ),
    }
    hardness = number(material, "surface_hardness_vickers", "HV")
    if hardness is not None:
        table["hardness"] = with_unit(hardness.value, "HV")
    return table


def _put_thickness(draft: Draft, section: str, wheel: Wheel) -> None:
    """Write the allowance of the tooth thickness, from span to the normal section."""
    cosine = math.cos(wheel.pressure_angle)
    allowance = {}
    for end in ("upper", "lower"):
        attribute = f"{end}_backlash_allowance_referenced_to_span"
        read = number(wheel.gear, attribute, "mm") or number(
            wheel.flank, attribute, "mm"
        )
        if read is not None:
            micrometres = float(f"{1e3 * read.value / cosine:.12g}")
            allowance[end] = with_unit(micrometres, "um")
    if len(allowance) == 2:
        draft.put(
            section,
            "tooth_thickness_allowance",
            allowance,
            f"component {wheel.gear.id}, backlash allowances referenced to span",
        )

    series = text(
        wheel.gear, "tooth_thickness_deviation_tolerance_series_din_3967_1978"
    )
    if series and not allowance:
        draft.left_out.append(
            f"component {wheel.gear.id}: tooth thickness {series} of DIN 3967, without "
            "numbers"
        )


def _put_roughness(draft: Draft, section: str, wheel: Wheel) -> None:
    """Write the mean roughness R_a of the flank."""
    read = number(
        wheel.flank, "arithmetic_mean_roughness_flank_iso_4287_1997", "mm"
    ) or number(wheel.gear, "arithmetic_mean_roughness_flank_iso_4287_1997", "mm")
    if read is not None and read.value > 0.0:
        micrometres = float(f"{1e3 * read.value:.12g}")
        draft.put(section, "roughness_ra", with_unit(micrometres, "um"), read.source)


def _put_flank_shape(draft: Draft, section: str, wheel: Wheel) -> None:
    """Write tip relief, lead crowning and end relief; name what is left out."""
    flank = wheel.flank
    if flank is None:
        return

    _put_chamfer(draft, section, wheel)
    for part in [flank, *_modifications(wheel.document, flank)]:
        _put_tip_relief(draft, section, part)
        _put_lead(draft, section, part)
        for attribute in (
            "profile_slope",
            "helix_slope",
            "profile_twist",
            "profile_deviation",
            "topographical_modification",
        ):
            stated = part.attributes.get(attribute)
            if stated is not None and stated.value not in (None, 0.0, False):
                draft.left_out.append(f"component {part.id}, {attribute}")


def _put_chamfer(draft: Draft, section: str, wheel: Wheel) -> None:
    """Write the end of the active flank: the chamfer's height, or its diameter."""
    for part in (wheel.flank, wheel.gear):
        chamfer = number(part, "tooth_tip_chamfer", "mm")
        if chamfer is not None and chamfer.value > 0.0:
            draft.take(section, "tip_chamfer", chamfer, "mm")
            return

    for part in (wheel.gear, wheel.flank):
        for attribute in ("active_tip_diameter", "tip_form_diameter"):
            read = number(part, attribute, "mm")
            if read is not None and read.value != 0.0:
                read = read._replace(value=abs(read.value))
                _put_usable_tip(draft, section, read, is_ring=wheel.is_ring)
                return


def _put_usable_tip(draft: Draft, section: str, read: Read, *, is_ring: bool) -> None:
    """Write a diameter at which the flank ends, where it lies within the tip."""
    tip = draft.entries.get(section, {}).get("tip_diameter")
    if tip is not None:
        within = read.value - float(str(tip.value).split()[0])
        if (within if is_ring else -within) < 0.0:
            draft.left_out.append(
                f"{read.source} = {read.value:g} mm: beyond the tip diameter"
            )
            return
        if within == 0.0:
            return
    draft.take(section, "usable_tip_diameter", read, "mm")


def _modifications(document: Document, flank: Component) -> Iterator[Component]:
    """Yield the modifications that a flank refers to."""
    for part in document.partners("reference", "origin", flank.id, "referenced"):
        if part.type not in ("material", "lubricant"):
            yield part


def _put_tip_relief(draft: Draft, section: str, part: Component) -> None:
    """Write a tip relief that begins at a diameter or has a length."""
    depth = number(part, "tip_relief_depth", "mm")
    if depth is None or depth.value <= 0.0:
        return

    relief: dict[str, object] = {
        "amount": with_unit(float(f"{1e3 * depth.value:.12g}"), "um")
    }
    start = number(part, "tip_relief_datum_diameter", "mm")
    length = number(part, "tip_relief_datum_length", "mm")
    if start is not None:
        relief["start_diameter"] = with_unit(start.value, "mm")
    elif length is not None:
        relief["length"] = with_unit(length.value, "mm")
    else:
        draft.left_out.append(f"{depth.source}: a tip relief without where it begins")
        return

    shape = text(part, "shape_of_relief")
    if shape in ("linear", "parabolic"):
        relief["shape"] = shape
    elif shape:
        draft.left_out.append(f"component {part.id}, shape_of_relief {shape}")
    draft.put(section, "tip_relief", relief, depth.source)


def _put_lead(draft: Draft, section: str, part: Component) -> None:
    """Write crowning and relief over the face where both ends are alike."""
    crowning = _alike(draft, part, "helix_crowning_amount")
    if crowning is not None:
        micrometres = float(f"{1e3 * crowning.value:.12g}")
        draft.put(
            section, "lead_crowning", with_unit(micrometres, "um"), crowning.source
        )

    depth = _alike(draft, part, "end_relief_depth")
    length = _alike(draft, part, "end_relief_length")
    if depth is not None and length is not None:
        relief = {
            "amount": with_unit(float(f"{1e3 * depth.value:.12g}"), "um"),
            "length": with_unit(length.value, "mm"),
        }
        draft.put(section, "end_relief", relief, depth.source)


def _alike(draft: Draft, part: Component, attribute: str) -> Read | None:
    """Return a value that both ends of the face have, None where they differ."""
    datum = number(part, f"{attribute}_datum_face", "mm")
    opposite = number(part, f"{attribute}_non_datum_face", "mm")
    if datum is None and opposite is None:
        return None
    if datum is None or opposite is None or datum.value != opposite.value:
        draft.left_out.append(
            f"component {part.id}, {attribute}: the two ends of the face differ"
        )
        return None
    return datum if datum.value > 0.0 else None
