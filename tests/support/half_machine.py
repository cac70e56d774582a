"""Files of a measuring machine, damaged in ways that know the format."""

import random
import re
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import measured_gear
from half_read import Mutant, Rows

from wearlab.tables.p40 import read_measurement

KINDS = ("profile", "lead")
SIDES = ("left", "right")
ODD = ("x", "1,5", "1.2.3", "####", "1e", "-", "5mm", "9999999")


def read(path: Path) -> Rows:
    """Return all curves and pitches of a file, and the mean profile of each side."""
    measurement = read_measurement(path)
    rows: Rows = []
    for number, (kind, side) in enumerate((k, s) for k in KINDS for s in SIDES):
        for tooth in (*measurement.teeth(kind, side), "mean"):
            if not measurement.teeth(kind, side):
                continue
            places, deviation = measurement.curve(kind, side, tooth)
            label = float(0 if tooth == "mean" else tooth)
            pairs = zip(places.tolist(), deviation.tolist(), strict=True)
            rows += [(float(number), label, *pair) for pair in pairs]
    for side, pitch in measurement.pitch.items():
        for column, values in enumerate((pitch.single, pitch.cumulative)):
            label = 10.0 + 2.0 * SIDES.index(side) + column
            rows += [(label, 0.0, float(n), value) for n, value in enumerate(values)]
    return rows


def _kept(text: str, chance: random.Random) -> str:
    """Write the same in another way."""
    return chance.choice(
        [
            lambda: text.replace("\n", "\r\n"),
            lambda: text.replace("  Values / ", " Werte  "),
            lambda: text.replace("right", "rechts").replace("left", "links"),
            lambda: text.replace("\nProfil:", "\n\nProfil:\n"),
            lambda: text + "\nremarks of the rig\n",
        ]
    )()


def _line_gone(text: str, chance: random.Random) -> str:
    lines = text.split("\n")
    del lines[chance.randrange(3, len(lines))]
    return "\n".join(lines)


def _line_twice(text: str, chance: random.Random) -> str:
    lines = text.split("\n")
    place = chance.randrange(3, len(lines))
    lines.insert(place, lines[place])
    return "\n".join(lines)


def _lines_swapped(text: str, chance: random.Random) -> str:
    lines = text.split("\n")
    a, b = (chance.randrange(3, len(lines)) for _ in range(2))
    lines[a], lines[b] = lines[b], lines[a]
    return "\n".join(lines)


def _odd_word(text: str, chance: random.Random) -> str:
    words = list(re.finditer(r"\S+", text))
    word = chance.choice(words[8:])
    return text[: word.start()] + chance.choice(ODD) + text[word.end() :]


def _word_gone(text: str, chance: random.Random) -> str:
    word = chance.choice(list(re.finditer(r"\S+ ?", text))[8:])
    return text[: word.start()] + text[word.end() :]


def _letter(text: str, chance: random.Random) -> str:
    place = chance.randrange(40, len(text))
    return text[:place] + chance.choice("xq7;,. -\t") + text[place + 1 :]


def _cut_off(text: str, chance: random.Random) -> str:
    return text[: chance.randrange(200, len(text))]


def _block_twice(text: str, chance: random.Random) -> str:
    blocks = text.split("\n\n")
    place = chance.randrange(1, len(blocks))
    blocks.insert(place, blocks[place])
    return "\n\n".join(blocks)


CHANGES: tuple[Callable[[str, random.Random], str], ...] = (
    _kept,
    _line_gone,
    _line_twice,
    _lines_swapped,
    _odd_word,
    _word_gone,
    _letter,
    _cut_off,
    _block_twice,
)


def mutants(count: int, seed: int) -> Iterator[Mutant]:
    """Yield damaged files, without what they may be read as: `is_explained` says it."""
    chance = random.Random(seed)
    text = measured_gear.mka()
    for number in range(count):
        change = CHANGES[number % len(CHANGES)]
        content = change(text, chance).encode()
        yield Mutant(change.__name__.strip("_"), "gear.mka", content, [])


def is_explained(what: str, reading: Rows, sound: Rows) -> bool:
    """Say whether a damaged file may be read so, beside the sound one.

    One number changes what depends on it: a curve's own point and that of the mean. A
    file that is cut off has the curves before.

    Parameters
    ----------
    what : was done
    reading, sound : rows of the damaged and of the sound file
    """
    by_place = {row[:3]: row[3] for row in sound}
    other = [row for row in reading if by_place.get(row[:3]) != row[3]]
    pitches = Counter(row[0] for row in sound if row[0] >= 10.0)
    missing = Counter(row[0] for row in sound) - Counter(row[0] for row in reading)
    if missing and all(count == pitches.get(kind) for kind, count in missing.items()):
        return not other  # a whole pitch table, which is then asked for by its side
    if what == "kept":
        return not other and len(reading) == len(sound)
    if what == "cut_off":
        own = [row for row in other if row[1]]
        return len(own) <= 1
    if what == "lines_swapped":  # which swaps the values of two curves
        return len(reading) >= len(sound) - 1
    is_of_one_side = len({row[0] for row in other}) == 1  # by its own code
    return (len(other) <= 2 or is_of_one_side) and len(reading) == len(sound)
