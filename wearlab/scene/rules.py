"""What sections must agree on, told by the path in the file."""

from collections.abc import Callable, Iterator
from itertools import pairwise
from operator import attrgetter
from typing import Any

from wearlab.scene import gears, sections
from wearlab.scene.errors import ErrorHarmonic
from wearlab.scene.mesh import OWN_MESHES, MeshSection, OneMesh
from wearlab.scene.operation import BACK
from wearlab.scene.thermal import tables_need_thermal, thermal_rules
from wearlab.wear.coefficients.calibrated import CalibratedCoefficient

Problems = Iterator[tuple[str, str]]
NARROWEST = 0.03  # modules
WIDEST = 1000.0  # modules


def _meshes_of_the_set(scene: sections.Sections, meshes: MeshSection) -> Problems:
    """What both kinds of mesh must share, and what pairs have not."""
    if not scene.gears.descriptor.is_pair:
        first, second = (meshes.of(section) for section in OWN_MESHES)
        for key in ("damping_in", "damping_law", "excitation"):
            if getattr(first, key) != getattr(second, key):
                yield (
                    f"mesh.planet_ring.{key}",
                    f"must be as in mesh.sun_planet: give it once, as mesh.{key}, and "
                    "leave it out of both",
                )
        return
    for section in OWN_MESHES:
        if getattr(meshes, section) is not None:
            yield (
                f"mesh.{section}",
                "belongs to planetary sets; this is a pair: write it under [mesh]",
            )
    if scene.operation.output_loaded is False:
        yield (
            "operation.load_torque",
            "'zero' needs a planetary set with a grounded output: leave it out",
        )


def _harmonics(
    scene: sections.Sections, harmonics: tuple[ErrorHarmonic, ...]
) -> Problems:
    """An error of one planet's mesh needs that planet."""
    planets = getattr(scene.gears, "planets", 1)
    for number, harmonic in enumerate(harmonics):
        last = harmonic.mesh.rsplit("-", 1)[-1]
        if last.isdigit() and int(last) > planets:
            problem = f"{harmonic.mesh!r}: of that kind there are meshes 1 to {planets}"
            yield f"errors.harmonic[{number}].mesh", problem


def _pins(scene: sections.Sections, members: dict[str, Any]) -> Problems:
    """Errors of the planets' pins stand at one member, so that they count once."""
    if all(
        getattr(members.get(member), "planet_position", ())
        for member in ("planet", "carrier")
    ):
        yield (
            "errors.planet.planet_position",
            "stands in errors.carrier as well, and both would add up: give the pins' "
            "tolerances in one place",
        )


def _pitches(scene: sections.Sections, members: dict[str, Any]) -> Problems:
    """Measured pitches turn with their member, are one a tooth, and count once."""
    errors: Any = scene.errors
    gear_options = scene.gears.gears()
    for name, member in members.items():
        table = getattr(member, "pitch", None)
        if table is None:
            continue
        path = f"errors.{name}.pitch"
        teeth = gear_options[name].teeth
        if not errors.slow.turns:
            yield (
                path,
                "are followed tooth after tooth: give errors.slow = 'hunting', not "
                f"{errors.slow.chosen!r}{_without_response(scene)}",
            )
        if len(table.cumulative) != teeth:
            yield (
                path,
                f"has {len(table.cumulative)} deviations, but {name} has {teeth} "
                "teeth: give one for each, in the order in which they come into mesh",
            )
        if member.total_composite:
            yield (
                path,
                f"is part of errors.{name}.total_composite, and both would add up: "
                "leave out total_composite",
            )


def _without_response(scene: sections.Sections) -> str:
    """Return the end of an advice to follow every tooth: no response does so."""
    followed = scene.dynamics is not None and scene.dynamics.response is not None
    return ", and leave out dynamics.response" if followed else ""


def _widths(scene: sections.Sections, gear_set: Any) -> Problems:
    """A width that no gear of this module has is written in a wrong unit."""
    low = NARROWEST * gear_set.module
    high = WIDEST * gear_set.module
    of_gears = {
        f"gears.{name}.face_width": gear.face_width
        for name, gear in gear_set.gears().items()
    }
    for path, width in {"gears.face_width": gear_set.face_width, **of_gears}.items():
        if width is not None and not low <= width <= high:
            proportion = f"{width / gear_set.module:.3g} times the module"
            yield (
                path,
                f"{1e3 * width:.4g} mm is {proportion}: no gear is so wide or narrow, "
                "check its unit",
            )


