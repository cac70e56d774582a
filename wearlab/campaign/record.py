"""A campaign as plain data: enough to open its grid from a store, years after its file has gone.

Which runs there are, what each is called and where it stands; not the scenes, which the runs hold themselves.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wearlab.campaign.axes import Axis, Coordinate
from wearlab.campaign.campaign import Campaign

FORMAT = 1


@dataclass(frozen=True)
class RecordedCase:
    """A run of a recorded campaign: its label, identity and place."""

    label: str
    id: str
    position: dict[str, int]


@dataclass(frozen=True)
class RecordedCampaign:
    """What `Store.open` asks of a campaign."""

    title: str
    reference: str | None
    cases: tuple[RecordedCase, ...]
    axes: tuple[Axis, ...] = ()
    figures: tuple[Any, ...] = ()
    path: Path | None = None


def to_record(campaign: Campaign) -> dict[str, Any]:
    """Return a campaign as JSON can hold it."""
    names = [axis.name for axis in campaign.axes]
    return {
        "format": FORMAT,
        "title": campaign.title,
        "reference": campaign.reference,
        "axes": [_axis(axis) for axis in campaign.axes],
        "cases": [[case.id, case.label, [case.position.get(n) for n in names]] for case in campaign.cases],
    }


def _axis(axis: Axis) -> dict[str, Any]:
    beside = {
        n: [list(coordinate.values), coordinate.units, coordinate.key]
        for n, coordinate in axis.coordinates.items()
    }
    return {
        "name": axis.name,
        "values": list(axis.values),
        "units": axis.units,
        "key": axis.key,
        "beside": beside,
    }


def from_record(record: Mapping[str, Any]) -> RecordedCampaign:
    """Return the campaign of a record.

    Raises
    ------
    ValueError : it is no record, or one of a newer wearlab
    """
    try:
        if record["format"] != FORMAT:
            raise ValueError(f"record of format {record['format']!r}, this wearlab reads {FORMAT}")
        axes = tuple(_read_axis(axis) for axis in record["axes"])
        cases = tuple(_read_case(case, axes) for case in record["cases"])
        return RecordedCampaign(str(record["title"]), record["reference"], cases, axes)
    except (KeyError, TypeError, IndexError, AttributeError) as error:
        raise ValueError(f"not the record of a campaign ({error!r})") from None


def _read_axis(block: Mapping[str, Any]) -> Axis:
    beside = {str(n): Coordinate(tuple(v), units, str(key)) for n, (v, units, key) in block["beside"].items()}
    return Axis(str(block["name"]), tuple(block["values"]), block["units"], str(block["key"]), beside)


def _read_case(block: list[Any], axes: tuple[Axis, ...]) -> RecordedCase:
    run_id, label, places = block
    position = {axis.name: int(i) for axis, i in zip(axes, places, strict=True) if i is not None}
    for axis in axes:
        if not 0 <= position.get(axis.name, 0) < len(axis.values):
            raise IndexError(f"{axis.name} has no place {position[axis.name]}")
    return RecordedCase(str(label), str(run_id), position)
