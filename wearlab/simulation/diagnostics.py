"""What is found of a finished run, piece by piece: a piece that fails is missing and says why."""

from collections.abc import Callable
from typing import TypeVar

import xarray as xr

Found = TypeVar("Found")


def diagnosed(name: str, find: Callable[[], Found], instead: Found, failures: list[str]) -> Found:
    """Return what is found of a run that has ended, or what stands for it where the search fails.

    Any error counts: hours of life are not lost for a number that describes them.

    Parameters
    ----------
    name : what is found, in words
    find : finds it
    instead : what stands for it after a failure
    failures : gets a line that names what is missing and why
    """
    try:
        return find()
    except Exception as error:
        reason = str(error).split("\n")[0] or type(error).__name__
        failures.append(f"not computed: {name}: {reason}")
        return instead


def with_told(run: xr.Dataset, lines: list[str]) -> xr.Dataset:
    """Return the dataset of a run whose ``validity`` tells more, a line each."""
    if not lines:
        return run
    told = [run["validity"].item(), *dict.fromkeys(lines)]
    return run.assign(validity=run["validity"].copy(data="\n".join(filter(None, told))))
