"""Plug-ins: files of a user's own whose variants, results and figures stand beside wearlab's.

A plug-in is code, and a campaign file may come from a stranger: nothing here runs any
unless the user said so (``--plugins`` on the command line; from Python, calling it is
saying so). What a plug-in's options are is written beside the runs it made, so that
plans, figures and reports of them need no code of it.
"""

import hashlib
import json
import linecache
import sys
from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager
from contextvars import ContextVar
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar, Literal, NamedTuple

from pydantic import create_model

from wearlab import options
from wearlab.options import option
from wearlab.slots import ORIGIN, Origin, Slot, SlotError, Variant, changed, within

GROUP = "wearlab.variants"
FOLDER = "plugins"
"""Where a store keeps what plug-ins declare, one file named by the hash of the
source."""
FORMAT = 1
CONSENT = "--plugins"


class PluginError(ValueError):
    """A plug-in cannot be read, says nothing, or may not be run."""


class Plugin(NamedTuple):
    """A plug-in's source.

    Parameters
    ----------
    name : its file's name, or that of its entry point
    source : its text
    module : the installed module it is, "" for a file
    """

    name: str
    source: str
    module: str = ""

    @property
    def sha256(self) -> str:
        """Hash of its source, part of the identity of every run that uses one of its variants."""
        return hashlib.sha256(self.source.encode()).hexdigest()


LOADED: dict[str, Plugin] = {}
"""The plug-ins that this process has run, by hash."""


_BROUGHT: dict[str, list[tuple[str, type[Variant]]]] = {}


class Sort:
    """What a plug-in may hold besides variants: values of its module that have a name.

    Parameters
    ----------
    word : what declarations call them
    kind : their type
    known : the table that they join, by name
    """

    all: ClassVar[dict[str, "Sort"]] = {}

    def __init__(self, word: str, kind: type, known: dict[str, Any]) -> None:
        self.word, self.kind, self.known = word, kind, known
        self.held: dict[str, dict[str, Any]] = {}
        self.owner: dict[str, str] = {}
        self.all[word] = self

    def wrong(self, value: Any) -> str:
        """Return what is wrong with a value, "" where nothing is."""
        raise NotImplementedError

    def add(self, value: Any) -> None:
        """Let a value join the table."""
        self.known[value.name] = value

    def remove(self, name: str) -> None:
        """Take a value out of the table."""
        self.known.pop(name, None)

    def declared(self, value: Any) -> dict[str, Any]:
        """Return what there is to know of a value unread, as JSON can hold it."""
        return {"name": value.name}

    def stand_in(self, record: Mapping[str, Any]) -> Any:
        """Return what stands for a value whose code is not run.

        None where nothing can.
        """
        return None

    def take(self, module: ModuleType, plugin: Plugin) -> None:
        """Take up the values that a plug-in's module makes.

        Raises
        ------
        SlotError
            When one is wrong, or another has its name.
        """
        own: dict[str, Any] = {}
        values: list[Any] = [
            value for value in vars(module).values() if isinstance(value, self.kind)
        ]
        for value in (
            value for value in values if self.known.get(value.name) is not value
        ):
            what = f"{self.kind.__name__} {value.name!r}"
            if value.name in self.known and self.owner.get(value.name) != plugin.name:
                raise SlotError(f"{what} is there already: give yours another name")
            if wrong := self.wrong(value):
                raise SlotError(f"{what}: {wrong}")
            own[value.name] = value
        self.hold(own, Origin(plugin.name, plugin.sha256))
        self.again(plugin.sha256)

    def hold(self, own: dict[str, Any], origin: Origin) -> None:
        """Know what a plug-in holds, by name."""
        self.held.setdefault(origin.sha256, {}).update(own)
        self.owner |= dict.fromkeys(own, origin.file)

    def again(self, sha256: str) -> None:
        """Let what a plug-in holds join the table once more."""
        for value in self.held.get(sha256, {}).values():
            self.add(value)

    def forget(self, sha256: str) -> None:
        """Take what a plug-in holds out of the table."""
        for name in self.held.pop(sha256, {}):
            self.remove(name)
            self.owner.pop(name, None)


UNRUN: dict[str, str] = {}
"""Names of what is not known until a plug-in is run → the plug-in's name."""


class Trust(NamedTuple):
    """Whether plug-ins may be run, and where else to look for what they declare.

    Parameters
    ----------
    runs : whether their code is run
    declared : folder in which runs of plug-ins have left declarations
    """

    runs: bool = True
    declared: Path | None = None


