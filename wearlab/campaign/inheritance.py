"""What a campaign file says together with the files it extends, as plain tables.

Errors of its keys.
"""

import hashlib
import os
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import reduce
from itertools import islice
from os import PathLike, fspath
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, get_args, get_origin

from pydantic import ValidationError

from wearlab import files, nearest
from wearlab.options import OptionTable
from wearlab.scene.merge import DropError, Table, merge, without
from wearlab.scene.problems import (
    EXPECTED,
    Refusal,
    limit_of,
    not_a_choice,
    not_of_kind,
    shown,
)


class CampaignError(Refusal):
    """A campaign file is refused whole; its problems say file and path first."""


def is_list_of(value: Any, kind: type) -> bool:
    """Whether a value is a list, all of whose elements are of a kind."""
    return isinstance(value, list) and all(
        isinstance(element, kind) for element in value
    )


def listed(value: Any, name: str) -> list[Any]:
    """Return the ``[[name]]`` blocks of a file.

    Raises
    ------
    CampaignError : the value is no list of tables
    """
    if not is_list_of(value, dict):
        raise CampaignError(
            f"{name}: {shown(value)} is no list of tables: write [[{name}]]"
        )
    return list(value)


def tried(faults: list[str], read: Callable[..., Any], *arguments: Any) -> Any:
    """Return what a reader returns, None where it refuses: its problems join the others."""
    try:
        return read(*arguments)
    except CampaignError as error:
        faults.extend(error.problems)
        return None


def plain(value: Any) -> Any:
    """Return a value in which mappings are tables, arrays lists, numbers of NumPy Python's, paths texts."""
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, PathLike):
        return fspath(value)
    if hasattr(value, "tolist"):  # an array, or one of its numbers
        value = value.tolist()
    return (
        [plain(element) for element in value]
        if isinstance(value, list | tuple)
        else value
    )


DEEPEST = 50  # tables within tables
LONGEST = 1_000  # characters of a key
WIDEST = 2**63  # whole numbers, as TOML has them
WORD = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
CHAIN = re.compile(
    rf"(?:^|[{{,])[ \t\[]*+(?:{WORD}[ \t]*+\.[ \t]*+){{{DEEPEST}}}", re.MULTILINE
)
AT_LINE = re.compile(r"at line (\d+)")
DECIMAL_COMMA = re.compile(r"=\s*(-?\d+),(\d+)\s*(?:$|#|\})")
BARE_QUANTITY = re.compile(
    r"=\s*(-?\d+(?:\.\d+)?(?:e[+-]?\d+)?)\s*([A-Za-zµ°][A-Za-z0-9µ°*/^]{0,20})"
)


def faults(value: Any, path: str = "", depth: int = 0) -> Iterator[str]:
    """Yield what is wrong with keys and whole numbers of a table, each with its path."""
    if depth > DEEPEST:
        yield f"{_short(path)}: keys nested more than {DEEPEST} deep"
    elif isinstance(value, dict):
        for key, inner in value.items():
            if fault := _of_key(key):
                yield f"{_short(path) or 'the file'}: {fault}"
            else:
                yield from faults(inner, f"{path}.{key}" if path else key, depth + 1)
    elif isinstance(value, list):
        for number, inner in enumerate(value):
            yield from faults(inner, f"{path}[{number}]", depth + 1)
    elif isinstance(value, int) and not -WIDEST <= value < WIDEST:
        digits = len(f"{abs(value):x}")
        yield (
            f"{_short(path)}: a whole number of {digits} hexadecimal digits: TOML has "
            "no more than 16"
        )


def _of_key(key: str) -> str | None:
    if not key.strip():
        return "an empty key"
    if len(key) > LONGEST:
        return f"a key of {len(key)} characters, {key[:20]!r}…"
    return (
        f"a key of {key.count('.') + 1} parts, {key[:20]!r}…"
        if key.count(".") > DEEPEST
        else None
    )


