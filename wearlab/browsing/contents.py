"""What each page tells, asked of the store: plain data for the templates, and files to take along."""

import re
from collections.abc import Mapping, Sequence
from shlex import quote
from typing import Any
from urllib.parse import parse_qsl, urlencode

from wearlab.browsing import figures, listing, one_run, recorded
from wearlab.figures import FigureError, plotting, single
from wearlab.figures import runs as grid_runs
from wearlab.figures.kind import KINDS, read
from wearlab.store import Store, StoreError, database, outcome, remarks
from wearlab.store import updates as kept
from wearlab.units import shown_unit
from wearlab.updating import report_text

Asked = Mapping[str, Sequence[str]]
"""The arguments of an address."""

CARDS = 24  # campaigns of a page
MOST_BESIDE = 24  # runs told side by side
# cases of a campaign that figures are drawn of, and that are sorted by any column
MOST_DRAWN = 2_000
BESIDE = (
    "SELECT DISTINCT m.run FROM members AS m JOIN runs AS r ON r.id = m.run WHERE "
    "r.state = 'done' "
)
BESIDE += f"AND m.campaign = {recorded.CAMPAIGN_OF_RUN} LIMIT {MOST_BESIDE + 1}"
"""The finished runs of the campaign recorded last that has a run, as far as they are
told side by side."""
NUMBER = re.compile(r"[± ]*(-?\d+(?:\.\d+)?(?:e[+-]?\d+)?)")


def _named(asked: Asked, name: str, what: str) -> str:
    """Return which campaign, run or update a page is asked for.

    Raises
    ------
    StoreError : none is
    """
    if found := figures.first(asked).get(name):
        return found
    raise StoreError(
        f"which {what}? Open one from the pages, or give {name}=… in the address of "
        "this one"
    )


