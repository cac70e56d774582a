"""Draw which room of the package imports which: ``python docs/rooms.py`` writes ``docs/images/rooms.png``."""

import ast
from collections import Counter
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.patches import FancyArrowPatch

TOP = Path(__file__).parents[1]
PACKAGE = TOP / "wearlab"
MEANING = {
    "options": "units, options, slots",
    "materials": "steels, plastics, oils",
    "gears": "shape of gears",
    "mesh": "contact, stiffness",
    "dynamics": "motion, forces",
    "wear": "laws, films",
    "thermal": "warm teeth",
    "life": "loop over cycles",
    "scene": "tables to options",
    "assembly": "options to physics",
    "simulation": "labelled datasets",
    "gradients": "derivatives",
    "query": "questions",
    "campaign": "grid of cases",
    "rexs": "gear unit files",
    "store": "files, catalogue",
    "runner": "workers",
    "comparison": "two runs",
    "updating": "measurements",
    "figures": "pictures",
    "accuracy": "error over time",
    "report": "pages",
    "cli": "commands",
}


def imports():
    """Return how many files of a room import another, by (from, to)."""
    found = Counter()
    for file in PACKAGE.rglob("*.py"):
        mine = file.relative_to(PACKAGE).parts[0]
        names = set()
        for node in ast.walk(ast.parse(file.read_text())):
            if (
                isinstance(node, ast.ImportFrom)
                and node.module
                and node.module.startswith("wearlab.")
            ):
                names.add(node.module.split(".")[1])
        found.update(
            (mine, name)
            for name in names
            if name != mine and {mine, name} <= set(MEANING)
        )
    return found


def draw(path):
    """Draw rooms along the road and their imports as arcs."""
    rooms = list(MEANING)
    found = imports()
    figure, axes = plt.subplots(figsize=(12, 5.2))
    for place, room in enumerate(rooms):
        axes.text(
            place,
            -0.25,
            room,
            ha="right",
            va="top",
            rotation=40,
            fontsize=11,
            weight="bold",
        )
        axes.text(
            place + 0.42,
            -0.3,
            MEANING[room],
            ha="right",
            va="top",
            rotation=40,
            fontsize=8,
            color="0.4",
        )
        axes.plot(place, 0, "o", color="#0b5b8c", markersize=9)
    for (later, earlier), count in found.items():
        start = rooms.index(later)
        end = rooms.index(earlier)
        axes.add_patch(
            FancyArrowPatch(
                (start, 0),
                (end, 0),
                connectionstyle="arc3,rad=0.45",
                arrowstyle="-|>",
                mutation_scale=9,
                shrinkA=6,
                shrinkB=6,
                linewidth=0.4 + 0.12 * min(count, 20),
                color="0.35",
                alpha=0.6,
            )
        )
    axes.set(xlim=(-1.2, len(rooms) - 0.3), ylim=(-2.2, 4.0))
    axes.axis("off")
    figure.savefig(path, dpi=130, bbox_inches="tight")


if __name__ == "__main__":
    draw(TOP / "docs" / "images" / "rooms.png")
