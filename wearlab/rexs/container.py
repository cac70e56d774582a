"""From a path to the document in it: XML, JSON, or a zip with one of them."""

import io
import zipfile
import zlib
from pathlib import Path

from wearlab.files import read_regular
from wearlab.rexs import json_file, xml_file
from wearlab.rexs.document import Document, RexsError

MAX_BYTES = 50_000_000
"""Bytes of a file, and of what a zip holds."""
SUFFIXES = (".rexs", ".rexsj", ".xml", ".json")
"""Names of what a zip may hold."""
UNPACKING = (
    zipfile.BadZipFile,
    zlib.error,
    NotImplementedError,
    EOFError,
    RuntimeError,
    ValueError,
)
"""What a damaged, encrypted or strangely packed zip raises."""


def read_document(path: str | Path) -> Document:
    """Return what a REXS file holds.

    The content tells what it is written in, not the suffix.

    Parameters
    ----------
    path : ``.rexs``, ``.rexsj``, or a zip with one of them

    Raises
    ------
    RexsError : it cannot be read; the message begins with the path
    """
    try:
        content = read_regular(path, MAX_BYTES)
        return _parsed(content)
    except OSError as error:
        raise RexsError(f"{path}: {error.strerror or error}") from None
    except RexsError as error:
        raise RexsError(f"{path}: {error}") from None


def _parsed(content: bytes) -> Document:
    """Return the document in the bytes of a file."""
    if content.startswith(b"PK\x03\x04"):
        content = _unzipped(content)

    match content.lstrip(b"\xef\xbb\xbf \t\r\n")[:1]:
        case b"<":
            return xml_file.read(content)
        case b"{":
            return json_file.read(content)
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):  # UTF-16 of an XML writer
        return xml_file.read(content)
    raise RexsError(
        "it is no REXS file: neither XML nor JSON nor a zip of one; export as REXS "
        "(.rexs)"
    )


def _unzipped(content: bytes) -> bytes:
    """Return the one model in a zip, of a size that is stated and kept."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            models = [
                entry
                for entry in archive.infolist()
                if entry.filename.lower().endswith(SUFFIXES)
                and not entry.filename.startswith("__MACOSX/")
            ]
            if len(models) != 1:
                names = ", ".join(entry.filename for entry in models) or "none"
                raise RexsError(
                    f"a zip holds one model (.rexs or .rexsj), this one: {names}; "
                    "unpack it and name the file"
                )
            model = models[0]
            if model.file_size > MAX_BYTES:
                raise RexsError(
                    f"{model.filename} has {model.file_size} bytes, more than the "
                    f"{MAX_BYTES} of a REXS file"
                )
            with archive.open(model) as file:
                unpacked = file.read(MAX_BYTES + 1)
    except RexsError:
        raise
    except UNPACKING as error:
        raise RexsError(
            f"the zip cannot be unpacked ({error}): unpack it yourself"
        ) from None

    if len(unpacked) > MAX_BYTES:
        raise RexsError(f"it unpacks to more than the {MAX_BYTES} bytes of a REXS file")
    return unpacked
