"""The content of each page: plain data for the templates, read from the store."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from shlex import quote
from typing import Any
from urllib.parse import parse_qsl, urlencode

from wearlab.browsing import figures, listing, one_run, recorded
from wearlab.figures import KINDS, FigureError, single
from wearlab.store import Store, StoreError, database, outcome, remarks
from wearlab.store import updates as stored_updates
from wearlab.units import shown_unit
from wearlab.updating import report_text

Arguments = Mapping[str, Sequence[str]]
"""The arguments of an address."""

CARDS = 24  # campaigns of a page
MAX_BESIDE = 24  # runs told side by side
# cases of a campaign that figures are drawn of, and that are sorted by any column
MAX_DRAWN = 2_000
BESIDE = (
    "SELECT DISTINCT m.run FROM members AS m JOIN runs AS r ON r.id = m.run WHERE "
    "r.state = 'done' "
)
BESIDE += f"AND m.campaign = {recorded.CAMPAIGN_OF_RUN} LIMIT {MAX_BESIDE + 1}"
"""The finished runs of the campaign recorded last that has a run, as far as they are
told side by side."""
FIRST = ("fleet", "posterior-fan", "remaining-life", "look-next", "decision")
"""Figures of an update, before the others."""
NUMBER = re.compile(r"[± ]*(-?\d+(?:\.\d+)?(?:e[+-]?\d+)?)")


def _named(arguments: Arguments, name: str, noun: str) -> str:
    """Return which campaign, run or update an address names.

    Raises
    ------
    StoreError : none is
    """
    identity = figures.first(arguments).get(name)
    if identity:
        return identity
    raise StoreError(
        f"which {noun}? Open one from the pages, or give {name}=… in the address of "
        "this one"
    )


def campaigns(store: Store, place: Any, arguments: Arguments) -> dict[str, Any]:
    """Return a page of the campaigns.

    Parameters
    ----------
    store : that has them
    place : where the page is shown
    arguments : of the address: ``page``
    """
    number = listing.whole(figures.first(arguments).get("page", ""))
    found, count = recorded.campaigns(store, CARDS, (number - 1) * CARDS)
    shown = [
        replace(campaign, path=_file_of_campaign(store, place, campaign.path))
        for campaign in found
    ]
    subjects = [remarks.subject_of(campaign.title) for campaign in shown]
    remarked: dict[str, list[remarks.Remark]] = {}
    for remark in remarks.remarks_on(store.archive.catalogue, subjects):
        remarked.setdefault(remark.campaign, []).append(remark)
    return {
        "told": shown,
        "remarked": remarked,
        "number": number,
        "pages": max(1, -(-count // CARDS)),
    }


def campaign(store: Store, place: Any, arguments: Arguments) -> dict[str, Any]:
    """Return a campaign: a page of its cases, and some of its figures.

    In a copy all of them.

    Parameters
    ----------
    store : that has it
    place : where the page is shown
    arguments : of the address: ``key``, ``page``, ``sort``, ``figure``

    Raises
    ------
    StoreError : it is not in the store
    """
    first = figures.first(arguments)
    key = _named(arguments, "key", "campaign")
    number = listing.whole(first.get("page", ""))
    listed, _ = recorded.campaigns(store)
    matches = [candidate for candidate in listed if candidate.key == key]
    if not matches:
        raise StoreError(f"campaign {key[:40]!r} is not in this store")
    shown = replace(matches[0], path=_file_of_campaign(store, place, matches[0].path))

    is_small = shown.cases <= MAX_DRAWN
    rows_of_page = listing.ROWS if place.live else MAX_DRAWN
    sort = first.get("sort", "") if is_small else ""
    heads, rows = cases(store, key, sort, (number - 1) * rows_of_page, rows_of_page)
    drawn: list[figures.ShownFigure] = []
    further: list[tuple[int, str]] = []
    if is_small and shown.counts.get("done"):
        begin = listing.whole(first.get("figure", ""))
        drawn, further = _figures_of(store, place, key, begin)

    subject = remarks.subject_of(shown.title)
    quotes = [sign for sign in "\"'" if sign not in shown.title]
    condition = ""
    if quotes and place.live:
        condition = f"campaign = {quotes[0]}{shown.title}{quotes[0]}"
    return {
        "heading": shown.title,
        "told": shown,
        "heads": heads,
        "rows": rows,
        "sort": sort,
        "where": condition,
        "sortable": place.live and is_small,
        "number": number,
        "pages": max(1, -(-shown.cases // rows_of_page)),
        "figures": drawn,
        "others": further,
        "subject": subject,
        "remarked": remarks.remarks_on(store.archive.catalogue, [subject]),
    }


def _figures_of(
    store: Store, place: Any, key: str, begin: int
) -> tuple[list[figures.ShownFigure], list[tuple[int, str]]]:
    """Return figures of a campaign, and number and name of those left out."""
    source = figures.Source(store, recorded.campaign_of(store, key))
    questions = source.asked()
    begin = min(begin, len(questions))
    drawn = []
    further = []
    for number, question in enumerate(questions, 1):
        if place.live and not begin <= number < begin + figures.MAX_AT_ONCE:
            further.append((number, figures.name_of(question)))
        else:
            files = place.files("campaign", f"key={key}&figure={number}")
            drawn.append(source.shown(question, files))
    return drawn, further


def cases(store: Store, key: str, sort: str, skip: int, limit: int) -> tuple[Any, Any]:
    """Return headings and rows of some cases of a campaign.

    Parameters
    ----------
    store, key : the campaign
    sort : name of a column, a minus sign before it turns the order, what is empty comes
        last; "": as recorded
    skip, limit : so many, after the first ones
    """
    question = (
        "SELECT run, label, position FROM members WHERE campaign = ? ORDER BY number "
        "LIMIT ? OFFSET ?"
    )
    bounds = (MAX_DRAWN, 0) if sort else (limit, skip)
    members = store.archive.catalogue.read(question, [key, *bounds])
    subject = "a campaign in the catalogue"
    places = [
        database.understood(subject, database.place, position)
        for _, _, position in members
    ]
    axes = list(dict.fromkeys(name for place in places for name in place))
    entries = store.archive.entries(run for run, _, _ in members)

    rows = []
    for (run, label, _), place in zip(members, places, strict=True):
        values = [shown_unit(str(place.get(axis, ""))) for axis in axes]
        cells = (str(label), *values, *_outcome_cells(store, entries.get(run)))
        rows.append((str(run), cells))

    heads = ("case", *axes, "state", "verdict", "result", "error")
    if sort:
        column = sort.removeprefix("-")
        if column in heads:
            _sort_rows(rows, heads.index(column), reverse=sort.startswith("-"))
        rows = rows[skip : skip + limit]
    return tuple((head, head.replace("_", " ")) for head in heads), tuple(rows)


def _outcome_cells(store: Store, entry: Any) -> tuple[str, ...]:
    """Return state, verdict, result and error of a run, None where it is missing."""
    if entry is None:
        return ("missing", "", "", "")
    headlines = list(outcome.headlines(entry.summary))
    headline = headlines[0] if headlines else outcome.Headline("", "", "", None)
    verdict = str(entry.summary.get("verdict") or outcome.last_line(entry.reason))
    state = store.archive.state_of(entry)
    return (state, verdict, headline.text, headline.margin)


def _sort_rows(
    rows: list[tuple[str, tuple[str, ...]]], column: int, *, reverse: bool
) -> None:
    """Sort rows by a column, numbers before words, empty cells last."""
    rows.sort(key=lambda row: _sort_key(row[1][column]), reverse=reverse)
    rows.sort(key=lambda row: not row[1][column])


def _sort_key(cell: str) -> tuple[bool, float, str]:
    """Return what a cell is sorted by: the number that it begins with, before words."""
    number = NUMBER.match(cell)
    return number is None, float(number[1]) if number else 0.0, cell


def runs(store: Store, place: Any, arguments: Arguments) -> dict[str, Any]:
    """Return a page of runs.

    Parameters
    ----------
    store : that has them
    place : where the page is shown
    arguments : of the address: condition, columns, order, page
    """
    table = listing.listed(store, figures.first(arguments))
    return {
        "told": table,
        "signs": listing.SIGNS,
        "back": urlencode(table.asked),
        "beside": comparable([row[0] for row in table.rows]),
    }


def comparable(runs: Sequence[str]) -> Sequence[str]:
    """Return runs that can be compared, none where there are too many or only one.

    Parameters
    ----------
    runs : ids
    """
    return runs if 1 < len(runs) <= MAX_BESIDE else []


def run(store: Store, place: Any, arguments: Arguments) -> dict[str, Any]:
    """Return the page of one run.

    Parameters
    ----------
    store : that has it
    place : where the page is shown
    arguments : of the address: ``id``, and the table of runs in ``back``

    Raises
    ------
    StoreError : no such run
    """
    first = figures.first(arguments)
    entry = store.archive.find(_named(arguments, "id", "run"))
    facts = _without_folders(store, one_run.content(store, entry))
    kinds: list[str] = []
    drawn: list[figures.ShownFigure] = []
    if facts["state"] == "done":
        try:
            source = figures.Source(store, recorded.together(store, [entry.id]))
            kinds = source.of_one_run()
        except figures.PROBLEMS as error:
            drawn = [figures.ShownFigure("", problem=str(error))]

    prints = []
    beside: list[str] = []
    if place.live:
        for kind in kinds:
            files = place.files("figure", f"run={entry.id}&kind={kind}")
            prints.append((KINDS[kind].title or kind, files))
        beside = [row[0] for row in store.archive.catalogue.read(BESIDE, [entry.id])]
    else:
        drawn += [source.shown(source.question(kind)) for kind in kinds]

    address = place.store_name
    folder = quote(address)
    kind = kinds[0] if kinds else "wear-profile"
    return {
        "heading": facts["title"],
        "told": facts,
        "back": _back(first),
        "beside": comparable(beside),
        "has_life": bool(entry.summary.get("life")),
        "figures": drawn,
        "prints": prints,
        "commands": f"{_place_of_store(store, place)}"
        f"wearlab show {entry.id} --store {folder}\n"
        f"wearlab figures --from FIGURE.png --store {folder}   # a figure that was "
        "taken along",
        "python": f"{_place_of_store(store, place)}import wearlab as wl\n"
        f"run = wl.open({address!r}).run({entry.id!r})\n"
        f"wl.figure(run, {kind!r})",
    }


def _place_of_store(store: Store, place: Any) -> str:
    """Return a line that says where commands find the store, nothing of an address."""
    first, *_ = (*Path(place.store_name).parts, "")
    if store.address is not None or not first:
        return ""
    return f"# in the folder that holds {quote(first)}:\n"


def _file_of_campaign(store: Store, place: Any, path: str) -> str:
    """Return the file of a campaign without the folders of this machine.

    In a window it starts from the folder that holds the store; of another place the
    last folder tells files of one name apart.
    """
    file = Path(path)
    if not path or not place.live:
        return file.name
    above = store.path.absolute().parent
    if file.is_relative_to(above):
        return str(file.relative_to(above))
    return str(Path("…", *file.parts[-2:]))


def _without_folders(store: Store, told: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is told of a run without the folders of this machine.

    Its file is named from the store's own folder on, and of a traceback the last line
    stays.
    """
    above = f"{store.path.absolute().parent}/"
    files = told["facts"].get("file", ())
    names = [str(Path(file).absolute()).removeprefix(above) for file in files]
    facts = {**told["facts"], "file": names} if names else told["facts"]
    return {**told, "facts": facts, "reason": outcome.last_line(told["reason"])}


