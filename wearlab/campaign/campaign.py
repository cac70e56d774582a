"""A campaign: cases and axes, figures and report.

As a table for notebooks and as plain data.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from annotated_types import Ge

from wearlab.campaign import update_options
from wearlab.campaign.axes import Axis, Coordinate
from wearlab.campaign.case import Case, Excluded
from wearlab.campaign.claims import ClaimSpec, spelled_note
from wearlab.options import ClosedTable, Count, Number, option
from wearlab.plugins import Plugin
from wearlab.tables import TableError
from wearlab.tables.points import Points, read_flank_points, read_points

MAX_SHOWN_CASES = 30
MAX_RECORDED_CASES = 5_000
MAX_RECORDED_POINTS = 200_000
"""Signs of a table of points that a store keeps."""
FORMAT = 1
"""Of the record of a campaign."""
DECADE = 10.0**0.5


def campaign_html(title: str, sweeps: Sequence[Axis], cases: Sequence[Case]) -> str:
    """Return a table of the cases: label, place on the axes and identity.

    Parameters
    ----------
    title : line above the table, in angle brackets
    sweeps : axes of the campaign
    cases : of the campaign
    """
    axes = {axis.name: axis for axis in sweeps}
    axis_headings = [
        f"{axis.name} [{axis.units}]" if axis.units else axis.name
        for axis in axes.values()
    ]
    headings = ["case", *axis_headings, "id"]
    rows = []
    for case in cases[:MAX_SHOWN_CASES]:
        places = (
            axis.values[case.position[name]] if name in case.position else ""
            for name, axis in axes.items()
        )
        rows.append([case.label, *places, case.id[:10]])

    head = "".join(f"<th>{escape(heading)}</th>" for heading in headings)
    body = "".join(_html_row(row) for row in rows)
    remark = ""
    if len(cases) > MAX_SHOWN_CASES:
        remark = f"<p>{MAX_SHOWN_CASES} of {len(cases)} cases</p>"
    return (
        f"<p><b>{escape(title[1:-1])}</b></p><table><tr>{head}</tr>{body}</table>"
        f"{remark}"
    )


def _html_row(cells: Sequence[Any]) -> str:
    """Return one row of a table."""
    columns = "".join(f"<td>{escape(str(cell))}</td>" for cell in cells)
    return f"<tr>{columns}</tr>"


Names = str | tuple[str, ...]


class MeasuredFlankSpec(ClosedTable):
    """A measured flank, described as in ``wear.initial``."""

    file: Path
    """table with columns as of wear.initial, or a measuring machine's .mka"""
    flank: str | None = None
    """flank that was measured [the only one of the figure]"""
    side: Literal["left", "right"] | None = None
    """of a measuring machine's file: which side of the teeth [required there]"""
    teeth: Literal["mean"] | Count = "mean"
    """of a measuring machine's file: the mean of all teeth, or the number of one"""
    x: str | None = None
    """column that says where on the flank [the one the file has]"""
    y: Literal["depth", "deviation"] | None = None
    """column that says how much [the one the file has]"""
    units: dict[str, str] = option({})
    """units of the columns [those in the file's headers]"""
    columns: dict[str, str] = option({})
    """headers of the file where they are others [by their names]"""
    zero: Literal["as-measured", "max", "pitch", "tip", "root", "line"] = "as-measured"
    """what counts as unworn"""
    direction: Literal["normal"] = "normal"
    """direction of the values: along the flank normal"""
    continuation: Literal["refuse", "hold", "slope", "zero"] = "refuse"
    """of no effect: points are drawn where they were measured"""

    def read(self, folder: Path, sheet: str | None, decimal: str | None) -> Points:
        """Return the points of the flank.

        Parameters
        ----------
        folder : that a relative path starts from
        sheet, decimal : of the table [found out]

        Raises
        ------
        TableError : the file cannot be read so
        """
        options = {"file": str(folder / self.file), "sheet": sheet, "decimal": decimal}
        keys = {"side", "teeth", "x", "y", "units", "columns"}
        options |= self.model_dump(include=keys)
        stated = {
            key: value for key, value in options.items() if value not in (None, {})
        }
        return read_flank_points(stated, self.flank, self.zero)


