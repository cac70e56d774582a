"""How far the models of a run are known to be off.

Model errors are measurements, not estimates for this very scene; `docs/model_error.md`
says how each was made.
"""

from collections.abc import Iterator
from itertools import chain

from wearlab import assembly
from wearlab.mesh.face.contact import FaceContact
from wearlab.scene import Scene
from wearlab.wear.coefficients import CoefficientModel

TABLE = "tests/benchmarks/defaults_table.py"
SHARE_OFF = 0.027
"""Largest model error of the defaults, from elements: of the share of a pair [1]."""
ERROR_OFF = 0.007
"""The same of the mean static transmission error [1]."""
FORCE_OFF = 0.08
"""The same of the largest vibrating mesh force [1]."""
EXTENDED = (
    f"onset of contact: pairs carry within {100 * SHARE_OFF:.2g} % of the load of "
    "what elements alone give them, the mean transmission error is within "
    f"{100 * ERROR_OFF:.2g} %, the largest vibrating mesh force within "
    f"{100 * FORCE_OFF:.2g} % ({TABLE}, fresh_pairs.py)"
)
JUMP = (
    "onset of contact: a jump at A, which overstates forces and wear at A of "
    "vibrating pairs 1.2 to 2.8 times (campaigns/extended_contact.toml, two meshes)"
)
SERIES = (
    "excitation: a truncated series; forces and lives move by tens of per cent with "
    "its harmonics"
)
EVERYWHERE = (
    "load: even across the face, every tooth alike, isothermal; misalignment raises "
    "wear where the face carries most, in proportion (mesh.face_load_factor)"
)

EVERYWHERE_WARM = EVERYWHERE.replace(", isothermal", "")
"""The same of teeth that warm up."""
OVER_FACE = (
    "load over the face: every tooth alike, isothermal; bodies of the gears even along "
    "it"
)
"""What is known of the load of flanks with a width, before what their coupling leaves
out."""


def model_errors(scene: Scene, model: assembly.GearModel) -> str:
    """Return the known model errors of a scene with size and source, one a line.

    Parameters
    ----------
    scene : the scene
    model : its physics
    """
    lines = chain(
        _mesh_lines(scene, model),
        _wear_lines(scene),
        _thermal_lines(scene),
        _load_lines(scene, model),
    )
    return "\n".join(dict.fromkeys(lines))


def _mesh_lines(scene: Scene, model: assembly.GearModel) -> Iterator[str]:
    """Return the model errors of stiffness, excitation and gaps by kind of mesh."""
    kinds = {kind.section: kind for kind in model.gears.kinds}
    for section, kind in kinds.items():
        options = scene.mesh.of(section)
        stiffness = f"stiffness: {options.stiffness.model_error}"
        if len(kinds) > 1:
            gears = " and ".join(gear.name for gear in kind.pair.gears)
            stiffness = f"{gears}, {stiffness}"
        yield stiffness

        if not options.excitation.by_pairs:
            yield SERIES
        elif options.extended_contact:
            yield EXTENDED
        else:
            yield JUMP
        if options.contact.model_error and scene.wear is not None:
            yield f"gaps: {options.contact.model_error}"


def _wear_lines(scene: Scene) -> Iterator[str]:
    """Return the model error of the wear coefficient, none without one."""
    if scene.wear is not None and scene.wear.coefficient is not None:
        model_error = getattr(
            scene.wear.coefficient, "model_error", CoefficientModel.model_error
        )
        yield f"wear coefficient: {model_error}"


def _thermal_lines(scene: Scene) -> Iterator[str]:
    """Return the model error of the temperatures, none where they do not count."""
    if scene.thermal is not None:
        yield f"temperature: {scene.thermal.model_error}"


def _load_lines(scene: Scene, model: assembly.GearModel) -> Iterator[str]:
    """Return the model errors of how the load lies on the flanks."""
    if model.face is None:
        yield EVERYWHERE if scene.thermal is None else EVERYWHERE_WARM
        return
    for of_set, kind in zip(model.gears.kinds, model.face.kinds, strict=True):
        model_error = scene.mesh.of(of_set.section).coupling.model_error
        yield f"{OVER_FACE}: {model_error}{_softness(kind.contact)}"


def _softness(contact: FaceContact) -> str:
    """Return by how much bodies of elements are softer than plane ones, if any."""
    if contact.solid is None:
        return ""
    softer = 100.0 * (contact.solid.even / contact.section.body - 1.0)
    return (
        f"; at even load {softer.min():+.1f} to {softer.max():+.1f} % against plane "
        "elements"
    )
