"""``[start]`` that names its run by campaign and select becomes one that names it by identity."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from wearlab.campaign.axes import Axis
from wearlab.campaign.campaign import Campaign
from wearlab.campaign.case import Case
from wearlab.campaign.errors import CampaignError
from wearlab.query.evaluate import index_of_quantity
from wearlab.scene.merge import Table
from wearlab.scene.problems import shown

DEEPEST = 20
Reader = Callable[[Path], Campaign]
_under_way: list[Path] = []


def named_start(table: Table, read: Reader) -> Table:
    """Return a scene's table in which ``start`` names its run by identity.

    Which run a campaign's case is follows from the files alone; no store is asked. ``read`` reads the other.

    Raises
    ------
    CampaignError
        When the other campaign cannot be read, refers back to this one, or select means no single run.
    """
    start = table.get("start")
    if not isinstance(start, dict) or "campaign" not in start:
        return table
    if "run" in start:
        raise CampaignError(["start: give one of 'run' and 'campaign', not both"])
    case = _selected(_campaign(start["campaign"], read), start.get("select", {}))
    kept = {key: value for key, value in start.items() if key not in ("campaign", "select")}
    return {**table, "start": {**kept, "run": case.id}}


def _campaign(given: Any, read: Reader) -> Campaign:
    if not isinstance(given, str):
        raise CampaignError([f"start.campaign: {shown(given)} is no campaign file"])
    file = Path(given).expanduser().resolve()
    if file in _under_way or len(_under_way) > DEEPEST:
        circle = " → ".join(path.name for path in (*_under_way, file))
        raise CampaignError([f"start.campaign: campaigns continue each other in a circle: {circle}"])
    _under_way.append(file)
    try:
        return read(file)
    finally:
        _under_way.pop()


def _selected(campaign: Campaign, select: Any) -> Case:
    if not isinstance(select, dict):
        raise CampaignError([f"start.select: {shown(select)} is no table of axis = value"])
    axes = {axis.name: axis for axis in campaign.axes}
    valid = [*axes, "case"]
    for key in select:
        if key not in valid:
            raise CampaignError(
                [f"start.select.{key}: no axis of {campaign.title!r}; there are {', '.join(valid)}"]
            )
    wanted = {key: _index(axes[key], value) for key, value in select.items() if key != "case"}
    label = select.get("case", campaign.cases[0].label)
    selected = {
        case.id: case
        for case in campaign.cases
        if case.label == label and all(case.position.get(name, at) == at for name, at in wanted.items())
    }
    if len(selected) != 1:
        raise CampaignError(
            [f"start.select: {shown(select)} means {len(selected)} runs of {campaign.title!r}; name one: "
             f"{', '.join(valid)}"]
        )  # fmt: skip
    return next(iter(selected.values()))


def _index(axis: Axis, wanted: Any) -> int:
    """Return where a value, or a quantity in any unit, stands on an axis."""
    index = index_of_quantity(wanted, axis.values, axis.units, axis.key)
    if index is None:
        units = f" {axis.units}" if axis.units else ""
        listed = ", ".join(
            f"{value:.12g}" if isinstance(value, float) else str(value) for value in axis.values
        )
        raise CampaignError(
            [f"start.select.{axis.name}: {shown(wanted)} is not on the axis; there are {listed}{units}"]
        )
    return index
