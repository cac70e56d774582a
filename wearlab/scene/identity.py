"""Identity of a scene: canonical JSON, and the hash of what is not default.

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

MODEL_VERSION = 6
WHOLE_BELOW = 2**53

Texts = dict[str, tuple[Any, str]]


def canonical(sections: dict[str, Any]) -> str:
    """Return plain nested values as canonical JSON: sorted keys, no spaces.

    Parameters
    ----------
    sections : parts or plain values by name; what is None is left out
    """
    return json.dumps(
        _plain(sections),
        sort_keys=True,
        separators=(",", ":"),
        ensure_ascii=False,
        allow_nan=False,
    )


def identity(scene: options.Part, texts: Texts) -> str:
    """Return the id of a scene: 20 hexadecimal digits of a hash.

    It is taken over the model version and what the scene says beyond its defaults.

    Parameters
    ----------
    scene : all sections
    texts : what sections say as canonical JSON, with the sections; those that are new
        are added
    """
    for name, value in scene.identifying().items():
        if name not in texts or texts[name][0] is not value:
            texts[name] = value, canonical(essence(scene, {name: value}))[1:-1]
    content = ",".join(text for _, (_, text) in sorted(texts.items()) if text)
    return hashlib.sha256(f"{MODEL_VERSION}\n{{{content}}}".encode()).hexdigest()[:20]


def essence(
    part: options.Part, looked_at: dict[str, Any] | None = None
) -> dict[str, Any]:
    """Return the options of a part that are not default, as plain nested values.

    Which of several models it is stays there, default or not: the options of two models
    may share names. A part all of whose options are default is an empty table where no
    part is the default.

    Parameters
    ----------
    part : some options
    looked_at : those of it that are looked at, by name [all]
    """
    defaults = _defaults(type(part))
    looked_at = part.identifying() if looked_at is None else looked_at
    essential = {}
    for name, value in looked_at.items():
        default = defaults.get(name)
        if value is None:
            continue
        at_default = value == default or (
            default is not None and _plain(value) == _plain(default)
        )
        if name == part.chooser or not at_default:
            essential[name] = _mapped(value, _essence)
    return essential


def _mapped(value: Any, leaf: Callable[[Any], Any]) -> Any:
    """Return tables and lists within each other with ``leaf`` of what is neither."""
    if isinstance(value, dict):
        return {key: _mapped(inner, leaf) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_mapped(inner, leaf) for inner in value]
    return leaf(value)


def _essence(value: Any) -> Any:
    """Return a part as what it says beyond its defaults, any other value as it is."""
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
    """Return values read from canonical JSON, every number marked as SI.

    Parameters
    ----------
    value : tables and lists within each other
    """

    def marked(leaf: Any) -> Any:
        if isinstance(leaf, bool) or not isinstance(leaf, int | float):
            return leaf
        is_large_count = isinstance(leaf, int) and abs(leaf) >= WHOLE_BELOW
        return leaf if is_large_count else options.Stored(leaf)

    return _mapped(value, marked)


def _plain(value: Any) -> Any:
    """Return parts as tables without absent values, and numbers with 12 digits."""
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
