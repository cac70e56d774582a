"""Readers of tables, each with a sound table and what it returns of a file."""

import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import half_machine
import half_read
import half_rexs
import measured_gear
import rexs_files
from scenes import external_pair

from wearlab.campaign.update_options import Data, ErrorModel
from wearlab.gears.specification import GearError
from wearlab.rexs import RexsError
from wearlab.scene import Scene, SceneError
from wearlab.tables import TableError
from wearlab.tables.points import read_points
from wearlab.tables.reading import table_of
from wearlab.updating.measurements import UpdateError, read_observations

REFUSALS = (SceneError, GearError, TableError, RexsError, UpdateError)
Rows = half_read.Rows
Column = half_read.Column
LONGEST = 10.0
"""Processor time of one file [s]."""
RPM = 0.10471975511965978


class Reader(NamedTuple):
    """A kind of table.

    Parameters
    ----------
    columns : of a sound table
    read : returns the rows that a file is read as
    understood : returns the rows as `read` tells them, of those in the columns' units
    """

    columns: tuple[Column, ...]
    read: Callable[[Path], Rows]
    understood: Callable[[Rows], Rows] = lambda rows: rows

    def mutants(self, count: int, seed: int) -> Iterator[half_read.Mutant]:
        """Yield damaged files."""
        return half_read.mutants(self.columns, count, seed)

    def explains(self, mutant: half_read.Mutant, reading: Rows, folder: Path) -> bool:
        """Say whether a damaged file may be read so."""
        rows = [self.understood(rows) for rows in mutant.explained]
        return half_read.is_explained(reading, rows)


class Machine(NamedTuple):
    """A measuring machine's file, as a `Reader`."""

    read: Callable[[Path], Rows] = half_machine.read

    def mutants(self, count: int, seed: int) -> Iterator[half_read.Mutant]:
        """Yield damaged files."""
        return half_machine.mutants(count, seed)

    def explains(self, mutant: half_read.Mutant, reading: Rows, folder: Path) -> bool:
        """Say whether a damaged file may be read so."""
        sound = folder / "sound.mka"
        sound.write_text(measured_gear.mka())
        return half_machine.is_explained(mutant.what, reading, half_machine.read(sound))


class GearUnit(NamedTuple):
    """A gear unit in REXS, as a `Reader`."""

    read: Callable[[Path], half_rexs.Reading] = half_rexs.read

    def mutants(self, count: int, seed: int) -> Iterator[half_read.Mutant]:
        """Yield damaged files."""
        return half_rexs.mutants(count, seed)

    def explains(
        self, mutant: half_read.Mutant, reading: half_rexs.Reading, folder: Path
    ) -> bool:
        """Say whether a damaged file may be read so."""
        sound = folder / "sound.rexs"
        sound.write_text(rexs_files.as_xml())
        return half_rexs.is_explained(mutant.what, reading, half_rexs.read(sound))


def fault_of(reader: Any, mutant: half_read.Mutant, folder: Path) -> str | None:
    """Return what is wrong with how a file is read, "" for nothing, None if refused."""
    path = folder / mutant.name
    path.write_bytes(mutant.content)
    begin = time.process_time()
    try:
        reading = reader.read(path)
    except REFUSALS as error:
        return None if str(error).strip() else "refused without a word"
    except Exception:
        return traceback.format_exc().splitlines()[-1]
    if time.process_time() - begin > LONGEST:
        return "too long"
    if reader.explains(mutant, reading, folder):
        return ""
    return f"read as {reading[:4]}"


def _scene(path: Path, **sections: Any) -> Scene:
    """Return a scene of an external pair."""
    operation = {"torque": "100 N*m", "speed": "1000 rpm"}
    table = {"gears": external_pair(20, 40), "operation": operation, **sections}
    return Scene.from_mapping(table, path.parent)


def _spectrum(path: Path) -> Rows:
    operation = _scene(path, operation={"duty": {"file": path.name}}).operation
    return [(block.torque, block.speed, block.share) for block in operation.blocks]


