"""``[update]`` read: what was measured, what is unknown, and which wear ends the life.

No part of any run's identity: the same stored runs serve every measurement.
"""

from collections.abc import Sequence
from typing import Any

from wearlab import nearest
from wearlab.campaign.axes import swept_keys
from wearlab.campaign.distributions import (
    Distribution,
    in_unit,
    is_distribution,
    number_of,
    read_distribution,
    written,
)
from wearlab.campaign.inheritance import CampaignError, Model, modelled
from wearlab.campaign.update_options import (
    PREVIOUS,
    SECTION,
    THICKNESS,
    WHEN,
    WHERE,
    CheckBlock,
    Columns,
    Data,
    DataBlock,
    Days,
    Decision,
    ErrorBlock,
    ErrorModel,
    Fleet,
    Limit,
    LimitBlock,
    PopulationBlock,
    RecordBlock,
    RecordColumns,
    Replaced,
    TrueModel,
    UnitBlock,
    UpdateBlock,
    UpdateSpec,
    unit_of,
)
from wearlab.scene import Scene, SceneError
from wearlab.scene.problems import not_a_choice, shown
from wearlab.schema import VARIABLES

FACTOR = "wear.coefficient.factor"


def read_update(given: Any) -> UpdateSpec:
    """Return what ``[update]`` says.

    Raises
    ------
    CampaignError : with every fault, one line each
    """
    if not isinstance(given, dict):
        raise CampaignError(f"{SECTION}: {shown(given)} is no table: write [{SECTION}]")
    problems: list[str] = []
    blocks = given.get("data", [])
    if not isinstance(blocks, list):
        problems.append(f"{SECTION}.data: {shown(blocks)} is no list of tables: write [[{SECTION}.data]]")
        blocks = []
    own = ("data", "limit", "calendar", "check", "population", "unit", "decision", "record", "replaced")
    head = {key: value for key, value in given.items() if key not in own}
    spec = _tried(problems, modelled, UpdateBlock, head, SECTION)
    unknown = _tried(problems, _unknown, given.get("unknown"))
    limit = _tried(problems, _limit, given.get("limit"))
    days = _tried(problems, _part, Days, given.get("calendar"), "calendar")
    data = [_tried(problems, _data, block, number) for number, block in enumerate(blocks, 1)]
    if spec is not None:
        if spec.discrepancy != "none" and not any(
            each_block and each_block.error.drift is not None for each_block in data
        ):
            problems.append(
                f"{SECTION}.discrepancy: {spec.discrepancy!r} needs error.drift in the data whose quantity "
                "strays: a value with its unit, or a distribution"
            )
    check = _tried(problems, _check, given.get("check"), data)
    decision = _tried(problems, _part, Decision, given.get("decision"), "decision")
    record = _tried(problems, _record, given.get("record"), data)
    replaced = _tried(problems, _replaced, given.get("replaced", []), given, unknown or {})
    fleet = None
    if "population" in given or "unit" in given or any(each and each.columns.unit for each in data):
        fleet = _tried(problems, read_fleet, given.get("population"), given.get("unit", []))
        problems += _not_of_a_fleet(given, unknown or {}, data)
    if problems:
        raise CampaignError(problems)
    read = {"limit": limit, "unknown": unknown, "data": tuple(data), "calendar": days, "check": check}
    read |= {"fleet": fleet, "decision": decision, "record": record, "replaced": replaced}
    if spec.change != "none" and [*unknown] != [FACTOR]:
        raise CampaignError(f"{SECTION}.change: goes with the unknown {FACTOR} alone: what changes is k")
    return UpdateSpec.model_construct(**{**dict(spec), **read})


