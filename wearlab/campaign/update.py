"""``[update]`` read: what was measured, what is unknown, and which wear ends the life.

No part of any run's identity: the same stored runs serve every measurement.
"""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

from wearlab.campaign import axes, distributions
from wearlab.campaign.blocks import CampaignError, attempt, modelled
from wearlab.campaign.case import Case
from wearlab.campaign.update_options import (
    SECTION,
    DataBlock,
    PopulationBlock,
    UpdateBlock,
    UpdateSpec,
)
from wearlab.scene import SceneError
from wearlab.scene.problems import not_a_choice, shown

FACTOR = "wear.coefficient.factor"
POPULATION = f"{SECTION}.population"


def read_update(given: Any) -> UpdateSpec:
    """Return what ``[update]`` says.

    Raises
    ------
    CampaignError : with every fault, one line each
    """
    block = modelled(
        UpdateBlock,
        {"unknown": {}, **given} if isinstance(given, dict) else given,
        SECTION,
    )
    problems: list[str] = []
    heard = partial(attempt, problems)
    read: dict[str, Any] = {
        "unknown": heard(_unknown, block.unknown),
        "limit": block.limit and block.limit.read(),
        "data": tuple(
            heard(one.read, number) for number, one in enumerate(block.data, 1)
        ),
        "check": block.check and heard(block.check.read, block.data),
    }
    keys = [*axes.swept_keys(block.unknown)]
    if (
        block.population is not None
        or block.unit
        or any(one.columns.unit for one in block.data)
    ):
        fleet = heard((block.population or PopulationBlock()).read, block.unit)
        read |= {"fleet": fleet, "population": None, "unit": ()}
        problems += _not_of_a_fleet(block, keys)
    problems += _not_together(block, keys)
    if problems:
        raise CampaignError(problems)
    return UpdateSpec.model_construct(**{**dict(block), **read})


def refuse_unknown_keys(spec: UpdateSpec, cases: Sequence[Case]) -> None:
    """Refuse unknowns that are no key of the scene, and data of cases that are not there.

    Raises
    ------
    CampaignError : with one line each
    """
    middle = {
        key: distributions.written(law.at(0.5), law.unit)
        for key, law in spec.unknown.items()
    }
    tried = [(f"unknown.{key}", key, value) for key, value in middle.items()]
    own = () if spec.fleet is None else enumerate(spec.fleet.units)
    tried += [
        (f"unit[{n}].scene.{key}", key, value)
        for n, unit in own
        for key, value in unit.scene.items()
    ]
    problems = []
    for place, key, value in tried:
        try:
            cases[0].scene.replace(key, value)
        except SceneError as error:
            problems += [f"{SECTION}.{place}: {line}" for line in error.problems]
    if spec.fleet is not None and len(cases) > 1:
        problems.append(
            f"{SECTION}: a fleet has one case, here are {len(cases)}: give "
            "update.unit.scene"
        )
    labels = list(dict.fromkeys(case.label for case in cases))
    wrong = (
        (data.place, label)
        for data in spec.data
        for label in data.cases
        if label not in labels
    )
    problems += [
        f"{place}.case: {not_a_choice(label, labels)}" for place, label in wrong
    ]
    if problems:
        raise CampaignError(problems)


def _unknown(given: dict[str, Any]) -> dict[str, distributions.Distribution]:
    where = f"{SECTION}.unknown"
    priors = {}
    for key, value in axes.swept_keys(given).items():
        if not distributions.is_distribution(value):
            raise CampaignError(
                f"{where}.{key}: {shown(value)} is no distribution to be known better"
            )
        priors[key] = distributions.read_distribution(value, f"{where}.{key}")
    if not priors:
        said = 'what is not known, such as "wear.coefficient.factor" = {lognormal = …}'
        raise CampaignError(f"{where}: required: {said}")
    return priors


def _not_together(block: UpdateBlock, unknown: Sequence[str]) -> Iterator[str]:
    """Yield what does not go together, one line each."""
    if block.discrepancy != "none" and all(
        one.error.drift is None for one in block.data
    ):
        yield (
            f"{SECTION}.discrepancy: {block.discrepancy!r} needs error.drift in the "
            "data whose quantity "
            "strays: a value with its unit, or a distribution"
        )
    changes = block.change != "none"
    alone = f"goes with the unknown {FACTOR} alone"
    if changes and unknown != [FACTOR]:
        yield f"{SECTION}.change: {alone}: what changes is k"
    others = [
        key for key in ("record", "unit", "population", "check") if getattr(block, key)
    ]
    others += ["change"] if changes else []
    if block.replaced and others:
        mean = (
            "; without the record, give [operation] the mean torque and speed since "
            "the gear was new"
        )
        remedy = f"leave one of them out{mean if others[0] == 'record' else ''}"
        yield (
            f"{SECTION}.replaced: does not go with {SECTION}.{others[0]} yet: {remedy}"
        )
    elif block.replaced and unknown != [FACTOR]:
        yield f"{SECTION}.replaced: {alone}: one run is made of each new gear"
    for place, one in _placed(block.data if block.record else ()):
        if one.columns.hours is None and one.columns.date is None:
            said = (
                "with update.record, say when by hours or date: cycles depend on the "
                "speeds"
            )
            yield f"{place}.columns: {said}"


def _not_of_a_fleet(block: UpdateBlock, unknown: Sequence[str]) -> Iterator[str]:
    """Yield what is asked of a fleet that only one unit can have, one line each."""
    for key in unknown:
        if key != FACTOR:
            said = "what differs between units goes into update.unit.scene"
            yield (
                f"{SECTION}.unknown.{key}: of a fleet {FACTOR} alone is unknown: {said}"
            )
    if block.change != "none":
        yield f"{SECTION}.change: of a fleet, {POPULATION}.power below 1 is running-in"
    if block.discrepancy != "none" or block.check is not None:
        yield (
            f"{SECTION}: of a fleet, neither discrepancy nor check; wear strays by "
            f"{POPULATION}"
        )
    for place, one in _placed(block.data):
        wrong = {
            "columns.unit: required of a fleet: which unit a row is of": one.columns.unit
            is None,
            "since: of a fleet, values count from the first cycle": one.since
            is not None,
            f"error.drift: of a fleet, use {POPULATION}.straying": one.error.drift
            is not None,
            "error.gain_sd: of a fleet, every unit has a k of its own: leave it out": one.error.gain_sd,
        }
        yield from (f"{place}.{said}" for said, is_so in wrong.items() if is_so)


def _placed(data: Sequence[DataBlock]) -> Iterator[tuple[str, DataBlock]]:
    return ((f"{SECTION}.data[{n}]", one) for n, one in enumerate(data))
