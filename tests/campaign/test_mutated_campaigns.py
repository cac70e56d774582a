"""Notes cannot lie: fifty mutations of the campaigns about papers are caught.

Each puts one false statement into a campaign or into the points that it draws, at a
place drawn by a seed. ``check --claims --measured`` is to fail on it.
"""

import random
import re
import shutil
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from wearlab.campaign.marks import QUOTATION, WORD
from wearlab.cli.app import status_of

TOP = Path(__file__).parents[2]
KEPT = TOP / "docs" / "papers" / "measured"
SEED = 57
COUNT = 50
MIN_CAUGHT = 48
NUMBER = re.compile(r"\d+(?:\.\d+)?")
PLACEHOLDER = re.compile(r"\{[^{}:|']+:[^{}:|']*= ([^{} ]+)\}")
STATE = re.compile(r"\b(update ?= ?|cycle ?= ?)(-?[\de]+)")
OPPOSITE = {
    "rises": "falls",
    "falls": "rises",
    "grows": "shrinks",
    "shrinks": "grows",
    "growing": "shrinking",
    "shallower": "deeper",
    "deepest": "shallowest",
    "shallowest": "deepest",
    "largest": "smallest",
    "smallest": "largest",
    "strongest": "weakest",
    "longest": "shortest",
    "least": "largest",
}


class Mutation(NamedTuple):
    """A text of a file, another in its place, and the campaign that is checked."""

    kind: str
    campaign: str
    file: Path
    start: int
    old: str
    new: str

    def apply(self) -> str:
        """Return the text of the file with the mutation."""
        text = self.file.read_text(encoding="utf-8")
        assert text[self.start :].startswith(self.old)
        return text[: self.start] + self.new + text[self.start + len(self.old) :]


def campaigns() -> list[Path]:
    """Return the campaigns that hold what they say of papers."""
    return [
        file
        for file in sorted((TOP / "campaigns").glob("*.toml"))
        if "\nreadings" in file.read_text(encoding="utf-8")
    ]


def another(number: str, draw: random.Random) -> str:
    """Return a number with one digit changed."""
    place = draw.choice([i for i, digit in enumerate(number) if digit.isdigit()])
    digits = [digit for digit in "123456789" if digit != number[place]]
    return number[:place] + draw.choice(digits) + number[place + 1 :]


def lines_of(text: str, key: str) -> Iterator[re.Match[str]]:
    """Yield the lines of a file that give a key."""
    return re.finditer(rf"(?m)^{key}\s*= .*$", text)


def numbers_typed(text: str, draw: random.Random) -> Iterator[tuple[int, str, str]]:
    """Yield quotations that become numbers by themselves, or other numbers."""
    for note in lines_of(text, "note"):
        for match in QUOTATION.finditer(note[0]):
            if (number := NUMBER.search(match[1])) is None:
                continue
            start = note.start() + match.start()
            wrong = match[1].replace(number[0], another(number[0], draw), 1)
            quoted = match[0].replace(match[1], wrong, 1)
            yield start, match[0], draw.choice([match[1], wrong, quoted])


def printed(text: str, draw: random.Random) -> Iterator[tuple[int, str, str]]:
    """Yield what claims say that a paper prints, and another number."""
    for line in lines_of(text, "printed"):
        number = NUMBER.search(line[0])
        yield line.start() + number.start(), number[0], another(number[0], draw)


def placeholders_typed(
    text: str, draw: random.Random
) -> Iterator[tuple[int, str, str]]:
    """Yield placeholders, and numbers of today's runs in their place."""
    for note in lines_of(text, "note"):
        for match in PLACEHOLDER.finditer(note[0]):
            yield note.start() + match.start(), match[0], match[1]


def other_states(text: str, draw: random.Random) -> Iterator[tuple[int, str, str]]:
    """Yield wear states of formulas in notes and claims, and others."""
    for key in ("note", "quantity"):
        for line in lines_of(text, key):
            for match in STATE.finditer(line[0]):
                state = "-1" if match[2] in ("0", "3e6") else "0"
                key_of_state = "update=" if "cycle" in match[1] else match[1]
                yield line.start() + match.start(), match[0], f"{key_of_state}{state}"


def wide(text: str, draw: random.Random) -> Iterator[tuple[int, str, str]]:
    """Yield tolerances, and 300 % in their place."""
    for line in lines_of(text, "tolerance"):
        new = re.sub(r"= .*", '= "300 %"', line[0])
        yield line.start(), line[0], new


