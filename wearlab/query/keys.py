"""Keys that a condition may ask for: names, kinds, units.

And where two scenes differ.
"""

import json
import re
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from typing import Any, NamedTuple, get_args, get_origin

from wearlab import units

PLAIN = ("", "1", "cycles")
FUNCTIONS = (
    "max",
    "min",
    "mean",
    "sum",
    "range",
    "abs",
    "where",
    "largest_at",
    "smallest_at",
)
"""Of formulas."""
REDUCED_DIMS = frozenset({"update", "flank", "mesh", "member"})
"""Of results with these dimensions a catalogue keeps the largest value."""
SHOWN = 12
ONLY_VALUE, SECOND_VALUE = ".value.0", ".value.1"
"""Of a table that a single value may stand for, such as ``mesh.misalignment``."""


class QueryError(ValueError):
    """A condition cannot be read or does not fit what is known.

    The message points at the place.

    Parameters
    ----------
    reason : one sentence with a remedy
    text : the condition
    position : where in it, from 0
    """

    def __init__(self, reason: str, text: str, position: int) -> None:
        self.reason, self.text, self.position = reason, text, position
        super().__init__(f"{reason}\n  {text}\n  {' ' * position}^")

    def __reduce__(self) -> tuple[type["QueryError"], tuple[str, str, int]]:
        return type(self), (self.reason, self.text, self.position)


class Key(NamedTuple):
    """Something a condition may ask for.

    Parameters
    ----------
    name : full dotted name
    kind : number | text | date
    unit : of its stored value, "" for plain numbers
    quantity : key of `wearlab.units.KINDS` when it is a quantity of a scene
    display_unit : what people read it in
    is_path : whether a beginning of its words may be left out
    history : whether it has a value at every wear state
    dims : along which a result has several values; what the catalogue keeps of it is
        the largest
    formula : by which it is computed from stored variables, None: it is kept as it is
    any_value : whether a comparison asks any of its values, not the largest alone
    """

    name: str
    kind: str = "number"
    unit: str = ""
    quantity: str | None = None
    display_unit: str = ""
    is_path: bool = False
    history: bool = False
    dims: tuple[str, ...] = ()
    formula: Any = None
    any_value: bool = False

    @property
    def is_kept(self) -> bool:
        """Whether the catalogue keeps a value of it, the largest of several."""
        return REDUCED_DIMS.issuperset(self.dims)


Elsewhere = Callable[[str], Key | str | None]


class Vocabulary:
    """All keys that may be asked for, found by their name or by its last words.

    Parameters
    ----------
    keys : those that have values
    aliases : other names of keys
    elsewhere : returns the key of a name that means something although nothing here has
        a value of it, or what to ask for instead
    reads_formulas : whether formulas such as ``min(iso_pitting_safety)`` may be asked
        for: there are files to compute them from
    """

    def __init__(
        self,
        keys: Iterable[Key],
        aliases: Mapping[str, str] = {},
        elsewhere: Elsewhere = lambda name: None,
        reads_formulas: bool = False,
    ) -> None:
        self.aliases = aliases
        self.elsewhere = elsewhere
        self.reads_formulas = reads_formulas
        self.formulas: dict[str, Key] = {}  # that were asked for, by their text
        self.keys = {key.name: key for key in keys}
        self.ends: dict[str, list[str]] = {}
        for key in self.keys.values():
            words = key.name.split(".") if key.is_path else [key.name]
            for start in range(1, len(words)):
                self.ends.setdefault(".".join(words[start:]), []).append(key.name)

    def find(self, name: str, at: int, text: str) -> Key:
        """Return the key that a name means.

        Parameters
        ----------
        name : as a condition writes it
        at : where it stands in the condition
        text : the condition

        Raises
        ------
        QueryError : no key is called so, or several are; the message lists them
        """
        wanted = name.removeprefix("scene.")
        if wanted not in self.keys:
            known: Any = (self.aliases, self.ends, self.keys)
            wanted = next(
                (
                    w
                    for w in (wanted, wanted.lower())
                    if any(w in each for each in known)
                ),
                wanted,
            )
            wanted = self.aliases.get(wanted, wanted)
        if wanted in self.keys:
            return self.keys[wanted]
        candidates = self.ends.get(wanted, [])
        if not candidates:
            self._require_one_value(wanted, at, text)
            candidates = self._places(wanted + ONLY_VALUE)
        if len(candidates) == 1:
            return self.keys[candidates[0]]
        if candidates:
            several = listed(sorted(candidates), "or")
            raise QueryError(f"{name!r} may mean {several}: write more of it", text, at)
        elsewhere = self.elsewhere(wanted)
        if isinstance(elsewhere, Key):
            return elsewhere
        if elsewhere:
            inside = self._inside(wanted) or self._inside(wanted.rpartition(".")[0])
            remedy = f"; there are {listed(inside, 'and')}" if inside else ""
            raise QueryError(f"{name!r} {elsewhere}{remedy}", text, at)
        near = get_close_matches(wanted, {**self.keys, **self.ends, **self.aliases}, 3)
        remedy = (
            f"did you mean {listed(near, 'or')}?"
            if near
            else "nothing here is called so"
        )
        raise QueryError(f"unknown name {name!r}; {remedy}", text, at)

    def _places(self, words: str) -> list[str]:
        """Return the keys that are called so, or end so."""
        return [words] if words in self.keys else self.ends.get(words, [])

    def _require_one_value(self, table: str, at: int, text: str) -> None:
        """Refuse a table for which no single value stands."""
        if self._places(table + SECOND_VALUE):
            values = listed([table + ONLY_VALUE, table + SECOND_VALUE], "or")
            reason = f"{table!r} has several values: ask for {values}"
            raise QueryError(reason, text, at)

    def _inside(self, table: str) -> list[str]:
        """Return the keys within a table, without the numbered values of lists."""
        inside = [key for key in self.keys if key.startswith(f"{table}.")]
        return sorted(
            key for key in inside if not any(word.isdigit() for word in key.split("."))
        )


