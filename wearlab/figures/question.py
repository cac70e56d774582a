"""What a figure asks of which runs, written into its file and read back."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple
from xml.etree import ElementTree

from wearlab import nearest, schema
from wearlab.campaign import Campaign, claims, inheritance
from wearlab.campaign.campaign import RecordedCampaign, from_record, to_record
from wearlab.figures import kind, kinds, published
from wearlab.figures.plot import Paper
from wearlab.files import finite_json
from wearlab.store.catalogue import Entry
from wearlab.store.watching import each_told

QUESTION = "question"
KEYS = (
    "kind",
    "select",
    "x",
    "y",
    "hue",
    "rows",
    "cols",
    "units",
    "y_as",
    "title",
    "note",
    "decimal",
)
READING = (
    ValueError,
    KeyError,
    TypeError,
    AttributeError,
    OverflowError,
    RecursionError,
)
"""What reading a question raises that no wearlab wrote."""
LARGEST = 50_000_000  # bytes, and pixels
STARTS = (PNG := b"\x89PNG", PDF := b"%PDF", b"<?xml", b"<svg")


def figure_problems(campaign: Campaign) -> list[str]:
    """Return one line for each ``[[figure]]`` that no run could satisfy.

    Its kind, its names or its labels are wrong.

    Parameters
    ----------
    campaign : its figures, axes and cases
    """
    folder = campaign.path.parent if campaign.path else None
    problems = []
    for number, spec in enumerate(campaign.figures, 1):
        try:
            problems += list(_problems(campaign, spec, number, folder))
        except kind.FigureError as error:
            problems.append(str(error))
    axes = [name for axis in campaign.axes for name in (axis.name, *axis.coordinates)]
    names = [*schema.VARIABLES, *schema.DIMENSIONS, *axes]
    return [*problems, *claims.unknown_names(campaign, names)]


def numbered_figures(campaign: Campaign) -> Iterator[tuple[int, Any]]:
    """Yield the figures of a campaign with their numbers, and tell who watches.

    Parameters
    ----------
    campaign : with its figures
    """
    yield from enumerate(each_told(campaign.figures), 1)


def _problems(campaign: Campaign, spec: Any, number: int, folder: Any) -> Iterator[str]:
    """Yield what is wrong with one ``[[figure]]``, a line each."""
    request = kind.read(spec, number, folder)
    if request.kind not in kinds.KINDS:
        yield f"{request.name}: {kind.no_kind(request.kind)}"

    yield from _unknown_dimensions(campaign, request)
    for name in request.y:
        if name not in schema.VARIABLES and not kind.is_of_update(request.kind):
            yield (
                f"{request.name}: y = {name!r} is no variable; "
                f"{nearest.choices(name, schema.VARIABLES)}"
            )
    file = getattr(request.published, "file", request.published)
    if isinstance(file, Path) and not file.is_file():
        stated = getattr(spec.published, "file", spec.published)
        yield f"{request.name}: published file {stated} is not there"


def _unknown_dimensions(
    campaign: Campaign, request: kind.FigureRequest
) -> Iterator[str]:
    """Yield which names of ``select``, x and the roles are none of the campaign's."""
    swept = {axis.name: axis.key for axis in campaign.axes}
    coordinates = {name for axis in campaign.axes for name in axis.coordinates}
    dims = {*swept, *coordinates, "case", *schema.DIMENSIONS} - set(schema.VARIABLES)
    for key in request.select:
        if key not in dims and key not in schema.VARIABLES:
            yield (
                f"{request.name}: select.{key} is unknown; "
                f"{kind.no_axis(key, swept, dims)}"
            )

    last_words = {key.rpartition(".")[2] for key in swept.values()}
    keys = {*swept.values(), *last_words}
    for role in ("x", "hue", "rows", "cols"):
        name = getattr(request, role)
        if name is None or name in dims | keys or name in schema.VARIABLES:
            continue
        valid = dims | set(schema.VARIABLES) if role == "x" else dims
        yield (
            f"{request.name}: {role} = {name!r} is unknown; "
            f"{kind.no_axis(name, swept, valid)}"
        )


