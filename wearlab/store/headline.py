"""What a run came to, in a few words: its life or wear, or what acts in the mesh where nothing wears."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from wearlab.units import HOUR


class Headline(NamedTuple):
    """One number of a run.

    Parameters
    ----------
    text : with its unit and what it is
    short : with its unit alone, or what it is where that is not plain
    of : what its error is an error of
    error : estimated numerical error, relative to it; None where there is no estimate
    """

    text: str
    short: str
    of: str
    error: float | None


class _Kind(NamedTuple):
    name: str
    scale: float
    text: str
    short: str
    of: str
    error: str
    hours: str = ""


WORN = (
    _Kind("life", 1.0, "cycles of life", "cycles", "life", "error_estimate_life", "service_life"),
    _Kind("max_wear_depth", 1e6, "µm worn", "µm", "wear", "error_estimate_wear_depth", "operating_hours"),
)
ONE_STATE = (
    _Kind(
        "mesh_force_max", 1.0, "N largest mesh force", "N in mesh", "force", "error_estimate_mesh_force_max"
    ),
    _Kind("ste_peak_to_peak", 1e6, "µm range of STE", "µm STE", "STE", ""),
    WORN[1],
)


AS_ASKED = ("cycles", "depth")
"""Ends of a life that a scene asks for."""
NO_WEAR = "no wear"


def unasked_end(summary: Mapping[str, Any]) -> str:
    """Return how a life ended that ended otherwise than asked; nothing of any other.

    Parameters
    ----------
    summary : results by name, as the catalogue has them
    """
    reason = str(summary.get("end_reason") or "")
    if not reason or reason in AS_ASKED:
        return ""
    if reason == NO_WEAR:
        return "no wear: nothing wears off these flanks; look at the coefficient, its film and its factor"
    return f"the life ended before its limit: {reason}"


def headlines(summary: Mapping[str, Any]) -> list[Headline]:
    """Return what a run came to, the most telling first.

    Parameters
    ----------
    summary : results by name, SI, as the catalogue has them; a run whose last ``cycle`` is 0 wears nothing
    """
    kinds = ONE_STATE if summary.get("cycle") == 0.0 else WORN
    told = [_headline(kind, summary) for kind in kinds if summary.get(kind.name) is not None]
    end = unasked_end(summary)
    if not end:
        return told
    if summary["end_reason"] == NO_WEAR:
        return [Headline(end, NO_WEAR, "", None), *told]
    return [*told, Headline(end, f"ended: {summary['end_reason']}", "", None)]


def _headline(kind: _Kind, summary: Mapping[str, Any]) -> Headline:
    value, error = summary[kind.name], summary.get(kind.error)
    number = f"{value * kind.scale:.4g}"
    relative = error / value if error is not None and value else None
    hours = hours_text(summary.get(kind.hours))
    joint = " = " if kind.hours == "service_life" else " after "
    tail = f"{joint}{hours}" if hours else ""
    return Headline(f"{number} {kind.text}{tail}", f"{number} {kind.short}{tail}", kind.of, relative)


def hours_text(seconds: float | None) -> str:
    """Return an operating time in hours, three digits of it; nothing where there is none."""
    if not seconds:
        return ""
    hours = float(f"{seconds / HOUR:.3g}")
    return f"{hours:,.0f} h" if hours >= 1000.0 else f"{hours:g} h"
