"""What a campaign file says together with the files that it extends."""

import hashlib
import os
from collections.abc import Iterable, Sequence
from functools import reduce
from pathlib import Path
from typing import Any, NamedTuple

from wearlab.campaign.blocks import CampaignError, texts_of
from wearlab.campaign.toml_file import MAX_KEY_LENGTH, check_table, read_toml
from wearlab.scene.merge import DropError, Table, merge, without

MAX_FILES = 60  # that a campaign extends, each counted as often as it is reached
PATH_KEYS = ("file", "published", "campaign", "readings")
PLUGINS = "plugins"


class Layer(NamedTuple):
    """What one file itself says, its paths made absolute."""

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

        Where no file did, this is the campaign file. A value that is no table, where
        the key goes on, has replaced what was there: its file wrote the key.

        Parameters
        ----------
        key : dotted
        """
        words = key.split(".")

        def words_written(layer: Layer) -> int:
            return _words_within(layer.table, words)

        return max(reversed(self.layers), key=words_written).file


def _words_within(table: Any, words: Sequence[str]) -> int:
    """Return how many words of a key a table has.

    These are all where the key leads on beyond a value that is no table.
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
        in_circle = (*children[children.index(file) :], file)
        circle = " → ".join(path.name for path in in_circle)
        raise CampaignError(
            f"{file}: extends: files extend each other in a circle: {circle}"
        )
    return over_parents(read_toml(file), file, file.parent, (*children, file))


def over_parents(
    table: Table, file: Path, folder: Path, children: tuple[Path, ...] = ()
) -> Inherited:
    """Return a table, as a campaign file holds it, merged over the files it extends.

    Parameters
    ----------
    table : of the file; its ``extends`` and ``drop`` are taken out of it
    file : what errors call it
    folder : what its paths start from
    children : as of `inherit`

    Raises
    ------
    CampaignError : as `inherit`
    """
    check_table(table, file)
    parents = _names(table.pop("extends", []), "extends", file)
    drops = _names(table.pop("drop", []), "drop", file)

    inherited: Table = {}
    layers: tuple[Layer, ...] = ()
    for name in parents:
        parent = inherit((folder / name).resolve(), children)
        inherited = merge(inherited, parent.table)
        layers = layers + parent.layers
        if len(layers) > MAX_FILES:
            raise CampaignError(
                f"{file}: extends: more than {MAX_FILES} files, each counted as "
                "often as it is reached: "
                "name each once, in the file that needs it"
            )

    anchored = _anchored(table, folder)
    remaining = dropped(inherited, drops, f"{file}: drop")
    return Inherited(merge(remaining, anchored), (*layers, Layer(file, anchored)))


def dropped(table: Table, keys: Iterable[str], where: str) -> Table:
    """Return a table without sections or dotted keys.

    Parameters
    ----------
    table : of a file
    keys : sections or dotted keys
    where : place of ``drop`` in the file

    Raises
    ------
    CampaignError : one is not there
    """
    try:
        return reduce(without, keys, table)
    except DropError as error:
        raise CampaignError(f"{where}: {error}") from None


def _names(value: Any, key: str, file: Path) -> tuple[str, ...]:
    """Return the names under ``extends`` or ``drop``."""
    if key == "extends":
        wanted = "a file or a list of files"
    else:
        wanted = "a list of sections or dotted keys"
    names = texts_of(value, f"{file}: {key}", f"not {wanted}")
    if any(len(name) > MAX_KEY_LENGTH for name in names):
        raise CampaignError(
            f"{file}: {key}: a name of more than {MAX_KEY_LENGTH} characters"
        )
    return names


def _anchored(value: Any, folder: Path, key: str = "") -> Any:
    """Return values whose paths start from the folder of the file that wrote them."""
    if isinstance(value, dict):
        inner = {
            word: _anchored(part, folder, word)
            for word, part in value.items()
            if word != "metadata"
        }
        return value | inner
    if isinstance(value, list):
        return [_anchored(part, folder, key) for part in value]
    if not isinstance(value, str):
        return value

    is_plugin_file = key == PLUGINS and value.endswith(".py")
    is_path = key.rpartition(".")[2] in PATH_KEYS or is_plugin_file
    return str(folder / value) if is_path else value


def source_text(path: Path | None) -> str:
    """Return the text of a campaign file and of all it extends, each under its name.

    The file itself comes first. Names are relative to its folder: the text tells
    nothing of a machine. Without a file the text is "".

    Parameters
    ----------
    path : the campaign file
    """
    if path is None or not path.is_file():
        return ""
    layers = inherit(path.resolve()).layers
    files = dict.fromkeys(layer.file for layer in reversed(layers))
    folder = path.resolve().parent
    return "\n".join(
        f"# ---- {_relative_name(file, folder)}\n{file.read_text(encoding='utf-8-sig')}"
        for file in files
    )


def fingerprint(text: str) -> str:
    """Return the hash by which a text is known, 16 hexadecimal digits.

    Parameters
    ----------
    text : of a campaign; the hash of no text is ""
    """
    return hashlib.sha256(text.encode()).hexdigest()[:16] if text else ""


def _relative_name(file: Path, folder: Path) -> str:
    """Return a file's path from a folder, its name where it lies on another drive."""
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:
        return file.name