def campaigns(store: Store, place: Any, asked: Asked) -> dict[str, Any]:
    """Return a page of the campaigns."""
    number = listing.whole(figures.first(asked).get("page", ""))
    told, count = recorded.campaigns(store, CARDS, (number - 1) * CARDS)
    said: dict[str, list[remarks.Remark]] = {}
    for remark in remarks.remarks_on(
        store.archive.catalogue, [remarks.subject_of(each.title) for each in told]
    ):
        said.setdefault(remark.campaign, []).append(remark)
    return {
        "told": told,
        "remarked": said,
        "number": number,
        "pages": max(1, -(-count // CARDS)),
    }


def campaign(store: Store, place: Any, asked: Asked) -> dict[str, Any]:
    """Return a campaign: a page of its cases, and some of its figures.

    In a copy all of them.

    Raises
    ------
    StoreError : it is not in the store
    """
    first = figures.first(asked)
    key = _named(asked, "key", "campaign")
    number = listing.whole(first.get("page", ""))
    if (
        told := next(
            (each for each in recorded.campaigns(store)[0] if each.key == key), None
        )
    ) is None:
        raise StoreError(f"campaign {key[:40]!r} is not in this store")
    few = told.cases <= MOST_DRAWN
    most = listing.ROWS if place.live else MOST_DRAWN
    sort = first.get("sort", "") if few else ""
    heads, rows = cases(store, key, sort, (number - 1) * most, most)
    drawn = list[figures.ShownFigure]()
    others = list[tuple[int, str]]()
    if few and told.counts.get("done"):
        source = figures.Source(store, recorded.campaign_of(store, key))
        questions = dict(enumerate(source.asked(), 1))
        at = min(listing.whole(first.get("figure", "")), len(questions))
        for figure, each in questions.items():
            if place.live and not at <= figure < at + figures.MOST_AT_ONCE:
                others.append((figure, figures.name_of(each)))
            else:
                drawn.append(
                    source.shown(
                        each, place.files("campaign", f"key={key}&figure={figure}")
                    )
                )
    subject = remarks.subject_of(told.title)
    mark = next((sign for sign in "\"'" if sign not in told.title), "")
    where = f"campaign = {mark}{told.title}{mark}" if mark and place.live else ""
    shown = {
        "heading": told.title,
        "told": told,
        "heads": heads,
        "rows": rows,
        "sort": sort,
        "where": where,
    }
    shown |= {
        "sortable": place.live and few,
        "number": number,
        "pages": max(1, -(-told.cases // most)),
    }
    shown |= {"figures": drawn, "others": others, "subject": subject}
    return shown | {"remarked": remarks.remarks_on(store.archive.catalogue, [subject])}


def cases(store: Store, key: str, sort: str, skip: int, limit: int) -> tuple[Any, Any]:
    """Return headings and rows of some cases of a campaign.

    Parameters
    ----------
    store, key : the campaign
    sort : name of a column, a minus sign before it turns the order, what is empty comes
        last; "": as recorded
    skip, limit : so many, after the first ones
    """
    some = (MOST_DRAWN, 0) if sort else (limit, skip)
    question = (
        "SELECT run, label, position FROM members WHERE campaign = ? ORDER BY number "
        "LIMIT ? OFFSET ?"
    )
    members = store.archive.catalogue.read(question, [key, *some])
    what = "a campaign in the catalogue"
    places = [
        database.understood(what, database.place, position)
        for _, _, position in members
    ]
    axes = list(dict.fromkeys(name for place in places for name in place))
    entries = store.archive.entries(run for run, _, _ in members)
    heads = ("case", *axes, "state", "verdict", "result", "error")
    rows = []
    for (run, label, _), place in zip(members, places, strict=True):
        entry = entries.get(run)
        came = ("missing", "", "", "")
        if entry is not None:
            told = next(
                iter(outcome.headlines(entry.summary)),
                outcome.Headline("", "", "", None),
            )
            verdict = str(
                entry.summary.get("verdict") or outcome.last_line(entry.reason)
            )
            came = (store.archive.state_of(entry), verdict, told.text, told.margin)
        rows.append(
            (
                str(run),
                (str(label), *(shown_unit(str(place.get(a, ""))) for a in axes), *came),
            )
        )
    if sort:
        if (name := sort.removeprefix("-")) in heads:
            at = heads.index(name)
            rows.sort(
                key=lambda row: _in_order(row[1][at]), reverse=sort.startswith("-")
            )
            rows.sort(key=lambda row: not row[1][at])
        rows = rows[skip : skip + limit]
    return tuple((head, head.replace("_", " ")) for head in heads), tuple(rows)


def _in_order(cell: str) -> tuple[bool, float, str]:
    """Return by what a cell is put in order: the number that it begins with, before words."""
    found = NUMBER.match(cell)
    return found is None, float(found[1]) if found else 0.0, cell


def runs(store: Store, place: Any, asked: Asked) -> dict[str, Any]:
    """Return a page of runs."""
    told = listing.listed(store, figures.first(asked))
    beside = comparable([row[0] for row in told.rows])
    return {
        "told": told,
        "signs": listing.SIGNS,
        "back": urlencode(told.asked),
        "beside": beside,
    }


def comparable(runs: Sequence[str]) -> Sequence[str]:
    """Return runs that can be told side by side, none where there are too many or one alone."""
    return runs if 1 < len(runs) <= MOST_BESIDE else []


def run(store: Store, place: Any, asked: Asked) -> dict[str, Any]:
    """Return what a page of one run tells: of the run ``id``, chosen in the table ``back``.

    Raises
    ------
    StoreError : no such run
    """
    first = figures.first(asked)
    entry = store.archive.find(_named(asked, "id", "run"))
    told = one_run.content(store, entry)
    kinds = list[str]()
    drawn = list[figures.ShownFigure]()
    if told["state"] == "done":
        try:
            source = figures.Source(store, recorded.together(store, [entry.id]))
            kinds = source.of_one_run()
        except figures.PROBLEMS as error:
            drawn = [figures.ShownFigure("", problem=str(error))]
    if not place.live:
        drawn += [source.shown(source.question(kind)) for kind in kinds]
    addresses = [
        (KINDS[kind].title or kind, f"run={entry.id}&kind={kind}")
        for kind in kinds
        if place.live
    ]
    beside = (
        [row[0] for row in store.archive.catalogue.read(BESIDE, [entry.id])]
        if place.live
        else []
    )
    shown = {
        "heading": told["title"],
        "told": told,
        "back": _back(first),
        "beside": comparable(beside),
    }
    shown |= {"has_life": bool(entry.summary.get("life")), "figures": drawn}
    shown["prints"] = [
        (title, place.files("figure", address)) for title, address in addresses
    ]
    where = store.address or str(store.path.absolute())
    again = (
        f"wearlab figures --from FIGURE.png --store {quote(where)}   # a figure that "
        "was taken along"
    )
    shown["commands"] = f"wearlab show {entry.id} --store {quote(where)}\n{again}"
    code = (
        "import wearlab as wl\nrun = "
        f"wl.open({where!r}).run({entry.id!r})\nwl.figure(run, "
    )
    return shown | {"python": f"{code}{next(iter(kinds), 'wear-profile')!r})"}


def _back(first: Mapping[str, str]) -> dict[str, str]:
    """Return condition, columns and order of the table of runs that was left, as far as there was one."""
    known = ("where", "columns", "sort")
    return {
        name: text for name, text in parse_qsl(first.get("back", "")) if name in known
    }


def compare(store: Store, place: Any, asked: Asked) -> dict[str, Any]:
    """Return marked runs, or a campaign, in one figure, with what there is to choose from."""
    first = {"state": "last", "back": "", **figures.first(asked)}
    asked = {**asked, "state": [first["state"]]}
    wanted = figures.wanted(asked)
    told = dict[str, Any](
        beside=None, problem="", commands="", heading="Compare", figures=()
    )
    told |= {
        "asked": wanted,
        "state": first["state"],
        "back": first["back"],
        "left": _back(first),
    }
    if not wanted.runs and not wanted.campaign:
        return {
            **told,
            "problem": "Mark some runs in a table first, then choose to compare them.",
        }
    if wanted.runs and not wanted.campaign:
        told["beside"] = one_run.side_by_side(store, wanted.runs[:MOST_BESIDE])
    source = figures.source_of(store, wanted)
    axes = [str(dim) for dim in source.grid.run_id.dims]
    dims = set(source.grid.dims)
    told["kinds"] = [
        (kind, f"{kind}: {KINDS[kind].shows}"[:90]) for kind in source.possible()
    ]
    told["numbers"] = [
        (name, f"{name}: {words}"[:90]) for name, words in source.numbers()
    ]
    told["abscissae"] = list(dict.fromkeys([*axes, *grid_runs.along_axes(source.grid)]))
    told["roles"] = [
        *axes,
        *(dim for dim in ("flank", "mesh", "update", "member") if dim in dims),
    ]
    told["heading"] = (
        f"{'Compare ' if len(wanted.runs) > 1 else ''}{source.campaign.title}"
    )
    try:
        drawn = source.ask_for(wanted)
    except FigureError as error:
        return {**told, "problem": str(error)}
    told["figures"] = [
        source.shown(drawn, place.files("figure", figures.address(asked)))
    ]
    where = quote(store.address or str(store.path.absolute()))
    again = f"wearlab figures --from {drawn.name}.png --store {where}"
    told["commands"] = f"{again}   # the PNG that was taken along"
    if len(wanted.runs) == 2:
        told["commands"] += f"\nwearlab compare {' '.join(wanted.runs)} --store {where}"
    return told


FIRST = ("fleet", "posterior-fan", "remaining-life", "look-next", "decision")
"""Figures of an update, before the others."""


def updates(store: Store, place: Any, asked: Asked) -> dict[str, Any]:
    """Return the updates of a store, the latest first, each with its answer and what speaks against it."""
    told = []
    for update in reversed(kept.kept_updates(store).values()):
        try:
            tree = kept.read_update(store, update.id)
            said = ["Its file has gone."] if tree is None else report_text.answers(tree)
            told.append(
                (
                    update,
                    said,
                    []
                    if tree is None
                    else report_text.alerts(report_text.text_of(tree)),
                )
            )
        except (StoreError, KeyError, ValueError) as error:
            told.append((update, [f"It cannot be read: {error}"], []))
    return {"told": told}


def update(store: Store, place: Any, asked: Asked) -> dict[str, Any]:
    """Return the answer of an update and its figures.

    Raises
    ------
    StoreError : there is none, or its file is damaged
    """
    prefix = _named(asked, "id", "update")
    known = kept.find_update(store, prefix)
    tree = None if known is None else kept.read_update(store, known.id)
    if known is None or tree is None:
        raise StoreError(
            f"update {prefix[:40]!r}: no such update, or its file has gone"
        )
    names = figures.put_first(
        FIRST, (name for name, kind in KINDS.items() if kind.of == "update")
    )
    plots = [
        (plot, name)
        for name in names
        if (plot := update_plot(store, known.subject, name))
    ]
    lines = report_text.text_of(tree)[1:]
    tables = report_text.fleet_tables(tree)
    prints = (place.files("update", f"id={known.id}&kind={name}") for _, name in plots)
    drawn = [
        figures.of_plot(plot, files)
        for (plot, _), files in zip(plots, prints, strict=True)
    ]
    shown = {
        "heading": known.title or "Update",
        "id": known.id,
        "runs": known.runs,
        "figures": drawn,
    }
    shown |= {
        "answers": report_text.answers(tree),
        "alerts": report_text.alerts(lines),
        "lines": lines,
    }
    return shown | {
        "fleet": tables,
        "about": report_text.fleet_about(tree) if tables else "",
    }


def update_plot(store: Store, subject: str, kind: str) -> Any:
    """Return a figure of an update, None where there is none."""
    try:
        return plotting.of_update(
            subject, store, read(single.specified({"kind": kind}), 1, None)
        )
    except (FigureError, KeyError, ValueError):
        return None


def progress(store: Store, place: Any, asked: Asked) -> dict[str, Any]:
    """Return how far runs are that are being computed, and whether the page looks again by itself."""
    return {
        "follow": bool(figures.first(asked).get("follow")),
        **recorded.progress(store),
    }
