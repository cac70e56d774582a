"""Imports run one way along the road of the design, and what must
start fast stays light.
"""

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import wearlab
from wearlab.sources import AFTER

PACKAGE = Path(wearlab.__file__).parent
ROAD = (
    *(
        "version",
        "sources",
        "arrays",
        "threads",
        "files",
        "compiled",
        "nearest",
        "materials",
        "units",
        "options",
        "slots",
        "plugins",
        "tables",
        "variable",
        "results",
        "schema",
        "gears",
        "mesh",
        "dynamics",
        "wear",
        "thermal",
        "life",
        "scene",
        "assembly",
        "simulation",
        "gradients",
    ),
    *(
        "query",
        "campaign",
        "rexs",
        "store",
        "runner",
        "comparison",
        "updating",
        "figures",
        "accuracy",
        "report",
    ),
    *("browsing", "cli"),
)
PHYSICS = ROAD[ROAD.index("gears") : ROAD.index("scene")]
SIBLINGS = (("dynamics", "wear"), ("comparison", "figures"))
FUNCTIONS = {
    "browse",
    "compare",
    "figure",
    "gradient",
    "load",
    "open",
    "plan",
    "run",
    "simulate",
    "update",
}
"""Of `wearlab`."""
LABELLED = {"xarray", "dask", "distributed", "netCDF4", "pandas", "matplotlib"}
HEAVY = LABELLED | {"numba", "scipy"}
MODULE = re.compile(r"wearlab(\.\w+)+(?=:|$)")


@cache
def imported(source: str, module: str) -> tuple[tuple[int, str], ...]:
    """Return line and name of every module that a source imports: anywhere in it, and
    by name as text.
    """
    return tuple(_imported(source, module))


def _imported(source: str, module: str) -> Iterator[tuple[int, str]]:
    package = module.split(".")
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level] if node.level else []
            base = ".".join([*above, *filter(None, [node.module])])
            yield node.lineno, base
            yield from ((node.lineno, f"{base}.{alias.name}") for alias in node.names)
        elif (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and MODULE.match(node.value)
        ):
            yield node.lineno, node.value


def room(module: str) -> str | None:
    """Return the room of a module of wearlab, None for the package
    itself and for others.
    """
    words = module.split(":")[0].split(".")
    return (
        words[1]
        if words[0] == "wearlab" and len(words) > 1 and words[1] in ROAD
        else None
    )


def backwards(source: str, module: str) -> list[str]:
    """Return every import of a module that goes against the road."""
    mine = room(module)
    if mine is None:
        return []
    later = ROAD[ROAD.index(mine) + 1 :]
    return sorted(
        {
            f"line {line}: {name}"
            for line, name in imported(source, module)
            if room(name) in later
        }
    )


@cache
def modules() -> list[str]:
    files = sorted(PACKAGE.rglob("*.py"))
    return [
        ".".join(("wearlab", *file.relative_to(PACKAGE).with_suffix("").parts))
        for file in files
    ]


@cache
def source_of(module: str) -> str:
    return (PACKAGE.parent / Path(*module.split("."))).with_suffix(".py").read_text()


def below(*rooms: str) -> list[str]:
    return [module for module in modules() if room(module) in rooms]


def taken_by(*rooms: str) -> list[tuple[str, str]]:
    """Return every module of some rooms with every name that it imports."""
    return [
        (module, name)
        for module in below(*rooms)
        for _, name in imported(source_of(module), module)
    ]


def test_the_detector_sees_every_way_to_import():
    """A test that cannot fail proves nothing."""
    for line in (
        "import wearlab.cli",
        "from wearlab.cli import app",
        "from wearlab import cli",
        "from ..cli import app",
        "def late():\n    from wearlab.cli.app import main",
        "HOME = 'wearlab.cli'",
        "SIMULATE = 'wearlab.cli:main'",
    ):
        assert backwards(line, "wearlab.store.grid"), line
    for line in (
        "import wearlab.scene",
        "from wearlab.store import files",
        "'see wearlab.cli'",
        "import numpy",
    ):
        assert not backwards(line, "wearlab.store.grid"), line


def test_every_room_is_on_the_road():
    rooms = {module.split(".")[1] for module in modules()} - {"__init__"}
    assert rooms <= set(ROAD)


def test_rooms_after_the_simulation_are_no_part_of_the_code_of_a_run():
    """A change in one of them must not make stored runs stale."""
    assert set(ROAD[ROAD.index("simulation") + 1 :]) <= AFTER


def test_no_room_bears_the_name_of_a_public_function():
    """Importing ``wearlab.update`` would hide ``wl.update``: such a
    room is called ``updating``.
    """
    assert {module.split(".")[1] for module in modules()} & FUNCTIONS == set()


def test_imports_run_one_way():
    wrong = {module: backwards(source_of(module), module) for module in modules()}
    assert (
        len(wrong) > 200
        and {module: names for module, names in wrong.items() if names} == {}
    )


def taken(source: str, module: str, known: set[str]) -> set[str]:
    """Return the modules that a module takes something from, at any place in it, for
    types alone too.
    """
    named = {name for _, name in imported(source, module) if name in known}
    whole = {
        name.rpartition(".")[0] for name in named
    }  # `from package import module` is not the package
    asked = {name for _, name in imported(source, module)}
    return {
        n
        for n in named
        if n not in whole or any(one.rpartition(".")[0] == n for one in asked - known)
    }


