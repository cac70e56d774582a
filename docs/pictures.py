"""Whether pictures of README and docs are today's: ``python docs/pictures.py [STORE [PICTURE ...]]``.

A picture that was drawn from runs carries its question: the campaign, the figure's table,
the runs. It is today's where a campaign of that title still has this figure, and where
its runs are those of the campaign's scenes by the model version of now. Without a store
the command lists stale pictures and fails when there are any; with one it runs the
campaigns of those that are no page's and no gallery's, and draws them anew.
``--compare STORE`` draws every picture whose runs are in the store once more, and fails
where it looks otherwise.
"""

import io
import json
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

import wearlab as wl
from wearlab.figures import drawing
from wearlab.figures.question import Question, embedded, question
from wearlab.figures.render import lightened, texts_of

TOP = Path(__file__).parents[1]
IMAGES = TOP / "docs" / "images"
PAPERS = TOP / "docs" / "papers" / "images"
BROAD, COLOURS = 900, 128
SEEN = 48  # of 255: what a colour differs by to be seen
SAME = 0.002  # share of pixels that may differ so: fonts and rounding of other machines
DRAWN_HERE = {
    "wear_profile": ("spur_speeds", 13),
    "lives_over_speed": ("planetary_speed_pieces", 1),
}
"""Picture of README or docs by name: its campaign, and the number of its figure."""
OF_NO_RUN = {
    "update_frontier.png": "sets of drawn laws, by tests/benchmarks/update_frontier.py",
    "growth.png": "times of `tests/benchmarks/growth.py`, whose table is beside it",
    "rooms.png": "the rooms of the package, by `docs/rooms.py`",
}
OF_NO_RUN_FOLDERS = {
    "accuracy": "of docs/accuracy.json, by docs/accuracy_pages.py",
    "browse": "windows, by docs/windows.py",
}


def pictures() -> list[Path]:
    """Return the pictures of README and docs that show runs or updates."""
    papers = PAPERS.glob("*.png")
    here = [
        file
        for file in IMAGES.rglob("*.png")
        if file.name not in OF_NO_RUN and file.parent.name not in OF_NO_RUN_FOLDERS
    ]
    return sorted([*here, *papers])


def campaign_files() -> dict[str, list[Path]]:
    """Return the campaign files of this project by title; several may share one."""
    found: dict[str, list[Path]] = {}
    for file in sorted((TOP / "campaigns").rglob("*.toml")):
        title = tomllib.loads(file.read_text(encoding="utf-8")).get("title", "")
        found.setdefault(title, []).append(file)
    return found


def why_stale(
    picture: Path, files: dict[str, list[Path]], loaded: dict[Path, Any]
) -> str:
    """Return why a picture is not of today's runs, "" where it is.

    Parameters
    ----------
    picture : the file
    files : campaign files by title
    loaded : campaigns that were read, by file; those that are new are added
    """
    return _asked_today(embedded(picture), files, loaded)[1]


def _asked_today(
    texts: dict[str, str], files: dict[str, list[Path]], loaded: dict[Path, Any]
) -> tuple[Question | None, str]:
    """Return the question of a picture as today's campaign has it, else why it is none.

    Parameters
    ----------
    texts : of the picture
    files, loaded : as of `why_stale`
    """
    if "question" not in texts:
        return None, "carries no question: draw it anew"
    asked = json.loads(texts["question"])
    number = int(asked["number"])
    runs = set(texts.get("runs", "").split())
    reasons = []
    for file in files.get(texts["campaign"], []):
        if file not in loaded:
            loaded[file] = wl.load(file)
        campaign = loaded[file]
        if number > len(campaign.figures):
            reasons.append(f"{file.name}: has no figure {number}")
            continue

        today = question(campaign, campaign.figures[number - 1], number)
        gone = runs - {case.id for case in campaign.cases}
        reason = ""
        points = None if today.points is None else today.points.record()
        if today.table != asked["table"] or points != asked["points"]:
            reason = f"its figure {number} is another"
        elif today.subject != asked.get("subject", ""):
            reason = "its update is of other runs or data"
        elif gone:
            reason = (
                f"{len(gone)} of {len(runs)} runs are of other scenes or model versions"
            )
        if not reason:
            return today, ""
        reasons.append(f"{file.name}: {reason}")
    return None, "; ".join(reasons) or f"no campaign is called {texts['campaign']!r}"