def refuse_unknown_keys(spec: UpdateSpec, scenes: Sequence[Scene], labels: Sequence[str]) -> None:
    """Refuse unknowns that are no key of the scene, and data of cases that are not there.

    Raises
    ------
    CampaignError : with one line each
    """
    tried = [(f"unknown.{key}", key, written(law.at(0.5), law.unit)) for key, law in spec.unknown.items()]
    own = () if spec.fleet is None else enumerate(spec.fleet.units)
    tried += [(f"unit[{n}].scene.{key}", key, value) for n, unit in own for key, value in unit.scene.items()]
    problems = []
    for place, key, value in tried:
        try:
            scenes[0].replace(key, value)
        except SceneError as error:
            problems += [f"{SECTION}.{place}: {line}" for line in error.problems]
    if spec.fleet is not None and len(scenes) > 1:
        problems.append(f"{SECTION}: a fleet has one case, here are {len(scenes)}: give update.unit.scene")
    for data in spec.data:
        for case in data.cases:
            if case not in labels:
                said = not_a_choice(case, list(dict.fromkeys(labels)))
                problems.append(f"{data.place}.case: {said}")
    if problems:
        raise CampaignError(problems)


def _not_of_a_fleet(given: Any, unknown: dict[str, Distribution], data: Sequence[Data | None]) -> list[str]:
    """Return what is asked of a fleet that only one unit can have, one line each."""
    problems = [
        f"{SECTION}.unknown.{key}: of a fleet {FACTOR} alone is unknown: what differs between units goes "
        "into update.unit.scene"
        for key in unknown
        if key != FACTOR
    ]
    if given.get("change", "none") != "none":
        problems.append(f"{SECTION}.change: of a fleet, {POPULATION}.power below 1 is running-in")
    if given.get("discrepancy", "none") != "none" or given.get("check") is not None:
        problems.append(f"{SECTION}: of a fleet, neither discrepancy nor check; wear strays by {POPULATION}")
    for one in (each for each in data if each is not None):
        wrong = {
            "columns.unit: required of a fleet: which unit a row is of": one.columns.unit is None,
            "since: of a fleet, values count from the first cycle": one.since is not None,
            f"error.drift: of a fleet, use {POPULATION}.straying": one.error.drift is not None,
            "error.gain_sd: of a fleet, every unit has a k of its own: leave it out": one.error.gain_sd,
        }
        problems += [f"{one.place}.{said}" for said, is_so in wrong.items() if is_so]
    return problems


def _tried(problems: list[str], read: Any, *arguments: Any) -> Any:
    try:
        return read(*arguments)
    except CampaignError as error:
        problems.extend(error.problems)
        return None


def _part(model: type[Model], given: Any, name: str) -> Model | None:
    """Return a table of the section as a model, None where it is absent."""
    return None if given is None else modelled(model, given, f"{SECTION}.{name}")


def _unknown(given: Any) -> dict[str, Distribution]:
    where = f"{SECTION}.unknown"
    if not isinstance(given, dict) or not given:
        raise CampaignError(
            f'{where}: required: what is not known, such as "wear.coefficient.factor" = {{lognormal = …}}'
        )
    priors = {}
    for key, value in swept_keys(given).items():
        if not is_distribution(value):
            raise CampaignError(f"{where}.{key}: {shown(value)} is no distribution to be known better")
        priors[key] = read_distribution(value, f"{where}.{key}")
    return priors


def _limit(given: Any) -> Limit | None:
    if given is None:
        return None
    block = modelled(LimitBlock, given, f"{SECTION}.limit")
    if block.depth is not None:
        return Limit("max_wear_depth", block.depth, block.flank)
    assert block.worn_mass is not None
    return Limit("worn_mass", block.worn_mass, block.member)


def _check(given: Any, data: Sequence[Data | None]) -> TrueModel | None:
    if given is None:
        return None
    where = f"{SECTION}.check"
    block = modelled(CheckBlock, given, where)
    if block.error is None:
        return TrueModel(None, block.power)
    errors = [_error(block.error, one.si, f"{where}.error", False) for one in data if one is not None]
    return TrueModel(tuple(errors), block.power)


