"""A campaign as one HTML page that needs nothing else: what it tells, with nothing computed, and its HTML."""

import base64
import json
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from wearlab.assembly.sheet import Sheet, sheet
from wearlab.campaign import Campaign, Case, inheritance
from wearlab.campaign.campaign import ReportSpec
from wearlab.figures import doubt, drawing
from wearlab.report.answer import Entries, answer, gathered
from wearlab.report.conditions import conditions
from wearlab.scene import parts_left_out, parts_present
from wearlab.store import Store, StoreError, outcome, provenance
from wearlab.store.catalogue import Entry

MOST_LINES = 100
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?!\w)")


def model_errors(entries: Entries) -> tuple[tuple[str, int], ...]:
    """Return the known errors of the models of runs, each with its count."""
    told = (
        dict.fromkeys(str(e.summary.get("model_error") or "").split("\n"))
        for e in entries.values()
    )
    return tuple(
        Counter(line for some in told for line in some if line).most_common(MOST_LINES)
    )


def remarks(entries: Entries) -> tuple[tuple[str, int], ...]:
    """Return assumed values and limits of validity that runs touch, warnings too, each with its count.

    Lines that differ in one number are one, with its range.
    """
    told = (
        (e, str(e.summary.get("validity") or "").split("\n")) for e in entries.values()
    )
    lines = gathered(
        (s, e.id) for e, some in told for s in dict.fromkeys([*some, *e.warnings]) if s
    )
    counted: Counter[str] = Counter()
    for some in gathered((NUMBER.sub("#", line), line) for line in lines).values():
        numbers = zip(*(NUMBER.findall(line) for line in some), strict=True)
        if sum(len(set(same)) > 1 for same in numbers) == 1:
            counted[doubt.in_one(some, NUMBER)] = len(
                set().union(*(lines[line] for line in some))
            )
        else:
            counted.update({line: len(lines[line]) for line in some})
    return tuple(counted.most_common(MOST_LINES))


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
    return (
        f"data:image/png;base64,{base64.b64encode(image).decode('ascii')}"
        if image
        else ""
    )


def drawn(campaign: Campaign, store: Store) -> Iterator[Drawn]:
    """Yield each figure of a campaign, or why it cannot be drawn."""
    if not campaign.figures:
        return
    pictures = partial(drawing.both_widths, grid=store.open(campaign), store=store)
    for spec, images, problem in drawing.each_figure(campaign, pictures):
        image, small = images or (b"", None)
        broad = (
            int.from_bytes(image[16:20], "big") > 1000
        )  # pixels: panels that take a whole row
        yield Drawn(
            str(getattr(spec, "title", None) or spec.kind),
            _uri(image),
            problem,
            broad,
            _uri(small),
        )


MOST_ROWS = 2000  # of a table: beyond, a page is no place to read them
Told = dict[str, Any]
Comparisons = dict[tuple[str, str, str], outcome.Comparison]
PROVENANCE = ("commit", "dirty", "packages", "machine", "model_version")


def content(campaign: Campaign, store: Store) -> dict[str, Any]:
    """Return what there is to tell of a campaign, by the names in `page.html`.

    Raises
    ------
    StoreError : there is no store
    """
    entries = store.archive.entries(case.id for case in campaign.cases)
    compared = _comparisons(campaign, store)
    rows = [
        _row(campaign, case, entries.get(case.id), store, compared)
        for case in campaign.cases
    ]
    states = Counter(
        {
            case.id: row["state"]
            for case, row in zip(campaign.cases, rows, strict=True)
        }.values()
    )
    text = inheritance.source_text(campaign.path)
    report = getattr(campaign, "report", None) or ReportSpec()
    runs = {"runs": len({case.id for case in campaign.cases}), **states}
    about: Told = {
        "title": campaign.title,
        "reference": campaign.reference or "",
        "report": report,
    }
    about |= {
        "file": campaign.path.name if campaign.path else "",
        "dates": _dates(entries),
        "counts": runs,
    }
    about |= {"metadata": getattr(campaign, "metadata", {}) or {}, "text": text}
    asked: Told = {
        "axes": tuple((a.name, _values(a.values, a.units)) for a in campaign.axes)
    }
    asked |= {"parts": tuple(_parts(campaign)), "conditions": conditions(campaign)}
    asked["gears"] = _gears(campaign) if "gears" in report.sections else ()
    shown = tuple(rows[:MOST_ROWS])
    found: Told = {
        "rows": shown,
        "extremes": [row for row in shown if row["comparison"]],
    }
    found |= {
        "left_out": max(0, len(rows) - MOST_ROWS),
        "figures": tuple(drawn(campaign, store)),
    }
    found["answer"] = answer(campaign, entries, report.wear_coefficient_factor, store)
    found["failures"] = tuple(_failures(campaign, rows, entries))[:100]
    limits = {"remarks": remarks(entries), "model_errors": model_errors(entries)}
    made: Told = {
        "seconds": outcome.seconds_text(sum(e.seconds or 0.0 for e in entries.values()))
    }
    made |= {
        "code": tuple(_code(store, entries)),
        "lineage": tuple(_lineage(campaign, store, entries)),
    }
    made["hash"] = inheritance.fingerprint(text)
    return about | asked | found | limits | made | _measured(campaign, store)


