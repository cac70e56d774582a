"""Plug-ins: Python files of users that add variants, results and kinds of figures.

A plug-in is code, and a campaign file may come from a stranger: nothing here runs any
unless the user said so (``--plugins`` on the command line; from Python, calling it is
saying so). What a plug-in's options are is written beside the runs it made, so that
plans, figures and reports of them need no code of it.
"""

import hashlib
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
from wearlab.files import finite_json, read_regular
from wearlab.options import option
from wearlab.slots import ORIGIN, Origin, Slot, SlotError, Variant, changed, within

GROUP = "wearlab.variants"
FOLDER = "plugins"
"""Where a store keeps what plug-ins declare, one file named by the hash of the
source."""
FORMAT = 1
CONSENT = "--plugins"
LARGEST = 10_000_000  # bytes of a source or a declaration
DECLARATION_ERRORS = (
    KeyError,
    TypeError,
    ValueError,
    AttributeError,
    AssertionError,
    OverflowError,
    RecursionError,
)
"""What reading a declaration raises that no wearlab wrote."""


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
        """Hash of its source: part of the identity of every run that uses it."""
        return hashlib.sha256(self.source.encode()).hexdigest()


LOADED: dict[str, Plugin] = {}
"""The plug-ins that this process has run, by hash."""
UNRUN: dict[str, str] = {}
"""Names of values that only a run of a plug-in defines → the plug-in's name."""
_VARIANTS: dict[str, list[tuple[str, type[Variant]]]] = {}
"""Variants of each plug-in that this process has run, with their names, by hash."""


class Registry:
    """A table of named values that plug-ins may add to, such as kinds of figures.

    A plug-in adds every value of the type that stands in its module.

    Parameters
    ----------
    word : what declarations of plug-ins call the values
    kind : type of the values
    table : the values by name, wearlab's and those of plug-ins
    """

    all: ClassVar[dict[str, "Registry"]] = {}

    def __init__(self, word: str, kind: type, table: dict[str, Any]) -> None:
        self.word = word
        self.kind = kind
        self.table = table
        self.by_plugin: dict[str, dict[str, Any]] = {}
        self.owner: dict[str, str] = {}
        self.all[word] = self

    def problem(self, value: Any) -> str:
        """Return what is wrong with a value, "" where nothing is.

        Parameters
        ----------
        value : of a plug-in's module
        """
        raise NotImplementedError

    def add(self, value: Any) -> None:
        """Add a value to the table.

        Parameters
        ----------
        value : of a plug-in, without a problem
        """
        self.table[value.name] = value

    def remove(self, name: str) -> None:
        """Remove a value from the table.

        Parameters
        ----------
        name : of the value
        """
        self.table.pop(name, None)

    def declared(self, value: Any) -> dict[str, Any]:
        """Return what a store keeps of a value, as JSON can hold it.

        Parameters
        ----------
        value : of a plug-in
        """
        return {"name": value.name}

    def stand_in(self, record: Mapping[str, Any]) -> Any:
        """Return what stands for a value whose code is not run, None where nothing can.

        Parameters
        ----------
        record : what a store keeps of the value, see `declared`
        """
        return None

    def take(self, module: ModuleType, plugin: Plugin) -> None:
        """Add the values of a plug-in's module to the table.

        Parameters
        ----------
        module : the module, executed
        plugin : whose module it is

        Raises
        ------
        SlotError
            When one is wrong, or another has its name.
        """
        new_values: dict[str, Any] = {}
        for value in vars(module).values():
            if not isinstance(value, self.kind):
                continue
            named: Any = value
            if self.table.get(named.name) is named:
                continue  # imported from elsewhere

            label = f"{self.kind.__name__} {named.name!r}"
            if named.name in self.table and self.owner.get(named.name) != plugin.name:
                raise SlotError(f"{label} is there already: give yours another name")
            if problem := self.problem(named):
                raise SlotError(f"{label}: {problem}")
            new_values[named.name] = named

        self.record(new_values, Origin(plugin.name, plugin.sha256))
        self.restore(plugin.sha256)

    def record(self, values: dict[str, Any], origin: Origin) -> None:
        """Note which values come from a plug-in.

        Parameters
        ----------
        values : by name
        origin : the plug-in
        """
        self.by_plugin.setdefault(origin.sha256, {}).update(values)
        self.owner |= dict.fromkeys(values, origin.file)

    def restore(self, sha256: str) -> None:
        """Add the values of a plug-in that was run to the table once more.

        Parameters
        ----------
        sha256 : hash of the plug-in's source
        """
        for value in self.by_plugin.get(sha256, {}).values():
            self.add(value)

    def forget(self, sha256: str) -> None:
        """Remove the values of a plug-in from the table.

        Parameters
        ----------
        sha256 : hash of the plug-in's source
        """
        for name in self.by_plugin.pop(sha256, {}):
            self.remove(name)
            self.owner.pop(name, None)


