"""What makes two scenes the same: canonical JSON, and the hash of what in it is not default.

Canonical JSON has defaults filled in, values in SI with 12 significant digits, 1 and
1.0 as one number; texts, paths and what a campaign says besides are not there. The hash
leaves out what stands at its default: an option added with a default makes no stored
run new, and a default that moves must raise the version.
"""

import hashlib
import json
from collections.abc import Callable
from functools import cache
from typing import Any

from wearlab import options, units

MODEL_VERSION = 5
WHOLE_BELOW = 2**53

Texts = dict[str, tuple[Any, str]]


def canonical(sections: dict[str, Any]) -> str:
    """Return plain nested values as canonical JSON: sorted keys, no spaces, absent parts left out."""
    return json.dumps(
        _plain(sections),
        sort_keys=True,
        separators=(",", ":"),
        ensure_ascii=False,
        allow_nan=False,
    )


def identity(scene: options.Part, texts: Texts) -> str:
    """Return the id of a scene: 20 hexadecimal digits of the hash over model version and what it says.

    Parameters
    ----------
    scene : all sections
    texts : what sections say as canonical JSON, with the sections; those that are new
        are added
    """
    for name, value in scene.identifying().items():
        if name not in texts or texts[name][0] is not value:
            texts[name] = value, canonical(essence(scene, {name: value}))[1:-1]
    said = ",".join(text for _, (_, text) in sorted(texts.items()) if text)
    return hashlib.sha256(f"{MODEL_VERSION}\n{{{said}}}".encode()).hexdigest()[:20]


def essence(part: options.Part, told: dict[str, Any] | None = None) -> dict[str, Any]:
    """Return the options of a part that do not stand at their default, as plain nested values.

    Which of several models it is stays there, default or not: the options of two models
    may share names. A part all of whose options are default is an empty table where no
    part is the default.

    Parameters
    ----------
    part : some options
    told : those of it that are looked at, by name [all]
    """
    defaults = _defaults(type(part))
    told = part.identifying() if told is None else told
    essential = {}
    for name, value in told.items():
        default = defaults.get(name)
        alike = value == default or (
            default is not None and _plain(value) == _plain(default)
        )
        if value is not None and (name == part.chooser or not alike):
            essential[name] = _mapped(value, _essence)
    return essential


def _mapped(value: Any, leaf: Callable[[Any], Any]) -> Any:
    """Return tables and lists within each other with ``leaf`` of what is neither."""
    if isinstance(value, dict):
        return {key: _mapped(inner, leaf) for key, inner in value.items()}
    return (
        [_mapped(inner, leaf) for inner in value]
        if isinstance(value, list | tuple)
        else leaf(value)
    )


def _essence(value: Any) -> Any:
    return value.written(essence(value)) if isinstance(value, options.Part) else value


@cache
def _defaults(part: type[options.Part]) -> dict[str, Any]:
    """Return the defaults of options by name, None where there is none."""
    fields = {
        name: field
        for name, field in part.model_fields.items()
        if not field.is_required()
    }
    return {
        name: field.get_default(call_default_factory=True)
        for name, field in fields.items()
    }


def stored(value: Any) -> Any:
    """Return values read from canonical JSON, every number marked as SI."""

    def number(own: Any) -> Any:
        if isinstance(own, bool) or not isinstance(own, int | float):
            return own
        return (
            own
            if isinstance(own, int) and abs(own) >= WHOLE_BELOW
            else options.Stored(own)
        )

    return _mapped(value, number)


def _plain(value: Any) -> Any:
    if isinstance(value, options.Part):
        value = value.model_dump()
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items() if inner is not None}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if not isinstance(value, float):
        return value
    short = units.rounded(value)
    return int(short) if short == int(short) and abs(short) < WHOLE_BELOW else short