def stale() -> dict[str, str]:
    """Return the pictures that are not today's, and why."""
    files = campaign_files()
    loaded: dict[Path, Any] = {}
    reasons = {
        str(picture.relative_to(TOP)): why_stale(picture, files, loaded)
        for picture in pictures()
    }
    return {name: reason for name, reason in reasons.items() if reason}


def write_small(image: bytes, file: Path) -> None:
    """Write a picture no broader than a page, in few colours, with its question."""
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(_small(image))


def _small(image: bytes) -> bytes:
    """Return a picture no broader than a page, in few colours."""
    stream = io.BytesIO()
    with Image.open(io.BytesIO(image)) as whole:
        width = min(BROAD, whole.width)
        size = (width, round(whole.height * width / whole.width))
        resized = whole.convert("RGB").resize(size, Image.Resampling.LANCZOS)
        resized.quantize(COLOURS).save(
            stream, format="png", optimize=True, pnginfo=texts_of(whole)
        )
    return stream.getvalue()


def share_seen(a: bytes, b: bytes) -> float:
    """Return the share of pixels by which two pictures look different.

    1 where they have other sizes.
    """
    with Image.open(io.BytesIO(a)) as first, Image.open(io.BytesIO(b)) as second:
        if first.size != second.size:
            return 1.0
        colours = [
            np.asarray(one.convert("RGB"), dtype=float) for one in (first, second)
        ]
    apart = np.abs(colours[0] - colours[1]).max(axis=-1)
    return float((apart > SEEN).mean())


def compare(store_folder: str) -> int:
    """Draw the pictures whose runs a store has once more; return how many look otherwise.

    One where there is no such picture.
    """
    store = wl.Store(store_folder)
    files = campaign_files()
    loaded: dict[Path, Any] = {}
    drawn = otherwise = 0
    for picture in pictures():
        texts = embedded(picture)
        asked, _ = _asked_today(texts, files, loaded)
        if asked is None or not _has_all(store, texts.get("runs", "").split()):
            continue
        drawn += 1
        grid = store.open(asked.campaign)
        image, _ = drawing.file_of(asked, grid, store, "png")
        again = _small(image) if picture.parent == PAPERS else lightened(image)
        share = share_seen(again, picture.read_bytes())
        if share > SAME:
            otherwise += 1
            print(f"{picture.relative_to(TOP)}: {share:.1%} of it looks otherwise")
    print(f"{drawn} pictures drawn once more, {otherwise} look otherwise")
    return otherwise if drawn else 1


def _has_all(store: wl.Store, runs: list[str]) -> bool:
    """Whether a picture has runs, and a store all of them."""
    entries = store.archive.entries(runs)
    return bool(runs) and all(
        run in entries and entries[run].state == "done" for run in runs
    )


def draw(store_folder: str, names: list[str]) -> None:
    """Run the campaigns of pictures, and draw them.

    Parameters
    ----------
    store_folder : where the runs are, or are made
    names : keys of `DRAWN_HERE`
    """
    store = wl.Store(store_folder)
    for name in names:
        file, number = DRAWN_HERE[name]
        campaign = wl.load(TOP / "campaigns" / f"{file}.toml")
        wl.run(campaign, store)
        asked = question(campaign, campaign.figures[number - 1], number)
        image, _ = drawing.file_of(asked, store.open(campaign), store, "png")
        (IMAGES / f"{name}.png").write_bytes(lightened(image))


def main(store_folder: str = "", *names: str) -> int:
    """Draw, compare, or list what is stale; return the exit status."""
    if store_folder == "--compare":
        return int(compare(*names) > 0)
    if store_folder.startswith("-"):
        print(f"{__doc__}\nno option {store_folder}", file=sys.stderr)
        return 2
    if store_folder:
        draw(store_folder, list(names) or list(DRAWN_HERE))
        return 0
    reasons = stale()
    for name, reason in reasons.items():
        print(f"{name}: {reason}")
    return int(bool(reasons))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
