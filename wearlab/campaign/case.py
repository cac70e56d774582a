"""One case of a campaign, what ``[expect]`` expects of it, and which are excluded."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from wearlab import nearest, schema, units
from wearlab.campaign.blocks import CampaignError, texts_of
from wearlab.query import Key, QueryError, Vocabulary, keys, read_condition
from wearlab.scene import Scene, merge
from wearlab.scene.problems import not_a_choice, shown

BASE = "base"
"""Label of the campaign's file itself."""
VERDICTS = (
    "completed",
    "refused",
    "failed",
    "aperiodic",
    "coexisting",
    "non-unique",
    "not attracting within the margin",
    "unstable",
    "stopped",
)
WITHOUT_DATA = ("refused", "failed")
EXPECT_KEYS = ("verdict", "response_period", "end_reason")
"""Keys of ``[expect]`` that are no variables of a dataset."""
DERIVED_KEYS = (
    Key("contact_ratio"),
    Key("total_contact_ratio"),
    Key("mesh_frequency", unit="Hz", display_unit="Hz"),
    Key("speed_ratio"),
)
DERIVED = tuple(key.name for key in DERIVED_KEYS)
TOTAL_RATIO = "total_contact_ratio"
RATIOS = ("contact_ratio", TOTAL_RATIO)
"""Those that are the same in every condition of operation."""


class ExpectedNumber(NamedTuple):
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
    values: Mapping[str, ExpectedNumber] = field(default_factory=dict)


def merged(base: merge.Table | None, over: merge.Table | None) -> merge.Table | None:
    """Return a case's ``expect`` over the file's, key by key.

    Another verdict replaces it all.

    Parameters
    ----------
    base : ``expect`` of the file, None where it has none
    over : ``expect`` of the case, None where it has none
    """
    if not isinstance(base, dict) or not isinstance(over, dict):
        return base if over is None else over
    base_verdict = base.get("verdict", "completed")
    if "verdict" in over and over["verdict"] != base_verdict:
        return over
    return merge.merge(base, over)


def read_expectation(table: Any) -> Expectation | None:
    """Return the expectation of a table, None when there is none.

    Parameters
    ----------
    table : what the file has under ``expect``

    Raises
    ------
    CampaignError
        With every fault of the table.
    """
    if table is None:
        return None
    if not isinstance(table, dict):
        raise CampaignError(f"expect: {shown(table)} is no table: write [expect]")

    verdict = table.get("verdict")
    reason = table.get("end_reason")
    faults: list[str] = []
    if verdict is not None and verdict not in VERDICTS:
        faults.append(f"expect.verdict: {not_a_choice(verdict, VERDICTS)}")
    if reason is not None and not isinstance(reason, str):
        faults.append(
            f"expect.end_reason: {shown(reason)} is no text, such as "
            "'cycles' or 'depth'"
        )

    values: dict[str, ExpectedNumber] = {}
    for name, value in table.items():
        if name in ("verdict", "end_reason"):
            continue
        try:
            values[name] = _expected_number(name, value)
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


def _expected_number(name: str, written: Any) -> ExpectedNumber:
    """Return value and tolerance of a variable in its stored unit."""
    if name == "response_period":
        return _expected_period(written)
    if name not in schema.VARIABLES:
        remedy = nearest.meant(name, [*EXPECT_KEYS, *schema.VARIABLES])
        raise ValueError(f"no variable of a dataset{remedy}")
    if not isinstance(written, dict) or set(written) != {"value", "tolerance"}:
        raise ValueError(f"{shown(written)} is not {{value = …, tolerance = …}}")

    stored_unit = schema.VARIABLES[name].units
    value = _number(written["value"], "value", stored_unit)
    tolerance = _number(written["tolerance"], "tolerance", stored_unit)
    width = str(written["tolerance"])
    unit = None
    if units.is_quantity(written["value"]):
        unit = (stored_unit, units.split(written["value"])[1])
    if unit and not isinstance(written["tolerance"], str):  # relative
        width = f"{100.0 * tolerance:g} %"
        tolerance = abs(tolerance * value)
    if tolerance < 0.0:
        raise ValueError(f"tolerance {shown(written['tolerance'])} is negative")
    return ExpectedNumber(value, tolerance, f"{written['value']} ± {width}", unit)


def _expected_period(written: Any) -> ExpectedNumber:
    """Return a count of mesh periods, which is exact."""
    if isinstance(written, bool) or not isinstance(written, int) or written < 0:
        raise ValueError(
            f"{shown(written)} is no count of mesh periods; 0 is aperiodic"
        )
    return ExpectedNumber(float(written), 0.0, str(written))


def _number(written: Any, key: str, stored_unit: str) -> float:
    """Return a quantity, or a plain number of a variable without unit, as stored."""
    if not (units.is_number(written) or isinstance(written, str)):
        raise ValueError(f"{key} {shown(written)} is neither a number nor a quantity")
    if isinstance(written, int | float):
        if key == "value" and stored_unit not in keys.PLAIN and written != 0:
            raise ValueError(
                f"{key} {shown(written)} needs its unit, such as '{written} "
                f"{stored_unit}'"
            )
        return float(written)
    if stored_unit in keys.PLAIN:
        raise ValueError(
            f"{key} {shown(written)}: a plain number, without quotes or unit"
        )
    try:
        number, unit = units.split(written)
        return units.convert(float(number), unit, stored_unit)
    except units.UnitError as error:
        raise ValueError(f"{key} {shown(written)}: {error}") from None


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


