"""``[numerics]``: one tolerance, and what may override what follows from it."""

from typing import Annotated

from annotated_types import Ge, Le, Lt

from wearlab.options import POSITIVE, Count, Number, Part, option

MOST = 1_000_000  # points; a state of the wear would take gigabytes
DERIVED = "from the tolerance"


class Numerics(Part):
    """How accurate a run is."""

    tolerance: Annotated[Number, POSITIVE, Lt(1.0)] = option(
        1e-3, "relative error in wear depth and life", source="wearlab"
    )
    steps_per_period: Annotated[Count, Ge(4), Le(MOST)] | None = option(
        None, "integration steps in a mesh period", derived=DERIVED
    )
    phase_points: Annotated[Count, Ge(8), Le(MOST)] | None = option(
        None, "stored phases of a mesh period", derived=DERIVED
    )
    profile_points: Annotated[Count, Ge(9), Le(MOST)] | None = option(
        None, "nodes on the path of contact", derived=DERIVED
    )
    cycle_tolerance: Annotated[Number, POSITIVE, Lt(1.0)] | None = option(
        None, "relative error of the steps over cycles", derived=DERIVED
    )
    most_right_hand_sides: Annotated[Number, Ge(1.0)] | None = option(
        None,
        "right-hand sides after which a life ends where it is, to be gone on from",
        derived="from the tolerance and the coordinates: minutes of work",
    )
