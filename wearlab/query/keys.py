"""Keys that a condition may ask for: names, kinds, units; and where two scenes differ."""

import json
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, NamedTuple, get_args

from wearlab import units
from wearlab.query import grammar
from wearlab.query.grammar import All, Compare, FirstCycle, Literal, Missing, Name, Not, QueryError, Some

if TYPE_CHECKING:
    from wearlab import options

PLAIN = ("", "1", "cycles")
SHOWN = 12


@dataclass(frozen=True)
class Key:
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
    """

    name: str
    kind: str = "number"
    unit: str = ""
    quantity: str | None = None
    display_unit: str = ""
    is_path: bool = False
    history: bool = False


class Vocabulary:
    """All keys that may be asked for, found by their name or by its last words.

    Parameters
    ----------
    keys : those that have values
    aliases : other names of keys
    elsewhere : returns the key of a name that means something although nothing here has a value of it,
        or what to ask for instead
    """

    def __init__(
        self,
        keys: Iterable[Key],
        aliases: dict[str, str] | None = None,
        elsewhere: Callable[[str], Key | str | None] = lambda name: None,
    ) -> None:
        self.elsewhere = elsewhere
        self.keys = {key.name: key for key in keys}
        self.aliases = aliases or {}
        self.ends: dict[str, list[str]] = {}
        for key in self.keys.values():
            words = key.name.split(".") if key.is_path else [key.name]
            for start in range(1, len(words)):
                self.ends.setdefault(".".join(words[start:]), []).append(key.name)

    def find(self, name: Name, text: str) -> Key:
        """Return the key that a name means.

        Raises
        ------
        QueryError : no key is called so, or several are; the message lists them
        """
        wanted = name.text.removeprefix("scene.")
        if wanted not in self.keys:
            known: Any = (self.aliases, self.ends, self.keys)
            wanted = next((w for w in (wanted, wanted.lower()) if any(w in each for each in known)), wanted)
            wanted = self.aliases.get(wanted, wanted)
        if wanted in self.keys:
            return self.keys[wanted]
        candidates = self.ends.get(wanted, [])
        if len(candidates) == 1:
            return self.keys[candidates[0]]
        if candidates:
            raise QueryError(
                f"{name.text!r} may mean {_listed(sorted(candidates), 'or')}: write more of it", text, name.at
            )
        elsewhere = self.elsewhere(wanted)
        if isinstance(elsewhere, Key):
            return elsewhere
        if elsewhere:
            inside = self._inside(wanted) or self._inside(wanted.rpartition(".")[0])
            remedy = f"; there are {_listed(inside, 'and')}" if inside else ""
            raise QueryError(f"{name.text!r} {elsewhere}{remedy}", text, name.at)
        near = get_close_matches(wanted, {**self.keys, **self.ends, **self.aliases}, 3)
        remedy = f"did you mean {_listed(near, 'or')}?" if near else "nothing here is called so"
        raise QueryError(f"unknown name {name.text!r}; {remedy}", text, name.at)

    def _inside(self, table: str) -> list[str]:
        """Return the keys within a table, without the numbered values of lists."""
        inside = [key for key in self.keys if key.startswith(f"{table}.")]
        return sorted(key for key in inside if not any(word.isdigit() for word in key.split(".")))


def _listed(words: list[str], joint: str) -> str:
    quoted = [repr(word) for word in words[:SHOWN]] + (["…"] if len(words) > SHOWN else [])
    return quoted[0] if len(quoted) == 1 else f"{', '.join(quoted[:-1])} {joint} {quoted[-1]}"


def read_condition(text: str, vocabulary: Vocabulary) -> Any:
    """Return the tree of a condition with keys for names and SI values for quantities.

    Raises
    ------
    QueryError : it cannot be read, a name is unknown, or a value does not fit
    """
    return _Binder(text, vocabulary).condition(grammar.parse(text))


def read_column(text: str, vocabulary: Vocabulary) -> Any:
    """Return the key, or the ``first_cycle(…)`` of a key, that a column shows."""
    return _Binder(text, vocabulary).operand(grammar.parse_operand(text))


@dataclass(frozen=True)
class _Binder:
    text: str
    vocabulary: Vocabulary

    def condition(self, tree: Any) -> Any:
        match tree:
            case All(conditions):
                return All(tuple(self.condition(condition) for condition in conditions))
            case Some(conditions):
                return Some(tuple(self.condition(condition) for condition in conditions))
            case Not(inner):
                return Not(self.condition(inner))
            case Missing(operand):
                return Missing(self.operand(operand))
            case Compare():
                return self.comparison(tree)
        raise AssertionError(tree)

    def operand(self, operand: Any) -> Any:
        if isinstance(operand, FirstCycle):
            inner = self.comparison(operand.condition)
            if not isinstance(inner.left, Key) or not isinstance(inner.right, Literal):
                raise QueryError("first_cycle(…) compares a name with a value", self.text, operand.at)
            if not inner.left.history:
                known = sorted(key.name for key in self.vocabulary.keys.values() if key.history)
                remedy = f"there are {_listed(known, 'and')}" if known else "no run has any"
                raise QueryError(
                    f"{inner.left.name!r} is not kept along a life; {remedy}", self.text, operand.at
                )
            return replace(operand, condition=inner)
        return self.vocabulary.find(operand, self.text)

    def comparison(self, tree: Compare) -> Compare:
        left = self.operand(tree.left)
        key = Key("cycle", history=False) if isinstance(left, FirstCycle) else left
        if tree.sign == "contains" and key.kind == "number":
            raise QueryError(f"{key.name!r} is a number and contains no text", self.text, tree.left.at)
        return Compare(tree.sign, left, self.value(tree.right, key, tree.sign))

    def value(self, given: Any, key: Key, sign: str) -> Any:
        """Return what a key is compared with: a literal in its unit, or another key of the same unit."""
        if isinstance(given, Name) and key.kind != "number":
            return Literal(given.text, given.at)  # a word without quotes
        if isinstance(given, Name | FirstCycle):
            other = self.operand(given)
            unit = "1" if isinstance(other, FirstCycle) else other.unit
            if isinstance(other, Key) and other.kind == key.kind and _same(unit, key.unit):
                return other
            raise QueryError(f"{key.name!r} and this have different units", self.text, given.at)
        if isinstance(given.value, str):
            return self._text(given, key)
        if key.kind != "number":
            raise QueryError(f"{key.name!r} is a text: write the value in quotes", self.text, given.at)
        return replace(
            given, value=given.value if isinstance(given.value, bool) else self._number(given, key)
        )

    def _text(self, given: Literal, key: Key) -> Literal:
        if key.kind == "number":
            example = f", such as {_example(key)}" if key.unit not in PLAIN else ""
            raise QueryError(f"{key.name!r} is a number{example}", self.text, given.at)
        return given

    def _number(self, given: Literal, key: Key) -> float:
        number = float(given.value)
        if given.unit in ("cycle", "cycles") and key.unit in PLAIN:
            return number
        if not given.unit:
            if key.unit not in PLAIN and number != 0.0:
                raise QueryError(f"{key.name!r} needs a unit, such as {_example(key)}", self.text, given.at)
            return number
        try:
            if key.quantity:
                return units.quantity(f"{number!r} {given.unit}", key.quantity)
            return float(units.convert(number, given.unit, key.unit or "1"))
        except units.UnitError as error:
            raise QueryError(str(error), self.text, given.at) from None


def _same(name: str, other: str) -> bool:
    if name == other or {name, other} <= set(PLAIN):
        return True
    try:
        return math.isclose(float(units.convert(1.0, name, other)), 1.0)
    except units.UnitError:
        return False


def _example(key: Key) -> str:
    return f"'{units.KINDS[key.quantity].example}'" if key.quantity else f"'1 {key.display_unit or key.unit}'"


def scene_key(name: str, text: bool) -> Key:
    """Return the key of a scene's value.

    Parameters
    ----------
    name : dotted
    text : whether its value is a text
    """
    if text:
        return Key(name, "text", is_path=True)
    kind = quantity_at(name)
    if kind is None:
        return Key(name, is_path=True)
    return Key(name, "number", units.KINDS[kind].unit, kind, _shown(units.KINDS[kind]), is_path=True)


def _shown(kind: units.Measure) -> str:
    """Return the unit that values of a kind are read in: that of its example, if it is one and no scale."""
    from wearlab.shop.materials import SCALES

    usual = units.split(kind.example)[1], *kind.units
    return next((unit for unit in usual if unit not in SCALES), kind.unit)


def quantity_at(name: str) -> str | None:
    """Return the kind of quantity that a dotted key holds, None for plain values."""
    from wearlab.scene.sections import field_at  # managing runs needs no scenes

    field = field_at(tuple(word for word in name.split(".") if not word.isdigit()))
    if field is None:
        return None
    unit = _unit(field.metadata) or _within(field.annotation)
    return unit.kind if unit else None


def declared_scene_key(name: str) -> Key | str | None:
    """Return the key of a scene's value that no run has, or what else a name is; None: no name of a scene."""
    from wearlab.scene.sections import field_at, parts_at

    path = tuple(word for word in name.split(".") if not word.isdigit())
    field = field_at(path)
    if field is None:
        return None
    if parts_at(path):
        return "is a table: ask for one of its keys"
    if field.exclude:
        return "stands in campaign files only, runs keep what it leads to"
    return scene_key(name, text=quantity_at(name) is None and _is_text(field.annotation))


