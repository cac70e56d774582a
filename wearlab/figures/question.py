"""A figure as a question: what was asked of which runs, written into its file and read back."""

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
from wearlab.store.catalogue import Entry


def figure_problems(campaign: Campaign) -> list[str]:
    """Return one line for each ``[[figure]]`` that no run could satisfy: its kind, names or labels are wrong.

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
    known = [*schema.VARIABLES, *schema.DIMENSIONS, *axes]
    return [*problems, *claims.unknown_names(campaign, known)]


def _problems(campaign: Campaign, spec: Any, number: int, folder: Any) -> Iterator[str]:
    request = kind.read(spec, number, folder)
    if request.kind not in kinds.KINDS:
        yield f"{request.name}: {kind.no_kind(request.kind)}"
    swept = {axis.name: axis.key for axis in campaign.axes}
    beside = {name for axis in campaign.axes for name in axis.coordinates}
    keys = {
        word
        for axis in campaign.axes
        for word in (axis.key, axis.key.rpartition(".")[2])
    }
    names = {*swept, *beside, "case", *schema.DIMENSIONS, *schema.VARIABLES}
    along = names - set(schema.VARIABLES)
    for key in request.select:
        if key not in names:
            yield (
                f"{request.name}: select.{key} is unknown; "
                f"{kind.no_axis(key, swept, along)}"
            )
    for role in ("x", "hue", "rows", "cols"):
        name = getattr(request, role)
        if name is not None and name not in names | keys:
            valid = names if role == "x" else along
            yield (
                f"{request.name}: {role} = {name!r} is unknown; "
                f"{kind.no_axis(name, swept, valid)}"
            )
    for name in request.y:
        if name not in schema.VARIABLES and not kind.is_of_update(request.kind):
            yield (
                f"{request.name}: y = {name!r} is no variable; "
                f"{nearest.choices(name, schema.VARIABLES)}"
            )
    if isinstance(request.published, Path) and not request.published.is_file():
        yield f"{request.name}: published file {spec.published} is not there"


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
    """

    number: int
    table: Mapping[str, Any]
    points: kind.Points | None
    campaign: Campaign | RecordedCampaign
    text: str = ""
    hash: str = ""
    runs: Mapping[str, str] | None = None
    subject: str = ""

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
    """Return what a ``[[figure]]`` says, ``published`` apart, as JSON holds it."""
    given = {key: getattr(spec, key, None) for key in KEYS}
    told = {
        k: v
        for k, v in given.items()
        if v not in (None, {}, (), "") or (k, v) == ("title", "")
    }
    return dict(json.loads(json.dumps(told)))


def question(campaign: Campaign, spec: Any, number: int) -> Question:
    """Return what one ``[[figure]]`` of a campaign asks.

    Raises
    ------
    FigureError : its units or published points cannot be read, or the measurements that
        it shows
    """
    request = kind.read(spec, number, campaign.path.parent if campaign.path else None)
    table = table_of(spec)
    if "note" in table:
        table["note"] = claims.spelled_note(
            table["note"], getattr(campaign, "claims", ())
        )
    points = (
        None
        if request.published is None
        else published.points_of(request.published, request)
    )
    text = inheritance.source_text(campaign.path)
    subject = ""
    if kind.is_of_update(request.kind):
        from wearlab.updating import inference, measurements

        try:
            subject = inference.subject_of(campaign)
        except measurements.UpdateError as error:
            raise request.error(error) from None
    return Question(
        number,
        table,
        points,
        campaign,
        text,
        inheritance.fingerprint(text),
        subject=subject,
    )


