"""Which finished runs are computed again."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Literal, get_args

from wearlab.runner.report import RunnerError
from wearlab.sources import is_other_code

if TYPE_CHECKING:
    from wearlab.store.catalogue import Head

Recompute = Literal["failed", "stale", "all"]
WITHOUT_DATA = ("failed", "refused")


def chosen(recompute: str | None, retry: bool) -> "Callable[[Head], bool]":
    """Return which runs, not running, are computed again.

    Parameters
    ----------
    recompute : "failed" (and refused), "stale" (made by other code than the present), "all", or None
    retry : the same as "failed", besides

    Raises
    ------
    RunnerError : no such choice
    """
    if recompute is not None and recompute not in get_args(Recompute):
        raise RunnerError(f"recompute = {recompute!r}: there are {', '.join(get_args(Recompute))}")

    def again(head: "Head") -> bool:
        if head.state in WITHOUT_DATA and (retry or recompute in ("failed", "all")):
            return True
        if recompute == "stale":
            return is_other_code(head.source_hash)
        return recompute == "all"

    return again
