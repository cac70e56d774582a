"""Which finished runs are computed again, and what becomes of them when that is interrupted."""

from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import TYPE_CHECKING, Literal, get_args

from wearlab.runner.report import RunnerError
from wearlab.sources import is_other_code
from wearlab.store.errors import StoreError

if TYPE_CHECKING:
    from wearlab.store import Store
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


def restore(store: "Store", ids: Iterable[str]) -> None:
    """Take runs back into the catalogue whose files are in place, though nothing was recorded of them.

    The file of a run to be computed again stays until a new one replaces it; and an interruption may come
    just after a file was written: nothing that was done is lost, and no file is left that nobody knows.
    """
    from wearlab.store.adopt import outcome_of

    wanted = list(ids)
    known = store.heads(wanted)
    for run_id in wanted:
        if run_id not in known and store.files.path(run_id).is_file():
            with suppress(StoreError):
                store.catalogue.record([outcome_of(store.files.path(run_id))])