def _back(first: Mapping[str, str]) -> dict[str, str]:
    """Return condition, columns and order of the table of runs that was left."""
    names = ("where", "columns", "sort")
    return {
        name: text for name, text in parse_qsl(first.get("back", "")) if name in names
    }


def compare(store: Store, place: Any, arguments: Arguments) -> dict[str, Any]:
    """Return marked runs, or a campaign, in one figure, with its choices.

    Parameters
    ----------
    store : that has the runs
    place : where the page is shown
    arguments : of the address: the runs or the campaign, and the figure
    """
    first = {"state": "last", "back": "", **figures.first(arguments)}
    arguments = {**arguments, "state": [first["state"]]}
    wish = figures.wanted(arguments)
    content: dict[str, Any] = {
        "beside": None,
        "problem": "",
        "commands": "",
        "heading": "Compare",
        "figures": (),
        "asked": wish,
        "state": first["state"],
        "back": first["back"],
        "left": _back(first),
    }
    if not wish.runs and not wish.campaign:
        problem = "Mark some runs in a table first, then choose to compare them."
        return {**content, "problem": problem}
    if not wish.campaign:
        content["beside"] = one_run.side_by_side(store, wish.runs[:MAX_BESIDE])

    source = figures.source_of(store, wish)
    content |= _choices(source)
    verb = "Compare " if len(wish.runs) > 1 else ""
    content["heading"] = f"{verb}{source.campaign.title}"
    try:
        question = source.ask_for(wish)
    except FigureError as error:
        return {**content, "problem": str(error)}

    files = place.files("figure", figures.address(arguments))
    content["figures"] = [source.shown(question, files)]
    folder = quote(place.store_name)
    content["commands"] = (
        f"{_place_of_store(store, place)}"
        f"wearlab figures --from {question.name}.png --store {folder}   # the PNG that "
        "was taken along"
    )
    if len(wish.runs) == 2:
        pair = " ".join(wish.runs)
        content["commands"] += f"\nwearlab compare {pair} --store {folder}"
    return content


