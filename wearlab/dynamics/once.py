"""What is asked of the same system again and again: found out once."""

from collections import OrderedDict
from collections.abc import Callable
from functools import wraps
from typing import TypeVar

from wearlab.dynamics.system import System

Answer = TypeVar("Answer")
KEPT = 16
"""Systems whose answers are remembered."""


def once(ask: Callable[[System], Answer]) -> Callable[[System], Answer]:
    """Let a function of a system remember its last answers, told apart by identity: systems do not change."""
    kept: OrderedDict[int, tuple[System, Answer]] = OrderedDict()

    @wraps(ask)
    def answer(system: System) -> Answer:
        held = kept.get(id(system))
        if held is None or held[0] is not system:
            held = kept[id(system)] = system, ask(system)
            while len(kept) > KEPT:
                kept.popitem(last=False)
        return held[1]

    return answer
