"""What makes two scenes the same: canonical JSON and its hash.

Defaults are filled in, values are SI with 12 significant digits, 1 and 1.0 are one number; texts, paths and
what a campaign says besides are not there.
"""

import hashlib
import json
from typing import Any

from wearlab.scene.part import Stored

MODEL_VERSION = 3
DIGITS = 12
WHOLE_BELOW = 2**53


def canonical(sections: dict[str, Any]) -> str:
    """Return plain nested values as canonical JSON: sorted keys, no spaces, absent parts left out."""
    return json.dumps(
        _plain(sections), sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False
    )


def identity(canonical_scene: str) -> str:
    """Return the id of a scene: 20 hexadecimal digits of the hash over model version and canonical JSON."""
    return hashlib.sha256(f"{MODEL_VERSION}\n{canonical_scene}".encode()).hexdigest()[:20]


def stored(value: Any) -> Any:
    """Return values read from canonical JSON, every number marked as SI."""
    if isinstance(value, dict):
        return {key: stored(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [stored(inner) for inner in value]
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    return value if isinstance(value, int) and abs(value) >= WHOLE_BELOW else Stored(value)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items() if inner is not None}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if isinstance(value, float):
        return _number(value)
    return value


def rounded(value: float) -> float:
    """Return a number to the digits in which scenes are told apart."""
    return float(f"{value:.{DIGITS}g}")


def _number(value: float) -> float | int:
    short = rounded(value)
    return int(short) if short == int(short) and abs(short) < WHOLE_BELOW else short
