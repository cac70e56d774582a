"""What leaving a part out saves: ``python docs/leaving_out_pages.py``.

Writes ``docs/evidence/leaving_out.md`` of what ``python
tests/benchmarks/leaving_out.py docs/evidence/leaving_out.json`` measured.
"""

import json
import sys
from pathlib import Path
from typing import Any

TOP = Path(__file__).parents[1]
sys.path.insert(0, str(TOP / "tests" / "benchmarks"))

import leaving_out  # noqa: E402

EVIDENCE = TOP / "docs" / "evidence"
MEASURED = EVIDENCE / "leaving_out.json"
PAGE = EVIDENCE / "leaving_out.md"
HEAD = """# What leaving a part out saves

What a scene does not name is neither computed, nor compiled, nor stored. Each row compares two scenes: in the first a part is
present and has no effect, such as friction with a coefficient of 0; in the second it is absent. The results agree, and the times tell what
the part costs. Times are those of the processor for one wearing state, compiled, the least of many turns, without estimates of errors. *nil*
means that the saving is no larger than what the turns differ by. The machine was quiet.

`python tests/benchmarks/leaving_out.py docs/evidence/leaving_out.json` measures, `python docs/leaving_out_pages.py` makes this page, and
`tests/validation/test_leaving_out.py` holds that the differences are within the tolerances."""
SETS = {
    "spur pair": "Two gears of 50 teeth at 340 N·m and 1860 rpm, in torsion.",
    "planetary set": "The gearbox NGW11-6 with 18 degrees of freedom "
    "(`campaigns/base/planetary_ngw11_vibration.toml`), until it has worn one state.",
    "helical pair": "A crowned, misaligned pair on bearings "
    "(`campaigns/helical_coupled.toml`), until it has worn one state.",
}
"""What each set is."""


def page() -> str:
    """Return the page of all that is kept."""
    everything = kept()
    parts = [HEAD]
    for name, text in SETS.items():
        parts += [f"## {name.capitalize()}"]
        if name not in everything:
            parts += [f"{text} Not measured yet."]
            continue
        measured = everything[name]
        parts += [
            f"{text} Measured on {measured['date']}, model version "
            f"{measured['model_version']}.",
            table(measured["parts"]),
        ]
    return "\n\n".join([*parts, *friction(everything)]) + "\n"


def table(parts: list[dict[str, Any]]) -> str:
    """Return what leaving out each part of a set saves."""
    rows = [leaving_out.row(leaving_out.Saving(**part)) for part in parts]
    tolerances = [
        f"{part['tolerance']:.0e}" if part["tolerance"] else "0" for part in parts
    ]
    heads = (*leaving_out.HEADS, "allowed")
    lines = [
        heads,
        *((*row, allowed) for row, allowed in zip(rows, tolerances, strict=True)),
    ]
    first, *others = [f"| {' | '.join(cells)} |" for cells in lines]
    return "\n".join([first, "|---" * len(heads) + "|", *others])


def friction(everything: dict[str, Any]) -> list[str]:
    """Return why friction without effect makes a difference, none where it is not measured."""
    differences = {
        name: part["difference"]
        for name, measured in everything.items()
        for part in measured["parts"]
        if part["name"] == "friction"
    }
    if not {"spur pair", "planetary set"} <= set(differences):
        return []
    return [
        "## Why friction differs in a spur pair",
        f"Friction with a coefficient of 0 moves the forces of the spur pair by "
        f"{differences['spur pair']:.0e}, those of the planetary set by "
        f"{differences['planetary set']:.0e}. Friction acts on both gears by "
        "different lever arms, so that a pair with friction turns by two angles and not "
        "by their difference alone: its state has four numbers instead of two, and "
        "it is integrated as larger systems are (`wearlab.dynamics.integrators.kernel`, "
        "`is_small`). Both integrations are accurate to `numerics.tolerance`, 1e-3, and "
        "that is by how much they may differ. The planetary set is integrated as a large system with friction and without, "
        "so that only the order of sums differs.",
    ]


def kept() -> dict[str, Any]:
    """Return what is kept of each set, by name."""
    return json.loads(MEASURED.read_text()) if MEASURED.exists() else {}


if __name__ == "__main__":
    PAGE.write_text(page())
