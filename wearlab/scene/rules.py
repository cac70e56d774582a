"""What sections must agree on, told by the path in the file."""

from collections.abc import Iterator
from typing import Any

from wearlab.mesh.damping_laws import ViscousDamping
from wearlab.scene import gears, mesh, sections
from wearlab.scene.face import face_rules
from wearlab.wear.coefficients import CalibratedCoefficient

Problems = Iterator[tuple[str, str]]


def _meshes_of_the_set(scene: sections.Sections) -> Problems:
    """What both kinds of mesh must share, and what pairs have not."""
    if not scene.gears.descriptor.is_pair:
        pair = [scene.mesh.of(section) for section in mesh.OWN_MESHES]
        for key in ("damping_in", "damping_law", "excitation"):
            if getattr(pair[0], key) != getattr(pair[1], key):
                yield f"mesh.planet_ring.{key}", f"must be as in mesh.sun_planet: write mesh.{key} for both"
        return
    for section in mesh.OWN_MESHES:
        if getattr(scene.mesh, section) is not None:
            yield f"mesh.{section}", "belongs to planetary sets; this is a pair: write it under [mesh]"
    if scene.operation.output_loaded is False:
        yield "operation.load_torque", "'zero' needs a planetary set with a grounded output"


def _harmonics(scene: sections.Sections) -> Problems:
    """An error of one planet's mesh needs that planet."""
    planets = getattr(scene.gears, "planets", 1)
    for number, harmonic in enumerate(scene.errors.harmonic if scene.errors is not None else ()):
        last = harmonic.mesh.rsplit("-", 1)[-1]
        if last.isdigit() and int(last) > planets:
            yield (
                f"errors.harmonic[{number}].mesh",
                f"{harmonic.mesh!r}: of that kind there are meshes 1 to {planets}",
            )


def _pins(scene: sections.Sections) -> Problems:
    """The planets' pins stand in one member's errors: written twice, they would count twice."""
    given = scene.errors.members if scene.errors is not None else {}
    if all(getattr(given.get(member), "planet_position", ()) for member in ("planet", "carrier")):
        yield (
            "errors.planet.planet_position",
            "stands in errors.carrier as well, and both would add up: give the pins' tolerances in one place",
        )


def _widths(scene: sections.Sections) -> Problems:
    """A width that no gear of this module has is in another unit than its author thinks."""
    low, high = (share * scene.gears.module for share in WIDTHS)
    own = {f"gears.{name}.face_width": gear.face_width for name, gear in scene.gears.gears().items()}
    for path, width in {"gears.face_width": scene.gears.face_width, **own}.items():
        if width is not None and not low <= width <= high:
            told = f"{width / scene.gears.module:.3g} times the module"
            yield path, f"{1e3 * width:.4g} mm is {told}: no gear is so wide or narrow, check its unit"


WIDTHS = 0.03, 1000.0  # modules
RULES_OF_SETS = (_meshes_of_the_set, _harmonics, _pins, _widths)


def broken_rules(scene: sections.Sections) -> list[str]:
    """Return one line for each rule that a scene breaks."""
    rules = (
        *RULES_OF_SETS,
        _friction,
        _damping,
        _carrier,
        _motion,
        _response,
        _fluctuation,
        _requested,
        _extended,
        _start,
        _conditions,
        _calibrated,
        _load,
        _limits,
        _initial,
        _needs,
        face_rules,
        _rating,
    )
    return [f"scene.{path}: {reason}" for rule in rules for path, reason in rule(scene)]


def _toothed(scene: sections.Sections) -> tuple[str, ...]:
    return scene.gears.toothed


def _sections(scene: sections.Sections) -> tuple[str, ...]:
    """Return the names of the tables that may say something of one kind of mesh."""
    return scene.gears.descriptor.sections


def _damping(scene: sections.Sections) -> Problems:
    for section in _sections(scene) if scene.dynamics is not None else ():
        mesh = scene.mesh.of(section)
        if mesh.damping is None and mesh.damping_ratio is None:
            yield (
                f"mesh.{section}".rstrip("."),
                "dynamics need mesh damping: give 'damping' such as '1000 N*s/m', or 'damping_ratio'",
            )
        for problem in mesh.damping_law.problems(scene):
            yield "mesh.damping_law", problem
        if mesh.damps_always and not isinstance(mesh.damping_law, ViscousDamping):
            yield (
                "mesh.damping_in",
                "'always' is the papers' dashpot: leave it out with damping_law = "
                f"{mesh.damping_law.chosen!r}",
            )


def _friction(scene: sections.Sections) -> Problems:
    if scene.dynamics is None or scene.dynamics.friction is None:
        return
    for section in _sections(scene):
        if not scene.mesh.of(section).excitation.by_pairs:
            yield (
                "dynamics.friction",
                "acts pair by pair: give mesh.excitation = 'pairs', not "
                f"{scene.mesh.of(section).excitation.chosen!r}",
            )
            return


