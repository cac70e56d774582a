"""What a catalogue's keys mean: values of scenes, variables of datasets, with their units."""

from wearlab.query.bind import Key
from wearlab.query.scene_keys import scene_key
from wearlab.schema import VARIABLES

STATISTICS = ("_min", "_mean", "_max")


def key_of(name: str, source: str, kind: str) -> Key:
    """Return a key as conditions understand it.

    Parameters
    ----------
    name : dotted key of a scene, or variable
    source : scene | result | history
    kind : number | text | history
    """
    if source == "scene":
        return scene_key(name, kind == "text")
    variable = VARIABLES.get(name) or VARIABLES.get(_stem(name))
    if kind == "text" or variable is None:
        return Key(name, kind)
    return Key(name, kind, variable.units, None, variable.display_units)


def declared_key(name: str) -> Key | None:
    """Return the key of a result that datasets may have, None for any other name."""
    variable = VARIABLES.get(name) or VARIABLES.get(_stem(name))
    if variable is None:
        return None
    return key_of(name, "result", "number" if variable.units else "text")


def _stem(name: str) -> str:
    return next((name.removesuffix(end) for end in STATISTICS if name.endswith(end)), name)
