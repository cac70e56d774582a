"""``errors.<member>.pitch``: the measured pitches of the teeth of one side."""

import re
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, ConfigDict, ValidationInfo
from pydantic.json_schema import SkipJsonSchema

from wearlab import options
from wearlab.arrays import Array
from wearlab.options import Stored, option
from wearlab.tables import ReadTable, TableError, p40
from wearlab.tables.written import (
    file_named,
    is_stored,
    refuse_contents,
    table_named,
)

QUANTITIES = {"F_p": "cumulative", "f_p": "single"}
"""What a table holds, and how a measuring machine's file calls it."""
WANTED = "{file, side, quantity, units}, or a list of F_p"
TOOTH_NUMBERS = re.compile(
    r"(?:tooth|zahn|dent|diente|dente)\W*(?:no|nr|number|nummer|n)?\W*", re.IGNORECASE
)
"""Names of a column that numbers the teeth."""
CLOSED = 0.5e-6
"""Largest F_p of the last tooth, which is 0 but for rounding [m]."""
CLOSED_SHARE = 0.02
"""The same over the range of F_p."""


class PitchTable(options.Part):
    """Pitch deviations of all teeth, in the order in which they come into mesh.

    The file's contents, not its path, are part of the scene.
    """

    model_config = ConfigDict(json_schema_extra={"required": ["file"]})

    file: str | None = option(None, identity=False)
    """table with a column F_p or f_p and a row a tooth, or a measuring machine's .mka
    [required in a campaign file, unless values stand there]"""
    sheet: str | None = option(None, identity=False)
    """sheet of a workbook [the only one that holds a table]"""
    decimal: Literal[".", ","] | None = option(None, identity=False)
    """decimal sign of the file [found out; refused where it has two meanings]"""
    side: Literal["left", "right"] | None = option(None, identity=False)
    """of a measuring machine's file (.mka): which side of the teeth [required there]"""
    quantity: Literal["F_p", "f_p"] = "F_p"
    """cumulative or single pitch deviation. Source: ISO 1328-1"""
    units: str | None = option(None, identity=False)
    """unit of the column [that of the header]"""
    values: tuple[options.Depth, ...] | None = None
    """the deviations themselves, in place of a file"""
    ordinate: SkipJsonSchema[tuple[float, ...]] = ()
    """the deviations in SI, from the file"""

    @classmethod
    def _complete(cls, table: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        if is_stored(table.get("ordinate")):
            return table
        if table.get("values") is not None and "file" not in table:
            return table
        refuse_contents(table, ("ordinate", "values"), WANTED)
        base = (info.context or {}).get("base_directory")
        return {**table, "ordinate": _read(table, base)}

    def _check(self) -> None:
        if not len(self.cumulative):
            raise ValueError(f"there are no deviations: give {WANTED}")
        last = float(self.cumulative[-1])
        span = float(np.ptp(self.cumulative))
        if abs(last) <= max(CLOSED, CLOSED_SHARE * span):
            return
        if self.quantity == "f_p":
            raise ValueError(
                f"all f_p sum to {1e6 * last:.3g} um, but a turn closes, so that they "
                "sum to 0: give f_p less its mean, or F_p with quantity = 'F_p'"
            )
        raise ValueError(
            f"F_p of the last tooth is {1e6 * last:.3g} um, but after a turn it comes "
            "back to 0: count F_p from the last tooth on, or give quantity = 'f_p' "
            "where these are single pitches"
        )

    @property
    def cumulative(self) -> Array:
        """F_p of every tooth, (z,) [m]."""
        numbers = np.asarray(
            self.ordinate if self.values is None else self.values, float
        )
        return np.cumsum(numbers) if self.quantity == "f_p" else numbers

    def waves(self) -> tuple[tuple[int, float, float], ...]:
        """Return F_p less its mean as ``Σ a cos(2π k i/z + p)`` of teeth i = 0, 1, ….

        Returns
        -------
        (k, a [m], p [rad]) of the orders k = 1 … z/2 of a turn that it has
        """
        pitches = self.cumulative
        teeth = len(pitches)
        lines = 2.0 * np.fft.rfft(pitches) / teeth
        if teeth % 2 == 0:
            lines[-1] *= 0.5
        size = np.abs(lines)
        present = np.flatnonzero(size > 1e-12 * (size[1:].max(initial=0.0) or 1.0))
        return tuple(
            (int(order), float(size[order]), float(np.angle(lines[order])))
            for order in present
            if order > 0
        )


def _read(table: dict[str, Any], base: Any) -> tuple[Stored, ...]:
    """Return the deviations of a file [m]."""
    quantity = table.get("quantity", "F_p")
    units = table.get("units")
    if not isinstance(units, str | None):
        raise ValueError(f"units: {str(units)[:40]} is no text: give units = 'um'")
    if not isinstance(quantity, str) or quantity not in QUANTITIES:
        raise ValueError(f"quantity: {quantity!r} is not one of 'F_p' and 'f_p'")
    path = (base or Path()) / file_named(table)
    if p40.is_measurement_file(path):
        return _of_machine(p40.read_measurement(path), table, QUANTITIES[quantity])
    if table.get("side") is not None:
        raise TableError(
            f"{path}: side belongs to a measuring machine's file (.mka); leave it out"
        )
    rows = table_named(table, base)
    _require_order(rows)
    read = rows.quantity(
        quantity, "m", columns={}, units={} if units is None else {quantity: units}
    )
    return tuple(Stored(number) for number in read)


def _require_order(rows: ReadTable) -> None:
    """Refuse rows that are not in the order of the teeth that they number."""
    named = [name for name in rows.names if TOOTH_NUMBERS.fullmatch(name)]
    if not named:
        return
    (name, *_) = named
    try:
        numbers = rows.numbers(name)
    except TableError as refusal:
        raise TableError(
            f"{refusal}: number teeth 1, 2, 3 ..., or leave the column out"
        ) from refusal
    first = 0.0 if numbers[0] == 0.0 else 1.0
    expected = first + np.arange(len(numbers))
    wrong = np.flatnonzero(numbers != expected)
    if wrong.size:
        row = int(wrong[0])
        raise TableError(
            f"{rows.place(row, name)}: tooth {numbers[row]:g} where {expected[row]:g} "
            f"belongs: give each tooth once, sorted by its number from {first:g} on"
        )


def _of_machine(
    measurement: p40.Measurement, table: dict[str, Any], column: str
) -> tuple[Stored, ...]:
    """Return the deviations of one side of a measuring machine's file [m]."""
    if table.get("units") is not None:
        raise TableError(
            f"{measurement.file}: it tells its quantities and units by codes: leave "
            "out units"
        )
    side = table.get("side")
    sides = " or ".join(f"side = {name!r}" for name in measurement.pitch)
    if not measurement.pitch:
        raise TableError(
            f"{measurement.file}: it has no pitch table: export the measurement with "
            "its pitches, or give a list of F_p"
        )
    if side not in measurement.pitch:
        raise TableError(f"{measurement.file}: say which side: {sides}")
    return tuple(Stored(number) for number in getattr(measurement.pitch[side], column))


def _as_table(value: object) -> object:
    """Return a list of deviations as a table that holds them."""
    return {"values": value} if isinstance(value, list | tuple) else value


MeasuredPitch = Annotated[
    PitchTable | None,
    BeforeValidator(
        _as_table, json_schema_input_type=PitchTable | list[options.Depth] | None
    ),
]
