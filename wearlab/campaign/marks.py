"""Marks in notes: quotations of sources, words of direction, expected numbers.

A note says ``{'1469 N' W23 Fig. 9}`` where it quotes, ``{falls|largest_force_40 -
largest_force_0}`` where a word makes a claim, and ``{largest_force_40:.0f = 1554}``
where a number of the runs is expected. Readers see ``1469 N``, ``falls`` and the
number.
"""

import re

QUOTATION = re.compile(r"\{'([^'{}]+)' ([^{}]+)\}")
WORD = re.compile(r"\{([A-Za-z]+)\|([^{}|]+)\}")
EXPECTED = re.compile(r"\s*=\s*([-+]?[\d.]+(?:e[-+]?\d+)?)\s*(?=\})")


def without_marks(note: str) -> str:
    """Return a note as readers see it, with placeholders where numbers stand.

    Parameters
    ----------
    note : of a figure

    Examples
    --------
    >>> without_marks("{falls|change} by {change:.1f = 3.2}, not {'9 %' W23 Fig. 6}")
    'falls by {change:.1f}, not 9 %'
    """
    without_quotations = QUOTATION.sub(r"\1", note)
    without_words = WORD.sub(r"\1", without_quotations)
    return EXPECTED.sub("", without_words)
