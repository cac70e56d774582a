"""The section ``[update]``: what was measured and is unknown, which wear is the end.

No part of any run's identity: the same stored runs serve every measurement.
"""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

from wearlab.campaign import axes, distributions
from wearlab.campaign.blocks import CampaignError, attempt, modelled
from wearlab.campaign.case import Case
from wearlab.campaign.scenario import scene_of
from wearlab.campaign.update_options import (
    SECTION,
    DataBlock,
    PopulationBlock,
    UpdateBlock,
    UpdateSpec,
)
from wearlab.scene import Scene, SceneError
from wearlab.scene.problems import not_a_choice, shown

FACTOR = "wear.coefficient.factor"
POPULATION = f"{SECTION}.population"
FACTOR_ALONE = f"goes with the unknown {FACTOR} alone"


def read_update(table: Any) -> UpdateSpec:
    """Return what ``[update]`` says.

    Parameters
    ----------
    table : what the file has under ``update``

    Raises
    ------
    CampaignError : with every fault, one line each
    """
    if isinstance(table, dict):  # _read_unknown says what is missing
        table = {"unknown": {}, **table}
    block = modelled(UpdateBlock, table, SECTION)

    problems: list[str] = []
    read = partial(attempt, problems)
    values: dict[str, Any] = {
        "unknown": read(_read_unknown, block.unknown),
        "limit": block.limit and block.limit.read(),
        "data": tuple(
            read(data.read, number) for number, data in enumerate(block.data, 1)
        ),
        "check": block.check and read(block.check.read, block.data),
    }
    unknown_keys = [*axes.swept_keys(block.unknown)]
    if _is_of_a_fleet(block):
        population = block.population or PopulationBlock()
        values["fleet"] = read(population.read, block.unit)
        values["population"] = None
        values["unit"] = ()
        problems += _not_of_a_fleet(block, unknown_keys)
    problems += _not_together(block, unknown_keys)
    if problems:
        raise CampaignError(problems)
    return UpdateSpec.model_construct(**{**dict(block), **values})


def _is_of_a_fleet(block: UpdateBlock) -> bool:
    """Whether several units were measured."""
    names_units = any(data.columns.unit or data.unit for data in block.data)
    return block.population is not None or bool(block.unit) or names_units


def refuse_unknown_keys(spec: UpdateSpec, cases: Sequence[Case]) -> None:
    """Refuse unknowns that are no key of the scene, and data of unknown cases.

    Parameters
    ----------
    spec : the section
    cases : of the campaign, at least one

    Raises
    ------
    CampaignError : with one line each
    """
    problems = []
    for place, settings in _settings(spec):
        problems += _refusals(cases[0].scene, place, settings)

    for number, scenario in enumerate(spec.scenario):
        try:
            scene_of(scenario, number, cases[0].scene)
        except CampaignError as error:
            problems += error.problems

    if spec.fleet is not None and len(cases) > 1:
        problems.append(
            f"{SECTION}: a fleet has one case, here are {len(cases)}: give "
            "update.unit.scene"
        )

    labels = list(dict.fromkeys(case.label for case in cases))
    problems += [
        f"{data.place}.case: {not_a_choice(label, labels)}"
        for data in spec.data
        for label in data.cases
        if label not in labels
    ]
    if problems:
        raise CampaignError(problems)


