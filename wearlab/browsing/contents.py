"""What each page tells, asked of the store: plain data for the templates, and files to take along."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

from wearlab.browsing import figures, listing, one_run, question, recorded
from wearlab.browsing.listing import ROWS, whole
from wearlab.figures.errors import FigureError
from wearlab.figures.kind import KINDS, read
from wearlab.store import database, outcome, remark_files, remarks
from wearlab.store import updates as kept
from wearlab.store.errors import StoreError
from wearlab.store.lineage import name_of
from wearlab.store.reading import checked_bytes

if TYPE_CHECKING:
    from wearlab.figures.question import Question
    from wearlab.store import Store

EMPTY = b'<svg xmlns="http://www.w3.org/2000/svg" width="16" height="9"/>'
CARDS = 24  # campaigns of a page
FIGURES = 2  # of a campaign that are drawn at once
NETCDF = "application/x-netcdf"
TEXT = "text/plain; charset=utf-8"
FIRST = ("fleet", "posterior-fan", "remaining-life", "look-next", "decision")
"""Figures of an update, before the others."""
MOST_BESIDE = 24  # runs told side by side
MOST_DRAWN = 2_000  # cases of a campaign that figures are drawn of


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
    heads, rows = cases(store, key, (number - 1) * ROWS, ROWS)
    source = recorded.campaign_of(store, key) if told.cases <= MOST_DRAWN else None
    drawn: list[figures.Shown] = []
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
        told = next(iter(outcome.headlines(entry.summary)), None) if entry else None
        rows.append(
            (
                str(run),
                (
                    str(label),
                    *(str(place.get(axis, "")) for axis in axes),
                    "missing" if entry is None else store.state_of(entry),
                    ""
                    if entry is None
                    else str(entry.summary.get("verdict") or outcome.last_line(entry.reason)),
                    "" if told is None else told.text,
                    "" if told is None or told.error is None else f"± {100 * told.error:.2g} %",
                ),
            )
        )
    return tuple((head, head.replace("_", " ")) for head in heads), tuple(rows)


def _figures(
    store: "Store", key: str, source: Any, place: Any, chosen: str
) -> tuple[list[figures.Shown], list[tuple[int, str]]]:
    """Return the figures of a campaign that are drawn, and number and name of the others."""
    grid = store.open(source)
    asked = _asked(source, grid)
    at = min(whole(chosen), len(asked)) - 1
    drawn = []
    for number, each in list(enumerate(asked, 1))[at : at + FIGURES]:
        files = _files(place, "campaign", f"key={key}&figure={number}")
        drawn.append(figures.shown(store, each, grid, files))
    shown = range(at, at + FIGURES)
    names = [(n, str(each.table.get("title") or each.table["kind"])) for n, each in enumerate(asked, 1)]
    return drawn, [pair for i, pair in enumerate(names) if i not in shown]


def _asked(source: Any, grid: Any) -> "list[Question]":
    """Return the questions of a campaign's figures; of one without any, some that its runs can answer."""
    asked = [question.question_of_figure(source, number) for number in range(1, len(source.figures) + 1)]
    return asked or [question.asked(source, kind, {}) for kind in question.possible(grid)[:FIGURES]]


def _files(place: Any, name: str, address: str) -> tuple[tuple[str, str], ...]:
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
    }


