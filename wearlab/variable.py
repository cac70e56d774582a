"""Declarations of variables of a dataset, and of results that follow from others."""

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import xarray as xr


class Variable(NamedTuple):
    """How one variable of the dataset is declared.

    Parameters
    ----------
    dims : names of its dimensions, in order
    units : unit of the stored values, UDUNITS form
    display_units : unit that figures, tables and CSV use
    long_name : what it is, in words
    comment : what a reader must know besides, or ""
    """

    dims: tuple[str, ...]
    units: str
    display_units: str
    long_name: str
    comment: str = ""


class VariableGroup(NamedTuple):
    """Variables that one part of a scene makes.

    Parameters
    ----------
    name : what lists call them
    needs : what must be there for them to be made
    variables : name → declaration
    """

    name: str
    needs: str
    variables: dict[str, Variable]


class Result(NamedTuple):
    """A variable that follows from others of the same run.

    Parameters
    ----------
    name : of the variable
    variable : its declaration
    of : the run in SI units → its values, with the declared dimensions in any order
    needs : variables without which a run has no such result
    """

    name: str
    variable: Variable
    of: "Callable[[xr.Dataset], xr.DataArray]"
    needs: tuple[str, ...]
