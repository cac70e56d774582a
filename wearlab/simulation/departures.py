"""How far a scene's models are from what they stand for: beside the numerical error, which a run estimates.

The sizes are measurements, not estimates for this very scene; `docs/model_error.md` says how each was made.
"""

from collections.abc import Iterator

from wearlab.scene import Scene
from wearlab.scene.build import Parts
from wearlab.wear.coefficients import CoefficientModel

TABLE = "tests/validation/defaults_table.py"
SHARE_OFF, ERROR_OFF, FORCE_OFF = 0.027, 0.007, 0.08
"""Largest departures of the defaults from elements: of the share of a pair, of the mean static transmission
error, of the largest vibrating mesh force [1]."""
EXTENDED = (
    f"onset of contact: pairs carry within {100 * SHARE_OFF:.2g} % of the load of what elements alone give "
    f"them, the mean transmission error is within {100 * ERROR_OFF:.2g} %, the largest vibrating mesh force "
    f"within {100 * FORCE_OFF:.2g} % ({TABLE}, fresh_pairs.py)"
)
JUMP = (
    "onset of contact: a jump at A, which overstates forces and wear at A of vibrating pairs 1.2 to 2.8 "
    "times (campaigns/extended_contact.toml, two meshes)"
)
SERIES = "excitation: a truncated series; forces and lives move by tens of per cent with its harmonics"
EVERYWHERE = (
    "load: even across the face, every tooth alike, isothermal; misalignment raises wear where the face "
    "carries most, in proportion (mesh.face_load_factor)"
)


def departures(scene: Scene, parts: Parts) -> str:
    """Return the known departures of a scene's models with size and source, one a line."""
    return "\n".join(dict.fromkeys(_lines(scene, parts)))


def _lines(scene: Scene, parts: Parts) -> Iterator[str]:
    sections = {kind.section: kind for kind in parts.gears.kinds}
    for section, part in sections.items():
        mesh = scene.mesh.of(section)
        name = " and ".join(gear.name for gear in part.pair.gears)
        stiffness = f"stiffness: {mesh.stiffness.departure}"
        yield f"{name}, {stiffness}" if len(sections) > 1 else stiffness
        if mesh.excitation.by_pairs:
            yield EXTENDED if mesh.extended_contact else JUMP
        else:
            yield SERIES
        if mesh.contact.departure and scene.wear is not None:
            yield f"gaps: {mesh.contact.departure}"
    if scene.wear is not None and scene.wear.coefficient is not None:
        told = getattr(scene.wear.coefficient, "departure", CoefficientModel.departure)
        yield f"wear coefficient: {told}"
    yield EVERYWHERE
