"""A campaign as one HTML page that needs nothing else; nothing is computed for it."""

import base64
import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from wearlab.assembly.sheet import Sheet, sheet
from wearlab.campaign import Campaign, Case, inheritance
from wearlab.campaign.campaign import ReportSpec
from wearlab.figures import doubt, drawing
from wearlab.report import key_results
from wearlab.report.answer import Entries, answer, gathered
from wearlab.report.conditions import conditions
from wearlab.scene import Scene, parts_left_out, parts_present
from wearlab.store import Store, StoreError, former, outcome, provenance
from wearlab.store.catalogue import Entry

FOLDER = Path(__file__).parent
SUFFIXES = (".html", ".htm", ".pdf")
MAX_LINES = 100  # of remarks, of model errors, and of failures
MAX_ROWS = 2000  # of a table: beyond, a page is no place to read them
MAX_GEAR_SHEETS = 4
MAX_AXIS_VALUES = 12  # beyond, the first and the last are shown
BROAD = 1000  # pixels of a figure whose panels take a whole row
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?!\w)")
PROVENANCE = {
    "commit": "commit",
    "dirty": "uncommitted edits",
    "packages": "packages",
    "machine": "machine",
    "model_version": "model version",
}
"""Attributes of a run, and how the page calls them."""

Content = dict[str, Any]
"""Values by the names that `page.html` has for them."""
Comparisons = dict[tuple[str, str, str], outcome.Comparison]
"""By run, label and place."""


class ReportError(ValueError):
    """A page that cannot be written as asked for; the message says what can."""


def report(campaign: Campaign, store: Store) -> str:
    """Return the page of a campaign, every text in it escaped.

    Equal stores give equal pages.

    Parameters
    ----------
    campaign : its cases and figures
    store : where the runs are; nothing is computed

    Raises
    ------
    StoreError : there is no store
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(FOLDER),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    template = environment.get_template("page.html")
    style = (FOLDER / "page.css").read_text(encoding="utf-8")
    return template.render(told=content(campaign, store), style=style)


def check_suffix(path: Path) -> None:
    """Refuse a file that no page is written to.

    Parameters
    ----------
    path : of the page

    Raises
    ------
    ReportError : its suffix is none of `SUFFIXES`, or nothing here writes it
    """
    if path.suffix.lower() not in SUFFIXES:
        suffix = path.suffix or "a file without"
        raise ReportError(
            f"{path}: a report is written as .html or .pdf, not as {suffix}"
        )
    if path.suffix.lower() == ".pdf":
        _printer()


def as_file(page: str, suffix: str) -> bytes:
    """Return the bytes of a page as HTML, or printed as a PDF.

    Parameters
    ----------
    page : HTML
    suffix : one of `SUFFIXES`

    Raises
    ------
    ReportError : WeasyPrint is not installed
    """
    if suffix.lower() != ".pdf":
        return page.encode()
    return bytes(_printer()(string=page).write_pdf())


def _printer() -> Any:
    """Return WeasyPrint's `HTML`."""
    try:
        from weasyprint import HTML
    except (ImportError, OSError) as error:  # OSError: Pango is not there
        reason = str(error).splitlines()[0]
        raise ReportError(
            f"a PDF needs WeasyPrint ({reason}): pip install 'wearlab[pdf]'; or name "
            "the file .html and print it from a browser"
        ) from None
    return HTML


def content(campaign: Campaign, store: Store) -> Content:
    """Return what there is to tell of a campaign, by the names in `page.html`.

    Parameters
    ----------
    campaign : its cases and figures
    store : where the runs are

    Raises
    ------
    StoreError : there is no store
    """
    entries = store.archive.entries(case.id for case in campaign.cases)
    report = getattr(campaign, "report", None) or ReportSpec()
    rows = _rows(campaign, entries, store)
    factor = report.wear_coefficient_factor
    return {
        "report": report,
        **_head(campaign, entries, rows),
        **_requested(campaign, report),
        **_results(campaign, entries, rows, store),
        "answer": answer(campaign, entries, factor, store),
        "remarks": remarks(entries),
        "model_errors": model_errors(entries),
        **_origin(campaign, entries, store),
        **_measured(campaign, store),
    }