def _replaced(given: Any, section: dict[str, Any], unknown: dict[str, Distribution]) -> tuple[Replaced, ...]:
    where, found = f"{SECTION}.replaced", []
    if not isinstance(given, list):
        raise CampaignError(f"{where}: {shown(given)} is no list of tables: write [[{where}]]")
    for number, one in enumerate(given):
        found.append(modelled(Replaced, one, f"{where}[{number}]"))
    others = [key for key in ("record", "unit", "population", "check") if section.get(key)]
    others += [key for key in ("change",) if section.get(key, "none") != "none"]
    remedy = "leave one of them out"
    if others[:1] == ["record"]:
        remedy += "; without the record, give [operation] the mean torque and speed since the gear was new"
    if given and others:
        raise CampaignError(f"{where}: does not go with {SECTION}.{others[0]} yet: {remedy}")
    if given and [*unknown] != [FACTOR]:
        raise CampaignError(
            f"{where}: goes with the unknown {FACTOR} alone: one run is made of each new gear"
        )
    return tuple(found)


def _record(given: Any, data: Sequence[Data | None]) -> RecordBlock | None:
    if given is None:
        return None
    where = f"{SECTION}.record"
    columns = given.get("columns", {}) if isinstance(given, dict) else {}
    modelled(RecordColumns, columns, f"{where}.columns")
    block = modelled(RecordBlock, given, where)
    when = [name for name in ("hours", "date", "duration") if getattr(block.columns, name) is not None]
    if len(when) != 1:
        raise CampaignError(f"{where}.columns: name one of hours, date, duration, not {len(when)} of them")
    for one in data:
        if one is not None and one.columns.hours is None and one.columns.date is None:
            said = "with update.record, say when by hours or date: cycles depend on the speeds"
            raise CampaignError(f"{one.place}.columns: {said}")
    return block


def _data(given: Any, number: int) -> Data:
    where = f"{SECTION}.data[{number - 1}]"
    own = {key: given.get(key, {}) for key in ("columns", "error")} if isinstance(given, dict) else {}
    columns = modelled(Columns, own.get("columns"), f"{where}.columns")
    modelled(ErrorBlock, own.get("error"), f"{where}.error")
    block = modelled(DataBlock, given, where)
    known = [*(name for name, variable in VARIABLES.items() if "update" in variable.dims), THICKNESS]
    if block.quantity not in known:
        remedy = nearest.meant(block.quantity, known, "; `wearlab variables` lists what is stored")
        raise CampaignError(f"{where}.quantity: {block.quantity!r} is no variable along update{remedy}")
    if block.member is not None and block.flank is not None:
        raise CampaignError(f"{where}: give a member or a flank, not both")
    for kind, names in (("when", WHEN), ("where on the flank", WHERE)):
        given_ones = [name for name in names if getattr(columns, name) is not None]
        if len(given_ones) > 1 and given_ones != ["hours", "date"]:
            raise CampaignError(f"{where}.columns: {' and '.join(given_ones)} both say {kind}; name one")
    if isinstance(block.since, str) and block.since != PREVIOUS:
        raise CampaignError(f"{where}.since: {not_a_choice(block.since, (PREVIOUS,))}, or a cycle")
    error = _error(block.error, unit_of(block.quantity), f"{where}.error", columns.sd is not None)
    along = any(getattr(columns, name) is not None for name in WHERE)
    if along != (block.quantity in ("wear_depth", THICKNESS)):
        said = "needs one of the columns" if not along else "has no place for the columns"
        raise CampaignError(f"{where}.quantity: {block.quantity} {said} {', '.join(WHERE)}")
    return Data.model_construct(**{**dict(block), "number": number, "error": error})