class Question(NamedTuple):
    """What a figure asks.

    Parameters
    ----------
    number : the figure's place in its campaign, from 1
    table : its ``[[figure]]`` block, ``published`` apart
    points : name and text of the CSV of published points
    campaign : the cases it is asked of, with their axes
    text, hash : the campaign file with all it extends, and its hash
    runs : id → hash of the file, of the runs that were drawn
    subject : of a figure of an update, the identity of what that is of
    paper : how it is to look
    """

    number: int
    table: Mapping[str, Any]
    points: kind.Points | None
    campaign: Campaign | RecordedCampaign
    text: str = ""
    hash: str = ""
    runs: Mapping[str, str] | None = None
    subject: str = ""
    paper: Paper = Paper()

    @property
    def request(self) -> kind.FigureRequest:
        """The figure's wishes."""
        return replace(
            kind.read(SimpleNamespace(**self.table), self.number, None),
            published=self.points,
        )

    @property
    def name(self) -> str:
        """The name of its file, without ending."""
        return f"{self.number:02d}-{self.table['kind']}"


def table_of(spec: Any) -> dict[str, Any]:
    """Return what a ``[[figure]]`` says, ``published`` apart, as JSON holds it.

    Parameters
    ----------
    spec : the campaign's figure
    """
    table = {}
    for key in KEYS:
        value = getattr(spec, key, None)
        is_set = value not in (None, {}, (), "")
        if is_set or (key == "title" and value == ""):
            table[key] = value
    return dict(json.loads(json.dumps(table)))


def question(campaign: Campaign, spec: Any, number: int) -> Question:
    """Return what one ``[[figure]]`` of a campaign asks.

    Parameters
    ----------
    campaign : that has the figure
    spec : the figure
    number : its place in the file, from 1

    Raises
    ------
    FigureError : its units or published points cannot be read, or the measurements that
        it shows
    """
    request = kind.read(spec, number, campaign.path.parent if campaign.path else None)
    table = table_of(spec)
    if "note" in table:
        campaign_claims = getattr(campaign, "claims", ())
        table["note"] = claims.spelled_note(table["note"], campaign_claims)

    points = None
    if request.published is not None:
        points = published.points_of(request.published, request)
    text = inheritance.source_text(campaign.path)
    return Question(
        number=number,
        table=table,
        points=points,
        campaign=campaign,
        text=text,
        hash=inheritance.fingerprint(text),
        subject=_subject_of(campaign, request),
    )


def _subject_of(campaign: Campaign, request: kind.FigureRequest) -> str:
    """Return the identity of what an update is of, "" for a figure of runs."""
    if not kind.is_of_update(request.kind):
        return ""
    from wearlab.updating import identity, measurements

    try:
        return identity.subject_of(campaign)
    except measurements.UpdateError as error:
        raise request.error(error) from None


def texts(
    figure_question: Question, entries: Mapping[str, Entry], missing: Sequence[str]
) -> dict[str, str]:
    """Return what a figure's file says about itself, text by keyword.

    Nothing that changes by itself.

    Parameters
    ----------
    figure_question : the question
    entries : the runs drawn
    missing : names of the runs that had no data
    """
    request = figure_question.request
    versions = {entry.wearlab_version or "" for entry in entries.values()}
    sources = {entry.source_hash or "" for entry in entries.values()}
    keywords = {
        "Title": request.title or kinds.KINDS[request.kind].title,
        "campaign": figure_question.campaign.title,
        "campaign_hash": figure_question.hash,
        "campaign_text": figure_question.text,
        "figure": request.kind,
        "table": _json(figure_question.table),
        "select": _json(dict(request.select)),
        "runs": " ".join(entries),
        "missing": "; ".join(missing),
        "wearlab": ", ".join(sorted(versions)),
        "source_hash": ", ".join(sorted(sources)),
        QUESTION: _json(_record_of(figure_question, entries)),
    }
    return {key: text for key, text in keywords.items() if text}


def _record_of(
    figure_question: Question, entries: Mapping[str, Entry]
) -> dict[str, Any]:
    """Return a question and the hashes of its runs' files, as JSON holds them."""
    record: dict[str, Any] = {
        "format": 1,
        "number": figure_question.number,
        "table": figure_question.table,
        "points": None
        if figure_question.points is None
        else figure_question.points.record(),
        "campaign": to_record(figure_question.campaign),  # type: ignore[arg-type]
        "runs": {run_id: entry.sha256 for run_id, entry in entries.items()},
    }
    if figure_question.subject:
        record["subject"] = figure_question.subject
    if not figure_question.paper.is_plain:
        record["paper"] = figure_question.paper.record()
    return record


