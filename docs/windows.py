"""Pictures of the pages of a window: ``python docs/windows.py STORE [CHROMIUM]`` writes ``docs/images/browse/*.png``.

The store has a campaign of lives at 340 N·m and more, an update of one gearbox, one of
a fleet, and a run that is under way or none. Needs Playwright and a browser.
"""

import io
import re
import shutil
import sys
from pathlib import Path
from urllib.parse import urlencode

from PIL import Image
from playwright.sync_api import sync_playwright

import wearlab as wl
from wearlab.browsing.window import Window
from wearlab.store.updates import kept_updates

OUT = Path(__file__).parent / "images" / "browse"
SHAPES = {"wide": (1280, 960, "light"), "narrow": (390, 960, "dark")}
SHOWN = {"wide": 900, "narrow": 390}  # pixels of the picture
WAIT = 300  # ms


def pages(window: Window) -> dict[str, tuple[str, dict[str, object], str]]:
    """Return name, address and what is waited for of every page."""
    store = window.store
    counted = "SELECT campaign FROM members GROUP BY campaign ORDER BY count(*) DESC"
    key = next(row[0] for row in store.archive.catalogue.read(counted))
    condition = "torque >= 340 N*m"
    longest = store.query(condition, sort="-life", limit=3)["id"]
    told = kept_updates(store)
    update = next((name for name, kept in told.items() if len(kept.runs) == 1), "")
    fleet = next((name for name, kept in told.items() if len(kept.runs) > 1), "")
    return {
        "campaigns": ("", {}, "img"),
        "campaign": ("campaign", {"key": key, "sort": "-result"}, "canvas"),
        "runs": ("runs", {"where": condition, "sort": "-life"}, "table.runs"),
        "run": ("run", {"id": longest[0]}, "canvas"),
        "compare": ("compare", {"run": longest}, "canvas"),
        "update": ("update", {"id": update}, "canvas"),
        "fleet": ("update", {"id": fleet}, "canvas"),
        "progress": ("progress", {}, "main"),
    }


def main(folder: str, browser: str | None = None) -> None:
    """Take every picture."""
    OUT.mkdir(parents=True, exist_ok=True)
    window = wl.browse(folder)
    with sync_playwright() as driver:
        chromium = driver.chromium.launch(
            executable_path=browser or shutil.which("chromium"), args=["--no-sandbox"]
        )
        for shape, (width, height, scheme) in SHAPES.items():
            page = chromium.new_page(
                viewport={"width": width, "height": height}, color_scheme=scheme
            )
            for name, (path, arguments, awaited) in pages(window).items():
                query = urlencode({"token": window.token, **arguments}, doseq=True)
                page.goto(f"http://127.0.0.1:{window.port}/{path}?{query}")
                page.locator(awaited).first.wait_for(timeout=120_000)
                if name == "campaigns":
                    page.wait_for_timeout(
                        10 * WAIT
                    )  # pictures are drawn when they come into sight
                if name == "run":
                    page.locator("#wear").scroll_into_view_if_needed()
                    page.evaluate("document.getElementById('wear').scrollIntoView()")
                page.wait_for_timeout(2 * WAIT)
                picture = Image.open(io.BytesIO(page.screenshot()))
                share = SHOWN[shape] / picture.width
                small = picture.convert("RGB").resize(
                    (SHOWN[shape], round(picture.height * share)),
                    Image.Resampling.LANCZOS,
                )
                small.quantize(96, dither=Image.Dither.NONE).save(
                    OUT / f"{name}-{shape}.png", optimize=True
                )
        chromium.close()
    window.stop()


if __name__ == "__main__":
    if len(sys.argv) < 2 or re.match("-", sys.argv[1]):
        sys.exit(str(__doc__))
    main(*sys.argv[1:3])
