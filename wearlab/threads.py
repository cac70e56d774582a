"""Threads of linear algebra."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache

from threadpoolctl import ThreadpoolController


@cache
def _libraries() -> ThreadpoolController:
    """Return the libraries of linear algebra that are loaded."""
    return ThreadpoolController()


@contextmanager
def one_thread() -> Iterator[None]:
    """Let linear algebra within take one thread.

    Matrices of gears are small, and threads that share one wait for each other longer
    than its product takes, above all on busy cores; a run is the same to the last digit
    however many cores there are.
    """
    with _libraries().limit(limits=1, user_api="blas"):
        yield
