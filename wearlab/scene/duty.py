"""``operation.duty`` and ``[[operation.stage]]``: conditions that take turns, and conditions in order."""

from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Discriminator, Tag, ValidationInfo

from wearlab.options import NOT_NEGATIVE, POSITIVE, Number, Part, Speed, Stored, Torque, option
from wearlab.table_options import duty_table, named_file, named_texts
from wearlab.tables import TableError

SUM_OF_SHARES = 1e-6
"""How far written shares may be from 1 in sum."""


class DutyBlock(Part):
    """One condition of a duty."""

    torque: Annotated[Torque, NOT_NEGATIVE] = option(..., "torque on the input member")
    speed: Annotated[Speed, POSITIVE] = option(..., "speed of the input member")
    share: Annotated[Number, POSITIVE] = option(..., "share of the operating time; all shares sum to 1")


class DutyFile(Part):
    """A load-duration table; its contents, not its path, are part of the scene."""

    file: str = option(..., "CSV file with a row for each condition")
    columns: dict[str, str] | None = option(
        None, "header of torque, speed and share in the file", derived="their own names"
    )
    units: dict[str, str] = option(
        {},
        "units of torque, speed and share; shares of time in %, h, s or [1], in proportion to their sum",
        derived="those in the headers",
    )


class OperationStage(Part):
    """One of several conditions in order; wear carries over from each to the next."""

    label: str | None = option(None, "name of the stage", derived="its number", identity=False)
    torque: Annotated[Torque, NOT_NEGATIVE] = option(..., "torque on the input member")
    speed: Annotated[Speed, POSITIVE] = option(..., "speed of the input member")
    cycles: Annotated[Number, POSITIVE] | None = option(
        None, "cycles of the stage", derived="up to wear.until, in the last stage"
    )


def _blocks(given: Any, info: ValidationInfo) -> Any:
    """Return the blocks of a file as if they were written in place."""
    if not isinstance(given, dict):
        return given
    if unknown := set(given) - set(DutyFile.model_fields):
        raise ValueError(f"unknown {', '.join(sorted(unknown))}: give file, columns and units")
    if "file" not in given:
        raise ValueError("'file' is required: {file, columns, units}")
    base: Path | None = (info.context or {}).get("base_directory")
    try:
        columns = named_texts({"columns": {}, **given}, "columns", '{ share = "duration" }')
        units = named_texts({"units": {}, **given}, "units", '{ torque = "N*m", speed = "rpm", share = "h" }')
        torque, speed, share = duty_table(named_file(given), columns, units, base)
    except TableError as error:
        raise ValueError(str(error)) from None
    total = sum(share)
    return [
        {"torque": Stored(t), "speed": Stored(n), "share": Stored(u / total)}
        for t, n, u in zip(torque, speed, share, strict=True)
        if u > 0.0
    ]


def _shares(blocks: Any) -> Any:
    """Refuse shares that do not sum to 1."""
    total = sum(block.share for block in blocks)
    if abs(total - 1.0) > SUM_OF_SHARES:
        raise ValueError(f"the shares of time sum to {total:.6g}, not to 1")
    return blocks


def _labels(stages: Any) -> Any:
    """Refuse no stages, stages without an end before the last, and two of one name."""
    if not stages:
        raise ValueError("there is no stage: give torque, speed and cycles of each")
    open_ended = [number for number, stage in enumerate(stages[:-1], 1) if stage.cycles is None]
    if open_ended:
        raise ValueError(f"stage {open_ended[0]} needs 'cycles': only the last one may go on to wear.until")
    names = labels_of(stages)
    if len(set(names)) != len(names):
        raise ValueError(f"two stages have one label: {', '.join(names)}")
    return stages


def labels_of(stages: Any) -> list[str]:
    """Return the names of stages, their numbers where they have none."""
    return [stage.label or str(number) for number, stage in enumerate(stages, 1)]


def _written(value: Any) -> str:
    return "file" if isinstance(value, dict) else "blocks"


Duty = Annotated[
    Annotated[tuple[DutyBlock, ...], Tag("blocks")] | Annotated[DutyFile, Tag("file")],
    Discriminator(_written),
    BeforeValidator(_blocks),
    AfterValidator(_shares),
]
OperationStages = Annotated[tuple[OperationStage, ...], AfterValidator(_labels)]