def _short(path: str) -> str:
    return path if len(path) < 200 else f"{path[:200]}…"


WORDS = re.compile(r"'([^']*)'")
Model = TypeVar("Model", bound=OptionTable)


def modelled(model: type[Model], given: Any, where: str) -> Model:
    """Return a table of the file as a model.

    Parameters
    ----------
    model : what it should be
    given : what the file says
    where : its place in the file

    Raises
    ------
    CampaignError : with one line for each key that is wrong
    """
    try:
        return model.model_validate(given)
    except ValidationError as error:
        faults: dict[
            tuple[str, str], tuple[list[dict[str, Any]], Any, type[OptionTable]]
        ] = {}
        for problem in error.errors():
            key, own, inner, place = _innermost(problem["loc"], given, model, where)
            faults.setdefault((place, key), ([], own, inner))[0].append(dict(problem))
        raise CampaignError(
            _line(key, *fault, place) for (place, key), fault in faults.items()
        ) from None


def blocks_of(model: type[Model], given: Any, name: str) -> tuple[Model, ...]:
    """Return the ``[[name]]`` blocks of a file as models.

    Raises
    ------
    CampaignError : they are no list, or with one line for each key that is wrong
    """
    if not isinstance(given, list):
        raise CampaignError(
            f"{name}: {shown(given)} is no list of tables: write [[{name}]]"
        )
    return tuple(
        modelled(model, block, f"{name}[{number}]")
        for number, block in enumerate(given)
    )


def texts_of(given: Any, where: str, wanted: str) -> tuple[str, ...]:
    """Return a text, or a list of them, as texts.

    Raises
    ------
    CampaignError : it is not what is wanted
    """
    texts = [given] if isinstance(given, str) else given
    if not is_list_of(texts, str):
        raise CampaignError(f"{where}: {shown(given)} is {wanted}")
    return tuple(texts)


def _innermost(
    loc: tuple[int | str, ...], given: Any, model: type[OptionTable], where: str
) -> tuple[str, Any, type[OptionTable], str]:
    """Return the key that pydantic finds wrong, "" for a whole table, and the table it is of."""
    if not loc:
        return "", given, model, where
    key = str(loc[0])
    rest = loc[1:]
    inner, listed = _table_of(model, key)
    if inner is None or key not in given or (listed and not rest):
        return key, given, model, where
    if listed:
        return _innermost(
            rest[1:], given[key][rest[0]], inner, f"{where}.{key}[{rest[0]}]"
        )
    return _innermost(rest, given[key], inner, f"{where}.{key}")


def _table_of(
    model: type[OptionTable], key: str
) -> tuple[type[OptionTable] | None, bool]:
    """Return what the tables of a key are, None of one that has values, and whether there are several."""
    annotation = (
        model.model_fields[key].annotation if key in model.model_fields else None
    )
    kinds = [
        kind for kind in (annotation, *get_args(annotation)) if isinstance(kind, type)
    ]
    tables = [kind for kind in kinds if issubclass(kind, OptionTable)]
    return (tables[0] if tables else None), get_origin(annotation) is tuple


