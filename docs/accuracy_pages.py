"""Error against run time, figures of each campaign of ``campaigns/accuracy``: ``python docs/accuracy_pages.py [NAME ...]``.

Runs ``wearlab accuracy`` on the campaigns named, on all with ``all``, on a machine that
does nothing else; keeps the figures, small, in ``docs/images/accuracy``, when and how
each was measured in ``docs/accuracy.json``, and writes ``docs/accuracy.md`` of all that
is kept, also without a name.
"""

import json
import sys
import tempfile
import time
import tomllib
from pathlib import Path
from typing import Any

import papers_pages
import xarray as xr

from wearlab.cli.app import status_of

TOP = Path(__file__).parents[1]
CAMPAIGNS = TOP / "campaigns" / "accuracy"
IMAGES = TOP / "docs" / "images" / "accuracy"
KEPT = TOP / "docs" / "accuracy.json"
KINDS = {
    "work-precision": "Error of the steady mesh force over the run time",
    "life-time": "Error of life and wear depth over the run time",
    "life": "Error of life and wear depth over contact analyses, which are the same "
    "on every machine",
    "knobs": "Error over each setting alone",
}
HEAD = """# What an error costs, campaign by campaign

Every scene of `campaigns/accuracy` solved at ever finer settings against a reference that a second method has confirmed, beside other
integrators and outside solvers (the extra `[peers]`). What the marks mean is under each figure; the ring is the default. Times are of
this machine and Python; curves beside each other were measured in one run, so that their ratio says more than the times. Made by
`python docs/accuracy_pages.py all`; `wearlab accuracy FILE` does it for scenes of your own, tables with it."""
BUSY = 0.9


def measure(name: str) -> None:
    """Run one campaign's study, keep its figures and how it was measured."""
    begun = time.perf_counter()
    used = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        if status_of(["accuracy", str(CAMPAIGNS / f"{name}.toml"), "--out", folder]):
            sys.exit(f"{name}: no curve was measured")
        for image in sorted(Path(folder).glob("*.png")):
            papers_pages.small(image.read_bytes(), IMAGES / f"{name}-{image.name}")
        with xr.open_dataset(Path(folder) / "accuracy.nc") as made:
            told = {
                key: made.attrs[key]
                for key in ("date_created", "model_version", "machine", "packages")
            }
    wall = time.perf_counter() - begun
    told |= {
        "minutes": round(wall / 60.0, 1),
        "share": round((time.process_time() - used) / wall, 2),
    }
    KEPT.write_text(json.dumps(kept() | {name: told}, indent=1, sort_keys=True) + "\n")


def kept() -> dict[str, Any]:
    """Return how each campaign was measured, by name."""
    return json.loads(KEPT.read_text()) if KEPT.exists() else {}


def campaigns() -> dict[str, str]:
    """Return what each campaign is of, by name."""
    titles = {
        file.stem: tomllib.loads(file.read_text())["title"]
        for file in sorted(CAMPAIGNS.glob("*.toml"))
    }
    short = {
        name: title.removeprefix("Error against run time: ")
        for name, title in titles.items()
    }
    return {name: title[0].upper() + title[1:] for name, title in short.items()}


def images(name: str) -> list[str]:
    """Return the kinds of figures that are kept of a campaign, those over the run time first."""
    return [kind for kind in KINDS if (IMAGES / f"{name}-{kind}.png").exists()]


def page() -> str:
    """Return the page of all that is kept."""
    parts = [HEAD]
    for name, title in campaigns().items():
        told = kept().get(name)
        parts += [f"## {title}"]
        parts += [
            f"`wearlab accuracy campaigns/accuracy/{name}.toml`, " + _measured(told)
        ]
        parts += [
            f"![{KINDS[kind]}, {title}](images/accuracy/{name}-{kind}.png)"
            for kind in images(name)
        ]
    return "\n\n".join(parts) + "\n"


def _measured(told: dict[str, Any] | None) -> str:
    if told is None:
        return "not measured yet."
    busy = (
        f", **others computing on the same machine** ({100 * told['share']:.0f} % of "
        "a core): times are too long"
        if told["share"] < BUSY
        else ""
    )
    return (
        f"measured on {told['date_created'][:10]} in {told['minutes']:g} minutes, "
        f"model version {told['model_version']}, "
        f"{told['machine']}, {told['packages'].split(', xarray')[0]}{busy}."
    )


if __name__ == "__main__":
    for chosen in campaigns() if sys.argv[1:] == ["all"] else sys.argv[1:]:
        measure(chosen)
    (TOP / "docs" / "accuracy.md").write_text(page())