def opposites(text: str, draw: random.Random) -> Iterator[tuple[int, str, str]]:
    """Yield words of direction, of ours or of a paper, and their opposites."""
    for note in lines_of(text, "note"):
        for pattern in (WORD, QUOTATION):
            for match in pattern.finditer(note[0]):
                words = re.findall("[a-z]+", match[1].lower())
                if turned := [word for word in words if word in OPPOSITE]:
                    said = match[1].lower()
                    opposite = said.replace(turned[0], OPPOSITE[turned[0]], 1)
                    new = match[0].replace(match[1], opposite, 1)
                    yield note.start() + match.start(), match[0], new


Places = Callable[[str, random.Random], Iterator[tuple[int, str, str]]]
KINDS: dict[str, Places] = {
    "a paper's number typed in a note": numbers_typed,
    "what a claim says is printed": printed,
    "a placeholder replaced by a number": placeholders_typed,
    "a formula read at another wear state": other_states,
    "a tolerance of 300 %": wide,
    "a word of direction turned round": opposites,
}
POINT = "a point of a file"


def of_points(file: Path, draw: random.Random) -> Iterator[Mutation]:
    """Yield numbers in the points that a campaign draws, and others."""
    text = file.read_text(encoding="utf-8")
    for line in lines_of(text, "published"):
        csv = file.parent / line[0].split('"')[1]
        points = csv.read_text(encoding="utf-8")
        head = re.search(r"(?m)^x.*\n", points)
        drawn = 1 if re.search(r", *y\b", head[0]) else 0
        for row in re.finditer(r"(?m)^.+$", points[head.end() :]):
            cell = row[0].split(",")[drawn]
            number = NUMBER.search(cell)[0]
            start = (
                head.end() + row.start() + row[0].index(cell, 0) + cell.index(number)
            )
            if drawn:
                start = head.end() + row.start() + len(row[0].split(",")[0]) + 1
                start += cell.index(number)
            yield Mutation(POINT, file.stem, csv, start, number, another(number, draw))


def drawn_mutations() -> list[Mutation]:
    """Return fifty mutations, the kinds in turn, at places drawn by the seed."""
    draw = random.Random(SEED)
    places: dict[str, list[Mutation]] = {kind: [] for kind in (*KINDS, POINT)}
    for file in campaigns():
        text = file.read_text(encoding="utf-8")
        for kind, find in KINDS.items():
            places[kind] += [
                Mutation(kind, file.stem, file, start, old, new)
                for start, old, new in find(text, draw)
            ]
        places[POINT] += of_points(file, draw)
    for mutations in places.values():
        draw.shuffle(mutations)
    kinds = [*places] * (COUNT // len(places) + 1)
    return [places[kind].pop() for kind in kinds[:COUNT]]


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    folder = tmp_path_factory.mktemp("mutated") / "campaigns"
    shutil.copytree(TOP / "campaigns", folder)
    return folder


def status(folder: Path, name: str) -> int:
    """Return the exit status of the check of a campaign."""
    kept = KEPT / f"{name}.json"
    file = folder / f"{name}.toml"
    return status_of(["check", str(file), "--claims", "--measured", str(kept)])


@pytest.mark.parametrize("file", campaigns(), ids=lambda file: file.stem)
def test_what_campaigns_say_of_papers_is_held(file):
    assert status(file.parent, file.stem) == 0


def test_every_campaign_with_claims_holds_what_it_says():
    claiming = {
        file
        for file in (TOP / "campaigns").rglob("*.toml")
        if "\n[[claim]]" in file.read_text(encoding="utf-8")
    }
    assert claiming <= set(campaigns()) and len(claiming) > 20


def test_fifty_mutations_are_caught(copy):
    mutations = drawn_mutations()
    counts = Counter(mutation.kind for mutation in mutations)
    assert len(mutations) == COUNT and min(counts.values()) >= 4 and len(counts) == 7

    missed = []
    for mutation in mutations:
        target = copy / mutation.file.relative_to(TOP / "campaigns")
        assert mutation.old != mutation.new
        target.write_text(mutation.apply(), encoding="utf-8")
        if status(copy, mutation.campaign) != 1:
            missed.append(mutation)
        shutil.copyfile(mutation.file, target)
    assert len(missed) <= COUNT - MIN_CAUGHT, missed
