"""What each page tells, asked of the store: plain data for the templates, and files to take along."""

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qsl, urlencode

from wearlab.browsing import figures, listing, one_run, question, recorded
from wearlab.browsing.listing import ROWS, whole
from wearlab.figures.drawing import of_update, specified
from wearlab.figures.kind import KINDS, FigureError, read
from wearlab.store import StoreError, database, outcome, remarks
from wearlab.store import updates as kept
from wearlab.units import shown_unit
from wearlab.updating.report_text import alerts, answers, fleet_about, fleet_tables, text_of

if TYPE_CHECKING:
    from wearlab.figures.question import Question
    from wearlab.store import Store

CARDS = 24  # campaigns of a page
FIGURES = 2  # of a campaign that are drawn at once
MOST_BESIDE = 24  # runs told side by side
MOST_DRAWN = 2_000  # cases of a campaign that figures are drawn of, and that are sorted by any column
BESIDE = (
    "SELECT DISTINCT m.run FROM members AS m JOIN runs AS r ON r.id = m.run "
    f"WHERE r.state = 'done' AND m.campaign = {recorded.CAMPAIGN_OF_RUN} LIMIT {MOST_BESIDE + 1}"
)
"""The finished runs of the campaign recorded last that has a run, as far as they are told side by side."""
USUAL = {"state": "last", "back": ""}
NUMBER = re.compile(r"[± ]*(-?\d+(?:\.\d+)?(?:e[+-]?\d+)?)")