def listed(words: list[str], joint: str) -> str:
    """Return words in quotes, the last after a joint, the first ones of many.

    Parameters
    ----------
    words : any
    joint : "and" or "or"
    """
    quoted = [repr(word) for word in words[:SHOWN]] + (
        ["…"] if len(words) > SHOWN else []
    )
    return (
        quoted[0]
        if len(quoted) == 1
        else f"{', '.join(quoted[:-1])} {joint} {quoted[-1]}"
    )


def split_columns(text: str) -> tuple[str, ...]:
    """Return the columns of a list; a comma in brackets or quotes parts nothing.

    Parameters
    ----------
    text : columns, parted by commas

    Examples
    --------
    >>> split_columns("life, wear_depth[flank=pinion, update=-1]")
    ('life', 'wear_depth[flank=pinion, update=-1]')
    """
    columns: list[str] = []
    column = ""
    for piece in text.split(","):
        column = f"{column},{piece}" if column else piece
        if _is_whole(column):
            columns.append(column.strip())
            column = ""
    return tuple(column for column in [*columns, column.strip()] if column)


def _is_whole(text: str) -> bool:
    """Whether all quotes, parentheses and brackets of a text are closed."""
    unquoted = re.sub(r"'[^']*'|\"[^\"]*\"", "", text)
    if "'" in unquoted or '"' in unquoted:
        return False
    return all(
        unquoted.count(opening) <= unquoted.count(closing)
        for opening, closing in ("()", "[]")
    )


def scene_key(name: str, text: bool) -> Key:
    """Return the key of a scene's value.

    Parameters
    ----------
    name : dotted
    text : whether its value is a text
    """
    kind = None if text else quantity_at(name)
    if kind is None:
        return Key(name, "text" if text else "number", is_path=True)
    return Key(
        name,
        "number",
        units.KINDS[kind].unit,
        kind,
        _shown(units.KINDS[kind]),
        is_path=True,
    )


def _shown(kind: units.Measure) -> str:
    """Return the unit that values of a kind are read in.

    That of its example, if it is one and no scale.
    """
    from wearlab.materials.grades import SCALES

    usual = units.split(kind.example)[1], *kind.units
    return next((unit for unit in usual if unit not in SCALES), kind.unit)


def quantity_at(name: str) -> str | None:
    """Return the kind of quantity that a dotted key holds, None for plain values.

    Parameters
    ----------
    name : dotted key of a scene
    """
    from wearlab import options
    from wearlab.scene.sections import field_at  # managing runs needs no scenes

    field = field_at(tuple(word for word in name.split(".") if not word.isdigit()))
    unit = (
        None if field is None else options.unit_within(field.annotation, field.metadata)
    )
    return unit.kind if unit else None


