"""A campaign as a table for notebooks."""

from collections.abc import Sequence
from html import escape

from wearlab.campaign.axes import Axis
from wearlab.campaign.case import Case

MOST_CASES = 30


def campaign_html(title: str, sweeps: Sequence[Axis], cases: Sequence[Case]) -> str:
    """Return title, and for every case its label, its place on the axes and its identity."""
    axes = {axis.name: axis for axis in sweeps}
    heads = ["case", *(f"{name} [{axis.units}]" if axis.units else name for name, axis in axes.items()), "id"]
    rows = []
    for case in cases[:MOST_CASES]:
        places = (axes[n].values[case.position[n]] if n in case.position else "" for n in axes)
        rows.append([case.label, *places, case.id[:10]])
    head = "".join(f"<th>{escape(heading)}</th>" for heading in heads)
    body = "".join(f"<tr>{''.join(f'<td>{escape(str(x))}</td>' for x in row)}</tr>" for row in rows)
    more = f"<p>{MOST_CASES} of {len(cases)} cases</p>" if len(cases) > MOST_CASES else ""
    return f"<p><b>{escape(title[1:-1])}</b></p><table><tr>{head}</tr>{body}</table>{more}"