def _head(campaign: Campaign, entries: Entries, rows: Sequence[Content]) -> Content:
    """Return title, file and dates, and how many runs are in which state."""
    states = {
        case.id: row["state"] for case, row in zip(campaign.cases, rows, strict=True)
    }
    return {
        "title": campaign.title,
        "reference": campaign.reference or "",
        "file": campaign.path.name if campaign.path else "",
        "dates": _dates(entries),
        "counts": {"runs": len(states), **Counter(states.values())},
    }


def _requested(campaign: Campaign, report: ReportSpec) -> Content:
    """Return what the campaign asks for: axes, parts, conditions and gears."""
    axes = ((axis.name, _values(axis.values, axis.units)) for axis in campaign.axes)
    return {
        "axes": tuple(axes),
        "parts": tuple(_parts(campaign)),
        "conditions": conditions(campaign),
        "gears": _gears(campaign) if "gears" in report.sections else (),
    }


def _results(
    campaign: Campaign, entries: Entries, rows: Sequence[Content], store: Store
) -> Content:
    """Return the rows of the tables, the figures and the failures."""
    shown = tuple(rows[:MAX_ROWS])
    failures = tuple(_failures(campaign, rows, entries))
    return {
        "rows": shown,
        "key_results": _key_results(campaign, shown, entries, store),
        "extremes": [row for row in shown if row["comparison"]],
        "left_out": max(0, len(rows) - MAX_ROWS),
        "figures": tuple(drawn(campaign, store)),
        "failures": failures[:MAX_LINES],
    }


def _key_results(
    campaign: Campaign, rows: Sequence[Content], entries: Entries, store: Store
) -> Content:
    """Return heads and rows of safeties, face load factors, transmission errors."""
    from wearlab.schema import VARIABLES

    results = []
    cases = []
    for case, row in zip(campaign.cases, rows, strict=False):
        entry = entries.get(case.id)
        numbers = key_results.key_results(store, entry) if entry else []
        if numbers:
            results.append(numbers)
            cases.append(row)
    heads, texts = key_results.table_of(results, VARIABLES)
    return {"heads": heads, "rows": list(zip(cases, texts, strict=True))}


def _origin(campaign: Campaign, entries: Entries, store: Store) -> Content:
    """Return where the runs come from: code, earlier runs, file and author."""
    text = inheritance.source_text(campaign.path)
    seconds = sum(entry.seconds or 0.0 for entry in entries.values())
    return {
        "metadata": getattr(campaign, "metadata", {}) or {},
        "text": text,
        "hash": inheritance.fingerprint(text),
        "seconds": outcome.seconds_text(seconds),
        "code": tuple(_code(store, entries)),
        "lineage": tuple(_lineage(campaign, store, entries)),
    }


def _measured(campaign: Campaign, store: Store) -> Content:
    """Return what the update of the measurements says, its answers, and its fleet."""
    from wearlab.store import updates
    from wearlab.updating import identity, measurements, report_text

    nothing: Content = {"measured": (), "updated": (), "fleet": (), "about": ()}
    if campaign.update is None:
        return nothing
    try:
        records = updates.updates_of(store, identity.subject_of(campaign))
    except measurements.UpdateError as error:
        return nothing | {"measured": (f"! {error}",)}
    tree = updates.read_update(store, records[0].id) if records else None
    if tree is None:
        problem = (
            "! no update of these measurements as they stand is kept: wearlab update "
            "FILE makes it"
        )
        return nothing | {"measured": (problem,)}

    with updates.understanding(records[0].id):
        text = report_text.text_of(tree)[1:]
        measured = (*text, "", *report_text.BELIEVED)
        tables = report_text.fleet_tables(tree)
        if not tables:
            answers = report_text.answers(tree)
            return nothing | {"measured": measured, "updated": answers}
        alerts = [f"! {line}" for line in report_text.alerts(text)]
        return {
            "measured": measured,
            "updated": [*alerts, *report_text.units_to_open(tree)],
            "fleet": [*tables, *report_text.what_if_tables(tree)],
            "about": report_text.fleet_about(tree),
        }


def model_errors(entries: Entries) -> tuple[tuple[str, int], ...]:
    """Return the known errors of the models of runs, each with its count.

    Parameters
    ----------
    entries : of the runs
    """
    counts: Counter[str] = Counter()
    for entry in entries.values():
        lines = str(entry.summary.get("model_error") or "").split("\n")
        counts.update(line for line in dict.fromkeys(lines) if line)
    return tuple(counts.most_common(MAX_LINES))