def circle(graph: dict[str, set[str]]) -> list[str]:
    """Return modules that import each other in a circle, none where
    there is no such circle.
    """
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def test_the_detector_sees_a_circle():
    assert circle({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}})
    assert not circle({"a": {"b", "c"}, "b": {"c"}, "c": set()})
    both = {"wearlab.cli", "wearlab.cli.app"}
    assert (
        taken("def late():\n    from wearlab.cli import app, NAME\n", "wearlab.x", both)
        == both
    )
    assert taken("from wearlab.cli import app", "wearlab.x", both) == {
        "wearlab.cli.app"
    }


def test_no_modules_import_each_other_in_a_circle():
    """Within a room imports run one way, too."""
    files = {module.removesuffix(".__init__"): module for module in modules()}
    faces = {"wearlab"}  # its names are loaded when they are first asked for
    graph = {
        name: taken(source_of(module), module, set(files)) - {name} - faces
        for name, module in files.items()
        if name not in faces
    }
    assert circle(graph) == []


@cache
def variants() -> tuple[str, ...]:
    """Return the packages whose files are variants of a slot: a line ``Slot(…,
    __name__)`` makes one.
    """
    found = [module for module in modules() if module.endswith(".__init__")]
    return tuple(
        m.removesuffix(".__init__")
        for m in found
        if re.search(r"= Slot\(", source_of(m))
    )


def test_sections_are_free_of_physics():
    """Of physics, sections know options of variants and kinds of sets.

    Only ``assembly`` knows more.
    """
    sections = [
        both for both in taken_by("scene") if not both[0].startswith("wearlab.assembly")
    ]
    assert len(sections) > 100
    rooms = {
        f"wearlab.{name}" for name in PHYSICS
    }  # what is taken of a room is named besides it
    assert all(
        len(ast.parse(source_of(f"{name}.__init__")).body) == 1 for name in rooms
    )
    known = (*variants(), "wearlab.gears.sets")
    beyond = [
        both
        for both in sections
        if both[1] not in rooms and not both[1].startswith(known)
    ]
    assert [
        b
        for b in beyond
        if room(b[1]) in PHYSICS or b[1].startswith("wearlab.assembly")
    ] == []


def test_options_of_variants_compile_nothing():
    assert "wearlab.wear.coefficients" in variants()
    shown = subprocess.run(
        [
            sys.executable,
            "-c",
            "import sys, importlib, pkgutil\n"
            f"for package in {variants()!r}:\n"
            "    here = importlib.import_module(package)\n"
            "    for one in pkgutil.iter_modules(here.__path__):\n"
            "        importlib.import_module(f'{package}.{one.name}')\n"
            "print(*sorted(sys.modules))",
        ],
        capture_output=True,
        text=True,
        check=True,
    )
    assert {name.split(".")[0] for name in shown.stdout.split()} & HEAVY == set()


def test_nothing_of_numba_is_used_that_its_manual_does_not_name():
    """A trick with a library's inside breaks with its next release."""
    assert [both for both in taken_by(*ROAD) if both[1].startswith("numba.core")] == []
    hidden = ("no_cpython_wrapper", "no_cfunc_wrapper", "numba.core")
    assert [
        (module, word)
        for module in modules()
        for word in hidden
        if word in source_of(module)
    ] == []
    # One option is: steps take four to six times as long without it. It is asked for in
    # one place; where a release knows it no more, nothing but the clock misses it.
    assert [module for module in modules() if "_nrt" in source_of(module)] == [
        "wearlab.compiled"
    ]


def test_physics_knows_no_labels():
    """Physics knows nothing of xarray; ``simulation`` labels."""
    known = taken_by(*PHYSICS, "compiled", "units", "schema")
    assert (
        len(known) > 1000
        and [both for both in known if both[1].split(".")[0] in LABELLED] == []
    )


def test_the_store_knows_nothing_of_gears():
    """It may know how physics refuses, and the source hash.

    Nothing else of what is computed.
    """
    known = {"wearlab.gears.specification", "wearlab.gears.specification.GearError"}
    names = [both for both in taken_by("store", "runner") if both[1] not in known]
    assert (
        len(names) > 100
        and [both for both in names if room(both[1]) in (*PHYSICS, "schema")] == []
    )


def test_figures_never_simulate():
    names = taken_by("figures", "query", "comparison", "report", "browsing")
    wrong = [
        both for both in names if room(both[1]) in (*PHYSICS, "simulation", "runner")
    ]
    assert len(names) > 100 and wrong == []


@pytest.mark.parametrize("siblings", SIBLINGS, ids=" ".join)
def test_siblings_do_not_import_each_other(siblings):
    """Vibration and wear meet in ``life``.

    What is asked of datasets meets in ``report``.
    """
    crossing = [
        (module, name)
        for module, name in taken_by(*siblings)
        if room(name) in siblings and room(name) != room(module)
    ]
    assert crossing == []


@pytest.mark.parametrize(
    "module",
    [
        *("wearlab", "wearlab.scene", "wearlab.campaign", "wearlab.store.catalogue"),
        *("wearlab.store.store", "wearlab.runner", "wearlab.cli"),
    ],
)
def test_what_must_start_fast_is_light(module):
    shown = subprocess.run(
        [sys.executable, "-c", f"import sys, {module}; print(*sorted(sys.modules))"],
        capture_output=True,
        text=True,
        check=True,
    )
    loaded = {name.split(".")[0] for name in shown.stdout.split()}
    assert loaded & HEAVY == set()
    if module == "wearlab.cli":
        assert loaded & {"numpy", "pydantic", "pint", "rich"} == set()
