"""Arrays that a REXS file holds as base64 text, from version 1.4 on."""

import base64
import binascii
from collections.abc import Sequence

import numpy as np

from wearlab.rexs.document import RexsError

TYPES = {"int32": "<i4", "float32": "<f4", "float64": "<f8"}


def decode(code: str, text: str, place: str) -> list[float]:
    """Return the numbers of a coded array.

    Parameters
    ----------
    code : int32, float32 or float64, little-endian
    text : base64
    place : where it stands, for messages

    Raises
    ------
    RexsError : another code, no base64, or bytes that are no whole numbers
    """
    if code not in TYPES:
        raise RexsError(
            f"{place}: the code {code!r} is not one of {', '.join(TYPES)}: export the "
            "file anew"
        )
    try:
        content = base64.b64decode("".join(text.split()), validate=True)
    except binascii.Error:
        raise RexsError(
            f"{place}: the array is no base64 text, or it is cut off: export the file "
            "anew"
        ) from None

    kind = np.dtype(TYPES[code])
    if len(content) % kind.itemsize:
        raise RexsError(
            f"{place}: {len(content)} bytes are no whole number of {code} values: "
            "export the file anew"
        )
    return [float(number) for number in np.frombuffer(content, dtype=kind)]


def decode_matrix(
    code: str, text: str, shape: tuple[int, int], place: str
) -> list[list[float]]:
    """Return the rows of a coded matrix.

    Parameters
    ----------
    code : int32, float32 or float64, little-endian
    text : base64, row by row
    shape : (rows, columns) as the file states them
    place : where it stands, for messages

    Raises
    ------
    RexsError : as of `decode`, or another size than the file states
    """
    numbers = decode(code, text, place)
    return in_rows(numbers, shape, place)


def in_rows(
    numbers: Sequence[float], shape: tuple[int, int], place: str
) -> list[list[float]]:
    """Return numbers as the rows of a matrix.

    Parameters
    ----------
    numbers : row by row
    shape : (rows, columns)
    place : where it stands, for messages

    Raises
    ------
    RexsError : there are more or fewer than rows times columns
    """
    rows, columns = shape
    if rows < 0 or columns < 0 or rows * columns != len(numbers):
        raise RexsError(
            f"{place}: {len(numbers)} values are not {rows} rows of {columns}: export "
            "the file anew"
        )
    return [list(numbers[row * columns : (row + 1) * columns]) for row in range(rows)]
