"""What was meant: the known word that is spelled most like another."""

from collections.abc import Iterable
from difflib import get_close_matches


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Return the known word that is spelled most like another, None where none is alike."""
    return next(iter(get_close_matches(word, list(known), 1)), None)


def meant(word: str, known: Iterable[str], otherwise: str = "") -> str:
    """Return the end of a message: the nearest known word as a question, or what to say without one."""
    near = nearest(word, known)
    return otherwise if near is None else f", did you mean {near!r}?"


def choices(value: object, valid: Iterable[object]) -> str:
    """Return the end of a message: the nearest valid choice first, then all of them."""
    known = [str(choice) for choice in valid]
    near = get_close_matches(str(value), known, 1, 0.6)
    meant = f"did you mean {near[0]!r}? " if near else ""
    return f"{meant}valid: {', '.join(known) or 'none'}"