class FigureSpec(ClosedTable):
    """One figure of a campaign."""

    kind: str
    """kind of figure, listed by `wearlab schema --figures`"""
    select: dict[str, Any] = option({})
    """dimension = label, or a list of labels [the kind's]"""
    x: str | None = None
    """dimension or coordinate along x [the kind's]"""
    y: Names | None = None
    """variable along y, or a list of them [the kind's]"""
    hue: str | None = None
    """dimension told apart by colour [the kind's]"""
    rows: str | None = None
    """dimension told apart by rows of panels [the kind's]"""
    cols: str | None = None
    """dimension told apart by columns of panels [the kind's]"""
    units: str | dict[str, str] | None = None
    """unit of y as a text, or a table of variable = unit [each variable's display
    unit]"""
    y_as: Literal["logarithm", "difference"] | None = None
    """y on a logarithmic axis, or less the first curve of its panel [its value]"""
    title: str | None = None
    """title of the figure [the kind's]"""
    note: str | None = None
    """one line under the figure: departures from a paper, and why; {formula:.2f unit}
    or {claim} in it is a number of the stored runs"""
    published: Path | MeasuredFlankSpec | None = None
    """table of points from a paper: columns x, y, hue and their units; without y places
    along x are marked; of a wear-map a measured flank: columns as of wear.initial,
    face_position and depth among them; of a wear-profile { file, flank, side, teeth, x,
    y, units, columns, zero }: a measured flank"""
    sheet: str | None = None
    """sheet of published, where that is a workbook [the only one that holds a table]"""
    decimal: Literal[".", ","] | None = None
    """decimal sign of published [found out; refused where it has two meanings]"""


Part = Literal[
    "answer",
    "gears",
    "figures",
    "asked",
    "results",
    "expected",
    "failures",
    "assumptions",
    "provenance",
]
PARTS: tuple[Part, ...] = (
    "answer",
    "gears",
    "figures",
    "assumptions",
    "asked",
    "results",
    "expected",
    "failures",
    "provenance",
)


class ReportSpec(ClosedTable):
    """What the page of a campaign tells."""

    lead: str | None = None
    """what the reader should know first, in a sentence or two"""
    sections: tuple[Part, ...] = PARTS
    """what is told, in this order; what a campaign does not have is left out [all]"""
    wear_coefficient_factor: Annotated[Number, Ge(1)] = DECADE
    """the wear coefficient may be so many times as large or as small: the range of the
    answer [a decade in all, √10 either way]"""


class Metadata(ClosedTable):
    """Who made it; no part of any run's identity."""

    author: str | tuple[str, ...] | None = None
    """author, or a list of authors [not told]"""
    orcid: str | None = None
    """ORCID of the author [not told]"""
    email: str | None = None
    """where the author is reached [not told]"""
    institution: str | None = None
    """institution [not told]"""
    licence: str | None = None
    """licence of the datasets [not told]"""
    publisher: str | None = None
    """who hands the datasets on [not told]"""
    project: str | None = None
    """project that they belong to [not told]"""
    acknowledgement: str | None = None
    """whom to thank [not told]"""


@dataclass(frozen=True)
class Campaign:
    """What a campaign file asks for.

    Parameters
    ----------
    title, reference, metadata : texts, not part of any run
    cases : every run; equal scenes share an id
    excluded : cases that a condition of the file keeps from being run
    axes : sweep axes, the dimensions of the grid
    figures : what is to be drawn
    path : the file
    plugins : the sources of a user's own variants
    update : what was measured and what is unknown, None when the file does not say
    report : what its page tells
    warnings : what the file does that it hardly means
    claims : what it says of its runs
    readings : two tables of what its sources print
    written : quantities of its scenes as its file wrote them, by key
    """

    title: str
    reference: str | None
    metadata: dict[str, str]
    cases: tuple[Case, ...]
    axes: tuple[Axis, ...] = ()
    figures: tuple[FigureSpec, ...] = field(default=(), repr=False)
    path: Path | None = None
    excluded: tuple[Excluded, ...] = field(default=(), repr=False)
    plugins: tuple[Plugin, ...] = field(default=(), repr=False)
    update: update_options.UpdateSpec | None = field(default=None, repr=False)
    report: ReportSpec = field(default=ReportSpec(), repr=False)
    warnings: tuple[str, ...] = field(default=(), repr=False)
    claims: tuple[ClaimSpec, ...] = field(default=(), repr=False)
    readings: tuple[Path, ...] = field(default=(), repr=False)
    written: Mapping[str, tuple[str, ...]] = field(default_factory=dict, repr=False)

    def __repr__(self) -> str:
        axes = ", ".join(f"{axis.name} {len(axis.values)}" for axis in self.axes)
        grid = f" ({axes})" if axes else ""
        return f"<Campaign {self.title!r}: {len(self.cases)} cases{grid}>"

    def _repr_html_(self) -> str:
        return campaign_html(repr(self), self.axes, self.cases)


class RecordedCase(NamedTuple):
    """A run of a recorded campaign: its label, identity and place."""

    label: str
    id: str
    position: dict[str, int]


