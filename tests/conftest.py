"""Helpers of tests that worker processes must be able to import live in ``tests/support``."""

import sys
from pathlib import Path

import pytest

sys.path[:0] = [str(Path(__file__).parent / folder) for folder in ("support", "validation")]


@pytest.fixture(autouse=True)
def no_plugins_left():
    """Leave the next test without the variants that campaigns of this one have brought."""
    yield
    plugins = sys.modules.get("wearlab.plugins")
    if plugins is not None and plugins.LOADED:
        plugins.forget()
