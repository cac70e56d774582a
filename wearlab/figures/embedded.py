"""The texts that a figure's file carries: written by ``render``, read back here; PNG, SVG and PDF."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

from wearlab.figures.errors import FigureError

DESCRIPTION = "{http://purl.org/dc/elements/1.1/}description"
SUBJECT = re.compile(rb"/Subject \(((?:[^\\()]|\\.)*)\)", re.DOTALL)
ESCAPED = re.compile(rb"\\(.)", re.DOTALL)
LARGEST = 50_000_000  # bytes, and pixels
ESCAPES = {b"n": b"\n", b"r": b"\r"}


def embedded(file: Path) -> dict[str, str]:
    """Return the texts of a figure's file, by keyword; none when it is not ours.

    Raises
    ------
    FigureError : it cannot be read, or is no PNG, SVG or PDF
    """
    try:
        if file.exists() and not file.is_file():
            raise FigureError(f"{file}: is no file")
        if file.stat().st_size > LARGEST:
            raise FigureError(f"{file}: {file.stat().st_size} bytes are more than a figure has")
        data = file.read_bytes()
    except OSError as error:
        raise FigureError(f"{file}: cannot be read ({error.strerror or error})") from error
    reader = next((read for start, read in READERS.items() if data.lstrip().startswith(start)), None)
    if reader is None:
        raise FigureError(f"{file}: is no PNG, SVG or PDF")
    try:
        return reader(file, data)
    except (ValueError, SyntaxError, OSError, ElementTree.ParseError) as error:
        raise FigureError(f"{file}: is damaged ({error})") from error


def _png(file: Path, data: bytes) -> dict[str, str]:
    from PIL import Image

    with Image.open(file, formats=["PNG"]) as image:
        if image.width * image.height > LARGEST:
            raise FigureError(f"{file}: {image.width} by {image.height} pixels are more than a figure has")
        image.load()
        return {str(key): str(text) for key, text in image.text.items()}  # type: ignore[attr-defined]


def _svg(file: Path, data: bytes) -> dict[str, str]:
    description = ElementTree.fromstring(data).find(f".//{DESCRIPTION}")
    return _texts(description.text if description is not None else None)


def _pdf(file: Path, data: bytes) -> dict[str, str]:
    subject = SUBJECT.search(data)
    if subject is None:
        return {}
    return _texts(ESCAPED.sub(lambda match: ESCAPES.get(match[1], match[1]), subject[1]).decode("ascii"))


def _texts(text: str | None) -> dict[str, str]:
    texts = json.loads(text or "{}")
    return {str(key): str(value) for key, value in texts.items()} if isinstance(texts, dict) else {}


READERS: dict[bytes, Callable[[Path, bytes], dict[str, str]]] = {
    b"\x89PNG": _png,
    b"%PDF": _pdf,
    b"<?xml": _svg,
    b"<svg": _svg,
}