def _choices(source: figures.Source) -> dict[str, Any]:
    """Return what a figure of some runs may be of: kinds, results, abscissae, roles."""
    axes = [str(dim) for dim in source.grid.run_id.dims]
    inner = [
        dim for dim in ("flank", "mesh", "update", "member") if dim in source.grid.dims
    ]
    return {
        "kinds": [
            (kind, f"{kind}: {KINDS[kind].shows}"[:90]) for kind in source.possible()
        ],
        "numbers": [
            (name, f"{name}: {words}"[:90]) for name, words in source.numbers()
        ],
        "abscissae": list(dict.fromkeys([*axes, *source.abscissae()])),
        "roles": [*axes, *inner],
    }


def updates(store: Store, place: Any, arguments: Arguments) -> dict[str, Any]:
    """Return the updates of a store, the latest first, with answers and alerts.

    Parameters
    ----------
    store : that has them
    place : where the page is shown
    arguments : of the address
    """
    rows: list[tuple[Any, list[str], list[str]]] = []
    for update in reversed(stored_updates.kept_updates(store).values()):
        answers = ["Its file has gone."]
        alerts: list[str] = []
        try:
            tree = stored_updates.read_update(store, update.id)
            if tree is not None:
                answers = report_text.answers(tree)
                alerts = report_text.alerts(report_text.text_of(tree))
        except (StoreError, KeyError, ValueError) as error:
            answers = [f"It cannot be read: {error}"]
            alerts = []
        rows.append((update, answers, alerts))
    return {"told": rows}


