"""Files of every reader, damaged: each is read, or refused in one message.

Those of REXS and of measuring machines are damaged in the tests of their rooms, too.
"""

import io
import random
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import measured_gear
import openpyxl
import pytest
import rexs_files
from scenes import external_pair

from wearlab.assembly.sets import build_set
from wearlab.gears.specification import GearError
from wearlab.rexs import RexsError
from wearlab.rexs.stages import read_unit
from wearlab.scene import Scene, SceneError
from wearlab.tables import TableError, read_table
from wearlab.tables.p40 import read_measurement

MUTATIONS = 500
ODD = (
    "", "nan", "-inf", "1e999", "-1", "0", "1e-320", "9" * 400, "=A1+1", "2026-02-30",
    "ä", "\x00", '"', "1,5", "1.234,5", "1,000", "true", "[]", "#DIV/0!", "-0.0",
    "Summe", "total", "\ufeff", "\r", "1 um", ";", "\t", ",",
)  # fmt: skip
SPECTRUM = (
    "torque [N*m],speed [rpm],hours\n0,0,4000\n345,1200,9000\n567,1150,800\n"
    "-210,1180,300\n0,1500,900\n"
)
PROFILE = "diameter [mm];deviation [um]\n" + "".join(
    f"{0.5 * place:.1f};{-0.02 * (place - 116) ** 2:.3f}\n" for place in range(112, 134)
)
PITCHES = "tooth,F_p [um]\n" + "".join(
    f"{tooth},{0.5 * (7 * tooth % 11) if tooth < 20 else 0}\n" for tooth in range(1, 21)
)
CURVE = "x [mm],y [um]\n" + "".join(f"{x},{x * x}\n" for x in range(20))
REFUSALS = (SceneError, GearError, TableError, RexsError)


def scene_of(**sections: Any) -> Callable[[Path], None]:
    """Return a reader that builds the gears of a scene with the file in it."""

    def use(path: Path) -> None:
        table = {
            "gears": external_pair(20, 40),
            "operation": {"torque": "100 N*m", "speed": "1000 rpm"},
            **_named(sections, path.name),
        }
        scene = Scene.from_mapping(table, path.parent)
        if not scene.operation.several:
            build_set(scene)

    return use


def _named(entry: Any, name: str) -> Any:
    """Return sections in which FILE is the name of the file."""
    if isinstance(entry, dict):
        return {key: _named(value, name) for key, value in entry.items()}
    return name if entry == "FILE" else entry


spectrum = scene_of(operation={"duty": {"file": "FILE"}})
profile = scene_of(
    wear={
        "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
        "initial": {"pinion": {"file": "FILE", "continuation": "hold", "zero": "max"}},
    }
)
pitches = scene_of(
    mesh={"damping_ratio": 0.05},
    dynamics={"model": "torsional"},
    errors={"slow": "hunting", "pinion": {"pitch": {"file": "FILE"}}},
)


def stages(path: Path) -> None:
    """Read every stage of a gear unit."""
    unit = read_unit(path)
    for stage in unit.stages:
        if not stage.reason:
            unit.draft(stage.number).table()


def values(path: Path) -> None:
    """Read a measuring machine's file."""
    measurement = read_measurement(path)
    for side in ("left", "right"):
        if measurement.teeth("profile", side):
            measurement.curve("profile", side, "mean")


def mutated(text: str, chance: random.Random) -> bytes:
    """Return a text with one or two odd places, or its bytes damaged."""
    if chance.random() < 0.3:
        return damaged(text.encode(), chance)
    for _ in range(chance.randrange(1, 3)):
        numbers = list(re.finditer(r"\d+\.?\d*", text)) or [re.match("", text)]
        lines = text.splitlines() or [""]
        place = chance.randrange(len(text) + 1)
        found = chance.choice(numbers)
        match chance.randrange(6):
            case 0:
                text = text[:place] + chance.choice(ODD) + text[place:]
            case 1:
                text = text[:place] + text[place + chance.randrange(1, 40) :]
            case 2:
                text = text[:place]
            case 3:
                chance.shuffle(lines)
                text = "\n".join(lines)
            case _:
                text = text[: found.start()] + chance.choice(ODD) + text[found.end() :]
    return text.encode("utf-8", "surrogatepass")