def _friction(scene: sections.Sections, friction: Any) -> Problems:
    whole = [
        mesh.excitation.chosen
        for mesh in scene.meshes.values()
        if not mesh.excitation.by_pairs
    ]
    if whole:
        yield (
            "dynamics.friction",
            f"acts pair by pair: give mesh.excitation = 'pairs', not {whole[0]!r}",
        )


def _moving_parts(scene: sections.Sections, dynamics: Any) -> Problems:
    """Meshes that move are damped, and a carrier that turns has a stated inertia."""
    for path, mesh in scene.meshes.items():
        if mesh.damping is None and mesh.damping_ratio is None:
            remedy = "give 'damping' such as '1000 N*s/m', or 'damping_ratio'"
            yield path, f"dynamics need mesh damping: {remedy}"
        yield from (
            ("mesh.damping_law", problem)
            for problem in mesh.damping_law.problems(scene)
        )
        if mesh.damps_always and not mesh.damping_law.acts_in_separation:
            law = repr(mesh.damping_law.chosen)
            yield (
                "mesh.damping_in",
                "'always' is the papers' dashpot: leave it out with damping_law = "
                f"{law}",
            )
    carrier = getattr(scene.gears, "carrier", None)
    for key, example in (("mass", "2.8 kg"), ("inertia", "11000 kg*mm^2")):
        if carrier is not None and getattr(carrier, key) is None:
            yield (
                f"gears.carrier.{key}",
                f"required with [dynamics], such as {example!r}",
            )


def _asked_itself(scene: sections.Sections, model: Any) -> Problems:
    """What a dynamic model, or the load that wears, itself asks of the scene."""
    yield from model.problems(scene)


def _response(scene: sections.Sections, response: Any) -> Problems:
    dynamics: Any = scene.dynamics
    if getattr(response.speed, "from") >= response.speed.to:
        yield (
            "dynamics.response.speed",
            "'from' must be below 'to'; direction = \"down\" goes the other way",
        )
    if not dynamics.follows_orbits:
        yield (
            "dynamics.response",
            f"follows orbits and needs method 'periodic', not {dynamics.method!r}",
        )
    if scene.errors is not None and scene.errors.slow.turns:
        measured = [f"errors.{name}.pitch" for name in scene.errors.measured_pitches]
        of_pitches = f" without {' and '.join(measured)}" if measured else ""
        problem = (
            f"does not follow errors.slow = {scene.errors.slow.chosen!r}; give "
            f"'averaged' or 'frozen'{of_pitches}, or leave it out"
        )
        yield "dynamics.response", problem


def _fluctuation(scene: sections.Sections, dynamics: Any) -> Problems:
    """A torque that fluctuates acts on a pair, and over speeds as the mesh does."""
    harmonics = scene.operation.fluctuation
    key = "operation.torque_fluctuation"
    if harmonics and scene.gears.kind == "planetary":
        yield (
            key,
            "acts on the input of a pair; the models of planetary sets have no such "
            "load: leave it out",
        )
    if dynamics.response is not None and not all(
        (harmonic.order or 0.5).is_integer() for harmonic in harmonics
    ):
        yield (
            key,
            "over speeds, as dynamics.response goes, give whole orders of the mesh "
            "frequency alone",
        )


def _requested(scene: sections.Sections, requested: tuple[str, ...]) -> Problems:
    """Results of a response on request need one; its spectra have their own orders."""
    if requested and scene.dynamics is None:
        model = "'torsional' with mesh.damping_ratio"
        if not scene.gears.descriptor.is_pair:
            carrier = "mass and inertia of gears.carrier"
            model = f"'planetary-torsional' with mesh.damping_ratio and {carrier}"
        yield (
            "store.variables",
            f"{requested[0]!r} is read off a motion, and under static load nothing "
            f"moves: give [dynamics], such as model = {model}, or leave it out of "
            "[store] variables (a case: drop = ['store.variables'])",
        )
    elif scene.dynamics is not None and scene.dynamics.response is not None:
        for name in requested:
            if name.endswith("_orders"):
                problem = (
                    f"{name!r} and dynamics.response have different orders: leave one "
                    "out"
                )
                yield "store.variables", problem