def campaigns(store: "Store", page: str) -> dict[str, Any]:
    """Return a page of the campaigns."""
    number = whole(page)
    told, count = recorded.campaigns(store, CARDS, (number - 1) * CARDS)
    said: dict[str, list[remarks.Remark]] = {}
    for remark in remarks.remarks_on(store.catalogue, [remarks.subject_of(each.title) for each in told]):
        said.setdefault(remark.campaign, []).append(remark)
    return {"told": told, "remarked": said, "number": number, "pages": max(1, -(-count // CARDS))}


def campaign(store: "Store", key: str, place: Any, first: Mapping[str, str]) -> dict[str, Any]:
    """Return a campaign: a page of its cases, and some of its figures.

    Raises
    ------
    StoreError : it is not in the store
    """
    told = _told(store, key)
    number = whole(first.get("page", ""))
    sort = first.get("sort", "") if told.cases <= MOST_DRAWN else ""
    heads, rows = (
        sorted_cases(store, key, sort, number) if sort else cases(store, key, (number - 1) * ROWS, ROWS)
    )
    source = recorded.campaign_of(store, key) if told.cases <= MOST_DRAWN else None
    drawn: list[figures.ShownFigure] = []
    others: list[tuple[int, str]] = []
    if source is not None and told.counts.get("done"):
        drawn, others = _figures(store, key, source, place, first.get("figure", ""))
    subject = remarks.subject_of(told.title)
    quote = next((sign for sign in "\"'" if sign not in told.title), "")
    return {
        "told": told,
        "heads": heads,
        "rows": rows,
        "caption": f"{len(rows)} of {told.cases} cases",
        "sort": sort,
        "sort_url": (lambda name: place.url("campaign", key=key, sort=name))
        if place.live and told.cases <= MOST_DRAWN
        else None,
        "number": number,
        "pages": max(1, -(-told.cases // ROWS)),
        "where": f"campaign = {quote}{told.title}{quote}" if quote else "",
        "figures": drawn,
        "others": others,
        "more": len(others),
        "subject": subject,
        "remarked": remarks.remarks_on(store.catalogue, [subject]),
    }


def _told(store: "Store", key: str) -> recorded.Told:
    known = [each for each in recorded.campaigns(store)[0] if each.key == key]
    if not known:
        raise StoreError(f"campaign {key[:40]!r} is not in this store")
    return known[0]


def cases(store: "Store", key: str, skip: int, limit: int) -> tuple[Any, Any]:
    """Return headings and rows of some cases of a campaign, in their order."""
    members = store.catalogue.read(
        "SELECT run, label, position FROM members WHERE campaign = ? ORDER BY number LIMIT ? OFFSET ?",
        [key, limit, skip],
    )
    what = "a campaign in the catalogue"
    places = [database.understood(what, database.place, position) for _, _, position in members]
    axes = list(dict.fromkeys(name for place in places for name in place))
    entries = store.entries(run for run, _, _ in members)
    heads = ("case", *axes, "state", "verdict", "result", "error")
    rows = []
    for (run, label, _), place in zip(members, places, strict=True):
        entry = entries.get(run)
        texts = [shown_unit(str(place.get(axis, ""))) for axis in axes]
        came = ("missing", "", "", "")
        if entry is not None:
            told = next(iter(outcome.headlines(entry.summary)), outcome.Headline("", "", "", None))
            verdict = str(entry.summary.get("verdict") or outcome.last_line(entry.reason))
            came = (store.state_of(entry), verdict, told.text, told.margin)
        rows.append((str(run), (str(label), *texts, *came)))
    return tuple((head, head.replace("_", " ")) for head in heads), tuple(rows)


def sorted_cases(store: "Store", key: str, sort: str, number: int) -> tuple[Any, Any]:
    """Return headings and one page of rows of the cases of a campaign, in the order of a column.

    Parameters
    ----------
    store, key : the campaign
    sort : name of the column, a minus sign before it turns the order; what is empty comes last
    number : of the page, from 1
    """
    heads, rows = cases(store, key, 0, MOST_DRAWN)
    names = [name for name, _ in heads]
    if (name := sort.removeprefix("-")) in names:
        at, down = names.index(name), sort.startswith("-")
        told = sorted(
            (row for row in rows if row[1][at]), key=lambda row: _in_order(row[1][at]), reverse=down
        )
        rows = (*told, *(row for row in rows if not row[1][at]))
    return heads, rows[(number - 1) * ROWS : number * ROWS]


def _in_order(cell: str) -> tuple[bool, float, str]:
    """Return by what a cell is put in order: the number that it begins with, before words."""
    found = NUMBER.match(cell)
    return found is None, float(found[1]) if found else 0.0, cell


def _figures(
    store: "Store", key: str, source: Any, place: Any, chosen: str
) -> tuple[list[figures.ShownFigure], list[tuple[int, str]]]:
    """Return the figures of a campaign that are drawn, and number and name of the others."""
    grid = store.open(source)
    asked = asked_of(source, grid)
    at = min(whole(chosen), len(asked)) - 1
    drawn = []
    for number, each in list(enumerate(asked, 1))[at : at + FIGURES]:
        files = files_of(place, "campaign", f"key={key}&figure={number}")
        drawn.append(figures.shown(store, each, grid, files))
    shown = range(at, at + FIGURES)
    names = [(n, str(each.table.get("title") or each.table["kind"])) for n, each in enumerate(asked, 1)]
    return drawn, [pair for i, pair in enumerate(names) if i not in shown]


def asked_of(source: Any, grid: Any) -> "list[Question]":
    """Return the questions of a campaign's figures; of one without any, some that its runs can answer."""
    asked = [question.question_of_figure(source, number) for number in range(1, len(source.figures) + 1)]
    if asked:
        return asked
    swept = question.over_axes(source, grid)
    kinds = [kind for kind in question.possible(grid) if not swept or kind != "wear-profile"]
    return [*swept, *(question.asked(source, kind, {}) for kind in kinds[: FIGURES - len(swept)])]


def files_of(place: Any, name: str, address: str) -> tuple[tuple[str, str], ...]:
    """Return format and address of the files of a figure; none in a copy, which draws nothing."""
    return (
        tuple((ending.upper(), place.file(name, ending, address)) for ending in figures.FORMATS)
        if place.live
        else ()
    )


def runs(store: "Store", first: Mapping[str, str], place: Any) -> dict[str, Any]:
    """Return a page of runs, and the addresses of others."""
    told = listing.listed(store, first)
    asked = {"where": told.where, "columns": ",".join(told.columns), "sort": told.sort}

    def without(name: str) -> str:
        kept = ",".join(column for column in told.columns if column != name)
        return str(place.url("runs", **{**asked, "columns": kept}))

    return {
        "told": told,
        "signs": listing.SIGNS,
        "sort_url": lambda name: place.url("runs", **{**asked, "sort": name}),
        "page_url": lambda number: place.url("runs", **asked, page=number),
        "without": without,
        "back": urlencode(asked),
        "compare_url": place.url("compare", run=[row[0] for row in told.rows], back=urlencode(asked))
        if 1 < len(told.rows) <= MOST_BESIDE
        else "",
    }


def run(store: "Store", prefix: str, place: Any, back: str = "") -> dict[str, Any]:
    """Return what a page of one run tells.

    Parameters
    ----------
    store, prefix, place : the run, and where addresses lead
    back : condition, columns and order of the table that it was chosen in, as an address writes them

    Raises
    ------
    StoreError : no such run
    """
    entry = store.find(prefix)
    told = one_run.content(store, entry)
    done = told["state"] == "done"
    prints, first = [], "wear-profile"
    if done and place.live:
        grid = store.open(recorded.together(store, [entry.id]))  # type: ignore[arg-type]
        for kind in question.of_one_run(grid):
            files = files_of(place, "figure", f"run={entry.id}&kind={kind}")
            prints.append((KINDS[kind].title or kind, files))
        first = (question.of_one_run(grid) or [first])[0]
    where = store.address or str(store.path.absolute())
    beside = [row[0] for row in store.catalogue.read(BESIDE, [entry.id])] if place.live else []
    return {
        "told": told,
        "back_url": _back_url(place, back),
        "beside_url": place.url("compare", run=beside) if 1 < len(beside) <= MOST_BESIDE else "",
        "has_life": bool(entry.summary.get("life")),
        "prints": prints,
        "cite_url": place.url("citation", id=entry.id) if done and place.live else "",
        "data_url": place.url("data", id=entry.id) if done and place.live else "",
        "commands": f"wearlab show {entry.id} --store {_quoted(where)}\n"
        f"wearlab figures --from FIGURE.png --store {_quoted(where)}   # a figure that was taken along",
        "python": f"import wearlab as wl\nrun = wl.open({where!r}).run({entry.id!r})\n"
        f"wl.figure(run, {first!r})",
    }


def _back_url(place: Any, back: str) -> str:
    """Return the address of the table of runs that was left, "" where none was."""
    chosen = {name: text for name, text in parse_qsl(back) if name in ("where", "columns", "sort")}
    return str(place.url("runs", **chosen)) if chosen else ""


def _quoted(path: str) -> str:
    return (
        path
        if all(sign.isalnum() or sign in "/._-:" for sign in path)
        else "'" + path.replace("'", "'\\''") + "'"
    )


def compared(store: "Store", arguments: Mapping[str, Sequence[str]], place: Any) -> dict[str, Any]:
    """Return marked runs, or a campaign, in one figure, with what there is to choose from."""
    told: dict[str, Any] = dict.fromkeys(("kinds", "numbers", "abscissae", "roles"), ())
    told |= {"figure": None, "beside": None, "problem": "", "commands": "", "title": "Compare"}
    told["state"], back = ((list(arguments.get(name, ())) or [usual])[0] for name, usual in USUAL.items())
    asked = question.wanted({**arguments, "state": [told["state"]]})
    told |= {"asked": asked, "back": back, "back_url": _back_url(place, back)}
    if not asked.runs and not asked.campaign:
        return {**told, "problem": "Mark some runs in a table first, then choose to compare them."}
    if asked.runs and not asked.campaign:
        told["beside"] = one_run.side_by_side(store, asked.runs[:MOST_BESIDE])
    source = question.source_of(store, asked)
    grid = store.open(source)  # type: ignore[arg-type]
    able = question.possible(grid)
    axes = [str(dim) for dim in grid.run_id.dims]
    told |= {
        "kinds": [(kind, f"{kind}: {KINDS[kind].shows}"[:90]) for kind in able],
        "numbers": [(name, f"{name}: {words}"[:90]) for name, words in question.numbers(grid)],
        "abscissae": [*axes, *question.beside_axes(grid)],
        "roles": [*axes, *(str(d) for d in ("flank", "mesh", "update", "member") if d in grid.dims)],
        "title": f"Compare {source.title}" if len(asked.runs) > 1 else source.title,
    }
    try:
        question_, grid = question.question_of(store, asked)
    except FigureError as error:
        return {**told, "problem": str(error)}
    told["figure"] = figures.shown(store, question_, grid, files_of(place, "figure", asked.address))
    told["commands"] = _compare_commands(store, asked, question_)
    return told


def _compare_commands(store: "Store", asked: question.WantedFigure, drawn: "Question") -> str:
    where = _quoted(store.address or str(store.path.absolute()))
    lines = [f"wearlab figures --from {drawn.name}.png --store {where}   # the PNG that was taken along"]
    if len(asked.runs) == 2:
        lines.append(f"wearlab compare {asked.runs[0]} {asked.runs[1]} --store {where}")
    return "\n".join(lines)


FIRST = ("fleet", "posterior-fan", "remaining-life", "look-next", "decision")
"""Figures of an update, before the others."""


def updates(store: "Store") -> list[tuple[kept.KeptUpdate, list[str], list[str]]]:
    """Return the updates of a store, the latest first, each with its answer and what speaks against it."""
    told = []
    for update in reversed(kept.kept_updates(store).values()):
        try:
            tree = kept.read_update(store, update.id)
            said = ["Its file has gone."] if tree is None else answers(tree)
            told.append((update, said, [] if tree is None else alerts(text_of(tree))))
        except (StoreError, KeyError, ValueError) as error:
            told.append((update, [f"It cannot be read: {error}"], []))
    return told


def update(store: "Store", prefix: str, place: Any) -> dict[str, Any]:
    """Return the answer of an update and its figures.

    Raises
    ------
    StoreError : there is none, or its file is damaged
    """
    known = kept.find_update(store, prefix)
    tree = None if known is None else kept.read_update(store, known.id)
    if known is None or tree is None:
        raise StoreError(f"update {prefix[:40]!r}: no such update, or its file has gone")
    drawn = []
    of_updates = [name for name, kind in KINDS.items() if kind.of == "update"]
    for name in [*(n for n in FIRST if n in of_updates), *(n for n in of_updates if n not in FIRST)]:
        shown = update_plot(store, known.subject, name)
        if shown is not None:
            files = files_of(place, "update", f"id={known.id}&kind={name}")
            drawn.append(figures.of_plot(shown, files))
    return {
        "title": known.title or "Update",
        "answers": answers(tree),
        "alerts": alerts(lines := text_of(tree)[1:]),
        "lines": lines,
        "fleet": (tables := fleet_tables(tree)),
        "about": fleet_about(tree) if tables else "",
        "figures": drawn,
        "runs": known.runs,
        "id": known.id,
    }


def update_plot(store: "Store", subject: str, kind: str) -> Any:
    """Return a figure of an update, None where there is none."""
    try:
        return of_update(subject, store, read(specified({"kind": kind}), 1, None))
    except (FigureError, KeyError, ValueError):
        return None