@dataclass(frozen=True)
class RecordedCampaign:
    """What `Store.open` asks of a campaign."""

    title: str
    reference: str | None
    cases: tuple[RecordedCase, ...]
    axes: tuple[Axis, ...] = ()
    figures: tuple[Any, ...] = ()
    path: Path | None = None


def to_record(campaign: Campaign) -> dict[str, Any]:
    """Return a campaign as JSON can hold it.

    Parameters
    ----------
    campaign : its title, reference, axes and cases
    """
    axes = [
        {
            "name": axis.name,
            "values": axis.values,
            "units": axis.units,
            "key": axis.key,
            "beside": axis.coordinates,
        }
        for axis in campaign.axes
    ]
    cases = []
    for case in campaign.cases:
        places = [case.position.get(axis.name) for axis in campaign.axes]
        cases.append([case.id, case.label, places])
    return {
        "format": FORMAT,
        "title": campaign.title,
        "reference": campaign.reference,
        "axes": axes,
        "cases": cases,
    }


def with_figures(campaign: Campaign) -> dict[str, Any] | None:
    """Return a campaign and its figures as JSON can hold it.

    With each figure stands the text of its published points, so that it is drawn
    alike where their file is not. The record is None of a campaign with too many cases.

    Parameters
    ----------
    campaign : to be recorded
    """
    if len(campaign.cases) > MAX_RECORDED_CASES:
        return None
    claims = getattr(campaign, "claims", ())
    written = getattr(campaign, "written", {})
    record = to_record(campaign)
    folder = campaign.path.parent if campaign.path else Path()
    record["figures"] = [
        _figure_record(spec, claims, folder) for spec in campaign.figures
    ]
    record["written"] = {key: list(texts) for key, texts in written.items()}
    return record


def _figure_record(
    spec: FigureSpec, claims: Sequence[ClaimSpec], folder: Path
) -> dict[str, Any]:
    """Return what a figure sets, its note spelled out, and its published points."""
    options = {
        key: getattr(spec, key, None)
        for key in FigureSpec.model_fields
        if key != "published"
    }
    note = options["note"]
    options["note"] = spelled_note(note, claims) if note else None
    options["points"] = _points_record(spec, folder)
    return {
        key: value for key, value in options.items() if value not in (None, {}, (), "")
    }


def _points_record(spec: FigureSpec, folder: Path) -> list[str]:
    """Return name and text of a figure's points; the name alone of what is not kept.

    That is a table which is too long, or cannot be read.
    """
    published = getattr(spec, "published", None)
    if published is None:
        return []
    is_flank = isinstance(published, MeasuredFlankSpec)
    name = Path(published.file if is_flank else published).name
    try:
        points = (
            published.read(folder, spec.sheet, spec.decimal)
            if is_flank
            else read_points(folder / published, spec.sheet)
        )
    except (TableError, OSError):
        return [name]
    return points.record() if len(points.text) <= MAX_RECORDED_POINTS else [name]


def from_record(record: Mapping[str, Any]) -> RecordedCampaign:
    """Return the campaign of a record.

    Parameters
    ----------
    record : as `to_record` returns it

    Raises
    ------
    ValueError : it is no record, or one of a newer wearlab
    """
    try:
        if record["format"] != FORMAT:
            raise ValueError(
                f"record of format {record['format']!r}, this wearlab reads {FORMAT}"
            )
        axes = tuple(_read_axis(axis) for axis in record["axes"])
        cases = tuple(_read_case(case, axes) for case in record["cases"])
        return RecordedCampaign(str(record["title"]), record["reference"], cases, axes)
    except (KeyError, TypeError, IndexError, AttributeError) as error:
        raise ValueError(f"not the record of a campaign ({error!r})") from None


def _read_axis(block: Mapping[str, Any]) -> Axis:
    """Return the axis of a record."""
    coordinates = {
        str(name): Coordinate(tuple(values), units, str(key))
        for name, (values, units, key) in block["beside"].items()
    }
    return Axis(
        str(block["name"]),
        tuple(block["values"]),
        block["units"],
        str(block["key"]),
        coordinates,
    )


def _read_case(block: list[Any], axes: tuple[Axis, ...]) -> RecordedCase:
    """Return the case of a record; its places are on the axes."""
    run_id, label, places = block
    position = {}
    for axis, place in zip(axes, places, strict=True):
        if place is None:
            continue
        position[axis.name] = int(place)
    for axis in axes:
        if not 0 <= position.get(axis.name, 0) < len(axis.values):
            raise IndexError(f"{axis.name} has no place {position[axis.name]}")
    return RecordedCase(str(label), str(run_id), position)
