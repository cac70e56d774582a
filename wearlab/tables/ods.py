"""Merged cells of open documents (.ods), which the library of workbooks does not tell.

A merged cell says over how many columns and rows it spans; what it covers stands behind
it as covered cells. Rows and cells that are alike may stand once, with their number.
"""

import io
import re
import zipfile
from collections.abc import Iterator
from html import unescape

Place = tuple[int, int]
Merged = tuple[Place, Place]
"""First and last cell, (row, column) from 0."""

MAX_HEAD_ROWS = 200
"""Rows of a sheet in which headers may stand."""
TAG = re.compile(
    rb"<table:(table|table-row|table-cell|covered-table-cell)(?=[\s/>])([^<>]*)>"
)
ATTRIBUTE = re.compile(rb'table:([\w-]+)="([^"]*)"')


def ods_content(raw: bytes) -> bytes:
    """Return what the sheets of an open document hold, nothing of other workbooks.

    Parameters
    ----------
    raw : bytes of the workbook
    """
    if not raw.startswith(b"PK"):
        return b""
    with zipfile.ZipFile(io.BytesIO(raw)) as archive:
        is_open_document = "content.xml" in archive.namelist()
        return archive.read("content.xml") if is_open_document else b""


def merged_in_ods(content: bytes) -> dict[str, list[Merged]]:
    """Return the merged cells of every sheet, by its name.

    Parameters
    ----------
    content : of the document, as `ods_content` returns it, which has been checked
    """
    merged: dict[str, list[Merged]] = {}
    for sheet, cells in _merged(content):
        merged.setdefault(sheet, []).append(cells)
    return merged


def _merged(content: bytes) -> Iterator[tuple[str, Merged]]:
    """Yield sheet and ends of each merged cell in a document's rows of headers."""
    sheet = ""
    row = column = next_row = 0
    for tag, text in TAG.findall(content):
        attributes = dict(ATTRIBUTE.findall(text))
        if tag == b"table":
            sheet = unescape(attributes.get(b"name", b"").decode("utf-8", "replace"))
            next_row = 0
        elif tag == b"table-row":
            row = next_row
            column = 0
            next_row += _count(attributes, b"number-rows-repeated")
        elif row < MAX_HEAD_ROWS:
            columns = _count(attributes, b"number-columns-spanned")
            rows = _count(attributes, b"number-rows-spanned")
            if columns > 1 or rows > 1:
                yield sheet, ((row, column), (row + rows - 1, column + columns - 1))
            column += _count(attributes, b"number-columns-repeated")


def _count(attributes: dict[bytes, bytes], name: bytes) -> int:
    """Return a number that an attribute states, 1 where it states none."""
    stated = attributes.get(name, b"1")
    return int(stated) if stated.isdigit() and len(stated) < 8 else 1
