"""What a campaign file says together with the files it extends."""

import tomllib
from collections.abc import Mapping
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

from wearlab.campaign.errors import CampaignError
from wearlab.campaign.plain import is_list_of
from wearlab.campaign.vetting import LONGEST, faults, too_deep
from wearlab.regular import read_regular
from wearlab.scene.merge import DropError, Table, merge, without
from wearlab.scene.problems import shown

LARGEST = 10_000_000  # bytes of a campaign file
MOST_FAULTS = 20  # told at once
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
        """Return the file that wrote a dotted key, or the longest beginning of it; else the campaign file."""
        words = key.split(".")
        for count in range(len(words), 0, -1):
            for layer in reversed(self.layers):
                if _has(layer.table, words[:count]):
                    return layer.file
        return self.layers[-1].file


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
        circle = " → ".join(name.name for name in (*children[children.index(file) :], file))
        raise CampaignError([f"{file}: extends: files extend each other in a circle: {circle}"])
    return _over_parents(_read(file), file, file.parent, (*children, file))


def inherit_table(table: Mapping[str, Any], name: Path, folder: Path) -> Inherited:
    """Return a table, as a campaign file would hold it, merged over the files it extends.

    Parameters
    ----------
    table : of a campaign
    name : what errors call it
    folder : what its paths start from
    """
    return _over_parents(dict(table), name, folder, ())


def _over_parents(own: Table, file: Path, folder: Path, children: tuple[Path, ...]) -> Inherited:
    if wrong := list(islice(faults(own), MOST_FAULTS)):
        raise CampaignError(f"{file}: {fault}" for fault in wrong)
    parents = _names(own.pop("extends", []), "extends", file)
    drops = _names(own.pop("drop", []), "drop", file)
    table: Table = {}
    layers: tuple[Layer, ...] = ()
    for parent in parents:
        above = inherit((folder / parent).resolve(), children)
        table, layers = merge(table, above.table), layers + above.layers
    for key in drops:
        try:
            table = without(table, key)
        except DropError as error:
            raise CampaignError([f"{file}: drop: {error}"]) from None
    own = _anchored(own, folder)
    return Inherited(merge(table, own), (*layers, Layer(file, own)))


def _read(file: Path) -> Table:
    try:
        text = read_regular(file, LARGEST).decode("utf-8-sig")
        if deep := too_deep(text):
            raise CampaignError([f"{file}: {deep}"])
        return tomllib.loads(text)
    except RecursionError:
        raise CampaignError([f"{file}: brackets or keys nested too deeply"]) from None
    except OSError as error:
        raise CampaignError([f"{file}: cannot read it: {error.strerror or error}"]) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise CampaignError([f"{file}: no TOML file: {error}"]) from None


def _names(value: Any, key: str, file: Path) -> list[str]:
    names = [value] if isinstance(value, str) else value
    if not is_list_of(names, str):
        wanted = "a file or a list of files" if key == "extends" else "a list of sections or dotted keys"
        raise CampaignError([f"{file}: {key}: {shown(value)} is not {wanted}"])
    if any(len(name) > LONGEST for name in names):
        raise CampaignError([f"{file}: {key}: a name of more than {LONGEST} characters"])
    return names


def _anchored(value: Any, folder: Path, key: str = "") -> Any:
    """Return values in which every path starts from the folder of the file that wrote it."""
    if isinstance(value, dict):
        return {
            word: _anchored(inner, folder, word) for word, inner in value.items() if word != "metadata"
        } | ({"metadata": value["metadata"]} if "metadata" in value else {})
    if isinstance(value, list):
        return [_anchored(inner, folder, key) for inner in value]
    if not isinstance(value, str):
        return value
    of_file = key.rpartition(".")[2] in PATH_KEYS or (key == PLUGINS and value.endswith(".py"))
    return str(folder / value) if of_file else value


def _has(table: Any, words: list[str]) -> bool:
    for word in words:
        if not isinstance(table, dict) or word not in table:
            return False
        table = table[word]
    return True
