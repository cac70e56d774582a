"""The valid word that is spelled most like another, and messages that offer it."""

import re
from collections.abc import Iterable
from difflib import get_close_matches

PARTS = re.compile(r"[-_ ]+")
MAX_LISTED = 40
"""Choices up to which a message lists all of them beside the nearest."""


def nearest(word: str, valid: Iterable[str]) -> str | None:
    """Return the valid word that is spelled most like another, None where none is near.

    Parameters
    ----------
    word : the word as somebody wrote it
    valid : the words to choose from
    """
    matches = get_close_matches(word, list(valid), 1)
    return matches[0] if matches else None


def meant(word: str, valid: Iterable[str], otherwise: str = "") -> str:
    """Return the end of a message: the nearest valid word as a question.

    Parameters
    ----------
    word : the word as somebody wrote it
    valid : the words to choose from
    otherwise : what to return where no valid word is near
    """
    match = nearest(word, valid)
    return otherwise if match is None else f", did you mean {match!r}?"


def alike(word: str, valid: Iterable[str]) -> list[str]:
    """Return up to three valid words that contain another, else the nearest.

    >>> alike("sun-planet", ["sun-planet-1", "sun-planet-2"])
    ['sun-planet-1', 'sun-planet-2']
    >>> alike("diametre", ["diameter"])
    ['diameter']

    Parameters
    ----------
    word : the word as somebody wrote it
    valid : the words to choose from
    """
    candidates = list(valid)
    parts = PARTS.split(word.lower())

    containing = []
    if word:
        containing = [
            candidate
            for candidate in candidates
            if _contains(PARTS.split(candidate.lower()), parts)
        ]
    return containing[:3] or get_close_matches(word, candidates, 1)


def _contains(words: list[str], part: list[str]) -> bool:
    """Return whether words contain others in a row."""
    starts = range(len(words) - len(part) + 1)
    return any(words[start : start + len(part)] == part for start in starts)


def choices(value: object, valid: Iterable[object]) -> str:
    """Return the end of a message: the nearest valid choices, then all unless many.

    Parameters
    ----------
    value : what somebody chose
    valid : the choices that there are
    """
    names = [str(choice) for choice in valid]
    near = alike(str(value), names)

    question = f"did you mean {' or '.join(map(repr, near))}? " if near else ""
    if near and len(names) > MAX_LISTED:
        return question.rstrip()
    return f"{question}valid: {', '.join(names) or 'none'}"