class Trust(NamedTuple):
    """Whether plug-ins may be run, and where their declarations are kept.

    Parameters
    ----------
    runs : whether their code is run
    declared : folder in which runs of plug-ins have left declarations
    """

    runs: bool = True
    declared: Path | None = None


_TRUST: ContextVar[Trust | None] = ContextVar("trust", default=None)


def trusting(trust: Trust) -> AbstractContextManager[None]:
    """Apply a trust while a campaign file is read.

    The command line trusts no plug-in without ``--plugins``.

    Parameters
    ----------
    trust : what holds inside of ``with``
    """
    return within(_TRUST, trust)


def read(path: str) -> Plugin:
    """Return the plug-in of a Python file, or of an entry point.

    Parameters
    ----------
    path : a file that ends in ``.py``, or the name of an entry point of the group
        ``wearlab.variants``

    Raises
    ------
    PluginError
        When there is no such file or entry point.
    """
    if path.endswith(".py"):
        return Plugin(Path(path).name, _text(Path(path), path))

    modules = {
        point.name: point.value.partition(":")[0] for point in entry_points(group=GROUP)
    }
    if path not in modules:
        installed = ", ".join(modules) or "none"
        raise PluginError(
            f"{path!r} is no Python file and no entry point of {GROUP}; installed: "
            f"{installed}"
        )
    module = modules[path]
    return Plugin(path, _text(_file_of(module), path), module)


def _file_of(module: str) -> Path:
    """Return the file of an installed module, without an import of its packages."""
    package, *submodules = module.split(".")
    spec = find_spec(package)
    if spec is None or spec.origin is None:
        raise PluginError(
            f"the module {module!r} of an entry point of {GROUP} is not installed"
        )
    file = Path(spec.origin)
    if not submodules:
        return file
    return file.parent.joinpath(*submodules).with_suffix(".py")


def _text(file: Path, path: str) -> str:
    """Return the text of a plug-in's file; errors call it by the path of the user."""
    try:
        return read_regular(file, LARGEST).decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise PluginError(f"{path}: cannot read it: {reason}") from None


def use(paths: Iterable[str]) -> tuple[Plugin, ...]:
    """Make the variants of plug-ins known: run them, or read their declarations.

    Parameters
    ----------
    paths : Python files and names of entry points

    Raises
    ------
    PluginError
        When one may not be run and nothing is known of it, or it cannot be run.
    """
    trust = _TRUST.get() or Trust()
    plugins = tuple(read(path) for path in paths)
    for plugin in plugins:
        declaration_file = trust.declared and trust.declared / f"{plugin.sha256}.json"
        if trust.runs:
            bring(plugin)
        elif declaration_file is not None and declaration_file.is_file():
            stand_in(_text(declaration_file, str(declaration_file)))
        else:
            raise PluginError(
                f"{plugin.name} is Python code that would be run: look at it, then "
                f"add {CONSENT}"
            )
    return plugins


def bring(plugin: Plugin) -> None:
    """Run a plug-in's source, once in a process; what it defines joins the slots.

    Parameters
    ----------
    plugin : its source

    Raises
    ------
    PluginError
        When it fails, or defines no variant.
    """
    if plugin.sha256 not in LOADED:
        variants_so_far = brought()
        _run(plugin)
        _VARIANTS[plugin.sha256] = [
            variant for variant in brought() if variant not in variants_so_far
        ]
        LOADED[plugin.sha256] = plugin

    for name, part in _VARIANTS[plugin.sha256]:
        part.slot.add(part, name)
    for registry in Registry.all.values():
        registry.restore(plugin.sha256)
    changed()


def values_of(word: str, plugins: Iterable[Plugin]) -> dict[str, str]:
    """Return the values that plug-ins add to a registry: name → hash of the source.

    Parameters
    ----------
    word : a key of `Registry.all`, such as "results"
    plugins : those that were run
    """
    by_plugin = Registry.all[word].by_plugin
    return {
        name: plugin.sha256
        for plugin in plugins
        for name in by_plugin.get(plugin.sha256, {})
    }


def forget() -> None:
    """Forget every plug-in; scenes that were made with one keep it."""
    for name, part in brought():
        del part.slot.known[name]

    for registry in Registry.all.values():
        for sha256 in tuple(registry.by_plugin):
            registry.forget(sha256)

    for table in (LOADED, _VARIANTS, UNRUN):
        table.clear()
    changed()


def _run(plugin: Plugin) -> None:
    """Execute a plug-in's source as a module, and take up what it defines."""
    module = _module_of(plugin)
    try:
        with within(ORIGIN, Origin(plugin.name, plugin.sha256)):
            exec(compile(plugin.source, module.__file__ or "", "exec"), vars(module))
        for registry in Registry.all.values():
            registry.take(module, plugin)
        _refuse_empty(plugin)
    except Exception as error:
        _undo(plugin, module)
        reason = f"{type(error).__name__}: {error}"
        if isinstance(error, SlotError):
            reason = str(error)
        raise PluginError(f"{plugin.name}: {reason}") from error


