"""Tables for notebooks."""

from collections.abc import Sequence
from html import escape
from typing import Any

MOST_ROWS = 60


def table_html(heads: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Return an HTML table; of many rows the first ones, and how many there are."""
    head = "".join(f"<th>{escape(heading)}</th>" for heading in heads)
    body = "".join(
        f"<tr>{''.join(f'<td>{escape(_text(cell))}</td>' for cell in row)}</tr>" for row in rows[:MOST_ROWS]
    )
    more = f"<p>{MOST_ROWS} of {len(rows)} rows</p>" if len(rows) > MOST_ROWS else ""
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{more}"


def _text(value: Any) -> str:
    return "" if value is None else f"{value:.6g}" if isinstance(value, float) else str(value)