def remarks(entries: Entries) -> tuple[tuple[str, int], ...]:
    """Return assumptions, limits of validity and warnings of runs, each with its count.

    Lines that differ in one number are one, with its range.

    Parameters
    ----------
    entries : of the runs
    """
    runs_of_line: dict[str, list[str]] = {}
    for entry in entries.values():
        validity = str(entry.summary.get("validity") or "").split("\n")
        for line in dict.fromkeys([*validity, *entry.warnings]):
            if line:
                runs_of_line.setdefault(line, []).append(entry.id)

    counts: Counter[str] = Counter()
    similar_lines = gathered((NUMBER.sub("#", line), line) for line in runs_of_line)
    for lines in similar_lines.values():
        if _differ_in_one_number(lines):
            runs = set().union(*(runs_of_line[line] for line in lines))
            counts[doubt.combined_reasons(lines, NUMBER)] = len(runs)
        else:
            counts.update({line: len(runs_of_line[line]) for line in lines})
    return tuple(counts.most_common(MAX_LINES))


def _differ_in_one_number(lines: Sequence[str]) -> bool:
    """Whether lines that are equal but for numbers differ in a single one."""
    numbers = zip(*(NUMBER.findall(line) for line in lines), strict=True)
    return sum(len(set(column)) > 1 for column in numbers) == 1


class Drawn(NamedTuple):
    """A figure as a data URI, with one for small screens if that is another.

    Or why there is none.
    """

    title: str
    uri: str
    problem: str
    broad: bool = False
    small: str = ""


def _uri(image: bytes | None) -> str:
    """Return an image as a data URI, "" for none."""
    if not image:
        return ""
    return f"data:image/png;base64,{base64.b64encode(image).decode('ascii')}"


def drawn(campaign: Campaign, store: Store) -> Iterator[Drawn]:
    """Yield each figure of a campaign, or why it cannot be drawn.

    Parameters
    ----------
    campaign : its figures
    store : where the runs are
    """
    if not campaign.figures:
        return
    draw = partial(drawing.both_widths, grid=store.open(campaign), store=store)
    for spec, images, problem in drawing.each_figure(campaign, draw):
        image, small = images or (b"", None)
        width = int.from_bytes(image[16:20], "big")  # of a PNG [pixels]
        yield Drawn(
            title=str(getattr(spec, "title", None) or spec.kind),
            uri=_uri(image),
            problem=problem,
            broad=width > BROAD,
            small=_uri(small),
        )


def _values(values: Sequence[Any], units: str | None) -> str:
    """Return the values of an axis with their unit, of many the first and the last."""
    shown = [outcome.value_text(value, None) for value in values]
    if len(shown) > MAX_AXIS_VALUES:
        shown = [*shown[:5], "…", *shown[-2:], f"({len(values)} values)"]
    return f"{', '.join(shown)} {units or ''}".rstrip()


def _rows(campaign: Campaign, entries: Entries, store: Store) -> list[Content]:
    """Return every case as a row of the table of results."""
    comparisons = _comparisons(campaign, store)
    missing = [case.id for case in campaign.cases if case.id not in entries]
    older = former.older_versions(campaign, store.archive, missing)
    return [
        _row(campaign, case, entries.get(case.id), store, comparisons, older)
        for case in campaign.cases
    ]


def _comparisons(campaign: Campaign, store: Store) -> Comparisons:
    """Return how cases compare with what is expected of them; the latest counts."""
    comparisons = {}
    members = store.archive.catalogue.members_of_campaign(campaign.title)
    for member in reversed(members):
        if member.comparison is not None:
            place = json.dumps(member.position, sort_keys=True)
            comparisons[member.run, member.label, place] = member.comparison
    return comparisons


def _row(
    campaign: Campaign,
    case: Case,
    entry: Entry | None,
    store: Store,
    comparisons: Comparisons,
    older: Mapping[str, str],
) -> Content:
    """Return one case in the table of results, in words but for the comparison.

    ``older`` is what to say of missing runs that another version of the model made.
    """
    warnings = len(entry.warnings) if entry else 0
    place = outcome.place(campaign, case)
    summary = entry.summary if entry else {}
    headlines = outcome.headlines(summary)
    errors = (
        f"{100 * headline.error:.2g} % of the {headline.of}"
        for headline in headlines
        if headline.error is not None
    )
    key = (case.id, case.label, json.dumps(place, sort_keys=True))
    return {
        "case": case.label,
        "places": tuple(place.get(axis.name, "all") for axis in campaign.axes),
        "state": "missing" if entry is None else store.archive.state_of(entry),
        "verdict": str(summary.get("verdict") or ""),
        "result": ", ".join(headline.text for headline in headlines),
        "error": ", ".join(errors),
        "seconds": outcome.seconds_text(entry.seconds if entry else None),
        "run": case.id,
        "note": f"{warnings} warnings" if warnings else older.get(case.id, ""),
        "comparison": comparisons.get(key),
    }


