"""What a campaign file writes of a table: its file, and texts by column."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from wearlab.options import Stored
from wearlab.tables.cells import DECIMALS, TableError
from wearlab.tables.reading import read_table
from wearlab.tables.table import ReadTable


def is_stored(*columns: Any) -> bool:
    """Say whether these are columns of numbers that a scene has already read."""
    return all(
        isinstance(column, list | tuple)
        and column
        and all(isinstance(number, Stored) for number in column)
        for column in columns
    )


def refuse_contents(
    options: Mapping[str, Any], contents: Sequence[str], wanted: str
) -> None:
    """Refuse options that write what is read from a file, or name no file.

    Parameters
    ----------
    options : as a campaign file writes them
    contents : keys of what is read from the file
    wanted : the keys that may be written, for messages

    Raises
    ------
    ValueError : one of `contents` is written, or ``file`` is not
    """
    written = [key for key in contents if key in options]
    if written:
        raise ValueError(f"{written[0]!r} is read from file, not written")
    if "file" not in options:
        raise ValueError(f"'file' is required: {wanted}")


def file_named(options: Mapping[str, Any]) -> str:
    """Return the name of the file that a table's contents stand in.

    Parameters
    ----------
    options : as a campaign file writes them, ``file`` among them

    Raises
    ------
    TableError : it is no text
    """
    file = options["file"]
    if not isinstance(file, str):
        raise TableError(f"file: {file!r} is no text: the name of a table's file")
    return file


def table_named(options: Mapping[str, Any], base: Path | None) -> ReadTable:
    """Return the table that options name by ``file``, ``sheet`` and ``decimal``.

    Parameters
    ----------
    options : as a campaign file writes them
    base : folder that a relative path starts from

    Raises
    ------
    TableError : one of them is no text, or the file cannot be read
    """
    path = (base or Path()) / file_named(options)
    sheet = options.get("sheet")
    if not isinstance(sheet, str | None):
        raise TableError(f"sheet: {sheet!r} is no text: the name of a workbook's sheet")
    decimal = options.get("decimal")
    if decimal is not None and decimal not in DECIMALS:
        raise TableError(f"decimal: {decimal!r} is not one of '.' and ','")
    return read_table(path, sheet=sheet, decimal=decimal)


def texts_by_column(
    options: Mapping[str, Any], key: str, example: str
) -> dict[str, str]:
    """Return a table of texts by column, such as units; an absent one is empty.

    Parameters
    ----------
    options : as a campaign file writes them
    key : of the table, ``units`` or ``columns``
    example : how it is written, for messages

    Raises
    ------
    TableError : it is something else
    """
    texts = options.get(key, {})
    if not isinstance(texts, dict):
        raise TableError(f"{key}: {texts!r} is no table: write {key} = {example}")
    for column, text in texts.items():
        if not isinstance(text, str):
            raise TableError(
                f"{key}.{column}: {text!r} is no text: write {key} = {example}"
            )
    return texts