def _line(
    key: str,
    errors: list[dict[str, Any]],
    given: Any,
    model: type[OptionTable],
    where: str,
) -> str:
    """Return what is wrong with one key, "" for the whole table."""
    error = errors[0]
    if error["type"] == "value_error":  # says itself what is wrong
        return (
            f"{where}.{key}".rstrip(".")
            + f": {error['msg'].removeprefix('Value error, ')}"
        )
    if not key:
        name, several, _ = where.partition("[")
        header = f"[[{name}]]" if several else f"[{name}]"
        return (
            f"{where}: {shown(given)} is {not_of_kind([error['type']])}: write {header}"
        )
    if error["type"] == "extra_forbidden":
        remedy = nearest.meant(
            key, model.model_fields, f"; there are {', '.join(model.model_fields)}"
        )
        return f"{where}.{key}: unknown key{remedy}"
    if error["type"] == "literal_error":
        return (
            f"{where}.{key}: "
            f"{not_a_choice(given[key], WORDS.findall(error['ctx']['expected']))}"
        )
    meaning = model.texts()[key]["description"]
    if error["type"] == "missing":
        return f"{where}.{key}: required: {meaning}"
    if limit := limit_of(error.get("ctx", {})):
        return f"{where}.{key}: {shown(given[key])} {limit}: {meaning}"
    if any(problem["type"] not in EXPECTED for problem in errors):
        said = str(error["msg"])
        return (
            f"{where}.{key}: {shown(given[key])}: {said[:1].lower()}{said[1:]}: "
            f"{meaning}"
        )
    wrong = not_of_kind(problem["type"] for problem in errors)
    if _table_of(model, key)[1]:
        return (
            f"{where}.{key}: {shown(given[key])} is {wrong} of tables: write "
            f"[[{where}.{key}]]"
        )
    return f"{where}.{key}: {shown(given[key])} is {wrong}: {meaning}"


LARGEST = 10_000_000  # bytes of a campaign file
MOST_FAULTS = 20  # told at once
MOST_FILES = 60  # that a campaign extends, each counted as often as it is reached
PATH_KEYS = ("file", "published", "campaign")
PLUGINS = "plugins"


class Layer(NamedTuple):
    """One file's own words, its paths made absolute."""

    file: Path
    table: Table


class Inherited(NamedTuple):
    """A file over what it extends.

    Parameters
    ----------
    table : everything merged
    layers : the files, the one that counts most last
    """

    table: Table
    layers: tuple[Layer, ...]

    def file_of(self, key: str) -> Path:
        """Return the file that wrote a dotted key, or the longest beginning of it.

        Else the campaign file.

        A value that is no table, where the key goes on, has replaced what was there:
        its file wrote the key.
        """
        words = key.split(".")
        return max(
            reversed(self.layers), key=lambda layer: _words_within(layer.table, words)
        ).file


def _words_within(table: Any, words: Sequence[str]) -> int:
    """Return how many words of a key a table has.

    All, where it ends in a value that is no table.
    """
    for count, word in enumerate(words):
        if not isinstance(table, dict):
            return len(words)
        if word not in table:
            return count
        table = table[word]
    return len(words)


def inherit(file: Path, children: tuple[Path, ...] = ()) -> Inherited:
    """Return a file merged over the files it extends, the later one over the earlier.

    Parameters
    ----------
    file : a campaign file
    children : the files that extend it, to notice circles

    Raises
    ------
    CampaignError
        When a file cannot be read, extends itself, or drops what is not there.
    """
    if file in children:
        circle = " → ".join(
            name.name for name in (*children[children.index(file) :], file)
        )
        raise CampaignError(
            f"{file}: extends: files extend each other in a circle: {circle}"
        )
    return over_parents(_read(file), file, file.parent, (*children, file))


def over_parents(
    own: Table, file: Path, folder: Path, children: tuple[Path, ...] = ()
) -> Inherited:
    """Return a table, as a campaign file holds it, merged over the files it extends.

    Parameters
    ----------
    own : the table
    file : what errors call it
    folder : what its paths start from
    children : as of `inherit`
    """
    if wrong := list(islice(faults(own), MOST_FAULTS)):
        raise CampaignError(f"{file}: {fault}" for fault in wrong)
    parents = _names(own.pop("extends", []), "extends", file)
    drops = _names(own.pop("drop", []), "drop", file)
    table: Table = {}
    layers: tuple[Layer, ...] = ()
    for parent in parents:
        above = inherit((folder / parent).resolve(), children)
        table = merge(table, above.table)
        layers = layers + above.layers
        if len(layers) > MOST_FILES:
            raise CampaignError(
                f"{file}: extends: more than {MOST_FILES} files, each counted as "
                "often as it is reached: "
                "name each once, in the file that needs it"
            )
    own = _anchored(own, folder)
    return Inherited(
        merge(dropped(table, drops, f"{file}: drop"), own), (*layers, Layer(file, own))
    )


