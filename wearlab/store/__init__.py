"""Where runs are kept: one immutable file per run, one catalogue, one lazy grid per campaign."""

from importlib import import_module
from typing import TYPE_CHECKING

from wearlab.store.errors import StoreError

if TYPE_CHECKING:
    from wearlab.store.store import Store as Store

__all__ = ["Store", "StoreError"]


def __getattr__(name: str) -> object:
    if name == "Store":
        return import_module("wearlab.store.store").Store
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