def run(store: "Store", prefix: str, place: Any) -> dict[str, Any]:
    """Return what a page of one run tells.

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
            files = _files(place, "figure", f"run={entry.id}&kind={kind}")
            prints.append((KINDS[kind].title or kind, files))
        first = (question.of_one_run(grid) or [first])[0]
    where = store.address or str(store.path.absolute())
    return {
        "told": told,
        "prints": prints,
        "cite_url": place.url("citation", id=entry.id) if done and place.live else "",
        "data_url": place.url("data", id=entry.id) if done and place.live else "",
        "commands": f"wearlab show {entry.id} --store {_quoted(where)}\n"
        f"wearlab figures --from FIGURE.png --store {_quoted(where)}   # a figure that was taken along",
        "python": f"import wearlab as wl\nrun = wl.open({where!r}).run({entry.id!r})\n"
        f"wl.figure(run, {first!r})",
    }


def _quoted(path: str) -> str:
    return (
        path
        if all(sign.isalnum() or sign in "/._-:" for sign in path)
        else "'" + path.replace("'", "'\\''") + "'"
    )


def compared(store: "Store", arguments: Mapping[str, Sequence[str]], place: Any) -> dict[str, Any]:
    """Return marked runs, or a campaign, in one figure, with what there is to choose from."""
    told: dict[str, Any] = {
        **{"kinds": (), "numbers": (), "abscissae": (), "roles": (), "figure": None, "beside": None},
        **{
            "problem": "",
            "commands": "",
            "title": "Compare",
            "state": (list(arguments.get("state", ())) or ["last"])[0],
        },
    }
    asked = question.wanted({**arguments, "state": [told["state"]]})
    told["asked"] = asked
    if not asked.runs and not asked.campaign:
        return {**told, "problem": "Mark some runs in a table first, then choose to compare them."}
    if asked.runs and not asked.campaign:
        told["beside"] = one_run.side_by_side(store, asked.runs[:MOST_BESIDE])
    source = question.source_of(store, asked)
    told["title"] = source.title
    grid = store.open(source)  # type: ignore[arg-type]
    able = question.possible(grid)
    axes = [str(dim) for dim in grid.run_id.dims]
    told |= {
        "kinds": [(kind, f"{kind}: {KINDS[kind].shows}"[:90]) for kind in able],
        "numbers": [(name, f"{name}: {words}"[:90]) for name, words in question.numbers(grid)],
        "abscissae": [*axes, *question.beside_axes(grid)],
        "roles": [*axes, *(str(d) for d in ("flank", "mesh", "update", "member") if d in grid.dims)],
        "title": source.title,
    }
    try:
        question_, grid = question.question_of(store, asked)
    except FigureError as error:
        return {**told, "problem": str(error)}
    told["figure"] = figures.shown(store, question_, grid, _files(place, "figure", asked.address))
    told["commands"] = _compare_commands(store, asked, question_)
    return told


def _compare_commands(store: "Store", asked: question.Wanted, drawn: "Question") -> str:
    where = _quoted(store.address or str(store.path.absolute()))
    lines = [f"wearlab figures --from {drawn.name}.png --store {where}   # the PNG that was taken along"]
    if len(asked.runs) == 2:
        lines.append(f"wearlab compare {asked.runs[0]} {asked.runs[1]} --store {where}")
    return "\n".join(lines)


def updates(store: "Store") -> list[tuple[kept.KeptUpdate, list[str]]]:
    """Return the updates of a store, the latest first, each with its answer."""
    from wearlab.updating.report_text import answers

    told = []
    for update in reversed(kept.kept_updates(store).values()):
        try:
            tree = kept.read_update(store, update.id)
            told.append((update, ["Its file has gone."] if tree is None else answers(tree)))
        except (StoreError, KeyError, ValueError) as error:
            told.append((update, [f"It cannot be read: {error}"]))
    return told


def update(store: "Store", prefix: str, place: Any) -> dict[str, Any]:
    """Return the answer of an update and its figures.

    Raises
    ------
    StoreError : there is none, or its file is damaged
    """
    from wearlab.updating.report_text import answers, text_of

    known = kept.find_update(store, prefix)
    tree = None if known is None else kept.read_update(store, known.id)
    if known is None or tree is None:
        raise StoreError(f"update {prefix[:40]!r}: no such update, or its file has gone")
    drawn = []
    of_updates = [name for name, kind in KINDS.items() if kind.of == "update"]
    for name in [*(n for n in FIRST if n in of_updates), *(n for n in of_updates if n not in FIRST)]:
        shown = _of_update(store, known.subject, name)
        if shown is not None:
            files = _files(place, "update", f"id={known.id}&kind={name}")
            drawn.append(figures.of_plot(shown, files))
    return {
        "title": known.title or "Update",
        "answers": answers(tree),
        "lines": text_of(tree)[1:],
        "figures": drawn,
        "runs": known.runs,
        "id": known.id,
    }


def _of_update(store: "Store", subject: str, kind: str) -> Any:
    from wearlab.figures.drawing import of_update, specified

    try:
        return of_update(subject, store, read(specified({"kind": kind}), 1, None))
    except (FigureError, KeyError, ValueError):
        return None


def progress(store: "Store") -> dict[str, Any]:
    """Return the runs under way, how far their lives are, and how far their campaigns are."""
    rows = store.catalogue.read(
        "SELECT id, owner, started FROM runs WHERE state = 'running' ORDER BY started"
    )
    present = datetime.now(UTC)
    told = []
    for run_id, owner, started in rows:
        reached = store.checkpoints.reached(run_id) if store.files.is_name(str(run_id)) else None
        told.append(
            {
                "id": str(run_id),
                "name": name_of(store, run_id) or str(run_id)[:10],
                "alive": store.is_alive(str(owner or "")),
                "since": _since(started, present),
                "cycles": "" if reached is None else f"{reached.cycle:.4g}",
                "depth": "" if reached is None else f"{1e6 * reached.depth:.3g} µm",
            }
        )
    return {"under_way": told, "campaigns": _under_way(store), "now": present.isoformat()}


def _since(started: Any, present: datetime) -> str:
    try:
        return outcome.seconds_text((present - datetime.fromisoformat(str(started))).total_seconds())
    except (ValueError, TypeError):
        return ""


def _under_way(store: "Store") -> list[dict[str, Any]]:
    """Return the campaigns with runs under way: finished, in all, time left by those finished."""
    told = []
    for each in recorded.campaigns(store)[0]:
        left = each.counts.get("running", 0)
        if not left:
            continue
        done = sum(each.counts.get(state, 0) for state in ("done", "failed", "refused"))
        total = done + left + each.counts.get("interrupted", 0) + each.counts.get("missing", 0)
        ((mean,),) = store.catalogue.read(
            "SELECT avg(r.seconds) FROM runs AS r JOIN members AS m ON m.run = r.id "
            "WHERE m.campaign = ? AND r.state = 'done'",
            [each.key],
        )
        time = "" if mean is None else outcome.seconds_text(float(mean) * (total - done) / left)
        told.append({"title": each.title, "done": done, "total": total, "left": left, "time": time})
    return told


def printed(store: "Store", name: str, ending: str, arguments: Mapping[str, Sequence[str]]) -> bytes:
    """Return the file of a figure that an address asks for.

    Raises
    ------
    FigureError, StoreError : it cannot be drawn
    """
    first = {key: values[0] for key, values in arguments.items() if values}
    if name == "campaign":
        source = recorded.campaign_of(store, first.get("key", ""))
        grid = store.open(source)  # type: ignore[arg-type]
        asked = _asked(source, grid)
        return figures.printed(
            store, asked[min(whole(first.get("figure", "")), len(asked)) - 1], grid, ending
        )
    if name == "update":
        return _printed_update(store, first.get("id", ""), first.get("kind", ""), ending)
    wanted, grid = question.question_of(store, question.wanted(arguments))
    return figures.printed(store, wanted, grid, ending)


def _printed_update(store: "Store", prefix: str, kind: str, ending: str) -> bytes:
    from wearlab.browsing import words
    from wearlab.figures.render import rendered

    known = kept.find_update(store, prefix)
    plot = None if known is None or kind not in KINDS else _of_update(store, known.subject, kind)
    if plot is None or known is None:
        raise FigureError(f"{kind[:40]!r} of update {prefix[:40]!r}: no such figure")
    if ending == "csv":
        return words.table(plot).encode()
    return rendered(plot, {"Title": plot.title, "update": known.id}, ending)


def file_name(name: str, arguments: Mapping[str, Sequence[str]]) -> str:
    """Return the name of a file that is taken along, of letters, digits and signs that every system takes."""
    first = [
        values[0]
        for key, values in arguments.items()
        if values and key in ("kind", "key", "id", "run", "figure")
    ]
    words = "-".join([name, *(value[:24] for value in first)])
    return "".join(sign if sign.isascii() and (sign.isalnum() or sign in "-_") else "-" for sign in words)


def taken(store: "Store", what: str, prefix: str) -> tuple[bytes, str, str]:
    """Return the file of a run, checked, or its citation; with its kind and name.

    Raises
    ------
    StoreError : no such run, it has no data, or its file is damaged
    """
    entry = store.find(prefix)
    if entry.state != "done":
        raise StoreError(f"run {entry.id} has no data: {entry.state}")
    if what == "citation":
        sentence, bibtex = one_run.citation(store, entry)
        return f"{sentence}\n\n{bibtex}\n".encode(), TEXT, f"citation-{entry.id[:10]}.txt"
    return checked_bytes(store.file_of(entry.id), entry.sha256), NETCDF, f"{entry.id}.nc"


def remarked(store: "Store", subject: str, what: str, text: str) -> tuple[str, dict[str, str]]:
    """Write a tag or note on a run or campaign of the store; return which page shows it.

    Raises
    ------
    StoreError : there is no such run or campaign, or the text does not do
    """
    if what not in remarks.KINDS:
        raise StoreError(f"{what[:20]!r} is no remark: tag, untag or note")
    titles = {
        remarks.subject_of(str(title)): (str(title), key)
        for title, key in store.catalogue.read("SELECT title, key FROM campaigns ORDER BY recorded")
    }
    if subject in titles:
        title, key = titles[subject]
        remark_files.add(store, subject, what, text, title)  # type: ignore[arg-type]
        return "campaign", {"key": key}
    entry = store.heads([subject]).get(subject)
    if entry is None:
        raise StoreError(f"run {subject[:40]!r}: no such run")
    remark_files.add(store, entry.id, what, text)  # type: ignore[arg-type]
    return "run", {"id": entry.id}
