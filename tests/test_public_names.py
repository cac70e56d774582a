"""``import wearlab as wl``: a handful of names, loaded when they are used."""

import ast
import inspect
import subprocess
import sys

import pytest

import wearlab


def test_every_public_name_is_there():
    for name in wearlab.__all__:
        assert callable(getattr(wearlab, name)), name
    assert dir(wearlab) == sorted([*wearlab.__all__, "__version__"])
    assert sorted(wearlab.HOMES) == wearlab.__all__
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = wearlab.nonsense


def test_functions_are_functions():
    for name in wearlab.__all__:
        assert inspect.isfunction(getattr(wearlab, name)) or inspect.isclass(
            getattr(wearlab, name)
        ), name


def test_no_room_hides_a_function():
    """Whatever has been imported before, a public name stays what it is."""
    code = (
        "import importlib, pkgutil, wearlab as wl\n"
        "for one in pkgutil.iter_modules(wl.__path__): "
        "importlib.import_module('wearlab.' + one.name)\n"
        "print([name for name in wl.__all__ if not callable(getattr(wl, name))])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout == "[]\n"


def test_type_checkers_take_every_name_of_the_stub_as_public():
    """They do where a name is imported as itself (PEP 484, stub files)."""
    for stated in wearlab.STUB.body:
        if isinstance(stated, ast.ImportFrom):
            assert [name.name for name in stated.names] == [
                name.asname for name in stated.names
            ]


def test_a_store_shows_what_users_may_call():
    """What the runner does with a store stands in its archive."""
    shown = {name for name in dir(wearlab.Store) if not name.startswith("_")}
    public = """
        address close features names note open path query reindex remarks run tag verify
    """
    assert shown == set(public.split())


@pytest.mark.parametrize("name", ["run", "figure", "update"])
def test_help_begins_with_an_example(name):
    """`test_examples.py` runs it."""
    text = inspect.getdoc(getattr(wearlab, name))
    assert text.split("\n\n")[1].startswith(">>> ")