def _refuse_empty(plugin: Plugin) -> None:
    """Refuse a plug-in that adds nothing, and say what it could add."""
    origin = Origin(plugin.name, plugin.sha256)
    registries = Registry.all.values()
    defines_variant = any(part.origin == origin for _, part in brought())
    defines_value = any(
        registry.by_plugin.get(plugin.sha256) for registry in registries
    )
    if defines_variant or defines_value:
        return

    bases = [slot.base for slot in Slot.all.values() if slot.base is not None]
    base_names = ", ".join(base.__name__ for base in bases)
    kinds = " or ".join(registry.kind.__name__ for registry in registries)
    raise SlotError(f"defines no variant, a class of {base_names}, and no {kinds}")


def _undo(plugin: Plugin, module: ModuleType) -> None:
    """Take back what a plug-in that failed has added; what it replaced returns."""
    del sys.modules[module.__name__]
    for registry in Registry.all.values():
        registry.forget(plugin.sha256)
        for sha256 in LOADED:
            registry.restore(sha256)


def _module_of(plugin: Plugin) -> ModuleType:
    """Return a new module whose source `inspect` finds: texts under options stay."""
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
    return [
        (name, part)
        for slot in Slot.all.values()
        for name, part in slot.known.items()
        if part.origin is not None
    ]


def declaration(plugin: Plugin) -> dict[str, Any]:
    """Return what a store keeps of a plug-in that was run, as JSON can hold it.

    Parameters
    ----------
    plugin : one of `LOADED`
    """
    values: dict[str, list[dict[str, Any]]] = {}
    for word, registry in Registry.all.items():
        plugin_values = registry.by_plugin.get(plugin.sha256, {}).values()
        values[word] = [registry.declared(value) for value in plugin_values]

    return {
        "format": FORMAT,
        "name": plugin.name,
        "sha256": plugin.sha256,
        "source": plugin.source,
        "variants": [_declared(name, part) for name, part in _VARIANTS[plugin.sha256]],
        **values,
    }


def _declared(name: str, part: type[Variant]) -> dict[str, Any]:
    """Return what a store keeps of a variant: its place and its options."""
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
    """Take up a plug-in from its declaration, without its code.

    Its variants have options and no physics, its results no function.

    Parameters
    ----------
    text : the declaration as JSON

    Raises
    ------
    PluginError
        When the declaration cannot be read.
    """
    try:
        record: Mapping[str, Any] = finite_json(text)
        origin = Origin(str(record["name"]), str(record["sha256"]), runs=False)
        with within(ORIGIN, origin):
            for variant in record["variants"]:
                _stand_in_variant(variant)
        for word, registry in Registry.all.items():
            for value in record.get(word, ()):
                _stand_in_value(registry, value, origin)
    except DECLARATION_ERRORS as error:
        raise PluginError(
            f"a plug-in's declaration cannot be read ({error!r})"
        ) from None
    changed()


def _stand_in_value(
    registry: Registry, record: Mapping[str, Any], origin: Origin
) -> None:
    """Add what stands for a value of a plug-in, or note that nothing can."""
    value = registry.stand_in(record)
    if value is None:
        UNRUN[str(record["name"])] = origin.file
        return
    if value.name in registry.table:
        return
    if problem := registry.problem(value):
        raise ValueError(f"{value.name}: {problem}")
    registry.record({value.name: value}, origin)
    registry.add(value)


def _stand_in_variant(record: Mapping[str, Any]) -> None:
    """Define a variant that has the declared options and no physics."""
    slot = Slot.all[record["slot"]]
    assert slot.base is not None

    fields: dict[str, Any] = {}
    for key, schema in record["options"].items():
        if key in slot.base.model_fields:
            continue
        kind = _option_type(schema)
        if key == slot.chooser:
            kind = Literal[str(record["name"])]
        default = ... if key in record["required"] else schema.get("default")
        if default is None:
            kind = kind | None
        fields[key] = kind, option(default, schema.get("description", ""))

    create_model(
        str(record["class"]), __base__=slot.base, __doc__=record["doc"], **fields
    )


def _option_type(schema: Mapping[str, Any]) -> Any:
    """Return the type of an option from its JSON Schema."""
    if "anyOf" in schema:
        branches = schema["anyOf"]
        schema = next(branch for branch in branches if branch.get("type") != "null")
    if "kind" in schema:
        return options.measured(schema["kind"])
    if "enum" in schema:
        return Literal[tuple(schema["enum"])]
    plain_types = {
        "number": options.Number,
        "integer": options.Count,
        "boolean": options.Switch,
        "string": str,
    }
    return plain_types.get(schema.get("type", ""), Any)
