"""The defaults against finite elements, in one command: stiffness, slow speed, onset of
contact.

``python tests/benchmarks/defaults_table.py FOLDER [--drawn 12] [--seconds 240] [--page
docs/evidence/defaults.md]`` judges the six meshes of the four papers and some drawn
ones,

1. the error of the stiffness (:mod:`.stiffness_table`),
2. the largest mesh force at 5 rpm over the static one (:mod:`.slow_table`),
3. the onset of contact, static and vibrating, of every way in (:mod:`.onset_table`),

sets the papers' scenes by the defaults of model version 3 beside them by today's
(:mod:`.changed_table`), keeps what it has found of each mesh in FOLDER, stops after so
many seconds and goes on when asked again. It prints the tables as far as they are
known, or writes them as a page of the documentation.
"""

import argparse
import json
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import changed_table
import onset_table
import slow_table
import stiffness_table

Row = dict[str, Any]


class Piece(NamedTuple):
    """What is judged at once, and kept: one part of the table for one mesh or set."""

    part: str
    label: str
    judge: Callable[[], Iterable[Any]]


def pieces(drawn: int) -> Iterator[Piece]:
    """Yield everything that the tables are made of."""
    for kind in slow_table.SETS:
        yield Piece("slow", kind, lambda kind=kind: slow_table.of_set(kind))
    for name in changed_table.SCENES:
        yield Piece("changed", name, lambda name=name: changed_table.of_scene(name))
    for part, judge in (
        ("stiffness", stiffness_table.scores),
        ("onset", onset_table.of_mesh),
    ):
        for label, scene, one in stiffness_table.meshes(drawn):
            yield Piece(
                part, label, lambda scene=scene, one=one, judge=judge: judge(scene, one)
            )


def kept(folder: Path, piece: Piece) -> Path:
    """Return the file of a piece."""
    name = "".join(letter if letter.isalnum() else "-" for letter in piece.label)
    return folder / f"{piece.part}-{name}.json"


def judged(folder: Path, all_pieces: list[Piece], seconds: float) -> int:
    """Judge what the folder does not hold yet, for so many seconds.

    Return how many pieces are left.
    """
    folder.mkdir(parents=True, exist_ok=True)
    begun = time.monotonic()
    missing = [piece for piece in all_pieces if not kept(folder, piece).exists()]
    for done, piece in enumerate(missing):
        if time.monotonic() - begun > seconds:
            return len(missing) - done
        found = [one._asdict() for one in piece.judge()]
        kept(folder, piece).write_text(
            json.dumps({"label": piece.label, "rows": found}, indent=1)
        )
        print(f"{piece.part}: {piece.label}", flush=True)
    return 0


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> list[str]:
    """Return the lines of a table in Markdown."""
    head = list(head)
    lines = [head, ["---"] * len(head), *rows]
    return [f"| {' | '.join(cells)} |" for cells in lines]


def per_cent(value: float) -> str:
    """Return a share in words."""
    return f"{100 * value:.1f} %"


def largest(rows: list[Row], keys: tuple[str, ...], **where: float) -> float:
    """Return the largest of some entries of the rows that agree."""
    mine = [
        row for row in rows if all(row[name] == value for name, value in where.items())
    ]
    return max(abs(row[key]) for row in mine for key in keys)


ZONES = ("single", "double")


def stiffness_lines(found: dict[str, list[Row]]) -> Iterator[str]:
    """Yield the table of the stiffness, and the worst of each model."""
    of_model = {
        model: {
            label: [row for row in rows if row["model"] == model]
            for label, rows in found.items()
        }
        for model in stiffness_table.MODELS
    }
    default, *options = of_model
    head = [
        "mesh",
        "single",
        "double",
        "50 µm",
        "0.1 T",
        "3 T",
        "worst",
        "ms",
        *options,
    ]
    lines = []
    for label, rows in of_model[default].items():
        cells = [largest(rows, (zone,), depth=0.0, torque=1.0) for zone in ZONES] + [
            largest(rows, ZONES, depth=50e-6, torque=1.0),
            largest(rows, ZONES, torque=0.1),
            largest(rows, ZONES, torque=3.0),
            largest(rows, ZONES),
        ]
        others = [
            f"{per_cent(largest(mine, ZONES, depth=0.0, torque=1.0))} "
            f"({per_cent(largest(mine, ZONES))})"
            for mine in (of_model[option][label] for option in options)
        ]
        lines.append(
            [label, *map(per_cent, cells), f"{1e3 * rows[0]['seconds']:.2f}", *others]
        )
    yield from table(head, lines)
    yield ""
    worst = {
        model: max(largest(rows, ZONES) for rows in each.values())
        for model, each in of_model.items()
    }
    yield (
        "Worst of all: "
        + ", ".join(f"{model} {per_cent(value)}" for model, value in worst.items())
        + "."
    )


