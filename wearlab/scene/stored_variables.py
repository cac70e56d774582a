"""``[store]``: what is kept of a run."""

from typing import Annotated

from annotated_types import MinLen
from pydantic import AfterValidator

from wearlab import nearest, options, schema

ALL = "all"
"""Stands for every variable that the present parts make without being asked."""


def _known(names: tuple[str, ...]) -> tuple[str, ...]:
    variables = (*schema.VARIABLES, ALL)
    if unknown := [name for name in names if name not in variables]:
        raise ValueError(
            f"{unknown[0]!r} is no variable of a "
            f"dataset{nearest.meant(unknown[0], variables)}"
        )
    return tuple(sorted(set(names)))


class StoreSection(options.Part):
    """What is kept of a run."""

    variables: Annotated[tuple[str, ...], MinLen(1), AfterValidator(_known)] | None = (
        None
    )
    """variables to store; 'all' is all that the present parts make, to which those made
    on request (mesh_acceleration, its spectrum and statistics, mesh_deflection_orders)
    are added by name [all that the present parts make]. Source: wearlab"""

    results: dict[str, str] = options.option({})
    """results of plug-ins that are stored, each with the hash of its source [those of
    the plug-ins that the file names]. Source: wearlab"""

    def keeps(self, name: str) -> bool:
        """Whether a variable that was made is stored."""
        return self.variables is None or name in self.variables or ALL in self.variables

    @property
    def requested(self) -> tuple[str, ...]:
        """The variables that are made because they are named here."""
        return tuple(name for name in self.variables or () if name in schema.ON_REQUEST)
