"""The code does not become harder to read: see ``tests/support/readability.py``."""

import pytest
from readability import BOUNDS, Counts, count, measure

PACKED = """
def rate(own, each):
    a, b = own + 1, each + 2
    return own * each + a * b + own * a  # fmt: skip
"""
PLAIN = '''
def rate(pressure, speed):
    """Return the wear rate.

    Parameters
    ----------
    pressure : [Pa]
    speed : [m/s]
    """
    return pressure * speed
'''


@pytest.fixture(scope="module")
def ratios():
    return measure().ratios()


@pytest.mark.parametrize("name", BOUNDS)
def test_no_ratio_is_above_its_bound(name, ratios):
    assert ratios[name] <= BOUNDS[name]


def test_what_is_packed_is_seen():
    counts = Counts()
    count(PACKED, "packed.py", set(), counts)
    assert counts.tuples == ["packed.py:3"]
    assert counts.dense_lines == ["packed.py:4"]
    assert counts.switched_off == ["packed.py:4"]
    assert sorted(counts.grammar_words) == [
        "packed.py:2 rate: each",
        "packed.py:2 rate: own",
    ]
    assert counts.unexplained == ["packed.py:2 rate"]


def test_what_is_plain_passes():
    counts = Counts()
    count(PLAIN, "plain.py", set(), counts)
    assert [
        name for name, value in counts.ratios().items() if value > BOUNDS[name]
    ] == []
    assert counts.places().values() and not any(counts.places().values())
