"""Draw the thumbnails of the gallery: ``python docs/gallery.py [STORE]`` writes ``docs/images/kinds/*.png``.

Campaigns of ``campaigns/gallery`` are run first where the store has not got them, and
those with an [update] updated, where a picture of theirs is missing or not today's.
"""

import sys
from pathlib import Path
from typing import Any

import pictures

import wearlab as wl
from wearlab.figures import FigureError, drawing
from wearlab.figures.question import question
from wearlab.figures.render import lightened

TOP = Path(__file__).parents[1]
OUT = TOP / "docs" / "images" / "kinds"
ASKED = {
    "update_gearbox": {"check": 200},
    "update_planetary_rig": {"replay": True},
}  # of an update


def main(folder: str = "wearlab-store") -> None:
    """Draw each kind once, from the first campaign that has it."""
    OUT.mkdir(exist_ok=True)
    known = pictures.campaign_files()
    loaded: dict[Path, Any] = {}
    for picture in OUT.glob("*.png"):
        if pictures.why_stale(picture, known, loaded):
            picture.unlink()
    files = [
        *sorted((TOP / "campaigns" / "gallery").glob("*.toml")),
        *sorted(TOP.glob("campaigns/update_*.toml")),
    ]
    for file in files:
        campaign = wl.load(file)
        store = wl.Store(folder)
        if file.parent.name == "gallery":
            wl.run(campaign, store, workers=0)
        elif not all((OUT / f"{spec.kind}.png").exists() for spec in campaign.figures):
            wl.update(campaign, store, **ASKED.get(file.stem, {}))
        for number, spec in enumerate(campaign.figures, 1):
            target = OUT / f"{spec.kind}.png"
            if target.exists():
                continue
            try:
                image, _ = drawing.file_of(
                    question(campaign, spec, number), store.open(campaign), store, "png"
                )
            except (FigureError, wl.StoreError) as error:
                print(f"{file.name}: {error}")
                continue
            target.write_bytes(lightened(image))


if __name__ == "__main__":
    main(*sys.argv[1:])
