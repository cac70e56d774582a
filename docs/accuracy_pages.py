"""Error against run time, a figure of each campaign of ``campaigns/accuracy``: ``python docs/accuracy_pages.py [NAME ...]``.

Runs ``wearlab accuracy`` on the campaigns named, on all without a name, on a machine that does nothing else; keeps the
figures, small, in ``docs/images/accuracy`` and writes ``docs/accuracy.md`` of all that are kept.
"""

import sys
import tempfile
from pathlib import Path

import papers_pages

import wearlab as wl
from wearlab.cli.app import status_of

TOP = Path(__file__).parents[1]
CAMPAIGNS = TOP / "campaigns" / "accuracy"
IMAGES = TOP / "docs" / "images" / "accuracy"


def measure(name: str) -> None:
    """Run one campaign's study and keep its figures."""
    with tempfile.TemporaryDirectory() as folder:
        status_of(["accuracy", str(CAMPAIGNS / f"{name}.toml"), "--out", folder])
        for image in sorted(Path(folder).glob("*.png")):
            papers_pages.small(image.read_bytes(), IMAGES / f"{name}-{image.name}")


def page() -> str:
    """Return the page of all figures that are kept."""
    parts = [
        "# What an error costs, campaign by campaign",
        "Made by `python docs/accuracy_pages.py`: every scene solved at ever finer settings against a reference that a second "
        "method has confirmed. The ring is the default.",
    ]
    for file in sorted(CAMPAIGNS.glob("*.toml")):
        images = sorted(IMAGES.glob(f"{file.stem}-*.png"))
        parts += [f"## {wl.load(file).title}", f"`wearlab accuracy campaigns/accuracy/{file.name}`"]
        parts += [f"![{image.stem}](images/accuracy/{image.name})" for image in images]
        parts += [] if images else ["Not measured yet on a quiet machine."]
    return "\n\n".join(parts) + "\n"


if __name__ == "__main__":
    for chosen in sys.argv[1:] or [file.stem for file in sorted(CAMPAIGNS.glob("*.toml"))]:
        measure(chosen)
    (TOP / "docs" / "accuracy.md").write_text(page())
