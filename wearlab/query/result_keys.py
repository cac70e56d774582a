"""What a catalogue's keys mean: values of scenes, variables of datasets, with their units."""

from wearlab.query.bind import Key
from wearlab.query.scene_keys import scene_key
from wearlab.schema import VARIABLES

STATISTICS = ("_min", "_mean", "_max")


def known_key(name: str, source: str, kind: str, history: bool) -> Key | None:
    """Return a key as conditions understand it; None for what is asked of only through another.

    Parameters
    ----------
    name, source, kind : as the catalogue keeps them
    history : whether the values along the life are kept too
    """
    if kind == "history":
        return None
    if source == "scene":
        return scene_key(name, kind == "text")
    variable = VARIABLES.get(name) or VARIABLES.get(_stem(name))
    if kind == "text" or variable is None:
        return Key(name, kind, history=history)
    return Key(name, kind, variable.units, None, variable.display_units, history=history)


def _stem(name: str) -> str:
    return next((name.removesuffix(end) for end in STATISTICS if name.endswith(end)), name)
