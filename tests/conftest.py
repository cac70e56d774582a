"""Helpers of tests that worker processes must be able to import live
in ``tests/support``.
"""

import gc
import os
import sys
from pathlib import Path

import pytest

os.environ.setdefault(
    "OPENBLAS_NUM_THREADS", "1"
)  # on busy cores threads wait for each other
HERE = Path(__file__).parent
sys.path[:0] = [str(HERE / folder) for folder in ("support", "benchmarks")]
sys.path.append(str(HERE.parent / "docs"))  # scripts that make pages

LONG = (
    "gradients/test_gradient.py",
    "figures/test_any_campaign.py",
    "dynamics/test_friction.py",
    "dynamics/test_against_scipy.py",
    "test_extremes.py",
    "runner/test_faults.py",
    "dynamics/test_exact_steps.py",
    "simulation/test_options.py",
    "mesh/exact/test_relation.py",
    "simulation/test_friction.py",
    "figures/test_drawing.py",
    "simulation/test_bearing_forces.py",
    "validation/test_leaving_out.py",
    "test_random_scenes.py",
    "simulation/test_estimates.py",
)
"""Files of the longest tests; half of them compile kernels, and none while another
compiles the same ones."""


def pytest_configure(config):
    """Keep xdist from beginning with the files of most tests: these
    are not the long ones.
    """
    config.option.loadscopereorder = False


def pytest_collection_modifyitems(items):
    """Begin with the long files: a worker that is given one last
    would keep all waiting for it.
    """
    place = {HERE / name: number for number, name in enumerate(LONG)}

    items.sort(key=lambda item: place.get(item.path, len(LONG)))
    gc.freeze()  # what all tests have imported is not looked through again and again


def _held(plugins):
    return any(
        values
        for registry in plugins.Registry.all.values()
        for values in registry.by_plugin.values()
    )


@pytest.fixture(autouse=True)
def no_plugins_left():
    """Leave the next test without the variants that campaigns or
    stores of this one have brought.
    """
    yield
    plugins = sys.modules.get("wearlab.plugins")
    if plugins is not None and (plugins.brought() or plugins.UNRUN or _held(plugins)):
        plugins.forget()