def _extended(scene: sections.Sections, section: Any) -> Problems:
    """Beyond A and E only tip corners touch, which some models do not know."""
    for path, mesh in scene.meshes.items():
        place = f"{path}.extended_contact"
        model = repr(mesh.contact.chosen)
        if mesh.extended_contact and not mesh.contact.tip_corners:
            knowing = (
                "'displacement'" if scene.face_keys else "'displacement' or 'exact'"
            )
            yield (
                place,
                f"{model} knows no tip corners: give mesh.contact = {knowing}, or "
                "leave it out",
            )
        if mesh.extended_contact and mesh.stiffness.of_mesh:
            whole = (
                "lets pairs engage one by one, and a stiffness of = 'mesh' has no "
                "pairs: give of = 'pair'"
            )
            yield place, f"{whole}, or leave it out"


def _beyond_path(scene: sections.Sections, beyond_path: bool) -> Problems:
    """Wear beyond A and E goes to points of both flanks, which contact must find."""
    if not beyond_path:
        return
    for path, mesh in scene.meshes.items():
        if not mesh.contact.pairs_corners:
            yield (
                "wear.beyond_path",
                f"{path}.contact = {mesh.contact.chosen!r} does not tell which points "
                f"meet beyond A and E: give {path}.contact = 'exact', or beyond_path = "
                "false",
            )
        elif not mesh.extended_contact:
            yield (
                "wear.beyond_path",
                "nothing touches beyond A and E without extended contact: leave "
                f"{path}.extended_contact out, or give beyond_path = false",
            )
    load = scene.wear.load if scene.wear is not None else None
    if load is not None and not load.tells_pairs:
        yield (
            "wear.beyond_path",
            f"wear.load = {load.chosen!r} does not say the force on each pair: let it "
            "have 'of_pairs', or give beyond_path = false",
        )


def _start(scene: sections.Sections, start: Any) -> Problems:
    members = scene.gears.toothed
    for name in start.replace:
        if name not in members:
            yield (
                "start.replace",
                f"{name!r} is no member with teeth; there are {', '.join(members)}",
            )
    if scene.wear is not None and scene.wear.initial is not None:
        yield (
            "start",
            "start and wear.initial both say how worn the flanks are: leave one out",
        )


def _conditions(scene: sections.Sections, operation: Any) -> Problems:
    """Conditions of operation share their flanks; stages need wear to carry over."""
    if not operation.blocks and not operation.stages:
        return
    word = "duty" if operation.blocks else "stage"
    if operation.reverses and not scene.gears.descriptor.is_pair:
        number = next(n for n, b in enumerate(operation.blocks, 1) if b.torque < 0.0)
        yield (
            "operation.duty",
            f"row {number} has a negative torque: in a planetary set either flank of "
            "a planet is the back of the other, and both would wear; leave such rows "
            "out, or compute them as a scene of their own with the other drive_flank",
        )
    if scene.dynamics is not None and scene.dynamics.response is not None:
        yield (
            "dynamics.response",
            f"follows one torque, not those of operation.{word}: leave one out",
        )
    if operation.stage is None:
        return
    if scene.wear is None or scene.wear.coefficient is None:
        yield (
            "operation.stage",
            "stages carry wear from one to the next and need wear.coefficient",
        )
    elif operation.stages[-1].cycles is None and scene.wear.until is None:
        yield "operation.stage", "the last stage needs 'cycles', or give wear.until"


def _calibrated(scene: sections.Sections, coefficient: Any) -> Problems:
    """A calibrated coefficient is one for all members; its flank belongs to the set."""
    wear: Any = scene.wear
    coefficients = coefficient.values() if isinstance(coefficient, dict) else ()
    if any(
        isinstance(member_coefficient, CalibratedCoefficient)
        for member_coefficient in coefficients
    ):
        yield (
            "wear.coefficient",
            "'calibrated' is one coefficient for all members, not one of several",
        )
    if not isinstance(coefficient, CalibratedCoefficient):
        return
    flanks = scene.gears.descriptor.flanks
    if coefficient.flank not in flanks:
        yield (
            "wear.coefficient.flank",
            f"no flank of this gear set; there are {', '.join(flanks)}",
        )
    if not wear.law.proportional:
        law = f"wear.law = {wear.law.chosen!r}"
        problem = (
            f"needs a rate proportional to it, and {law} says of none: give the "
            "coefficient's value"
        )
        yield "wear.coefficient", f"'calibrated' {problem}"


def _back_limits(scene: sections.Sections, wear: Any) -> Problems:
    """A limit on a back flank needs a condition that loads it."""
    for name in ("until", "snapshots"):
        flank = getattr(getattr(wear, name), "flank", None) or ""
        if flank.endswith(BACK) and not scene.operation.reverses:
            yield (
                f"wear.{name}.flank",
                f"{flank!r} is loaded by reversed torque alone, and no row of "
                f"operation.duty has one: give {flank.removesuffix(BACK)!r}",
            )