_TRUST: ContextVar[Trust | None] = ContextVar("trust", default=None)


def trusting(trust: Trust) -> AbstractContextManager[None]:
    """Hold to this while a campaign file is read: the command line trusts nothing unless told so."""
    return within(_TRUST, trust)


def read(named: str) -> Plugin:
    """Return the plug-in of a Python file, or of an entry point of the group ``wearlab.variants``.

    Raises
    ------
    PluginError
        When there is no such file or entry point.
    """
    if named.endswith(".py"):
        return Plugin(Path(named).name, _text(Path(named), named))
    known = {
        point.name: point.value.partition(":")[0] for point in entry_points(group=GROUP)
    }
    if named not in known:
        there = ", ".join(known) or "none"
        raise PluginError(
            f"{named!r} is no Python file and no entry point of {GROUP}; installed: "
            f"{there}"
        )
    return Plugin(named, _text(_place(known[named]), named), known[named])


def _place(module: str) -> Path:
    """Return the file of an installed module, none of whose packages is imported for that."""
    first, *further = module.split(".")
    spec = find_spec(first)
    if spec is None or spec.origin is None:
        raise PluginError(
            f"the module {module!r} of an entry point of {GROUP} is not installed"
        )
    place = Path(spec.origin)
    return place.parent.joinpath(*further).with_suffix(".py") if further else place


def _text(file: Path, named: str) -> str:
    try:
        return file.read_bytes().decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise PluginError(
            f"{named}: cannot read it: {getattr(error, 'strerror', None) or error}"
        ) from None


def use(named: Iterable[str]) -> tuple[Plugin, ...]:
    """Make the variants of plug-ins known: run them, or take what is written of them.

    Parameters
    ----------
    named : Python files and entry points

    Raises
    ------
    PluginError
        When one may not be run and nothing is known of it, or it cannot be run.
    """
    trust = _TRUST.get() or Trust()
    plugins = tuple(read(path) for path in named)
    for plugin in plugins:
        record = trust.declared and trust.declared / f"{plugin.sha256}.json"
        if trust.runs:
            bring(plugin)
        elif record is not None and record.is_file():
            stand_in(record.read_text())
        else:
            said = f"is Python code that would be run: look at it, then add {CONSENT}"
            raise PluginError(f"{plugin.name} {said}")
    return plugins


def bring(plugin: Plugin) -> None:
    """Run a plug-in's source, once in a process; what it defines joins the slots.

    Raises
    ------
    PluginError
        When it fails, or defines no variant.
    """
    if plugin.sha256 not in LOADED:
        before = brought()
        _run(plugin)
        _BROUGHT[plugin.sha256] = [
            variant for variant in brought() if variant not in before
        ]
        LOADED[plugin.sha256] = plugin
    for name, part in _BROUGHT[plugin.sha256]:
        part.slot.add(part, name)
    for sort in Sort.all.values():
        sort.again(plugin.sha256)
    changed()


def held(word: str, plugins: Iterable[Plugin]) -> dict[str, str]:
    """Return the names of what plug-ins hold of a sort, each with the hash of its source."""
    return {
        name: plugin.sha256
        for plugin in plugins
        for name in Sort.all[word].held.get(plugin.sha256, {})
    }


def forget() -> None:
    """Forget every plug-in; scenes that were made with one keep it."""
    for name, part in brought():
        del part.slot.known[name]
    for sort in Sort.all.values():
        for sha256 in tuple(sort.held):
            sort.forget(sha256)
    for table in (LOADED, _BROUGHT, UNRUN):
        table.clear()
    changed()


def _run(plugin: Plugin) -> None:
    """Execute a plug-in's source as a module of its own, and take up what it defines."""
    module = _module_of(plugin)
    origin = Origin(plugin.name, plugin.sha256)
    sorts = Sort.all.values()
    try:
        with within(ORIGIN, origin):
            exec(compile(plugin.source, module.__file__ or "", "exec"), vars(module))
        for sort in sorts:
            sort.take(module, plugin)
        defines_variant = any(part.origin == origin for _, part in brought())
        if not defines_variant and not any(
            sort.held.get(plugin.sha256) for sort in sorts
        ):
            bases = ", ".join(
                slot.base.__name__
                for slot in Slot.all.values()
                if slot.base is not None
            )
            kinds = " or ".join(sort.kind.__name__ for sort in sorts)
            raise SlotError(f"defines no variant, a class of {bases}, and no {kinds}")
    except Exception as error:
        del sys.modules[module.__name__]
        for sort in sorts:
            sort.forget(plugin.sha256)
            for sha256 in LOADED:
                sort.again(sha256)
        reason = (
            str(error)
            if isinstance(error, SlotError)
            else f"{type(error).__name__}: {error}"
        )
        raise PluginError(f"{plugin.name}: {reason}") from error


