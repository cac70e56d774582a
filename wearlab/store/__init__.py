"""Where runs are kept: one immutable file per run, one catalogue, one lazy grid per campaign."""

from wearlab.store.files import StoreError
from wearlab.store.store import Store, open_store

open = open_store  # wearlab.open, which type checkers know by that name