def declared_scene_key(name: str) -> Key | str | None:
    """Return the key of a scene's value that no run has, or what else a name is.

    None: no name of a scene.

    Parameters
    ----------
    name : dotted
    """
    from wearlab.scene.sections import field_at, parts_at

    path = tuple(word for word in name.split(".") if not word.isdigit())
    field = field_at(path)
    if field is None:
        return None
    if parts_at(path):
        value = field_at((*path, "value"))
        if value is not None and _is_list(value.annotation):
            return scene_key(name + ONLY_VALUE, text=False)
        return "is a table: ask for one of its keys"
    if field.exclude:
        of_pitch = path[-1].endswith("diametral_pitch")
        instead = ": ask for gears.module, such as '20 DP'" if of_pitch else ""
        return f"stands in campaign files only, runs keep what it leads to{instead}"
    return scene_key(
        name, text=quantity_at(name) is None and _is_text(field.annotation)
    )


def _is_list(annotation: Any) -> bool:
    """Say whether a value may be a list."""
    is_tuple = get_origin(annotation) is tuple
    return is_tuple or any(map(_is_list, get_args(annotation)))


def declared_scene_end(name: str) -> Key | str | None:
    """Return what `declared_scene_key` does, for the last words of a name.

    Parameters
    ----------
    name : dotted
    """
    from wearlab.scene.sections import places_ending

    places = [".".join(place) for place in places_ending(tuple(name.split(".")))]
    if len(places) > 1:
        return f"may mean {listed(places, 'or')}: write more of it"
    return declared_scene_key(places[0]) if places else None


def _is_text(annotation: Any) -> bool:
    """Say whether a value may be a word."""
    return (
        annotation is str
        or isinstance(annotation, str)
        or any(map(_is_text, get_args(annotation)))
    )


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
    variable = _variable(name)
    dims = variable.dims if variable and _is_variable(name) else ()
    if kind == "text" or variable is None:
        return Key(name, kind, dims=dims)
    return Key(
        name,
        kind,
        variable.units,
        display_unit=variable.display_units,
        dims=dims,
    )


def declared_key(name: str) -> Key | None:
    """Return the key of a result that datasets may have, None for any other name.

    Parameters
    ----------
    name : of a variable, or of one of its statistics
    """
    variable = _variable(name)
    return variable and key_of(name, "result", "number" if variable.units else "text")


def _variable(name: str) -> Any:
    """Return the variable of a name, or of one of its statistics.

    None where there is none.
    """
    from wearlab.schema import VARIABLES

    stem = next(
        (name.removesuffix(end) for end in STATISTICS if name.endswith(end)), name
    )
    return VARIABLES.get(name) or VARIABLES.get(stem)


def _is_variable(name: str) -> bool:
    """Say whether a name is that of a variable, not of one of its statistics."""
    from wearlab.schema import VARIABLES

    return name in VARIABLES


def flat(values: Any, above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted keys and values.

    Entries of a list are numbered from 0, what is absent is left out.

    Parameters
    ----------
    values : nested tables and lists
    above : key of the table they stand in
    """
    if isinstance(values, dict | list):
        for key, value in (
            values.items() if isinstance(values, dict) else enumerate(values)
        ):
            yield from flat(value, f"{above}.{key}" if above else str(key))
    elif values is not None:
        yield above, values


def differing_keys(
    scenes: Sequence[Mapping[str, Any]], always: Container[str] = ()
) -> list[str]:
    """Return the keys whose values differ among flat scenes.

    In the order of the first scene.

    Parameters
    ----------
    scenes : flat
    always : keys that count as differing
    """
    keys = dict.fromkeys(key for scene in scenes for key in scene)
    return [
        key
        for key in keys
        if key in always or len({repr(scene.get(key)) for scene in scenes}) > 1
    ]


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
    flat_a = dict(flat(json.loads(a or "{}")))
    flat_b = dict(flat(json.loads(b or "{}")))
    found_differences = []
    for key in sorted({*flat_a, *flat_b}):
        if flat_a.get(key) != flat_b.get(key):
            value_a = in_usual_unit(key, flat_a.get(key))[0]
            value_b = in_usual_unit(key, flat_b.get(key))[0]
            found_differences.append(
                SceneDifference(
                    key, value_a, value_b, scene_key(key, False).display_unit or None
                )
            )
    return found_differences


def in_usual_unit(key: str, value: Any) -> tuple[Any, str]:
    """Return a value of a scene as it is usually written, and its unit.

    To the digits that a scene keeps.

    Parameters
    ----------
    key : dotted
    value : in SI
    """
    declared = scene_key(key, False)
    if declared.quantity and units.is_number(value):
        value = float(
            f"{units.convert(float(value), declared.unit, declared.display_unit):.9g}"
        )
    return value, declared.display_unit
