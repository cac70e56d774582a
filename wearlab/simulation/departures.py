"""How far a scene's models are from what they stand for: beside the numerical error, which a run estimates.

The sizes are measurements, not estimates for this very scene; `docs/model_error.md` says how each was made.
"""

from collections.abc import Iterator
from typing import Any

from wearlab.scene import Scene
from wearlab.scene.build import Parts
from wearlab.scene.mesh import OneMesh

TABLE = "tests/validation/defaults_table.py"
STIFFNESS_OFF, SHARE_OFF, ERROR_OFF, FORCE_OFF = 0.026, 0.027, 0.007, 0.08
"""Largest departures of the defaults from elements: of the stiffness, of the share of a pair, of the mean
static transmission error, of the largest vibrating mesh force [1]."""
STIFFNESS = {
    "finite-element, weber": f"within {100 * STIFFNESS_OFF:.2g} % of converged plane elements, worn by up to "
    f"50 um, at 0.1 to 3 times the load ({TABLE})",
    "finite-element, yang-sun": "9 to 51 % too stiff: a constant contact is about three times stiffer than a "
    f"loaded one ({TABLE})",
    "potential-energy, shared": f"up to 26 % off plane elements, most under light loads ({TABLE})",
    "potential-energy, none": f"8 to 43 % off plane elements: two pairs count their bodies twice ({TABLE})",
}
GIVEN = "stiffness: as prescribed; nothing here tells how far it is off"
EXTENDED = (
    f"onset of contact: pairs carry within {100 * SHARE_OFF:.2g} % of the load of what elements alone give "
    f"them, the mean transmission error is within {100 * ERROR_OFF:.2g} %, the largest vibrating mesh force "
    f"within {100 * FORCE_OFF:.2g} % ({TABLE}, fresh_pairs.py)"
)
JUMP = (
    "onset of contact: a jump at A, which overstates forces and wear at A of vibrating pairs 1.2 to 2.8 "
    "times (campaigns/extended_contact.toml, two meshes)"
)
FIRST_ORDER = (
    "gaps: first order in wear; the unloaded error of Y23's internal flanks is 13 to 63 % too large at 20 "
    'to 100 um (mesh.contact = "exact" has no such error)'
)
SERIES = "excitation: a truncated series; forces and lives move by tens of per cent with its harmonics"
COEFFICIENT = "wear coefficient: usually known within a decade; depth and 1/life are proportional to it"
CALIBRATED = "wear coefficient: from one life; right at that torque and speed, predicted elsewhere"
EVERYWHERE = (
    "load: even across the face, every tooth alike, isothermal; misalignment raises wear where the face "
    "carries most, in proportion (mesh.face_load_factor)"
)


def departures(scene: Scene, parts: Parts) -> str:
    """Return the known departures of a scene's models with size and source, one a line."""
    return "\n".join(dict.fromkeys(_lines(scene, parts)))


def _lines(scene: Scene, parts: Parts) -> Iterator[str]:
    sections = {one.section: one for one in parts.gears.kinds}
    for section, one in sections.items():
        mesh = scene.mesh.of(section)
        name = " and ".join(gear.name for gear in one.pair.gears)
        yield f"{name}, {_stiffness(mesh)}" if len(sections) > 1 else _stiffness(mesh)
        if mesh.excitation.chosen == "pairs":
            yield EXTENDED if mesh.extended_contact else JUMP
        else:
            yield SERIES
        if mesh.contact.chosen == "displacement" and scene.wear is not None:
            yield FIRST_ORDER
    if scene.wear is not None and scene.wear.coefficient is not None:
        given: Any = scene.wear.coefficient
        yield CALIBRATED if getattr(given, "model", "") == "calibrated" else COEFFICIENT
    yield EVERYWHERE


def _stiffness(mesh: OneMesh) -> str:
    asked: Any = mesh.stiffness
    second = asked.hertz if asked.model == "finite-element" else getattr(asked, "coupling", "")
    said = STIFFNESS.get(f"{asked.model}, {second}")
    return GIVEN if said is None else f"stiffness: {said}"