def dropped(table: Table, keys: Iterable[str], where: str) -> Table:
    """Return a table without sections or dotted keys.

    Raises
    ------
    CampaignError : one is not there
    """
    try:
        return reduce(without, keys, table)
    except DropError as error:
        raise CampaignError(f"{where}: {error}") from None


def _read(file: Path) -> Table:
    try:
        text = files.read_regular(file, LARGEST).decode("utf-8-sig")
        if chain := CHAIN.search(
            text
        ):  # the TOML reader takes long over long dotted keys
            line = text.count("\n", 0, chain.start()) + 1
            raise CampaignError(
                f"{file}: line {line}: a key of more than {DEEPEST} parts"
            )
        return tomllib.loads(text)
    except RecursionError:
        raise CampaignError(f"{file}: brackets or keys nested too deeply") from None
    except OSError as error:
        raise CampaignError(
            f"{file}: cannot read it: {error.strerror or error}"
        ) from None
    except UnicodeDecodeError as error:
        raise CampaignError(f"{file}: no TOML file: {error}") from None
    except tomllib.TOMLDecodeError as error:
        raise CampaignError(
            f"{file}: no TOML file: {error}{_remedy(text, str(error))}"
        ) from None


def _remedy(text: str, problem: str) -> str:
    """Return how the quantity of the line that is no TOML is written.

    No text of the file besides.
    """
    place = AT_LINE.search(problem)
    lines = text.splitlines()
    if place is None or not 0 < int(place[1]) <= len(lines):
        return ""
    line = lines[int(place[1]) - 1]
    if comma := DECIMAL_COMMA.search(line):
        return f"; write a decimal point: {comma[1]}.{comma[2]}"
    if bare := BARE_QUANTITY.search(line):
        return f'; write a quantity with its unit in quotes: "{bare[1]} {bare[2]}"'
    return ""


def _names(value: Any, key: str, file: Path) -> tuple[str, ...]:
    wanted = (
        "a file or a list of files"
        if key == "extends"
        else "a list of sections or dotted keys"
    )
    names = texts_of(value, f"{file}: {key}", f"not {wanted}")
    if any(len(name) > LONGEST for name in names):
        raise CampaignError(f"{file}: {key}: a name of more than {LONGEST} characters")
    return names


def _anchored(value: Any, folder: Path, key: str = "") -> Any:
    """Return values in which every path starts from the folder of the file that wrote it."""
    if isinstance(value, dict):
        inner = {
            word: _anchored(own, folder, word)
            for word, own in value.items()
            if word != "metadata"
        }
        return value | inner
    if isinstance(value, list):
        return [_anchored(inner, folder, key) for inner in value]
    if not isinstance(value, str):
        return value
    of_file = key.rpartition(".")[2] in PATH_KEYS or (
        key == PLUGINS and value.endswith(".py")
    )
    return str(folder / value) if of_file else value


def source_text(path: Path | None) -> str:
    """Return the text of a campaign file and of all it extends, each under its name.

    "" without a file.

    The file itself comes first. Names are relative to its folder: the text tells
    nothing of a machine.

    Parameters
    ----------
    path : the campaign file
    """
    if path is None or not path.is_file():
        return ""
    files = dict.fromkeys(
        layer.file for layer in reversed(inherit(path.resolve()).layers)
    )
    texts = (
        (_name(file, path.resolve().parent), file.read_text(encoding="utf-8-sig"))
        for file in files
    )
    return "\n".join(f"# ---- {name}\n{text}" for name, text in texts)


def fingerprint(text: str) -> str:
    """Return the hash by which a text is known, 16 hexadecimal digits.

    "" for no text.
    """
    return hashlib.sha256(text.encode()).hexdigest()[:16] if text else ""


def _name(file: Path, folder: Path) -> str:
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:  # another drive
        return file.name