def _motion(scene: sections.Sections) -> Problems:
    """What a dynamic model itself asks of the scene."""
    if scene.dynamics is not None:
        yield from scene.dynamics.problems(scene)


def _carrier(scene: sections.Sections) -> Problems:
    """What turns has an inertia; nothing is known of a carrier's shape that could tell it."""
    carrier: Any = getattr(scene.gears, "carrier", None)
    if carrier is None or scene.dynamics is None:
        return
    for key, example in (("mass", "2.8 kg"), ("inertia", "11000 kg*mm^2")):
        if getattr(carrier, key) is None:
            yield f"gears.carrier.{key}", f"required with [dynamics], such as {example!r}"


def _response(scene: sections.Sections) -> Problems:
    if scene.dynamics is None or scene.dynamics.response is None:
        return
    speed: Any = scene.dynamics.response.speed
    if getattr(speed, "from") >= speed.to:
        yield "dynamics.response.speed", "'from' must be below 'to'; direction = \"down\" goes the other way"
    if not scene.dynamics.follows_orbits:
        yield (
            "dynamics.response",
            f"follows orbits and needs method 'periodic', not {scene.dynamics.method!r}",
        )
    if scene.errors is not None and scene.errors.slow.turns:
        yield (
            "dynamics.response",
            f"does not follow errors.slow = {scene.errors.slow.chosen!r}; give 'averaged' or 'frozen'",
        )


def _fluctuation(scene: sections.Sections) -> Problems:
    """A torque that fluctuates acts on a pair, and over speeds as the mesh does."""
    harmonics = scene.operation.fluctuation
    if not harmonics or scene.dynamics is None:
        return
    key = "operation.torque_fluctuation"
    if scene.gears.kind == "planetary":
        yield key, "acts on the input of a pair; the models of planetary sets have no such load: leave it out"
    if scene.dynamics.response is not None and not all((one.order or 0.5).is_integer() for one in harmonics):
        yield key, "over speeds, as dynamics.response goes, give whole orders of the mesh frequency alone"


def _requested(scene: sections.Sections) -> Problems:
    """What is read off a response on request needs one, and its spectra have orders of their own."""
    if scene.store.requested and scene.dynamics is None:
        yield (
            "store.variables",
            f"{scene.store.requested[0]!r} is read off a motion, and under static load nothing moves: give "
            "[dynamics], such as model = 'torsional' with mesh.damping_ratio, or leave it out of [store] "
            "variables (a case: drop = ['store.variables'])",
        )
    elif scene.dynamics is not None and scene.dynamics.response is not None:
        for name in scene.store.requested:
            if name.endswith("_orders"):
                yield (
                    "store.variables",
                    f"{name!r} and dynamics.response have different orders: leave one out",
                )


def _load(scene: sections.Sections) -> Problems:
    """What the load that wears itself asks of the scene."""
    if scene.wear is not None:
        yield from scene.wear.load.problems(scene)


def _limits(scene: sections.Sections) -> Problems:
    if scene.wear is None:
        return
    if scene.wear.until is not None and scene.wear.coefficient is None:
        yield (
            "wear.coefficient",
            'required with until, such as {model = "constant", value = "9.65e-19 m^2/N"}',
        )
    if scene.wear.snapshots is not None and scene.wear.until is None and scene.operation.stage is None:
        yield "wear.snapshots", "snapshots need 'until': without it there is one wear state"


def _initial(scene: sections.Sections) -> Problems:
    if scene.wear is None or scene.wear.initial is None:
        return
    flanks = scene.gears.descriptor.flanks
    for flank in gears.ALL_FLANKS:
        initial = scene.wear.initial_of(flank)
        if initial is not None and flank not in flanks:
            yield f"wear.initial.{flank}", f"no flank of this gear set; there are {', '.join(flanks)}"
        elif initial is not None and initial.by_law and scene.wear.coefficient is None:
            yield (
                f"wear.initial.{flank}.shape",
                "'worn' is by this wear law and needs 'wear.coefficient'; or give 'quadratic' or 'uniform'",
            )


def _extended(scene: sections.Sections) -> Problems:
    """Beyond A and E only tip corners touch: one search and one stiffness know nothing of them."""
    for section in _sections(scene):
        mesh = scene.mesh.of(section)
        if not mesh.extended_contact:
            continue
        path = f"mesh.{section}.extended_contact".replace("..", ".")
        if not mesh.contact.tip_corners:
            yield (
                path,
                f"{mesh.contact.chosen!r} knows no tip corners: give mesh.contact = 'exact', or leave it out",
            )
        if mesh.stiffness.of_mesh:
            yield (
                path,
                "lets pairs engage one by one, and a stiffness of = 'mesh' has no pairs: "
                "give of = 'pair', or leave it out",
            )