def damaged(content: bytes, chance: random.Random) -> bytes:
    """Return bytes of which some are others, gone, or new."""
    letters = bytearray(content)
    place = chance.randrange(len(letters))
    match chance.randrange(4):
        case 0:
            letters[place] = chance.randrange(256)
        case 1:
            del letters[place:]
        case 2:
            letters[place:place] = bytes(chance.randrange(256) for _ in range(20))
        case 3:
            del letters[place : place + chance.randrange(1, 200)]
    return bytes(letters)


def workbook(text: str, chance: random.Random) -> bytes:
    """Return the rows of a text as a workbook with odd cells, or its bytes damaged."""
    book = openpyxl.Workbook()
    sheet = book.active
    for line in text.splitlines():
        cells = re.split("[,;]", line)
        is_number = re.compile(r"-?\d+(\.\d+)?")
        sheet.append([float(c) if is_number.fullmatch(c) else c for c in cells])
    for _ in range(chance.randrange(1, 4)):
        row = chance.randrange(1, sheet.max_row + 2)
        column = chance.randrange(1, sheet.max_column + 2)
        odd = chance.choice([*ODD, None, True, 10**15, -1, 1e300])
        if not isinstance(odd, str) or odd.isprintable():
            sheet.cell(row, column).value = odd
    saved = io.BytesIO()
    book.save(saved)
    content = saved.getvalue()
    return damaged(content, chance) if chance.random() < 0.3 else content


def zipped(text: str, chance: random.Random) -> bytes:
    """Return a damaged zip, or one of a damaged text."""
    saved = io.BytesIO()
    content = mutated(text, chance) if chance.random() < 0.5 else text.encode()
    with zipfile.ZipFile(saved, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("unit.rexs", content)
    return damaged(saved.getvalue(), chance)


class Reader(NamedTuple):
    """What is damaged, how, and what reads it."""

    name: str
    text: str
    make: Callable[[str, random.Random], bytes]
    use: Callable[[Path], Any]


READERS = {
    "spectrum": Reader("a.csv", SPECTRUM, mutated, spectrum),
    "spectrum in a workbook": Reader("a.xlsx", SPECTRUM, workbook, spectrum),
    "profile": Reader("a.csv", PROFILE, mutated, profile),
    "profile in a workbook": Reader("a.xlsx", PROFILE, workbook, profile),
    "pitches": Reader("a.csv", PITCHES, mutated, pitches),
    "published points": Reader("a.csv", CURVE, mutated, read_table),
    "gear unit": Reader("a.rexs", rexs_files.as_xml(), mutated, stages),
    "gear unit in JSON": Reader("a.rexsj", rexs_files.as_json(), mutated, stages),
    "gear unit in a zip": Reader("a.rexsz", rexs_files.as_xml(), zipped, stages),
    "curves": Reader("a.mka", measured_gear.mka(), mutated, values),
    "values": Reader(
        "a.mew", measured_gear.mka().replace("MK.FILE", "MW.FILE"), mutated, values
    ),
}


@pytest.mark.parametrize("kind", READERS)
def test_damaged_files_are_read_or_cost_one_message(kind, tmp_path):
    chance = random.Random(56)
    reader = READERS[kind]
    refused = 0
    for number in range(MUTATIONS):
        path = tmp_path / f"{number}_{reader.name}"
        path.write_bytes(reader.make(reader.text, chance))
        try:
            reader.use(path)
        except REFUSALS as error:
            refused += 1
            assert str(error).strip()
    assert 0 < refused < MUTATIONS
