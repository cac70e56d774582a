"""``[update.population]`` and ``[[update.unit]]`` as files write them: many units of one design."""

from collections.abc import Callable
from typing import Any

from wearlab.campaign.axes import swept_keys
from wearlab.campaign.distributions import Distribution, is_distribution, read_distribution
from wearlab.campaign.inheritance import CampaignError, modelled
from wearlab.campaign.update_options import SECTION, Days, Fleet, FleetUnit, PopulationBlock, UnitBlock
from wearlab.scene.problems import shown

POPULATION, UNIT = f"{SECTION}.population", f"{SECTION}.unit"
DEFAULTS = {
    name: {"lognormal": {"median": median, "cov": cov}}
    for name, median, cov in (("spread", 0.3, 1.0), ("straying", 0.2, 1.0), ("power", 1.0, 0.2))
}


def read_fleet(population: Any, units: Any, days_of: Callable[[Any, str], Days | None]) -> Fleet:
    """Return what ``[update.population]`` and ``[[update.unit]]`` say.

    Parameters
    ----------
    population, units : as written
    days_of : reads a calendar at a place of the file

    Raises
    ------
    CampaignError : with one line for each fault
    """
    block = modelled(PopulationBlock, population if population is not None else {}, POPULATION)
    if not isinstance(units, list):
        raise CampaignError([f"{UNIT}: {shown(units)} is no list of tables: write [[{UNIT}]]"])
    if block.reference is not None and not 0.0 < block.reference < float("inf"):
        raise CampaignError([f"{POPULATION}.reference: {block.reference:g} is no number of hours"])
    named: list[FleetUnit] = []
    for number, given in enumerate(units):
        where = f"{UNIT}[{number}]"
        calendar = given.get("calendar") if isinstance(given, dict) else None
        days = days_of(calendar, f"{where}.calendar")
        unit = modelled(UnitBlock, given, where)
        if unit.name in [other.name for other in named]:
            raise CampaignError([f"{where}.name: {unit.name!r} is there already: give each unit its own"])
        named.append(FleetUnit(unit.name, swept_keys(unit.scene or {}), days))
    return Fleet(
        _positive(block.spread or DEFAULTS["spread"], "spread"),
        _shared(block.straying, "straying", 0.0),
        _shared(block.power, "power", 0.05),
        block.reference,
        tuple(named),
    )


def _shared(given: float | dict[str, Any] | None, name: str, least: float) -> float | Distribution:
    if given is None or isinstance(given, dict):
        return _positive(DEFAULTS[name] if given is None else given, name)
    if not least <= given < 10.0:
        raise CampaignError([f"{POPULATION}.{name}: {given:g} is not from {least:g} to 10"])
    return given


def _positive(given: dict[str, Any], name: str) -> Distribution:
    where = f"{POPULATION}.{name}"
    if not is_distribution(given):
        raise CampaignError([f"{where}: {shown(given)} is no distribution"])
    read = read_distribution(given, where)
    if read.unit is not None or read.below(0.0) > 0.0:
        raise CampaignError([f"{where}: must be positive and without a unit, such as a log-normal"])
    return read