def _module_of(plugin: Plugin) -> ModuleType:
    """Return a new module whose source `inspect` finds, so that texts under options stay."""
    module = ModuleType(f"wearlab_plugin_{plugin.sha256[:16]}")
    module.__file__ = f"{plugin.sha256}/{plugin.name}"
    module.__package__ = plugin.module.rpartition(".")[0]
    lines = plugin.source.splitlines(keepends=True)
    linecache.cache[module.__file__] = (
        len(plugin.source),
        None,  # is no file whose time is looked at
        lines,
        module.__file__,
    )
    sys.modules[module.__name__] = module
    return module


def brought() -> list[tuple[str, type[Variant]]]:
    """Return the variants of plug-ins that are known now, each with its name."""
    every = [variant for slot in Slot.all.values() for variant in slot.known.items()]
    return [(name, part) for name, part in every if part.origin is not None]


def declaration(plugin: Plugin) -> dict[str, Any]:
    """Return what there is to know of a plug-in that was run, as JSON can hold it."""
    told = {
        "format": FORMAT,
        "name": plugin.name,
        "sha256": plugin.sha256,
        "source": plugin.source,
    }
    variants = [_declared(name, part) for name, part in _BROUGHT[plugin.sha256]]
    held = {
        word: sort.held.get(plugin.sha256, {}).values()
        for word, sort in Sort.all.items()
    }
    sorts = {
        word: [Sort.all[word].declared(value) for value in values]
        for word, values in held.items()
    }
    return {**told, "variants": variants, **sorts}


def _declared(name: str, part: type[Variant]) -> dict[str, Any]:
    schema = part.model_json_schema()
    return {
        "slot": part.slot.key,
        "class": part.__name__,
        "name": name,
        "doc": part.__doc__ or "",
        "options": schema["properties"],
        "required": schema.get("required", []),
    }


def stand_in(text: str) -> None:
    """Take up a plug-in as it was declared: options without physics, results without their function.

    Raises
    ------
    PluginError
        When the declaration cannot be read.
    """
    try:
        record: Mapping[str, Any] = json.loads(text)
        origin = Origin(str(record["name"]), str(record["sha256"]), runs=False)
        with within(ORIGIN, origin):
            for variant in record["variants"]:
                _stand_in(variant)
        for word, sort in Sort.all.items():
            for value in record.get(word, ()):
                made = sort.stand_in(value)
                if made is None:
                    UNRUN[str(value["name"])] = str(record["name"])
                elif made.name not in sort.known:
                    if wrong := sort.wrong(made):
                        raise ValueError(f"{made.name}: {wrong}")
                    sort.hold({made.name: made}, origin)
                    sort.add(made)
    except (KeyError, TypeError, ValueError) as error:
        raise PluginError(
            f"a plug-in's declaration cannot be read ({error!r})"
        ) from None
    changed()


def _stand_in(record: Mapping[str, Any]) -> None:
    slot = Slot.all[record["slot"]]
    assert slot.base is not None
    fields: dict[str, Any] = {}
    for key, said in record["options"].items():
        if key in slot.base.model_fields:
            continue
        kind = Literal[str(record["name"])] if key == slot.chooser else _kind(said)
        default = ... if key in record["required"] else said.get("default")
        kind = kind if default is not None else kind | None
        fields[key] = kind, option(default, said.get("description", ""))
    create_model(
        str(record["class"]), __base__=slot.base, __doc__=record["doc"], **fields
    )


def _kind(said: Mapping[str, Any]) -> Any:
    """Return the type of an option from its JSON Schema."""
    if "anyOf" in said:
        said = next(branch for branch in said["anyOf"] if branch.get("type") != "null")
    if "kind" in said:
        return options.measured(said["kind"])
    if "enum" in said:
        return Literal[tuple(said["enum"])]
    plain = {
        "number": options.Number,
        "integer": options.Count,
        "boolean": options.Switch,
        "string": str,
    }
    return plain.get(said.get("type", ""), Any)