def _measured(campaign: Campaign, store: Store) -> dict[str, Any]:
    """Return what the update of the campaign's measurements says, its answers, and the table of a fleet."""
    from wearlab.store import updates
    from wearlab.updating import inference, measurements, report_text

    found: dict[str, Any] = dict.fromkeys(("measured", "updated", "fleet", "about"), ())
    if campaign.update is None:
        return found
    try:
        own = updates.updates_of(store, inference.subject_of(campaign))
    except measurements.UpdateError as error:
        return found | {"measured": (f"! {error}",)}
    if not own or (tree := updates.read_update(store, own[0].id)) is None:
        said = (
            "! no update of these measurements as they stand is kept: wearlab update "
            "FILE makes it"
        )
        return found | {"measured": (said,)}
    text = report_text.text_of(tree)[1:]
    found["measured"] = (*text, "", *report_text.BELIEVED)
    if not (tables := report_text.fleet_tables(tree)):
        return found | {"updated": report_text.answers(tree)}
    leads = [
        *(f"! {line}" for line in report_text.alerts(text)),
        *report_text.units_to_open(tree),
    ]
    return found | {
        "updated": leads,
        "fleet": tables,
        "about": report_text.fleet_about(tree),
    }


def _values(values: Sequence[Any], units: str | None) -> str:
    shown = [outcome.value_text(value, None) for value in values]
    if len(shown) > 12:
        shown = [*shown[:5], "…", *shown[-2:], f"({len(values)} values)"]
    return f"{', '.join(shown)} {units or ''}".rstrip()


def _comparisons(campaign: Campaign, store: Store) -> Comparisons:
    """Return how cases compare with what is expected of them, by run, label and place."""
    return {
        (
            member.run,
            member.label,
            json.dumps(member.position, sort_keys=True),
        ): member.comparison
        for member in reversed(store.archive.catalogue.members())  # the latest counts
        if member.comparison is not None and member.campaign == campaign.title
    }


def _row(
    campaign: Campaign,
    case: Case,
    entry: Entry | None,
    store: Store,
    compared: Comparisons,
) -> Told:
    """Return one case in the table of results.

    Everything in words, but for the comparison.
    """
    where = outcome.place(campaign, case)
    summary = entry.summary if entry else {}
    told = outcome.headlines(summary)
    return dict(
        case=case.label,
        places=tuple(where.get(axis.name, "all") for axis in campaign.axes),
        state="missing" if entry is None else store.archive.state_of(entry),
        verdict=str(summary.get("verdict") or ""),
        result=", ".join(text.text for text in told),
        error=", ".join(
            f"{100 * t.error:.2g} % of the {t.of}" for t in told if t.error is not None
        ),
        seconds=outcome.seconds_text(entry.seconds if entry else None),
        run=case.id,
        note=f"{len(entry.warnings)} warnings" if entry and entry.warnings else "",
        comparison=compared.get(
            (case.id, case.label, json.dumps(where, sort_keys=True))
        ),
    )


def _dates(entries: Entries) -> str:
    days = sorted(e.started[:10] for e in entries.values() if e.started)
    return (
        ""
        if not days
        else days[0]
        if days[0] == days[-1]
        else f"{days[0]} to {days[-1]}"
    )


def _parts(
    campaign: Campaign,
) -> Iterator[tuple[str, tuple[str, ...], tuple[str, ...]]]:
    """Yield the parts present and left out, of the first case of each label.

    Equal ones together.
    """
    scenes = {case.label: case.scene for case in reversed(campaign.cases)}
    labels = dict.fromkeys(case.label for case in campaign.cases)
    told = {
        n: (tuple(parts_present(scenes[n])), tuple(parts_left_out(scenes[n])))
        for n in labels
    }
    for (present, absent), names in gathered(
        (own, label) for label, own in told.items()
    ).items():
        yield ", ".join(names), present, absent


