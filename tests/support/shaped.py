"""Gears by keywords: what a set shares, and what is its own."""

from collections.abc import Callable
from typing import Any

from wearlab.gears.specification import Basics


def shaped(make: Callable[..., Any], *members: Any, **keywords: Any) -> Any:
    """Return a pair or a set whose basics stand among the keywords."""
    basics = Basics(
        **{key: keywords.pop(key) for key in Basics._fields if key in keywords}
    )
    return make(*members, basics, **keywords)