def _conditions(scene: sections.Sections) -> Problems:
    """Several conditions of operation share their flanks, and stages need wear to carry over."""
    several = scene.operation.blocks or scene.operation.stages
    if not several:
        return
    word = "duty" if scene.operation.blocks else "stage"
    if scene.dynamics is not None and scene.dynamics.response is not None:
        yield "dynamics.response", f"follows one torque, not those of operation.{word}: leave one out"
    if scene.operation.stage is None:
        return
    if scene.wear is None or scene.wear.coefficient is None:
        yield "operation.stage", "stages carry wear from one to the next and need wear.coefficient"
    elif scene.operation.stages[-1].cycles is None and scene.wear.until is None:
        yield "operation.stage", "the last stage needs 'cycles', or give wear.until"


def _calibrated(scene: sections.Sections) -> Problems:
    """A calibrated coefficient is one for all members, and its flank is one of the set's."""
    if scene.wear is None or scene.wear.coefficient is None:
        return
    if isinstance(scene.wear.coefficient, dict):
        if any(
            isinstance(coefficient, CalibratedCoefficient) for coefficient in scene.wear.coefficient.values()
        ):
            yield "wear.coefficient", "'calibrated' is one coefficient for all members, not one of several"
        return
    given, flanks = scene.wear.coefficient, scene.gears.descriptor.flanks
    if not isinstance(given, CalibratedCoefficient):
        return
    if given.flank not in flanks:
        yield "wear.coefficient.flank", f"no flank of this gear set; there are {', '.join(flanks)}"
    if not scene.wear.law.proportional:
        yield (
            "wear.coefficient",
            f"'calibrated' needs a rate proportional to it, and wear.law = {scene.wear.law.chosen!r} "
            "says of none: give the coefficient's value",
        )


def _start(scene: sections.Sections) -> Problems:
    if scene.start is None:
        return
    members = scene.gears.toothed
    for name in scene.start.replace:
        if name not in members:
            yield "start.replace", f"{name!r} is no member with teeth; there are {', '.join(members)}"
    if scene.wear is not None and scene.wear.initial is not None:
        yield "start", "start and wear.initial both say how worn the flanks are: leave one out"


def _rating(scene: sections.Sections) -> Problems:
    """A rating is of one pair."""
    if scene.rating is not None and not scene.gears.descriptor.is_pair:
        yield "rating", "is of a pair, and this is a planetary set: leave it out, or rate each mesh as a pair"
        return
    if scene.rating is None:
        return
    given = [key for key in scene.rating.of_pitting if getattr(scene.rating, key) is not None]
    wanted = [f"rating.{key}" for key in scene.rating.of_pitting if key not in given]
    for name, gear in scene.gears.gears().items():
        wanted += [f"gears.{name}.roughness_ra"] if gear.roughness_ra is None else []
    if scene.rating.equivalent_misalignment is None and scene.mesh.misalignment is None:
        wanted.append("mesh.misalignment (0 where gears are aligned)")
    if given and wanted:
        yield f"rating.{given[0]}", f"the safety against pitting also takes {', '.join(wanted)}"


def _needs(scene: sections.Sections) -> Problems:
    """What law, coefficients and films must know of oil and flanks stands in the scene."""
    if scene.wear is None or scene.wear.coefficient is None:
        return
    each = [scene.wear.coefficient_of(member) for member in _toothed(scene)]
    asking = dict.fromkeys(
        [("film = true", section.film_model.needs) for section in each if section.film_model is not None]
        + [(repr(section.chosen), section.needs) for section in each]
        + [(repr(scene.wear.law.chosen), scene.wear.law.needs)]
    )
    for needed, check in NEEDED.items():
        who = " and ".join(name for name, needs in asking if needed in needs)
        if who:
            yield from check(scene, who)


def _needs_oil(scene: sections.Sections, who: str) -> Problems:
    if scene.lubricant is None:
        yield "lubricant", f"{who} in wear.coefficient needs [lubricant]"


def _needs_roughness(scene: sections.Sections, who: str) -> Problems:
    for member, gear in scene.gears.gears().items():
        if gear.roughness_ra is None:
            yield (
                f"gears.{member}.roughness_ra",
                f"{who} in wear.coefficient needs both roughnesses, such as '0.3 um'",
            )


def _needs_hardness(scene: sections.Sections, who: str) -> Problems:
    for member, gear in scene.gears.gears().items():
        if getattr(gear.material or scene.gears.material, "hardness", None) is None:
            yield f"gears.{member}.material", f"{who} needs the hardness of both flanks, such as '7 GPa'"


def _needs_temperature(scene: sections.Sections, who: str) -> Problems:
    if getattr(scene.lubricant, "temperature", None) is None:
        yield "lubricant", f"{who} needs the temperature of the oil"


def _needs_both(scene: sections.Sections, who: str) -> Problems:
    yield from _needs_oil(scene, who)
    yield from _needs_roughness(scene, who)


NEEDED = {
    "lubricant": _needs_oil,
    "roughness": _needs_roughness,
    "lambda_ratio": _needs_both,
    "hardness": _needs_hardness,
    "temperature": _needs_temperature,
}
