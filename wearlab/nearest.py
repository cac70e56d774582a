"""What was meant: the known word that is spelled most like another."""

import re
from collections.abc import Iterable
from difflib import get_close_matches

PARTS = re.compile(r"[-_ ]+")


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Return the known word that is spelled most like another, None where none is alike."""
    return next(iter(get_close_matches(word, list(known), 1)), None)


def meant(word: str, known: Iterable[str], otherwise: str = "") -> str:
    """Return the end of a message: the nearest known word as a question, or what to say without one."""
    near = nearest(word, known)
    return otherwise if near is None else f", did you mean {near!r}?"


MOST_LISTED = 40
"""Choices up to which all of them are told beside the nearest."""


def alike(word: str, known: Iterable[str]) -> list[str]:
    """Return up to three known words that hold another as whole words, else the one spelled most like it.

    >>> alike("sun-planet", ["sun-planet-1", "sun-planet-2"]), alike("diametre", ["diameter"])
    (['sun-planet-1', 'sun-planet-2'], ['diameter'])
    """
    words = PARTS.split(word.lower())
    listed = list(known)
    within = (
        [one for one in listed if _holds(PARTS.split(one.lower()), words)]
        if word
        else []
    )
    return within[:3] or get_close_matches(word, listed, 1)


def _holds(words: list[str], part: list[str]) -> bool:
    return any(
        words[at : at + len(part)] == part for at in range(len(words) - len(part) + 1)
    )


def choices(value: object, valid: Iterable[object]) -> str:
    """Return the end of a message: the nearest valid choices first, then all of them unless they are many."""
    known = [str(choice) for choice in valid]
    near = alike(str(value), known)
    meant = f"did you mean {' or '.join(map(repr, near))}? " if near else ""
    if near and len(known) > MOST_LISTED:
        return meant.rstrip()
    return f"{meant}valid: {', '.join(known) or 'none'}"