def _shares(rows: Rows) -> Rows:
    total = sum(hours for _, _, hours in rows) or 1.0
    return [
        (torque, RPM * abs(speed), hours / total)
        for torque, speed, hours in rows
        if hours != 0.0
    ]


def _update(path: Path) -> Rows:
    block = Data(
        file=str(path),
        quantity="worn_mass",
        member="pinion",
        columns={"cycle": "cycles", "value": "loss"},
        number=1,
        error=ErrorModel(sd=1e-6),
    )
    observed = read_observations(block)
    return list(zip(observed.time.tolist(), observed.value.tolist(), strict=True))


def _points(path: Path) -> Rows:
    points = read_points(path)
    table = table_of(points.name, points.text.encode())
    x = table.quantity("x", "m", columns={}, units={})
    y = table.quantity("y", "m", columns={}, units={})
    return list(zip(x, y, strict=True))


def _profile(path: Path) -> Rows:
    initial = {"pinion": {"file": path.name, "continuation": "hold", "zero": "max"}}
    coefficient = {"model": "constant", "value": "1e-18 m^2/N"}
    wear = {"coefficient": coefficient, "initial": initial}
    measured = _scene(path, wear=wear).wear.initial.pinion
    return list(zip(measured.abscissa, measured.ordinate, strict=True))


def _pitches(path: Path) -> Rows:
    errors = {"slow": "hunting", "pinion": {"pitch": {"file": path.name}}}
    scene = _scene(
        path,
        errors=errors,
        mesh={"damping_ratio": 0.05},
        dynamics={"model": "torsional"},
    )
    ordinate = scene.errors.pinion.pitch.ordinate
    return [(tooth, value) for tooth, value in enumerate(ordinate, 1)]


def _scaled(*factors: float) -> Callable[[Rows], Rows]:
    """Return what brings rows into SI units."""
    return lambda rows: [
        tuple(f * n for f, n in zip(factors, row, strict=True)) for row in rows
    ]


TOOTH = tuple(float(tooth) for tooth in range(1, 21))
DIAMETERS = tuple(56.0 + 0.5 * place for place in range(22))
READERS: dict[str, Any] = {
    "machine": Machine(),
    "gear unit": GearUnit(),
    "spectrum": Reader(
        (
            Column("torque", "N*m", (0.0, 1345.5, 567.0, 210.25), "kN*m", 1e-3),
            Column("speed", "rpm", (0.0, 1200.0, 1150.5, 1180.0), "1/s", 1.0 / 60.0),
            Column("hours", "h", (4000.0, 9000.0, 800.5, 12300.0), "min", 60.0),
        ),
        _spectrum,
        _shares,
    ),
    "update": Reader(
        (
            Column("cycles", "", (125000.0, 1250000.0, 3400500.0, 7800000.0)),
            Column("loss", "mg", (35.5, 1410.25, 2300.5, 3900.0), "g", 1e-3),
        ),
        _update,
        _scaled(1.0, 1e-6),
    ),
    "points": Reader(
        (
            Column("x", "mm", (1.25, 2.5, 1003.5, 12500.0), "m", 1e-3),
            Column("y", "um", (0.5, 1234.5, 900.0, 20.125), "mm", 1e-3),
        ),
        _points,
        _scaled(1e-3, 1e-6),
    ),
    "profile": Reader(
        (
            Column("diameter", "mm", DIAMETERS, "m", 1e-3),
            Column(
                "deviation", "um", tuple(-0.125 * n**2 for n in range(22)), "mm", 1e-3
            ),
        ),
        _profile,
        _scaled(1e-3, 1e-6),
    ),
    "pitches": Reader(
        (
            Column("tooth", "", TOOTH),
            Column(
                "F_p",
                "um",
                (*(0.5 * (7 * n % 11) for n in range(19)), 0.0),
                "mm",
                1e-3,
            ),
        ),
        _pitches,
        _scaled(1.0, 1e-6),
    ),
}
