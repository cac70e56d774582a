"""``[store]``: what is kept of a run."""

from typing import Annotated

from annotated_types import MinLen
from pydantic import AfterValidator
from pydantic_core import PydanticCustomError

from wearlab.nearest import meant
from wearlab.options import Part, option
from wearlab.schema import ON_REQUEST, VARIABLES

ALL = "all"
"""Stands for every variable that the present parts make without being asked."""


def _known(names: tuple[str, ...]) -> tuple[str, ...]:
    for name in names:
        if name not in VARIABLES and name != ALL:
            raise PydanticCustomError(
                "variable",
                "{name} is no variable of a dataset{near}",
                {"name": repr(name), "near": meant(name, (*VARIABLES, ALL))},
            )
    return tuple(sorted(set(names)))


class StoreSection(Part):
    """What is kept of a run."""

    variables: Annotated[tuple[str, ...], MinLen(1), AfterValidator(_known)] | None = option(
        None,
        "variables to store; 'all' is all that the present parts make, to which those made on request "
        "(mesh_acceleration, its spectrum and statistics, mesh_deflection_orders) are added by name",
        derived="all that the present parts make",
        source="wearlab",
    )

    def keeps(self, name: str) -> bool:
        """Whether a variable that was made is stored."""
        return self.variables is None or name in self.variables or ALL in self.variables

    @property
    def requested(self) -> tuple[str, ...]:
        """The variables that are made because they are named here."""
        return tuple(name for name in self.variables or () if name in ON_REQUEST)
