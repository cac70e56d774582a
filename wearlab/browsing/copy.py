"""A copy of one campaign that needs no wearlab and no server: pages and Bokeh's scripts in one folder."""

import os
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bokeh.resources import Resources
from markupsafe import Markup

from wearlab.browsing import contents, figures, pages, question, recorded
from wearlab.browsing.gate import SCRIPTS
from wearlab.nearest import choices
from wearlab.store import files
from wearlab.store.files import StoreError

if TYPE_CHECKING:
    from wearlab.store import Store

MOST = 200  # runs


class Folder:
    """Where the pages of a copy lie: beside each other; what only a window can do leads to the campaign."""

    pages = (("index", "Campaign"),)
    live = False
    style = "style.css"

    def __init__(self, runs: Sequence[str]) -> None:
        self.runs = frozenset(runs)

    def url(self, name: str, **arguments: Any) -> str:
        """Return the address of a page."""
        run = arguments.get("id")
        return f"run-{run}.html" if name == "run" and run in self.runs else "index.html"


def write_copy(store: "Store", folder: Path, title: str | None = None) -> Path:
    """Write a copy of a campaign: its page, one for each of its runs, and what draws their figures.

    Parameters
    ----------
    store : where it is
    folder : made where it is not; one that holds other files is refused
    title : of the campaign, or the name of its file [the only one]

    Returns
    -------
    The page to begin with.

    Raises
    ------
    StoreError : no such campaign, it has more than 200 runs, or the folder is not free
    """
    told = _chosen(store, title)
    if told.cases > MOST:
        raise StoreError(f"{told.title}: {told.cases} cases are more than the {MOST} of a copy")
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise StoreError(f"{folder}: is there already: name an empty folder, or a new one")
    rows = contents.cases(store, told.key, 0, MOST)[1]
    ids = [run_id for run_id, _ in rows if run_id in store.entries([run_id])]
    place = Folder(ids)
    part = files.part_of(folder.absolute())
    with files.written(folder):
        part.mkdir(parents=True)
        try:
            scripts = _scripts(part)
            _write(part / "style.css", pages.style())
            _write(part / "index.html", _campaign(store, told, place, scripts))
            for run_id in dict.fromkeys(ids):
                _write(part / f"run-{run_id}.html", _run(store, run_id, place, scripts))
            if folder.exists():
                folder.rmdir()
            os.replace(part, folder)
        finally:
            shutil.rmtree(part, ignore_errors=True)
    return folder / "index.html"


def _chosen(store: "Store", title: str | None) -> recorded.Told:
    known, _ = recorded.campaigns(store)
    found = [each for each in known if title in (None, each.title, each.path, Path(each.path).name)]
    titles = [each.title for each in known]
    if not found:
        raise StoreError(f"campaign {title!r} is not in this store; {choices(title, titles)}")
    if title is None and len(found) > 1:
        raise StoreError(
            f"this store has {len(found)} campaigns: choose one by --campaign; {choices('', titles)}"
        )
    return found[0]


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def _scripts(folder: Path) -> Markup:
    """Put Bokeh's scripts into a folder; return what loads them."""
    names = []
    for file in (
        *Resources(mode="absolute", components=SCRIPTS).js_files,
        pages.HERE / "templates" / pages.NAMES,
    ):
        shutil.copyfile(file, folder / Path(file).name)
        names.append(Path(file).name)
    return Markup("".join(f'<script src="{Markup.escape(name)}"></script>' for name in names))


def _page(store: "Store", template: str, place: Folder, heading: str, told: dict[str, Any]) -> str:
    name = str(store.address or store.path.absolute().name)
    beside = {"here": "index", "store_name": name, "token": "", "writable": False}
    return pages.rendered(template, place, heading, {**beside, **told})


def _drawn(scripts: Markup, shown: Sequence[figures.ShownFigure]) -> Markup:
    own = "\n".join(figure.script for figure in shown if figure.script)
    return Markup(f"{scripts}<script>{own}</script>") if own else Markup("")


def _campaign(store: "Store", told: recorded.Told, place: Folder, scripts: Markup) -> str:
    content = contents.campaign(store, told.key, place, {})
    heads, rows = contents.cases(store, told.key, 0, MOST)
    source = recorded.campaign_of(store, told.key)
    shown = content["figures"]
    if source.figures:
        grid = store.open(source)  # type: ignore[arg-type]
        asked = [question.question_of_figure(source, number) for number in range(1, len(source.figures) + 1)]
        shown = [figures.shown(store, each, grid) for each in asked]
    content |= {"heads": heads, "rows": rows, "caption": f"{len(rows)} cases", "pages": 1, "where": ""}
    content |= {"figures": shown, "more": 0, "others": [], "scripts": _drawn(scripts, shown)}
    return _page(store, "campaign.html", place, told.title, content)


def _run(store: "Store", run_id: str, place: Folder, scripts: Markup) -> str:
    content = contents.run(store, run_id, place)
    shown: list[figures.ShownFigure] = []
    if content["told"]["state"] == "done":
        source = recorded.together(store, [run_id])
        try:
            grid = store.open(source)  # type: ignore[arg-type]
            kinds = question.of_one_run(grid)
            shown = [figures.shown(store, question.asked(source, kind, {}), grid) for kind in kinds]
        except figures.PROBLEMS as error:
            shown = [figures.ShownFigure("", problem=str(error))]
    content |= {"app": "", "figures": shown, "scripts": _drawn(scripts, shown)}
    return _page(store, "run.html", place, content["told"]["title"], content)