def _limits(scene: sections.Sections, wear: Any) -> Problems:
    if wear.until is not None and wear.coefficient is None:
        problem = (
            'required with until, such as {model = "constant", value = "9.65e-19 '
            'm^2/N"}'
        )
        yield "wear.coefficient", problem
    if (
        wear.snapshots is not None
        and wear.until is None
        and scene.operation.stage is None
    ):
        yield (
            "wear.snapshots",
            "snapshots need 'until': without it there is one wear state",
        )


def _initial(scene: sections.Sections, initial: Any) -> Problems:
    wear = scene.wear
    flanks = scene.gears.descriptor.flanks
    lawless = (
        "'worn' is by this wear law and needs 'wear.coefficient'; or give 'quadratic' "
        "or 'uniform'"
    )
    for flank in gears.ALL_FLANKS:
        wear_of_flank = getattr(initial, flank)
        if wear_of_flank is not None and flank not in flanks:
            yield (
                f"wear.initial.{flank}",
                f"no flank of this gear set; there are {', '.join(flanks)}",
            )
        elif (
            wear_of_flank is not None
            and wear_of_flank.by_law
            and wear is not None
            and wear.coefficient is None
        ):
            yield f"wear.initial.{flank}.shape", lawless
        elif wear_of_flank is not None and wear_of_flank.planet is not None:
            yield from _one_planet(scene, flank, wear_of_flank)


def _one_planet(scene: sections.Sections, flank: str, initial: Any) -> Problems:
    """Wear of one planet is that of a planet's flank, and there is such a planet."""
    path = f"wear.initial.{flank}.planet"
    planets = getattr(scene.gears, "planets", 0)
    if not flank.startswith("planet"):
        yield path, f"{flank} is no flank of a planet: leave it out"
    elif initial.planet > planets:
        yield path, f"there are planets 1 to {planets}, no planet {initial.planet}"
    elif initial.thins_teeth:
        problem = "of one planet: give sides = 'drive', or leave planet out"
        yield f"wear.initial.{flank}.sides", f"'both' thins teeth of all, not {problem}"
    elif scene.face_keys:
        yield (
            path,
            (
                f"planets of flanks with a width are alike: leave it out, or "
                f"{' and '.join(scene.face_keys)}"
            ),
        )


def _projection(scene: sections.Sections, wear: Any) -> Problems:
    """A projection that moves gaps needs gaps along the line of action, and no face."""
    if not wear.projection.moves_gaps:
        return
    name = repr(wear.projection.chosen)
    for path, mesh in scene.meshes.items():
        if not mesh.contact.along_line_of_action:
            yield (
                "wear.projection",
                f"{name} stretches gaps along the line of action, and {path}.contact = "
                f"{mesh.contact.chosen!r} has other gaps: give {path}.contact = "
                "'displacement', or projection = 'normal'",
            )
    if scene.face_keys:
        yield (
            "wear.projection",
            f"{name} is not known over the face: give projection = 'normal', or leave "
            f"{' and '.join(scene.face_keys)} out",
        )


def _needs(scene: sections.Sections, wear: Any) -> Problems:
    """The scene states what law, coefficients and films need of oil and flanks."""
    coefficients = scene.coefficients.values()
    films = [
        coefficient.film_model
        for coefficient in coefficients
        if coefficient.film_model is not None
    ]
    named = [("film = true", film) for film in films] + [
        (repr(variant.chosen), variant) for variant in (*coefficients, wear.law)
    ]
    asking = dict.fromkeys(
        (name, variant.needs) for name, variant in named if coefficients
    )
    gears = scene.gears.gears()
    dry = [] if scene.lubricant else ["lubricant"]
    smooth = [
        f"gears.{name}.roughness_ra"
        for name, gear in gears.items()
        if gear.roughness_ra is None
    ]
    metals = {
        name: gear.material or scene.gears.material for name, gear in gears.items()
    }
    soft = [
        f"gears.{name}.material"
        for name, metal in metals.items()
        if metal.hardness is None
    ]
    cold = (
        ["lubricant"] if getattr(scene.lubricant, "temperature", None) is None else []
    )
    unwarmed = ["thermal"] if scene.thermal is None else []
    oil = "in wear.coefficient needs [lubricant]"
    rough = "in wear.coefficient needs both roughnesses, such as '0.3 um'"
    for needed, missing, reason in (
        ("lubricant", dry, oil),
        ("roughness", smooth, rough),
        ("lambda_ratio", dry, oil),
        ("lambda_ratio", smooth, rough),
        ("hardness", soft, "needs the hardness of both flanks, such as '7 GPa'"),
        ("temperature", cold, "needs the temperature of the oil"),
        ("flank_temperature", unwarmed, "needs [thermal], which finds the flank's"),
    ):
        who = " and ".join(name for name, needs in asking if needed in needs)
        yield from ((path, f"{who} {reason}") for path in missing if who)


