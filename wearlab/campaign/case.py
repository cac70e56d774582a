"""One case of a campaign, what ``[expect]`` says that it must come to, and which cases are excluded."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from wearlab import nearest, schema, units
from wearlab.campaign.blocks import CampaignError, texts_of
from wearlab.query import Key, QueryError, Vocabulary, keys, read_condition
from wearlab.scene import Scene, merge, problems

VERDICTS = (
    *("completed", "refused", "failed", "aperiodic"),
    *(
        "coexisting",
        "non-unique",
        "not attracting within the margin",
        "unstable",
        "stopped",
    ),
)
WITHOUT_DATA = ("refused", "failed")
WORDS = ("verdict", "response_period", "end_reason")


class Wanted(NamedTuple):
    """An expected value.

    Parameters
    ----------
    value, tolerance : in the unit of the stored variable; the tolerance is absolute
    written : both as the file wrote them
    units : (stored, written) units, None for plain numbers
    """

    value: float
    tolerance: float
    written: str
    units: tuple[str, str] | None = None


@dataclass(frozen=True)
class Expectation:
    """What a case is expected to come to.

    Parameters
    ----------
    verdict : one of `VERDICTS`, or None
    end_reason : with what the reason that ended the life begins, or None
    values : variable → value and tolerance; ``response_period`` is one of them
    """

    verdict: str | None = None
    end_reason: str | None = None
    values: Mapping[str, Wanted] = field(default_factory=dict)


def merged(base: merge.Table | None, own: merge.Table | None) -> merge.Table | None:
    """Return a case's ``expect`` over the file's, key by key.

    Another verdict replaces it all.
    """
    if not isinstance(base, dict) or not isinstance(own, dict):
        return base if own is None else own
    changes = "verdict" in own and own["verdict"] != base.get("verdict", "completed")
    return own if changes else merge.merge(base, own)


def read_expectation(given: Any) -> Expectation | None:
    """Return the expectation of a table, None when there is none.

    Raises
    ------
    CampaignError
        With every fault of the table.
    """
    if given is None:
        return None
    if not isinstance(given, dict):
        raise CampaignError(
            f"expect: {problems.shown(given)} is no table: write [expect]"
        )
    faults: list[str] = []
    verdict = given.get("verdict")
    reason = given.get("end_reason")
    if verdict is not None and verdict not in VERDICTS:
        faults.append(f"expect.verdict: {problems.not_a_choice(verdict, VERDICTS)}")
    if reason is not None and not isinstance(reason, str):
        faults.append(
            f"expect.end_reason: {problems.shown(reason)} is no text, such as "
            "'cycles' or 'depth'"
        )
    values: dict[str, Wanted] = {}
    for name, value in given.items():
        if name in ("verdict", "end_reason"):
            continue
        try:
            values[name] = _wanted(name, value)
        except ValueError as error:
            faults.append(f"expect.{name}: {error}")
    if verdict in WITHOUT_DATA and (values or reason):
        faults.append(
            f"expect: a case that is {verdict} has no data to compare: give the "
            "verdict alone"
        )
    if faults:
        raise CampaignError(faults)
    return Expectation(verdict, reason, values)


def _wanted(name: str, given: Any) -> Wanted:
    """Return value and tolerance of a variable in its stored unit.

    A count of mesh periods is exact.
    """
    if name == "response_period":
        if isinstance(given, bool) or not isinstance(given, int) or given < 0:
            raise ValueError(
                f"{problems.shown(given)} is no count of mesh periods; 0 is aperiodic"
            )
        return Wanted(float(given), 0.0, str(given))
    if name not in schema.VARIABLES:
        raise ValueError(
            "no variable of a "
            f"dataset{nearest.meant(name, [*WORDS, *schema.VARIABLES])}"
        )
    if not isinstance(given, dict) or set(given) != {"value", "tolerance"}:
        raise ValueError(f"{problems.shown(given)} is not {{value = …, tolerance = …}}")
    stored = schema.VARIABLES[name].units
    value = _number(given["value"], "value", stored)
    tolerance = _number(given["tolerance"], "tolerance", stored)
    unit = (
        (stored, units.split(given["value"])[1])
        if units.is_quantity(given["value"])
        else None
    )
    said = str(given["tolerance"])
    if unit and not isinstance(given["tolerance"], str):
        said = f"{100.0 * tolerance:g} %"
        tolerance = abs(tolerance * value)
    if tolerance < 0.0:
        raise ValueError(f"tolerance {problems.shown(given['tolerance'])} is negative")
    return Wanted(value, tolerance, f"{given['value']} ± {said}", unit)


def _number(given: Any, key: str, stored: str) -> float:
    """Return a number in the stored unit: a quantity with its unit, or a plain number where there is none."""
    if not (units.is_number(given) or isinstance(given, str)):
        raise ValueError(
            f"{key} {problems.shown(given)} is neither a number nor a quantity"
        )
    if isinstance(given, int | float):
        if key == "value" and stored not in keys.PLAIN and given != 0:
            raise ValueError(
                f"{key} {problems.shown(given)} needs its unit, such as '{given} "
                f"{stored}'"
            )
        return float(given)
    if stored in keys.PLAIN:
        raise ValueError(
            f"{key} {problems.shown(given)}: a plain number, without quotes or unit"
        )
    try:
        number, unit = units.split(given)
        return units.convert(float(number), unit, stored)
    except units.UnitError as error:
        raise ValueError(f"{key} {problems.shown(given)}: {error}") from None


BASE = "base"


@dataclass(frozen=True)
class Case:
    """One run of a campaign.

    Parameters
    ----------
    label : "base", or the label of a ``[[case]]``
    scene : what is run
    position : axis → index; an axis that is missing here is one the run is broadcast
        along
    expect : what it is expected to come to, None when the file does not say
    """

    label: str
    scene: Scene
    position: dict[str, int]
    expect: Expectation | None = None

    @property
    def id(self) -> str:
        """The identity of the run."""
        return self.scene.id

    def __repr__(self) -> str:
        return f"<Case {self.label!r} {self.position or ''}: {self.scene!r}>"


KEYS = (
    Key("contact_ratio"),
    Key("mesh_frequency", unit="Hz", display_unit="Hz"),
    Key("speed_ratio"),
)
DERIVED = tuple(key.name for key in KEYS)


class CaseValues:
    """The values of one case, each found when it is asked for.

    Parameters
    ----------
    scene : of the case
    values : of its scene, by key
    critical : critical speeds that several cases share, found once
    """

    def __init__(
        self, scene: Scene, values: dict[str, Any], critical: dict[str, float | None]
    ) -> None:
        self.scene, self.values, self.critical = scene, values, critical

    def get(self, name: str) -> Any:
        """Return a value of the scene, or one derived from it."""
        if name in DERIVED and name not in self.values:
            self.values[name] = self.derived(name)
        return self.values.get(name)

    def derived(self, name: str) -> float | None:
        """Return a quantity of `DERIVED`.

        None where no such gears can be, or the scene has no such thing.

        ``mesh_frequency`` is in Hz; ``speed_ratio`` is the speed of the input over its
        first critical speed, where the mesh frequency meets the lowest natural
        frequency that the mesh excites.
        """
        from wearlab.assembly import sets
        from wearlab.gears.specification import GearError

        scene = self.scene
        lacks_speed = name != "contact_ratio" and scene.operation.speed is None
        if lacks_speed or (name == "speed_ratio" and scene.dynamics is None):
            return None
        try:
            gears = sets.build_set(scene)
            if (
                name == "contact_ratio"
            ):  # the smallest where a set has meshes of several kinds
                return min(float(kind.pair.contact_ratio) for kind in gears.kinds)
            frequency = float(gears.mesh_frequency)
            if name == "mesh_frequency":
                return frequency
            first = self._first_excited()
            return None if first is None else frequency / first
        except GearError:
            return None

    def _first_excited(self) -> float | None:
        """Return the lowest natural frequency that the mesh excites [Hz]."""
        from wearlab.assembly import build, build_modes

        same = self.scene.replace("operation.speed", "1 rpm").canonical()
        if same not in self.critical:
            modes = build_modes(build(self.scene)).modes
            excited = modes.frequency[modes.excited()]
            self.critical[same] = float(excited.min()) if excited.size else None
        return self.critical[same]


class Excluded(NamedTuple):
    """A case that is not run.

    Parameters
    ----------
    label, position : as of a case
    condition : the one that excludes it, as the file writes it
    """

    label: str
    position: dict[str, int]
    condition: str


Cases = tuple[Case, ...]


def read_conditions(given: Any) -> tuple[str, ...]:
    """Return the conditions of ``exclude``, one text or a list of them."""
    wanted = "no condition, such as 'speed_ratio > 1.2'"
    texts = texts_of(given, "exclude", wanted)
    if not all(map(str.strip, texts)):
        raise CampaignError(f"exclude: {problems.shown(given)} is {wanted}")
    return texts


def without_excluded(
    cases: Cases, conditions: Sequence[str]
) -> tuple[Cases, tuple[Excluded, ...]]:
    """Return the cases that no condition excludes, and the others.

    Raises
    ------
    CampaignError
        When a condition cannot be read, or none of the cases is left.
    """
    if not conditions:
        return cases, ()
    values = [dict(keys.flat(json.loads(case.scene.canonical()))) for case in cases]
    bound = _bound(conditions, values)
    critical: dict[str, float | None] = {}
    kept = []
    excluded = []
    for case, known in zip(cases, values, strict=True):
        asked: Any = CaseValues(case.scene, known, critical)
        met = next(
            (
                text
                for text, tree in zip(conditions, bound, strict=True)
                if tree.holds(asked)
            ),
            None,
        )
        if met is None:
            kept.append(case)
        else:
            excluded.append(Excluded(case.label, case.position, met))
    if not kept:
        raise CampaignError(f"exclude: every one of {len(cases)} cases is excluded")
    return tuple(kept), tuple(excluded)


def _bound(conditions: Sequence[str], values: Sequence[dict[str, Any]]) -> list[Any]:
    texts = {
        name: isinstance(value, str)
        for known in values
        for name, value in known.items()
    }
    vocabulary = Vocabulary(
        [*KEYS, *(keys.scene_key(name, text) for name, text in texts.items())]
    )
    bound = []
    for number, text in enumerate(conditions):
        try:
            bound.append(read_condition(text, vocabulary))
        except QueryError as error:
            where = f"at character {error.position + 1} of {error.text!r}"
            raise CampaignError(
                f"exclude[{number}]: {error.reason} ({where})"
            ) from None
    return bound