def _gears(campaign: Campaign) -> tuple[dict[str, Any], ...]:
    """Return the sheet of each gear set that can be built, and the cases that have it, "" for all."""
    sheets: dict[str, Sheet] = {}
    names: dict[str, dict[str, None]] = {}
    for case in campaign.cases:
        key = case.scene.gears.model_dump_json()
        if key not in names and len(sheets) < 4:
            with suppress(ValueError):
                sheets[key] = sheet(case.scene)
        names.setdefault(key, {})[case.label] = None
    told = {key: ", ".join(names[key]) if len(sheets) > 1 else "" for key in sheets}
    return tuple({"cases": told[key], "sheet": made} for key, made in sheets.items())


def _failures(
    campaign: Campaign, rows: Sequence[Told], entries: Entries
) -> Iterator[Told]:
    told: set[str] = set()
    for case, row in zip(campaign.cases, rows, strict=True):
        if row["state"] != "done" and case.id not in told:
            told.add(case.id)
            reason = (entries[case.id].reason if case.id in entries else None) or ""
            words = {"headline": outcome.last_line(reason), "reason": reason.strip()}
            yield {
                "case": _name(campaign, case),
                "run": case.id,
                "state": row["state"],
                **words,
            }


def _name(campaign: Campaign, case: Case) -> str:
    return ", ".join([case.label, *outcome.place(campaign, case).values()])


def _lineage(
    campaign: Campaign, store: Store, entries: Entries
) -> list[tuple[str, tuple[str, ...]]]:
    """Return the cases that rest on other runs, and which runs those are.

    Equal ones together.
    """

    def steps(entry: Entry) -> Iterator[str]:
        yield from map(str, provenance.lineage(store, entry))
        if entry.calibration:
            yield f"run {entry.calibration}, which calibrated it"

    known = ((case, entries[case.id]) for case in campaign.cases if case.id in entries)
    told = gathered(
        (tuple(steps(entry)), _name(campaign, case)) for case, entry in known
    )
    return [
        ("; ".join(names), rests_on) for rests_on, names in told.items() if rests_on
    ]


def _code(store: Store, entries: Entries) -> Iterator[dict[str, str]]:
    """Yield each code that made runs: its version and hash, and what one of its files tells of the rest."""
    done = (entry for entry in entries.values() if entry.state == "done")
    made = gathered(
        ((entry.wearlab_version or "", entry.source_hash or ""), entry.id)
        for entry in done
    )
    for (version, source), ids in made.items():
        told = {"wearlab": version, "source hash": source, "runs": str(len(ids))}
        with suppress(StoreError):
            attributes = store.run(ids[0]).attrs
            words = {"dirty": "uncommitted edits", "model_version": "model version"}
            told |= {
                words.get(n, n): str(attributes[n])
                for n in PROVENANCE
                if n in attributes
            }
        yield told


FOLDER = Path(__file__).parent
SUFFIXES = (".html", ".htm", ".pdf")


class ReportError(ValueError):
    """A page that cannot be written as asked for; the message says what can."""


def check_suffix(path: Path) -> None:
    """Refuse a file that no page is written to.

    Raises
    ------
    ReportError : its suffix is none of `SUFFIXES`, or nothing here writes it
    """
    if path.suffix.lower() not in SUFFIXES:
        given = path.suffix or "a file without"
        raise ReportError(
            f"{path}: a report is written as .html or .pdf, not as {given}"
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
    return (
        page.encode()
        if suffix.lower() != ".pdf"
        else bytes(_printer()(string=page).write_pdf())
    )


def _printer() -> Any:
    """Return WeasyPrint's `HTML`."""
    try:
        from weasyprint import HTML
    except (ImportError, OSError) as error:  # OSError: Pango is not there
        raise ReportError(
            f"a PDF needs WeasyPrint ({str(error).splitlines()[0]}): pip install "
            "'wearlab[pdf]'; or name the "
            "file .html and print it from a browser"
        ) from None
    return HTML


def report(campaign: Campaign, store: Store) -> str:
    """Return the page of a campaign, every text in it escaped: equal stores give equal pages.

    Parameters
    ----------
    campaign : its cases and figures
    store : where the runs are; nothing is computed

    Raises
    ------
    StoreError : there is no store
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    strict: Any = {
        "undefined": StrictUndefined,
        "trim_blocks": True,
        "lstrip_blocks": True,
    }
    environment = Environment(
        loader=FileSystemLoader(FOLDER), autoescape=True, **strict
    )
    style = (FOLDER / "page.css").read_text(encoding="utf-8")
    return environment.get_template("page.html").render(
        told=content(campaign, store), style=style
    )