def _rating(scene: sections.Sections, rating: Any) -> Problems:
    """A rating is of one pair."""
    if not scene.gears.descriptor.is_pair:
        yield (
            "rating",
            "is of a pair, and this is a planetary set: leave it out, or rate each "
            "mesh as a pair",
        )
        return
    stated = [key for key in rating.of_pitting if getattr(rating, key) is not None]
    lacking = [f"rating.{key}" for key in rating.of_pitting if key not in stated]
    for name, gear in scene.gears.gears().items():
        lacking += [f"gears.{name}.roughness_ra"] if gear.roughness_ra is None else []
    if rating.equivalent_misalignment is None and scene.mesh.misalignment is None:
        lacking.append("mesh.misalignment (0 where gears are aligned)")
    if stated and lacking:
        yield (
            f"rating.{stated[0]}",
            f"the safety against pitting also takes {', '.join(lacking)}",
        )


def _face(scene: sections.Sections, gear_set: Any) -> Problems:
    """Options that flanks with a width exclude, each with what to give instead."""
    keys = scene.face_keys
    yield from _measured(scene, keys)
    if not keys:
        return
    without = f"or leave {' and '.join(keys)} out and give mesh.face_load_factor"
    yield from _hands(scene, gear_set.gears())
    yield from _one_face(gear_set, keys[0])
    for path, mesh in scene.meshes.items():
        yield from _mesh_of_a_face(mesh, path, keys[0])
    yield from _in_motion(scene, keys[0])
    if scene.errors is not None:
        yield (
            "errors",
            f"are not known over the face ({keys[0]}): leave [errors] out, {without}",
        )
    if scene.start is not None:
        yield "start", "takes wear over by profile alone: give wear.initial instead"
    if scene.wear is not None and isinstance(
        scene.wear.coefficient, CalibratedCoefficient
    ):
        yield (
            "wear.coefficient",
            "'calibrated' knows no face: give the coefficient's value",
        )


def _measured(scene: sections.Sections, keys: tuple[str, ...]) -> Problems:
    """A flank that was measured over its face needs points over the face."""
    for flank in scene.gears.descriptor.flanks:
        initial = scene.initial_of(flank)
        if initial is None or not getattr(initial, "over_the_face", False):
            continue
        path = f"wear.initial.{flank}"
        if not keys:
            problem = (
                "was measured over the face (face_position), and this scene has none"
            )
            yield (
                f"{path}.file",
                f"{problem}: give mesh.face_points, such as 41, or a file of one "
                "profile",
            )
        if initial.sides == "both":
            yield (
                f"{path}.sides",
                "'both' thins every slice alike, and a face is worn unevenly: give "
                "'drive'",
            )


def _in_motion(scene: sections.Sections, key: str) -> Problems:
    """Motions of flanks with a width use force over deflection, without friction."""
    if scene.dynamics is None:
        return
    if scene.dynamics.friction is not None:
        yield "dynamics.friction", f"is not known over the face ({key}): leave it out"
    if scene.dynamics.response is not None:
        yield (
            "dynamics.response",
            f"is not followed over the face ({key}): sweep operation.speed instead",
        )
    if not all(mesh.excitation.by_pairs for mesh in scene.meshes.values()):
        yield (
            "mesh.excitation",
            f"of flanks with a width ({key}) is their own: give 'pairs', or leave it "
            "out",
        )
    if scene.wear is not None and (
        scene.wear.load.needs_slope or scene.wear.wohler_slope is not None
    ):
        problem = f"counts forces of whole pairs, which a face ({key}) has not"
        yield (
            "wear.wohler_slope",
            f"{problem}: give wear.load = 'instant' or 'static', and leave it out",
        )