def _settings(spec: UpdateSpec) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the place of everything that the section sets in scenes, and its values."""
    for key, prior in spec.unknown.items():
        yield "unknown", {key: distributions.written(prior.at(0.5), prior.unit)}
    if spec.fleet is None:
        return
    for number, unit in enumerate(spec.fleet.units):
        yield f"unit[{number}].scene", dict(unit.scene)


def _refusals(scene: Scene, place: str, settings: dict[str, Any]) -> list[str]:
    """Return what is wrong with settings of a scene, key by key where that tells it."""
    try:
        scene.replace(settings)
    except SceneError as error:
        whole = [f"{SECTION}.{place}: {line}" for line in error.problems]
    else:
        return []
    single = []
    for key, value in settings.items():
        try:
            scene.replace(key, value)
        except SceneError as error:
            single += [f"{SECTION}.{place}.{key}: {line}" for line in error.problems]
    return single or whole


def _read_unknown(table: dict[str, Any]) -> dict[str, distributions.Distribution]:
    """Return the prior of each unknown key."""
    where = f"{SECTION}.unknown"
    priors = {}
    for key, value in axes.swept_keys(table).items():
        if not distributions.is_distribution(value):
            raise CampaignError(
                f"{where}.{key}: {shown(value)} is no distribution to be known better"
            )
        priors[key] = distributions.read_distribution(value, f"{where}.{key}")
    if not priors:
        raise CampaignError(
            f"{where}: required: what is not known, such as "
            '"wear.coefficient.factor" = {lognormal = …}'
        )
    return priors


def _not_together(block: UpdateBlock, unknown: Sequence[str]) -> Iterator[str]:
    """Yield which options do not go together, one line each."""
    drifts = [data.error.drift for data in block.data]
    accumulates = block.discrepancy == "accumulating" and not _is_of_a_fleet(block)
    if accumulates and all(drift is None for drift in drifts):
        yield (
            f"{SECTION}.discrepancy: {block.discrepancy!r} needs error.drift in the "
            "data whose quantity "
            "strays: a value with its unit, or a distribution"
        )
    if block.change != "none" and unknown != [FACTOR]:
        yield f"{SECTION}.change: {FACTOR_ALONE}: what changes is k"
    labels = [scenario.label for scenario in block.scenario]
    for number, label in enumerate(labels):
        if label in labels[:number]:
            yield (
                f"{SECTION}.scenario[{number}].label: {label!r} is there already: give "
                "each its own"
            )
    if block.scenario and unknown != [FACTOR]:
        yield f"{SECTION}.scenario: {FACTOR_ALONE}"
    if block.replaced:
        yield from _not_with_replaced(block, unknown)
    if block.record:
        for number, data in enumerate(block.data):
            by_cycles = data.columns.hours is None and data.columns.date is None
            if by_cycles and isinstance(data.at, float | None):
                key = "columns" if data.at is None else "at"
                yield (
                    f"{SECTION}.data[{number}].{key}: with update.record, say when "
                    "by hours or date: cycles depend on the speeds"
                )


def _not_with_replaced(block: UpdateBlock, unknown: Sequence[str]) -> Iterator[str]:
    """Yield which options do not go with gears that were replaced."""
    is_of_a_fleet = _is_of_a_fleet(block)
    for number, event in enumerate(block.replaced):
        place = f"{SECTION}.replaced[{number}].unit"
        if is_of_a_fleet and event.unit is None:
            yield f"{place}: required of a fleet: the unit in which they were replaced"
        if not is_of_a_fleet and event.unit is not None:
            yield (
                f"{place}: {event.unit!r}: here is one gear set; leave it out, or name "
                f"the column that says which unit a row is of ({SECTION}.data: columns "
                '= { unit = "…" })'
            )
    if block.check:
        yield (
            f"{SECTION}.replaced: does not go with {SECTION}.check yet: leave one of "
            "them out"
        )
    elif unknown != [FACTOR] and not is_of_a_fleet:
        yield f"{SECTION}.replaced: {FACTOR_ALONE}: one run is made of each new gear"


def _not_of_a_fleet(block: UpdateBlock, unknown: Sequence[str]) -> Iterator[str]:
    """Yield which options of a fleet only a single unit can have, one line each."""
    for key in unknown:
        if key != FACTOR:
            yield (
                f"{SECTION}.unknown.{key}: of a fleet {FACTOR} alone is unknown: what "
                "differs between units goes into update.unit.scene"
            )
    if block.change != "none":
        yield f"{SECTION}.change: of a fleet, {POPULATION}.power below 1 is running-in"
    if block.discrepancy == "accumulating" or block.check is not None:
        yield (
            f"{SECTION}: of a fleet, neither accumulating nor check; wear strays by "
            f"{POPULATION}"
        )
    for number, data in enumerate(block.data):
        for problem in _data_not_of_a_fleet(data):
            yield f"{SECTION}.data[{number}].{problem}"


def _data_not_of_a_fleet(data: DataBlock) -> Iterator[str]:
    """Yield what is wrong with measurements of a fleet, key first."""
    if data.at is not None and data.unit is None:
        yield "unit: required of a fleet: whose flank was measured"
    elif data.at is None and data.columns.unit is None:
        yield "columns.unit: required of a fleet: which unit a row is of"
    if data.error.drift is not None:
        yield f"error.drift: of a fleet, use {POPULATION}.straying"
