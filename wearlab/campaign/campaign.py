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
from wearlab.options import ClosedTable, Number, option
from wearlab.plugins import Plugin

MOST_CASES = 30


def campaign_html(title: str, sweeps: Sequence[Axis], cases: Sequence[Case]) -> str:
    """Return title, and for every case its label, its place on the axes and its identity."""
    axes = {axis.name: axis for axis in sweeps}
    heads = [
        "case",
        *(
            f"{name} [{axis.units}]" if axis.units else name
            for name, axis in axes.items()
        ),
        "id",
    ]
    rows = []
    for case in cases[:MOST_CASES]:
        places = (
            axes[n].values[case.position[n]] if n in case.position else "" for n in axes
        )
        rows.append([case.label, *places, case.id[:10]])
    head = "".join(f"<th>{escape(heading)}</th>" for heading in heads)
    body = "".join(
        f"<tr>{''.join(f'<td>{escape(str(x))}</td>' for x in row)}</tr>" for row in rows
    )
    more = (
        f"<p>{MOST_CASES} of {len(cases)} cases</p>" if len(cases) > MOST_CASES else ""
    )
    return (
        f"<p><b>{escape(title[1:-1])}</b></p><table><tr>{head}</tr>{body}</table>{more}"
    )


Names = str | tuple[str, ...]


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
    published: Path | None = None
    """CSV of points from a paper: columns x, y, hue and their units; without y places
    along x are marked; of a wear-map a measured flank: columns as of wear.initial,
    face_position and depth among them"""


DECADE = 10.0**0.5
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
    *(
        "answer",
        "gears",
        "figures",
        "assumptions",
        "asked",
        "results",
        "expected",
        "failures",
        "provenance",
    ),
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
    written: Mapping[str, tuple[str, ...]] = field(default_factory=dict, repr=False)

    def __repr__(self) -> str:
        axes = ", ".join(f"{axis.name} {len(axis.values)}" for axis in self.axes)
        return (
            f"<Campaign {self.title!r}: {len(self.cases)} "
            f"cases{f' ({axes})' if axes else ''}>"
        )

    def _repr_html_(self) -> str:
        return campaign_html(repr(self), self.axes, self.cases)


FORMAT = 1


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
    """Return a campaign as JSON can hold it."""
    names = [axis.name for axis in campaign.axes]
    return {
        "format": FORMAT,
        "title": campaign.title,
        "reference": campaign.reference,
        "axes": [
            {
                **{n: getattr(axis, n) for n in ("name", "values", "units", "key")},
                "beside": axis.coordinates,
            }
            for axis in campaign.axes
        ],
        "cases": [
            [case.id, case.label, [case.position.get(n) for n in names]]
            for case in campaign.cases
        ],
    }


MOST_RECORDED = 5_000  # cases


def with_figures(campaign: Campaign) -> dict[str, Any] | None:
    """Return a campaign and its figures as JSON can hold it, None of one with too many cases.

    Points of papers are files of their own, and left out.
    """
    if len(campaign.cases) > MOST_RECORDED:
        return None
    claimed = getattr(campaign, "claims", ())
    figures = []
    for spec in campaign.figures:
        given = {
            key: getattr(spec, key, None)
            for key in FigureSpec.model_fields
            if key != "published"
        }
        note = given["note"]
        given["note"] = spelled_note(note, claimed) if note else None
        figures.append(
            {
                key: value
                for key, value in given.items()
                if value not in (None, {}, (), "")
            }
        )
    written = {
        key: list(texts) for key, texts in getattr(campaign, "written", {}).items()
    }
    return {**to_record(campaign), "figures": figures, "written": written}


def from_record(record: Mapping[str, Any]) -> RecordedCampaign:
    """Return the campaign of a record.

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
    beside = {
        str(n): Coordinate(tuple(v), units, str(key))
        for n, (v, units, key) in block["beside"].items()
    }
    return Axis(
        str(block["name"]),
        tuple(block["values"]),
        block["units"],
        str(block["key"]),
        beside,
    )


def _read_case(block: list[Any], axes: tuple[Axis, ...]) -> RecordedCase:
    run_id, label, places = block
    position = {
        axis.name: int(i) for axis, i in zip(axes, places, strict=True) if i is not None
    }
    for axis in axes:
        if not 0 <= position.get(axis.name, 0) < len(axis.values):
            raise IndexError(f"{axis.name} has no place {position[axis.name]}")
    return RecordedCase(str(label), str(run_id), position)
