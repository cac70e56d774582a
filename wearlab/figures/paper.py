"""How a figure for a paper is to look: its width, and what a style file sets."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from wearlab.figures.kind import FigureError
from wearlab.figures.plot import MAX_WIDTH, MIN_WIDTH, Paper
from wearlab.files import read_regular
from wearlab.nearest import choices
from wearlab.units import UnitError, convert, is_number, split

GENERIC = ("serif", "sans-serif", "monospace", "cursive", "fantasy")
"""Families that stand for a list of fonts."""
LARGEST_STYLE = 1_000_000
"""Bytes of a style file."""


def paper_of(width: str | None, style: Path | None) -> Paper:
    """Return the look that a width and a style file ask for.

    Parameters
    ----------
    width : such as "84 mm", None as wide as panels need
    style : file of matplotlib's settings, None for wearlab's

    Raises
    ------
    FigureError : no such width, file, setting or font
    """
    inches = None if width is None else width_in_inches(width)
    return Paper(inches, {} if style is None else style_of(style))


def width_in_inches(text: str | float) -> float:
    """Return a width in inches.

    Parameters
    ----------
    text : with its unit, such as "84 mm", or a number of inches

    Raises
    ------
    FigureError : no length, or one that no figure has

    Examples
    --------
    >>> round(width_in_inches("84mm"), 3)
    3.307
    """
    try:
        if is_number(text):
            inches = float(text)
        else:
            number, unit = split(str(text))
            inches = float(convert(float(number), unit, "inch"))
    except UnitError as error:
        raise FigureError(f"width {text!r}: {error}, such as 84mm") from None
    if not MIN_WIDTH <= inches <= MAX_WIDTH:
        raise FigureError(
            f"width {text!r}: a figure is {25.4 * MIN_WIDTH:.0f} to "
            f"{25.4 * MAX_WIDTH:.0f} mm wide"
        )
    return inches


def style_of(path: Path) -> dict[str, Any]:
    """Return the settings of a style file of matplotlib.

    Parameters
    ----------
    path : lines of ``key: value``, such as ``font.size: 8``

    Raises
    ------
    FigureError : it cannot be read, or holds an unknown setting or a font that is not
        installed
    """
    import matplotlib

    try:
        text = read_regular(path, LARGEST_STYLE).decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise FigureError(f"style {path}: {reason}") from None

    settings: Any = matplotlib.RcParams()
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.partition("#")[0] if '"' not in line else line
        key, colon, value = bare.partition(":")
        key = key.strip()
        if not bare.strip():
            continue
        place = f"style {path}, line {number}"
        if not colon:
            raise FigureError(f"{place}: {line.strip()!r}: write key: value")
        if key not in matplotlib.rcParamsDefault:
            known = sorted(matplotlib.rcParamsDefault)
            raise FigureError(f"{place}: {key}: {choices(key, known)}")
        try:
            settings[key] = value.strip().strip('"')
        except ValueError as error:
            raise FigureError(f"{place}: {error}") from None
    chosen = {key: value for key, value in settings.items() if "backend" not in key}
    _require_font(path, chosen)
    return chosen


def _require_font(path: Path, settings: Mapping[str, Any]) -> None:
    """Refuse fonts of which none is installed: matplotlib would take another."""
    import matplotlib
    from matplotlib.font_manager import fontManager

    defaults: Any = matplotlib.rcParamsDefault
    families = settings.get("font.family", [])
    if settings.get("text.usetex") or not families:
        return
    names: list[str] = []
    for family in families:
        key = f"font.{family}"
        listed = settings.get(key, defaults.get(key, []))
        names += listed if family in GENERIC else [family]
    installed = fontManager.get_font_names()
    if not set(names) & set(installed):
        raise FigureError(
            f"style {path}: font.family: {', '.join(names[:3])} is not installed; "
            f"{choices(names[0], installed)}"
        )
