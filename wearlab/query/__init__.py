"""Conditions on runs: comparisons with units, bound to keys and asked of values."""

from wearlab.query.grammar import read_column, read_condition
from wearlab.query.keys import Key, QueryError, Vocabulary, split_columns