def update(store: Store, place: Any, arguments: Arguments) -> dict[str, Any]:
    """Return the answer of an update and its figures.

    Parameters
    ----------
    store : that has it
    place : where the page is shown
    arguments : of the address: ``id``

    Raises
    ------
    StoreError : there is none, or its file is damaged
    """
    prefix = _named(arguments, "id", "update")
    record = stored_updates.find_update(store, prefix)
    tree = None if record is None else stored_updates.read_update(store, record.id)
    if record is None or tree is None:
        raise StoreError(
            f"update {prefix[:40]!r}: no such update, or its file has gone"
        )

    names = [name for name, kind in KINDS.items() if kind.of == "update"]
    drawn = []
    for name in figures.put_first(FIRST, names):
        plot = update_plot(store, record.subject, name)
        if plot:
            files = place.files("update", f"id={record.id}&kind={name}")
            drawn.append(figures.of_plot(plot, files))
    about = {"id": record.id, "runs": record.runs, "figures": drawn}
    with stored_updates.understanding(record.id):
        lines = report_text.text_of(tree)[1:]
        tables = report_text.fleet_tables(tree)
        return about | {
            "heading": record.title or "Update",
            "answers": report_text.answers(tree),
            "alerts": report_text.alerts(lines),
            "lines": lines,
            "fleet": [*tables, *report_text.what_if_tables(tree)],
            "about": report_text.fleet_about(tree) if tables else "",
        }


def update_plot(store: Store, subject: str, kind: str) -> Any:
    """Return a figure of an update, None where there is none.

    Parameters
    ----------
    store : that has it
    subject : identity of what it is of
    kind : of the figure
    """
    try:
        return single.update_plot(subject, store, kind)
    except (FigureError, KeyError, ValueError):
        return None


def progress(store: Store, place: Any, arguments: Arguments) -> dict[str, Any]:
    """Return how far running runs are, and whether the page is loaded anew by itself.

    Parameters
    ----------
    store : that has them
    place : where the page is shown
    arguments : of the address: ``follow``
    """
    follow = bool(figures.first(arguments).get("follow"))
    return {"follow": follow, **recorded.progress(store)}
