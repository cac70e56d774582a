"""Which keys of two scenes differ."""

import json
from typing import Any, NamedTuple

from wearlab.query.keys import flat, quantity_at
from wearlab.units import KINDS, convert, split


class SceneDifference(NamedTuple):
    """A key of the scene that differs.

    Parameters
    ----------
    key : dotted
    a, b : values in ``units``, None where the scene has no such key
    units : as its quantity is usually written, None for plain values
    """

    key: str
    a: Any
    b: Any
    units: str | None


def differences(a: str, b: str) -> list[SceneDifference]:
    """Return the keys in which two canonical scenes differ, in alphabetical order.

    Parameters
    ----------
    a, b : canonical JSON of the scenes; "" for none
    """
    flat_a, flat_b = (dict(flat(json.loads(text or "{}"))) for text in (a, b))
    keys = [key for key in sorted({*flat_a, *flat_b}) if flat_a.get(key) != flat_b.get(key)]
    return [_difference(key, flat_a.get(key), flat_b.get(key)) for key in keys]


def _difference(key: str, a: Any, b: Any) -> SceneDifference:
    kind = quantity_at(key)
    if kind is None:
        return SceneDifference(key, a, b, None)
    stored, usual = KINDS[kind].unit, split(KINDS[kind].example)[1]
    return SceneDifference(key, _shown(a, stored, usual), _shown(b, stored, usual), usual)


def _shown(value: Any, stored: str, usual: str) -> Any:
    """Return a stored number in the usual unit, to the digits that a scene keeps."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    return float(f"{convert(float(value), stored, usual):.9g}")
