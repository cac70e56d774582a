"""What the sections of a scene ask of each other."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from wearlab.scene.coefficient import MEMBERS, JanakiramanCoefficient
from wearlab.scene.dynamics import Spur3dofDynamics, Support, TorsionalDynamics, TorsionalSupport

if TYPE_CHECKING:
    from wearlab.scene.scene import Scene


def broken_rules(scene: "Scene") -> list[str]:
    """Return one line for each rule that a scene breaks."""
    rules = (_damping, _supports, _response, _load, _limits, _initial, _oil)
    return [f"scene.{path}: {reason}" for rule in rules for path, reason in rule(scene)]


Problems = Iterator[tuple[str, str]]


def _damping(scene: "Scene") -> Problems:
    if scene.dynamics is not None and scene.mesh.damping is None and scene.mesh.damping_ratio is None:
        yield "mesh", "dynamics need mesh damping: give 'damping' such as '1000 N*s/m', or 'damping_ratio'"


def _supports(scene: "Scene") -> Problems:
    match scene.dynamics:
        case Spur3dofDynamics() | TorsionalDynamics():
            supports = {member: scene.dynamics.supports.get(member) for member in MEMBERS}
        case _:
            return
    held = [member for member, support in supports.items() if support is not None and _holds(support)]
    if len(held) == len(supports):
        yield (
            "dynamics.supports",
            "torsional springs hold both gears: nothing turns, and the torque does not set the mesh force; "
            "hold the output alone",
        )
    for member, support in supports.items():
        path = f"dynamics.supports.{member}"
        if support is None or support.damping_ratio is not None:
            continue
        if isinstance(support, Support) and support.damping is None:
            yield path, "give 'damping' such as '5360 N*s/m', or 'damping_ratio'"
        if _holds(support) and support.torsional_damping is None:
            yield (
                path,
                "a torsional spring needs 'torsional_damping' such as '2 N*m*s/rad', or 'damping_ratio'",
            )


def _holds(support: TorsionalSupport | Support) -> bool:
    """Whether a torsional spring ties the gear to ground."""
    return support.torsional_stiffness is not None or support.tangential_stiffness is not None


def _response(scene: "Scene") -> Problems:
    if scene.dynamics is None or scene.dynamics.response is None:
        return
    speed: Any = scene.dynamics.response.speed
    if getattr(speed, "from") >= speed.to:
        yield "dynamics.response.speed", "'from' must be below 'to'; direction = \"down\" goes the other way"
    if scene.dynamics.method != "periodic":
        yield (
            "dynamics.response",
            f"follows orbits and needs method 'periodic', not {scene.dynamics.method!r}",
        )
    if scene.errors is not None and scene.errors.slow == "hunting":
        yield "dynamics.response", "does not follow errors.slow = 'hunting'; give 'averaged' or 'frozen'"


def _load(scene: "Scene") -> Problems:
    if scene.wear is None:
        return
    load = scene.wear.load
    if load != "static" and scene.dynamics is None:
        yield "wear.load", f"{load!r} needs [dynamics]; without it the load is 'static'"
    if load == "equivalent" and scene.wear.wohler_slope is None:
        yield "wear.load", "'equivalent' needs 'wohler_slope', such as 6.61"


def _limits(scene: "Scene") -> Problems:
    if scene.wear is None:
        return
    if scene.wear.until is not None and scene.wear.coefficient is None:
        yield (
            "wear.coefficient",
            'required with until, such as {model = "constant", value = "9.65e-19 m^2/N"}',
        )
    if scene.wear.snapshots is not None and scene.wear.until is None:
        yield "wear.snapshots", "snapshots need 'until': without it there is one wear state"


def _initial(scene: "Scene") -> Problems:
    if scene.wear is None or scene.wear.initial is None or scene.wear.coefficient is not None:
        return
    for member in MEMBERS:
        initial = getattr(scene.wear.initial, member)
        if initial is not None and initial.shape == "worn":
            yield (
                f"wear.initial.{member}.shape",
                "'worn' is by this wear law and needs 'wear.coefficient'; or give 'quadratic' or 'uniform'",
            )


def _oil(scene: "Scene") -> Problems:
    if scene.wear is None or scene.wear.coefficient is None:
        return
    each = [scene.wear.coefficient_of(member) for member in MEMBERS]
    needs = [
        name
        for name, needed in (
            ("film = true", any(one.film for one in each)),
            ("'janakiraman'", any(isinstance(one, JanakiramanCoefficient) for one in each)),
        )
        if needed
    ]
    if not needs:
        return
    if scene.lubricant is None:
        yield "lubricant", f"{' and '.join(needs)} in wear.coefficient needs [lubricant]"
    for member, gear in scene.gears.gears().items():
        if gear.roughness_ra is None:
            yield (
                f"gears.{member}.roughness_ra",
                f"{' and '.join(needs)} in wear.coefficient needs both roughnesses, such as '0.3 um'",
            )