def question_in(keywords: Mapping[str, str], file: Path) -> Question:
    """Return the question that a figure's file holds.

    Parameters
    ----------
    keywords : texts of the file
    file : for messages

    Raises
    ------
    FigureError : they hold none, or one that this wearlab cannot read
    """
    if QUESTION not in keywords:
        raise kind.FigureError(
            f"{file}: carries no question of wearlab: it was not drawn by 'wearlab "
            "figures'"
        )
    try:
        return _question_of(finite_json(keywords[QUESTION]), keywords)
    except READING as error:
        raise kind.FigureError(
            f"{file}: its question cannot be read ({error})"
        ) from None


def _question_of(record: Mapping[str, Any], keywords: Mapping[str, str]) -> Question:
    """Return the question that a record and the texts beside it hold."""
    if record["format"] != 1:
        raise ValueError(
            f"question of format {record['format']!r}, this wearlab reads 1"
        )
    options = dict(record["table"]).items()
    table = {key: value for key, value in options if key in KEYS}
    if table["kind"] not in kinds.KINDS:
        raise ValueError(f"no kind of figure: {table['kind']!r}")

    points = None
    if record["points"] is not None:
        points = kind.Points.recorded(record["points"])
    hashes = {str(run_id): str(sha256) for run_id, sha256 in record["runs"].items()}
    return Question(
        number=int(record["number"]),
        table=table,
        points=points,
        campaign=from_record(record["campaign"]),
        text=keywords.get("campaign_text", ""),
        hash=keywords.get("campaign_hash", ""),
        runs=hashes,
        subject=str(record.get("subject", "")),
        paper=Paper.recorded(record["paper"]) if "paper" in record else Paper(),
    )


def _json(value: Any) -> str:
    """Return a value as JSON, always in the same words."""
    return json.dumps(value, sort_keys=True, ensure_ascii=False, separators=(",", ":"))


def embedded(file: Path) -> dict[str, str]:
    """Return the texts of a figure's file, by keyword; none when it is not ours.

    Parameters
    ----------
    file : PNG, SVG or PDF

    Raises
    ------
    FigureError : it cannot be read, or is no PNG, SVG or PDF
    """
    try:
        data = _content_of(file)
    except OSError as error:
        raise kind.FigureError(
            f"{file}: cannot be read ({error.strerror or error})"
        ) from error
    if not data.lstrip().startswith(STARTS):
        raise kind.FigureError(f"{file}: is no PNG, SVG or PDF")
    try:
        return _texts(file, data)
    except (ValueError, SyntaxError, OSError, ElementTree.ParseError) as error:
        raise kind.FigureError(f"{file}: is damaged ({error})") from error


def _content_of(file: Path) -> bytes:
    """Return the bytes of a regular file that is no larger than a figure."""
    if file.exists() and not file.is_file():
        raise kind.FigureError(f"{file}: is no file")
    size = file.stat().st_size
    if size > LARGEST:
        raise kind.FigureError(f"{file}: {size} bytes are more than a figure has")
    return file.read_bytes()


def _texts(file: Path, data: bytes) -> dict[str, str]:
    """Return the texts that a PNG holds one by one, a PDF or SVG as JSON."""
    keywords: Any
    if data.lstrip().startswith(PNG):
        keywords = _texts_of_png(file)
    elif data.lstrip().startswith(PDF):
        keywords = finite_json(_subject_of_pdf(data) or "{}")
    else:
        description = ".//{http://purl.org/dc/elements/1.1/}description"
        text = ElementTree.fromstring(data).findtext(description)
        keywords = finite_json(text or "{}")
    if not isinstance(keywords, dict):
        return {}
    return {str(key): str(value) for key, value in keywords.items()}


def _texts_of_png(file: Path) -> Any:
    """Return the texts of a PNG that has no more pixels than a figure."""
    from PIL import Image

    with Image.open(file, formats=["PNG"]) as image:
        if image.width * image.height > LARGEST:
            raise kind.FigureError(
                f"{file}: {image.width} by {image.height} pixels are more than a "
                "figure has"
            )
        image.load()
        return image.text  # type: ignore[attr-defined]


def _subject_of_pdf(data: bytes) -> str:
    """Return the subject of a PDF, its escaped signs as they were."""
    subject = re.search(rb"/Subject \(((?:[^\\()]|\\.)*)\)", data, re.DOTALL)
    escaped = subject[1] if subject else b""
    signs = {b"n": b"\n", b"r": b"\r"}
    plain = re.sub(rb"(?s)\\(.)", lambda sign: signs.get(sign[1], sign[1]), escaped)
    return plain.decode("ascii")
