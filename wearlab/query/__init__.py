"""Conditions on runs: a small grammar of comparisons with units, bound to keys and asked of mappings."""

from wearlab.query.bind import Key, Vocabulary, read_column, read_condition
from wearlab.query.errors import QueryError
from wearlab.query.evaluate import holds

__all__ = ["Key", "QueryError", "Vocabulary", "holds", "read_column", "read_condition"]
