"""Where runs are kept: a file per run, a catalogue, a lazy grid per campaign."""

from wearlab.store.files import StoreError
from wearlab.store.store import Store, open_store

open = open_store  # wearlab.open, which type checkers know by that name