def _is_text(annotation: Any) -> bool:
    """Say whether a value may be a word."""
    return annotation is str or isinstance(annotation, str) or any(map(_is_text, get_args(annotation)))


def _unit(metadata: Iterable[Any]) -> "options.Unit | None":
    from wearlab import options

    return next((mark for mark in metadata if isinstance(mark, options.Unit)), None)


def _within(annotation: Any) -> "options.Unit | None":
    own = _unit(getattr(annotation, "__metadata__", ()))
    return own or next((unit for inner in get_args(annotation) if (unit := _within(inner))), None)


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
    from wearlab.schema import VARIABLES

    variable = VARIABLES.get(name) or VARIABLES.get(_stem(name))
    if kind == "text" or variable is None:
        return Key(name, kind)
    return Key(name, kind, variable.units, None, variable.display_units)


def declared_key(name: str) -> Key | None:
    """Return the key of a result that datasets may have, None for any other name."""
    from wearlab.schema import VARIABLES

    variable = VARIABLES.get(name) or VARIABLES.get(_stem(name))
    if variable is None:
        return None
    return key_of(name, "result", "number" if variable.units else "text")


def _stem(name: str) -> str:
    return next((name.removesuffix(end) for end in STATISTICS if name.endswith(end)), name)


def flat(values: Any, above: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted keys and values; entries of a list are numbered from 0, what is absent is left out."""
    inner: Iterable[tuple[Any, Any]]
    if isinstance(values, dict):
        inner = values.items()
    elif isinstance(values, list):
        inner = enumerate(values)
    else:
        if values is not None:
            yield above, values
        return
    for key, value in inner:
        yield from flat(value, f"{above}.{key}" if above else str(key))


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
    stored, usual = units.KINDS[kind].unit, units.split(units.KINDS[kind].example)[1]
    return SceneDifference(key, _in_usual_unit(a, stored, usual), _in_usual_unit(b, stored, usual), usual)


def _in_usual_unit(value: Any, stored: str, usual: str) -> Any:
    """Return a stored number in the usual unit, to the digits that a scene keeps."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    return float(f"{units.convert(float(value), stored, usual):.9g}")