def _hands(scene: sections.Sections, members: dict[str, gears.Toothed]) -> Problems:
    """Hands belong to a helix, and those of gears in mesh must fit."""
    if scene.gears.helix_angle is None:
        for name in (name for name, gear in members.items() if gear.hand is not None):
            yield (
                f"gears.{name}.hand",
                "is that of a helix: give gears.helix_angle, or leave it out",
            )
        return
    for (first, hand), (second, mate_hand) in pairwise(scene.hands().items()):
        if (hand == mate_hand) != (second == "ring"):
            fitting = "the same hand" if second == "ring" else "opposite hands"
            problem = (
                f"{mate_hand!r} does not mesh with {first}'s {hand!r}: these gears "
                f"have {fitting}"
            )
            yield f"gears.{second}.hand", problem


def _one_face(gear_set: gears.SetOptions, key: str) -> Problems:
    """The meshes of a set are told over one face."""
    widths = {
        name: gear.face_width or gear_set.face_width
        for name, gear in gear_set.gears().items()
    }
    meshes = {min(widths[first], widths[second]) for first, second in pairwise(widths)}
    if len(meshes) > 1:
        faces = " and ".join(f"{1e3 * width:.4g}" for width in sorted(meshes))
        problem = (
            f"gives the meshes of this set faces of {faces} mm, and flanks with a "
            f"width ({key})"
        )
        narrowest = min(widths, key=lambda name: widths[name])
        yield (
            f"gears.{narrowest}.face_width",
            f"{problem} are told over one: give the planets the narrowest",
        )


def _mesh_of_a_face(mesh: OneMesh, path: str, key: str) -> Problems:
    coupling = mesh.coupling
    stiffness = mesh.stiffness
    contact = mesh.contact
    if mesh.face_load_factor != 1.0:
        problem = (
            f"is of scenes without a face, and {key} gives this one a face, of which "
            "it is a result"
        )
        yield f"{path}.face_load_factor", f"{problem}: leave one out"
    if stiffness.of_mesh:
        yield (
            f"{path}.stiffness.of",
            f"'mesh' has no pairs to share out over the face ({key}): give 'pair'",
        )
    if stiffness.turns_loads:
        yield (
            f"{path}.stiffness.load_direction",
            "'worn' turns the load of whole pairs, and slices of a face "
            f"({key}) stand beside each other: give 'ideal', or leave it out",
        )
    if coupling.of_contact and stiffness.prescribed:
        problem = (
            "must know what the contact itself yields, and a prescribed stiffness does "
            "not tell: give 'none'"
        )
        yield (
            f"{path}.face_coupling",
            f"{coupling.chosen!r} {problem}, or another mesh.stiffness",
        )
    if coupling.of_elements and not stiffness.of_elements:
        problem = (
            "goes with mesh.stiffness = 'finite-element': give that, or 'pasternak'"
        )
        yield f"{path}.face_coupling", f"{coupling.chosen!r} {problem}"
    if not contact.along_line_of_action or contact.by_threshold:
        problem = (
            f"flanks with a width ({key}) meet on the line of action: give "
            "'displacement'"
        )
        yield f"{path}.contact", problem


RULES: tuple[tuple[str, Callable[[sections.Sections, Any], Problems]], ...] = (
    ("mesh", _meshes_of_the_set),
    ("errors.harmonic", _harmonics),
    ("errors.members", _pins),
    ("errors.members", _pitches),
    ("gears", _widths),
    ("dynamics.friction", _friction),
    ("dynamics", _moving_parts),
    ("dynamics", _asked_itself),
    ("dynamics.response", _response),
    ("dynamics", _fluctuation),
    ("store.requested", _requested),
    ("mesh", _extended),
    ("start", _start),
    ("operation", _conditions),
    ("wear.coefficient", _calibrated),
    ("wear.load", _asked_itself),
    ("wear", _limits),
    ("wear", _back_limits),
    ("wear.initial", _initial),
    ("wear.beyond_path", _beyond_path),
    ("wear", _projection),
    ("wear", _needs),
    ("gears", _face),
    ("rating", _rating),
    ("gears", tables_need_thermal),
    ("thermal", thermal_rules),
)
"""Rules in the order in which they are problem, each with what a scene must have to be
asked: it gets that."""


def broken_rules(scene: sections.Sections) -> list[str]:
    """Return one line for each rule that a scene breaks."""
    problems: list[str] = []
    for place, rule in RULES:
        section = place.partition(".")[0]
        subject = None if getattr(scene, section) is None else attrgetter(place)(scene)
        if subject is not None:
            problems += (
                f"scene.{path}: {reason}" for path, reason in rule(scene, subject)
            )
    return problems
