"""Where runs are kept: one immutable file per run, one catalogue, one lazy grid per campaign."""

from importlib import import_module
from typing import TYPE_CHECKING

from wearlab.store.files import StoreError

if TYPE_CHECKING:
    from wearlab.store.store import Store as Store
    from wearlab.store.store import open_store as open
    from wearlab.store.store import open_store as open_store

__all__ = ["Store", "StoreError", "open", "open_store"]


def __getattr__(name: str) -> object:
    if name in ("Store", "open_store", "open"):
        own = "open_store" if name == "open" else name  # wearlab.open, which type checkers know by that name
        return getattr(import_module("wearlab.store.store"), own)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
