"""What a run amounts to, in one word."""

from collections.abc import Sequence

from wearlab.dynamics.steady.coexisting import Search
from wearlab.life import history, limits

BEYOND = 1e-3
"""Distance beyond 1 at which motions leave: the margin of attraction, on the other side
of 1."""
ORDINARY = {
    "not converged": "converged",
    "aperiodic": "periodic",
    "non-unique": "unique",
}
"""Verdict of a run of which a response lacks a property → that property."""


def verdict(life_history: history.History, searches: Sequence[Search] = ()) -> str:
    """Return in one word what the run amounts to.

    What deviates most from an ordinary run wins.

    Parameters
    ----------
    life_history : the states
    searches : what the searches for other attractors of the states came to
    """
    life = life_history.life
    if life is not None and life.end_reason not in (limits.ALL_CYCLES, limits.WORN_OUT):
        return "stopped"

    responses = [
        response for state in life_history.state for response in state.responses
    ]
    for word, property_name in ORDINARY.items():
        if not all(getattr(response.verdict, property_name) for response in responses):
            return word

    multipliers = [
        abs(response.multipliers[0])
        for response in responses
        if response.verdict.attracting is False
    ]
    if multipliers:
        leaves = max(multipliers) > 1.0 + BEYOND
        return "unstable" if leaves else "not attracting within the margin"
    if any(search.rival is not None for search in searches):
        return "coexisting"
    return "completed"
