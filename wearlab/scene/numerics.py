"""``[numerics]``: one tolerance, and what may override what follows from it; ``[store]``: what is kept."""

from typing import Annotated

from annotated_types import Ge, Le, Lt, MinLen
from pydantic import AfterValidator
from pydantic_core import PydanticCustomError

from wearlab import nearest, options
from wearlab.schema import ON_REQUEST, VARIABLES

MOST = 1_000_000  # points; a state of the wear would take gigabytes
DERIVED = "from the tolerance"


class Numerics(options.Part):
    """How accurate a run is."""

    tolerance: Annotated[options.Number, options.POSITIVE, Lt(1.0)] = options.option(
        1e-3, "relative error in wear depth and life", source="wearlab"
    )
    steps_per_period: Annotated[options.Count, Ge(4), Le(MOST)] | None = options.option(
        None, "integration steps in a mesh period", derived=DERIVED
    )
    phase_points: Annotated[options.Count, Ge(8), Le(MOST)] | None = options.option(
        None, "stored phases of a mesh period", derived=DERIVED
    )
    profile_points: Annotated[options.Count, Ge(9), Le(MOST)] | None = options.option(
        None, "nodes on the path of contact", derived=DERIVED
    )
    cycle_tolerance: Annotated[options.Number, options.POSITIVE, Lt(1.0)] | None = options.option(
        None, "relative error of the steps over cycles", derived=DERIVED
    )
    most_right_hand_sides: Annotated[options.Number, Ge(1.0)] | None = options.option(
        None,
        "right-hand sides after which a life ends where it is, to be gone on from",
        derived="from the tolerance and the coordinates: minutes of work",
    )


ALL = "all"
"""Stands for every variable that the present parts make without being asked."""


def _known(names: tuple[str, ...]) -> tuple[str, ...]:
    for name in names:
        if name not in VARIABLES and name != ALL:
            raise PydanticCustomError(
                "variable",
                "{name} is no variable of a dataset{near}",
                {"name": repr(name), "near": nearest.meant(name, (*VARIABLES, ALL))},
            )
    return tuple(sorted(set(names)))


class StoreSection(options.Part):
    """What is kept of a run."""

    variables: Annotated[tuple[str, ...], MinLen(1), AfterValidator(_known)] | None = options.option(
        None,
        "variables to store; 'all' is all that the present parts make, to which those made on request "
        "(mesh_acceleration, its spectrum and statistics, mesh_deflection_orders) are added by name",
        derived="all that the present parts make",
        source="wearlab",
    )

    results: dict[str, str] = options.option(
        {},
        "results of plug-ins that are stored, each with the hash of its source",
        derived="those of the plug-ins that the file names",
        source="wearlab",
    )

    def keeps(self, name: str) -> bool:
        """Whether a variable that was made is stored."""
        return self.variables is None or name in self.variables or ALL in self.variables

    @property
    def requested(self) -> tuple[str, ...]:
        """The variables that are made because they are named here."""
        return tuple(name for name in self.variables or () if name in ON_REQUEST)