def onset_lines(found: dict[str, list[Row]]) -> Iterator[str]:
    """Yield the table of the onset, and the worst of each way in."""
    keys = ("share", "largest", "entering")

    def cell(row: Row) -> str:
        return (
            "; ".join(per_cent(row[key]) for key in keys)
            + f"; {1e3 * row['seconds']:.2f} ms"
        )

    ways = list(onset_table.WAYS)
    by_way = {label: {row["way"]: row for row in rows} for label, rows in found.items()}
    yield from table(
        ["mesh", *ways],
        [[label, *(cell(rows[way]) for way in ways)] for label, rows in by_way.items()],
    )
    yield ""
    worst = [
        f"{way} "
        + "; ".join(
            per_cent(max(abs(rows[way][key]) for rows in by_way.values()))
            for key in keys
        )
        for way in ways
    ]
    yield "Worst of all: " + ", ".join(worst) + "."


def slow_lines(found: dict[str, list[Row]]) -> Iterator[str]:
    """Yield the table of slow sets."""
    rows = [
        [label, *(f"{row['ratio']:.4f}" for row in rows)]
        for label, rows in found.items()
    ]
    yield from table(["set", *slow_table.WAYS], rows)


def changed_lines(found: dict[str, list[Row]]) -> Iterator[str]:
    """Yield the table of the papers' scenes by former and today's defaults."""
    ways = list(changed_table.WAYS)
    heads = (
        "dynamic factor",
        "STE range, µm",
        f"cycles to {changed_table.DEPTH.replace('um', 'µm')}",
    )
    head = ["scene", *(f"{name}: {way}" for name in heads for way in ways)]
    lines = []
    for label, rows in found.items():
        by_way = {row["way"]: row for row in rows}
        cells = [
            shape.format(factor * by_way[way][key])
            for key, factor, shape in (
                ("factor", 1.0, "{:.3f}"),
                ("ste", 1e6, "{:.2f}"),
                ("life", 1.0, "{:.3g}"),
            )
            for way in ways
        ]
        lines.append([label, *cells])
    yield from table(head, lines)


PAGE = """# The defaults against finite elements

This page is written by

```sh
python tests/benchmarks/defaults_table.py FOLDER --page docs/evidence/defaults.md
```

which keeps what it found in a folder, so that it may be stopped and asked again. What
is judged are the six meshes of the four [papers](../bibliography.md) and {drawn} drawn
ones that helped to choose nothing: 18 to 60 teeth (rings 70 to 120), modules m of 1 to
10 mm, faces b of 4 to 16 modules, loads of 30 to 150 N/mm per millimetre of module. How
the judges are made, and how far they can be trusted, stands in [How far the models are
off](../model_error.md).
{missing}
## Stiffness

Largest error of the secant mesh stiffness against an element solution of its own
(refinement 4, on the worn outline). Of the default: unworn in single and in double
contact, with 50 µm off both flanks, at 0.1 and 3 times the torque T, the worst of all,
and the time that a contact analysis takes. Of the options: unworn at the torque, in
brackets the worst of all depths and torques.

{stiffness}

## Slow sets

Largest mesh force at 5 rpm over the static one. A pair that takes up its load at once
never comes to rest.

{slow}

## Before and after

What the change of the defaults did to the scenes of the papers, each with its gears,
torque and supports, a damping ratio of the mesh of 0.07 where the paper prints no
damping, and wear by the vibrating load with k = 1e-18 m²/N: the largest dynamic factor,
the range of the static transmission error, and the cycles until the deepest flank has
lost {depth}. Version 3 took up the load at A by a jump and its stiffness from the
potential-energy method.

{changed}

## Onset of contact

Error of the share of a pair in the static load (largest); of the largest mesh force and
of the force of the pair that enters at A, both vibrating; the time that a contact
analysis takes. The mesh frequency is 0.6 of the natural one, the damping ratio 0.07.

{onset}
"""


NOT_YET = """
Not judged yet: {}.
"""


def page(folder: Path, all_pieces: list[Piece]) -> str:
    """Return the page of what a folder holds."""
    found: dict[str, dict[str, list[Row]]] = {}
    missing = [piece for piece in all_pieces if not kept(folder, piece).exists()]
    for piece in all_pieces:
        if piece not in missing:
            found.setdefault(piece.part, {})[piece.label] = json.loads(
                kept(folder, piece).read_text()
            )["rows"]
    drawn = sum(label[0].isdigit() for label in found["stiffness"])
    written = {
        "stiffness": stiffness_lines,
        "slow": slow_lines,
        "changed": changed_lines,
        "onset": onset_lines,
    }
    return PAGE.format(
        drawn=drawn,
        missing=NOT_YET.format(
            ", ".join(f"{one.label} ({one.part})" for one in missing)
        )
        if missing
        else "",
        depth=changed_table.DEPTH.replace("um", "µm"),
        **{part: "\n".join(lines(found[part])) for part, lines in written.items()},
    )


def main() -> None:
    """Judge what is missing, and print or write the page."""
    asked = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    asked.add_argument("folder", type=Path)
    asked.add_argument("--drawn", type=int, default=12)
    asked.add_argument("--seconds", type=float, default=240.0)
    asked.add_argument("--page", type=Path)
    words = asked.parse_args()
    all_pieces = list(pieces(words.drawn))
    left = judged(words.folder, all_pieces, words.seconds)
    if left:
        print(
            f"{len(all_pieces) - left} of {len(all_pieces)} pieces judged; ask again "
            "for the rest"
        )
    text = page(words.folder, all_pieces)
    if words.page is None:
        print(text)
    else:
        words.page.write_text(text)


if __name__ == "__main__":
    main()