def _error(block: ErrorBlock, unit: str, where: str, by_column: bool) -> ErrorModel:
    sd = _spread(block.sd, unit, f"{where}.sd")
    drift = _spread(block.drift, unit, f"{where}.drift")
    relative = 0.0 if block.relative is None else block.relative
    offset = 0.0 if block.offset_sd is None else _positive(block.offset_sd, unit, f"{where}.offset_sd")
    if sd is None and not relative and not by_column:
        raise CampaignError(
            f"{where}: required: sd (a value with its unit, or a distribution), relative, or columns.sd"
        )
    gain = block.gain_sd or 0.0
    if gain and (offset or drift is not None):
        said = "goes with independent errors: leave out offset_sd and drift, or the gain"
        raise CampaignError(f"{where}.gain_sd: {said}")
    return ErrorModel(sd, relative, offset, drift, gain)


def _spread(given: Any, unit: str, where: str) -> float | Distribution | None:
    """Return a standard deviation [SI], or its distribution."""
    if given is None:
        return None
    if not isinstance(given, dict):
        return _positive(given, unit, where)
    if not is_distribution(given):
        raise CampaignError(f"{where}: {shown(given)} is neither a value nor a distribution")
    spread = read_distribution(given, where)
    if spread.below(0.0) > 0.0:
        raise CampaignError(f"{where}: is negative at times; truncate it, or take a log-normal")
    if spread.unit is None and unit not in ("1", ""):
        raise CampaignError(f"{where}: its values need the quantity's unit")
    in_unit(1.0, spread.unit or unit, unit, where)
    return spread


def _positive(given: Any, unit: str, where: str) -> float:
    value, own = number_of(given, where)
    if own is None and unit not in ("1", ""):
        raise CampaignError(f"{where}: {shown(given)} is no quantity: write a number with its unit")
    value = in_unit(value, own or unit, unit, where)
    if not value > 0.0:
        raise CampaignError(f"{where}: {shown(given)} must be greater than 0")
    return value


POPULATION, UNIT = f"{SECTION}.population", f"{SECTION}.unit"
DEFAULTS = {
    name: {"lognormal": {"median": median, "cov": cov}}
    for name, median, cov in (("spread", 0.3, 1.0), ("straying", 0.2, 1.0), ("power", 1.0, 0.2))
}


def read_fleet(population: Any, units: Any) -> Fleet:
    """Return what ``[update.population]`` and ``[[update.unit]]`` say.

    Parameters
    ----------
    population, units : as written

    Raises
    ------
    CampaignError : with one line for each fault
    """
    block = modelled(PopulationBlock, population if population is not None else {}, POPULATION)
    if not isinstance(units, list):
        raise CampaignError(f"{UNIT}: {shown(units)} is no list of tables: write [[{UNIT}]]")
    named: list[UnitBlock] = []
    for number, given in enumerate(units):
        where = f"{UNIT}[{number}]"
        calendar = given.get("calendar") if isinstance(given, dict) else None
        _part(Days, calendar, f"unit[{number}].calendar")
        unit = modelled(UnitBlock, given, where)
        if unit.name in [other.name for other in named]:
            raise CampaignError(f"{where}.name: {unit.name!r} is there already: give each unit its own")
        named.append(unit.model_copy(update={"scene": swept_keys(unit.scene)}))
    shared = {
        "straying": _shared(block.straying, "straying", 0.0),
        "power": _shared(block.power, "power", 0.05),
    }
    shared["spread"] = _positive_law(block.spread or DEFAULTS["spread"], "spread")
    return Fleet.model_construct(**{**dict(block), **shared, "units": tuple(named)})


def _shared(given: float | dict[str, Any] | None, name: str, least: float) -> float | Distribution:
    if given is None or isinstance(given, dict):
        return _positive_law(DEFAULTS[name] if given is None else given, name)
    if not least <= given < 10.0:
        raise CampaignError(f"{POPULATION}.{name}: {given:g} is not from {least:g} to 10")
    return given


def _positive_law(given: dict[str, Any], name: str) -> Distribution:
    where = f"{POPULATION}.{name}"
    if not is_distribution(given):
        raise CampaignError(f"{where}: {shown(given)} is no distribution")
    read = read_distribution(given, where)
    if read.unit is not None or read.below(0.0) > 0.0:
        raise CampaignError(f"{where}: must be positive and without a unit, such as a log-normal")
    return read
