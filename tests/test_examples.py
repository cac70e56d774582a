"""Examples in docstrings do what they say."""

import doctest
import importlib

import pytest

from wearlab.sources import PACKAGE

WITH_EXAMPLES = [
    ".".join(file.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(
        ".__init__"
    )
    for file in sorted(PACKAGE.rglob("*.py"))
    if ">>> " in file.read_text(encoding="utf-8")
]


@pytest.mark.parametrize("module", WITH_EXAMPLES)
def test_an_example_gives_what_it_shows(module):
    found = doctest.testmod(
        importlib.import_module(module), optionflags=doctest.NORMALIZE_WHITESPACE
    )
    assert found.failed == 0


def test_examples_are_found_and_can_fail():
    assert "wearlab.scene.scene" in WITH_EXAMPLES
    wrong = doctest.DocTestParser().get_doctest(
        ">>> 1 + 1\n3\n", {}, "wrong", None, None
    )
    assert (
        doctest.DocTestRunner(verbose=False).run(wrong, out=lambda text: None).failed
        == 1
    )