def texts(
    asked: Question, entries: Mapping[str, Entry], missing: Sequence[str]
) -> dict[str, str]:
    """Return what a figure's file says about itself, text by keyword.

    Nothing that changes by itself.

    Parameters
    ----------
    asked : the question
    entries : the runs drawn
    missing : names of the runs that had no data
    """
    request = asked.request
    runs = entries.values()
    written: dict[str, Any] = {
        "format": 1,
        "number": asked.number,
        "table": asked.table,
    }
    written["points"] = None if asked.points is None else list(asked.points)
    written["campaign"] = to_record(asked.campaign)  # type: ignore[arg-type]
    written["runs"] = {run_id: entry.sha256 for run_id, entry in entries.items()}
    written |= {"subject": asked.subject} if asked.subject else {}
    told = {
        "Title": request.title or kinds.KINDS[request.kind].title,
        **{
            "campaign": asked.campaign.title,
            "campaign_hash": asked.hash,
            "campaign_text": asked.text,
        },
        **{
            "figure": request.kind,
            "table": _json(asked.table),
            "select": _json(dict(request.select)),
        },
        **{"runs": " ".join(entries), "missing": "; ".join(missing)},
        "wearlab": ", ".join(sorted({entry.wearlab_version or "" for entry in runs})),
        "source_hash": ", ".join(sorted({entry.source_hash or "" for entry in runs})),
        QUESTION: _json(written),
    }
    return {key: text for key, text in told.items() if text}


def asked_by(told: Mapping[str, str], file: Path) -> Question:
    """Return the question that a figure's texts hold.

    Raises
    ------
    FigureError : they hold none, or one that this wearlab cannot read
    """
    if QUESTION not in told:
        said = "carries no question of wearlab: it was not drawn by 'wearlab figures'"
        raise kind.FigureError(f"{file}: {said}")
    try:
        written = json.loads(told[QUESTION])
        if written["format"] != 1:
            raise ValueError(
                f"question of format {written['format']!r}, this wearlab reads 1"
            )
        table = {
            key: value for key, value in dict(written["table"]).items() if key in KEYS
        }
        if table["kind"] not in kinds.KINDS:
            raise ValueError(f"no kind of figure: {table['kind']!r}")
        points = (
            None
            if written["points"] is None
            else kind.Points(*map(str, written["points"]))
        )
        source = from_record(written["campaign"])
        about = str(written.get("subject", ""))
        text = told.get("campaign_text", "")
        fingerprint = told.get("campaign_hash", "")
        runs = {str(run_id): str(sha256) for run_id, sha256 in written["runs"].items()}
        return Question(
            int(written["number"]),
            table,
            points,
            source,
            text,
            fingerprint,
            runs,
            about,
        )
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise kind.FigureError(
            f"{file}: its question cannot be read ({error})"
        ) from None


def _json(value: Any) -> str:
    return json.dumps(value, sort_keys=True, ensure_ascii=False, separators=(",", ":"))


LARGEST = 50_000_000  # bytes, and pixels
STARTS = (PNG := b"\x89PNG", PDF := b"%PDF", b"<?xml", b"<svg")


def embedded(file: Path) -> dict[str, str]:
    """Return the texts of a figure's file, by keyword; none when it is not ours.

    Raises
    ------
    FigureError : it cannot be read, or is no PNG, SVG or PDF
    """
    try:
        if file.exists() and not file.is_file():
            raise kind.FigureError(f"{file}: is no file")
        if file.stat().st_size > LARGEST:
            raise kind.FigureError(
                f"{file}: {file.stat().st_size} bytes are more than a figure has"
            )
        data = file.read_bytes()
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


def _texts(file: Path, data: bytes) -> dict[str, str]:
    """Return the texts that a PNG holds one by one, a PDF or SVG as JSON."""
    from PIL import Image

    if data.lstrip().startswith(PNG):
        with Image.open(file, formats=["PNG"]) as image:
            if image.width * image.height > LARGEST:
                size = (
                    f"{image.width} by {image.height} pixels are more than a figure has"
                )
                raise kind.FigureError(f"{file}: {size}")
            image.load()
            texts: Any = image.text  # type: ignore[attr-defined]
    else:
        if not data.lstrip().startswith(PDF):
            text = ElementTree.fromstring(data).findtext(
                ".//{http://purl.org/dc/elements/1.1/}description"
            )
        else:
            subject = re.search(rb"/Subject \(((?:[^\\()]|\\.)*)\)", data, re.DOTALL)
            escaped = subject[1] if subject else b""
            signs = {b"n": b"\n", b"r": b"\r"}
            text = re.sub(
                rb"(?s)\\(.)", lambda s: signs.get(s[1], s[1]), escaped
            ).decode("ascii")
        texts = json.loads(text or "{}")
    return (
        {str(key): str(value) for key, value in texts.items()}
        if isinstance(texts, dict)
        else {}
    )