def _dates(entries: Entries) -> str:
    """Return from which day to which the runs were made."""
    days = sorted(entry.started[:10] for entry in entries.values() if entry.started)
    if not days:
        return ""
    return days[0] if days[0] == days[-1] else f"{days[0]} to {days[-1]}"


def _parts(
    campaign: Campaign,
) -> Iterator[tuple[str, tuple[str, ...], tuple[str, ...]]]:
    """Yield labels of cases, and which parts their first scenes have and leave out."""
    scenes: dict[str, Scene] = {}
    for case in campaign.cases:
        scenes.setdefault(case.label, case.scene)
    labels = gathered(
        ((tuple(parts_present(scene)), tuple(parts_left_out(scene))), label)
        for label, scene in scenes.items()
    )
    for (present, absent), names in labels.items():
        yield ", ".join(names), present, absent


def _gears(campaign: Campaign) -> tuple[Content, ...]:
    """Return sheets of the gear sets, and the cases that have each, "" for all."""
    sheets: dict[str, Sheet] = {}
    labels: dict[str, dict[str, None]] = {}
    for case in campaign.cases:
        key = case.scene.gears.model_dump_json()
        if key not in labels and len(sheets) < MAX_GEAR_SHEETS:
            with suppress(ValueError):  # such gears cannot be built
                sheets[key] = sheet(case.scene)
        labels.setdefault(key, {})[case.label] = None
    return tuple(
        {"cases": ", ".join(labels[key]) if len(sheets) > 1 else "", "sheet": gear_set}
        for key, gear_set in sheets.items()
    )


def _failures(
    campaign: Campaign, rows: Sequence[Content], entries: Entries
) -> Iterator[Content]:
    """Yield each run that has no data, and why."""
    listed: set[str] = set()
    for case, row in zip(campaign.cases, rows, strict=True):
        if row["state"] == "done" or case.id in listed:
            continue
        listed.add(case.id)
        entry = entries.get(case.id)
        reason = (entry.reason if entry is not None else None) or ""
        yield {
            "case": _name(campaign, case),
            "run": case.id,
            "state": row["state"],
            "headline": outcome.last_line(reason),
            "reason": reason.strip(),
        }


def _name(campaign: Campaign, case: Case) -> str:
    """Return the label of a case and its places."""
    return ", ".join([case.label, *outcome.place(campaign, case).values()])


def _lineage(
    campaign: Campaign, store: Store, entries: Entries
) -> list[tuple[str, tuple[str, ...]]]:
    """Return the cases that rest on other runs, and which runs those are."""
    names_of_steps = gathered(
        (tuple(_steps(store, entries[case.id])), _name(campaign, case))
        for case in campaign.cases
        if case.id in entries
    )
    return [
        ("; ".join(names), steps) for steps, names in names_of_steps.items() if steps
    ]


def _steps(store: Store, entry: Entry) -> Iterator[str]:
    """Yield the runs that one goes on from, and the one that calibrated it."""
    yield from map(str, provenance.lineage(store, entry))
    if entry.calibration:
        yield f"run {entry.calibration}, which calibrated it"


def _code(store: Store, entries: Entries) -> Iterator[dict[str, str]]:
    """Yield each code that made runs, and what one of its files says of its origin."""
    runs_of_code = gathered(
        ((entry.wearlab_version or "", entry.source_hash or ""), entry.id)
        for entry in entries.values()
        if entry.state == "done"
    )
    for (version, source_hash), ids in runs_of_code.items():
        code = {"wearlab": version, "source hash": source_hash, "runs": str(len(ids))}
        with suppress(StoreError):
            attributes = store.run(ids[0]).attrs
            for name, label in PROVENANCE.items():
                if name in attributes:
                    code[label] = str(attributes[name])
        yield code