class CaseValues:
    """The values of one case, each computed when a condition asks for it.

    Parameters
    ----------
    scene : of the case
    values : of its scene, by key
    critical : lowest excited natural frequency [Hz] of each scene at 1 rpm, shared by
        the cases of a campaign
    """

    def __init__(
        self, scene: Scene, values: dict[str, Any], critical: dict[str, float | None]
    ) -> None:
        self.scene = scene
        self.values = values
        self.critical = critical

    def get(self, name: str) -> Any:
        """Return a value of the scene, or one derived from it.

        Parameters
        ----------
        name : dotted key of the scene, or one of `DERIVED`
        """
        if name in DERIVED and name not in self.values:
            self.values[name] = self.derived(name)
        return self.values.get(name)

    def derived(self, name: str) -> float | None:
        """Return a quantity of `DERIVED`, None where the scene has no such thing.

        Parameters
        ----------
        name : ``contact_ratio`` or ``total_contact_ratio``, the smallest where a set
            has meshes of several kinds; ``mesh_frequency`` [Hz]; or ``speed_ratio``,
            the speed of the input over its first critical speed, where the mesh
            frequency meets the lowest natural frequency that the mesh excites

        Raises
        ------
        CampaignError : a frequency is asked of several conditions of operation
        """
        from wearlab.assembly import sets
        from wearlab.gears.specification import GearError

        scene = self.scene
        if name == "speed_ratio" and scene.dynamics is None:
            return None
        if name not in RATIOS and scene.operation.several:
            raise CampaignError(
                f"exclude: {name} is of one speed, and operation.duty or .stage has "
                "several: exclude by contact_ratio or by keys of the scene"
            )
        try:
            gears = sets.build_set(scene.in_heaviest_condition)
            if name in RATIOS:
                base_angle = gears.helix.base_angle if name == TOTAL_RATIO else 0.0
                pairs = [kind.pair for kind in gears.kinds]
                return min(pair.total_contact_ratio(base_angle) for pair in pairs)
            mesh_frequency = float(gears.mesh_frequency)
            if name == "mesh_frequency":
                return mesh_frequency
            natural_frequency = self._first_excited()
            if natural_frequency is None:
                return None
            return mesh_frequency / natural_frequency
        except GearError:  # no such gears can be
            return None

    def _first_excited(self) -> float | None:
        """Return the lowest natural frequency that the mesh excites [Hz]."""
        from wearlab.assembly import build, build_modes

        at_1_rpm = self.scene.replace("operation.speed", "1 rpm").canonical()
        if at_1_rpm not in self.critical:
            modes = build_modes(build(self.scene)).modes
            excited = modes.frequency[modes.excited()]
            self.critical[at_1_rpm] = float(excited.min()) if excited.size else None
        return self.critical[at_1_rpm]


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


def read_conditions(value: Any) -> tuple[str, ...]:
    """Return the conditions of ``exclude``, one text or a list of them.

    Parameters
    ----------
    value : what the file has under ``exclude``

    Raises
    ------
    CampaignError : it is no text or list of texts, or one is empty
    """
    problem = "no condition, such as 'speed_ratio > 1.2'"
    texts = texts_of(value, "exclude", problem)
    if not all(text.strip() for text in texts):
        raise CampaignError(f"exclude: {shown(value)} is {problem}")
    return texts


def without_excluded(
    cases: Cases, conditions: Sequence[str]
) -> tuple[Cases, tuple[Excluded, ...]]:
    """Return the cases that no condition excludes, and the others.

    Parameters
    ----------
    cases : every case of the campaign
    conditions : of ``exclude``, as the file writes them

    Raises
    ------
    CampaignError
        When a condition cannot be read, or none of the cases is left.
    """
    if not conditions:
        return cases, ()

    values = [dict(keys.flat(json.loads(case.scene.canonical()))) for case in cases]
    parsed = dict(zip(conditions, _parsed(conditions, values), strict=True))
    critical: dict[str, float | None] = {}
    included = []
    excluded = []
    for case, scene_values in zip(cases, values, strict=True):
        case_values: Any = CaseValues(case.scene, scene_values, critical)
        condition = next(
            (text for text, tree in parsed.items() if tree.holds(case_values)), None
        )
        if condition is None:
            included.append(case)
        else:
            excluded.append(Excluded(case.label, case.position, condition))
    if not included:
        raise CampaignError(f"exclude: every one of {len(cases)} cases is excluded")
    return tuple(included), tuple(excluded)


def _parsed(conditions: Sequence[str], values: Sequence[dict[str, Any]]) -> list[Any]:
    """Return the syntax tree of each condition, its names those of the scenes."""
    is_text = {
        name: isinstance(value, str)
        for scene_values in values
        for name, value in scene_values.items()
    }
    scene_keys = (keys.scene_key(name, text) for name, text in is_text.items())
    vocabulary = Vocabulary([*DERIVED_KEYS, *scene_keys])
    trees = []
    for number, text in enumerate(conditions):
        try:
            trees.append(read_condition(text, vocabulary))
        except QueryError as error:
            place = f"at character {error.position + 1} of {error.text!r}"
            raise CampaignError(
                f"exclude[{number}]: {error.reason} ({place})"
            ) from None
    return trees
