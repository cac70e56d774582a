"""One table: every variable of a dataset, its dimensions, unit, display unit and meaning, and what makes it.

Nothing else in wearlab spells a unit or a long name; labelling, figures, tables and exports read them here.
Each file of this folder declares a few groups of variables; a group is what one part of a scene makes.
"""

from typing import NamedTuple

from wearlab.results import RESULTS
from wearlab.schema import coordinates, dynamics, life, mesh
from wearlab.variable import Variable as Variable


class Dimension(NamedTuple):
    """What a dimension counts."""

    name: str
    meaning: str


DIMENSIONS = (
    Dimension("update", "wear states: the initial one, snapshots, the end"),
    Dimension("flank", "flanks that wear"),
    Dimension("profile", "nodes on the path of contact; two at one position where wear may jump"),
    Dimension("mesh", "gear meshes"),
    Dimension("phase", "fraction of one mesh period, 0 when a pair enters contact at A"),
    Dimension("mesh_period", "successive mesh periods of the response"),
    Dimension("pair", "tooth pairs in contact, leading first"),
    Dimension("member", "gears"),
    Dimension("harmonic", "order of the mesh frequency"),
    Dimension("mode", "natural modes, by ascending frequency"),
    Dimension("axis", "x, y"),
    Dimension("multiplier", "Floquet multipliers, by descending modulus"),
    Dimension("part", "real and imaginary part"),
    Dimension("error_angle", "quadrature over the angles of the members"),
    Dimension("step", "accepted steps over cycles"),
    Dimension("response_speed", "speeds of the input member at which the response is followed"),
    Dimension("direction", "up, down: the order in which the speeds are passed"),
    Dimension("strobe", "states once per mesh period"),
    Dimension("order", "frequency over the mesh frequency"),
    Dimension("rival", "other attractors found, by falling largest force"),
    Dimension("jump", "jumps of the response, in the order in which they are met"),
    Dimension("end", "where a pair engages, where it leaves"),
    Dimension("duty", "conditions of operation that take turns"),
    Dimension("stage", "conditions of operation in order"),
    Dimension("edge", "the last speed before a jump, the first after it"),
)

GROUPS = tuple(group for part in (coordinates, mesh, dynamics, life) for group in part.GROUPS)
VARIABLES: dict[str, Variable] = {
    **{name: variable for group in GROUPS for name, variable in group.variables.items()},
    **{result.name: result.variable for result in RESULTS},
}

ON_REQUEST = tuple(dynamics.ON_REQUEST)
"""Variables that are computed only when ``[store] variables`` names them."""


def origin_of(name: str) -> tuple[str, str]:
    """Return the group of a variable, and what must be there for it to be made.

    Parameters
    ----------
    name : a key of `VARIABLES`
    """
    made_of = next((result.needs for result in RESULTS if result.name == name), ())
    if made_of:
        return origin_of(made_of[0])
    home = {name: group for group in GROUPS for name in group.variables}[name]
    return home.name, home.needs


def attributes(name: str) -> dict[str, str]:
    """Return the CF attributes of a variable: units, display_units, long_name, and comment if any."""
    variable = VARIABLES[name]
    named = {
        "units": variable.units,
        "display_units": variable.display_units,
        "long_name": variable.long_name,
        "comment": variable.comment,
    }
    return {key: value for key, value in named.items() if value}
