"""One table: every variable of a dataset, its dimensions, unit, display unit and meaning, and what makes it.

Nothing else in wearlab spells a unit or a long name; labelling, figures, tables and exports read them here.
Each file of this folder declares a few groups of variables; a group is what one part of a scene makes.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

from wearlab.nearest import meant
from wearlab.plugins import Sort
from wearlab.results import OF_PLUGINS, RESULTS
from wearlab.schema import coordinates, dynamics, life, mesh
from wearlab.units import UnitError, convert
from wearlab.variable import Result
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
    **{name: result.variable for name, result in RESULTS.items()},
}

CONTENTS = (
    *(
        (begin, "qualityInformation")
        for begin in ("error_estimate", "estimate_quality", "residual", "verdict")
    ),
    *((begin, "qualityInformation") for begin in ("validity", "model_error")),
    *((begin, "auxiliaryInformation") for begin in ("run_time", "count", "steps_cycle")),
)
"""Beginnings of names of what is no result of the model."""

ON_REQUEST = tuple(dynamics.ON_REQUEST)
"""Variables that are computed only when ``[store] variables`` names them."""


def origin_of(name: str) -> tuple[str, str]:
    """Return the group of a variable, and what must be there for it to be made.

    Parameters
    ----------
    name : a key of `VARIABLES`
    """
    result = {**RESULTS, **OF_PLUGINS}.get(name)
    if result is not None and result.needs:
        return origin_of(result.needs[0])
    if result is not None:
        return "plug-ins", "its plug-in"
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
        "coverage_content_type": _content(name),
    }
    return {key: value for key, value in named.items() if value}


def _content(name: str) -> str:
    """Return what a variable is for catalogues, as ACDD 1.3 names it after ISO 19115-1."""
    if any(name in group.variables for group in coordinates.GROUPS):
        return "coordinate"
    return next((content for begin, content in CONTENTS if name.startswith(begin)), "modelResult")


class _Results(Sort):
    """Results of plug-ins: each is a variable as if wearlab declared it."""

    def wrong(self, value: Result) -> str:
        """Return which dimension, unit or need of a result nobody knows."""
        if value.name in VARIABLES and value.name not in self.known:
            return "wearlab has a variable of this name: give yours another"
        variable, dims = value.variable, [dimension.name for dimension in DIMENSIONS]
        for said, known in ((variable.dims, dims), (value.needs, list(VARIABLES))):
            for name in said:
                if name not in known:
                    return (
                        f"{name!r} is no {'dimension' if known is dims else 'variable'}{meant(name, known)}"
                    )
        try:
            convert(1.0, variable.units, variable.display_units)
        except UnitError as error:
            return f"units = {variable.units!r}, display_units = {variable.display_units!r}: {error}"
        return "" if variable.long_name else "its long_name is empty: say what it is"

    def add(self, value: Result) -> None:
        """Let a result join, and the table of variables with it."""
        super().add(value)
        VARIABLES[value.name] = value.variable

    def remove(self, name: str) -> None:
        """Take a result out of both."""
        super().remove(name)
        VARIABLES.pop(name, None)

    def declared(self, value: Result) -> dict[str, Any]:
        """Return name, needs and the variable's declaration."""
        return {"name": value.name, "needs": list(value.needs), "variable": value.variable._asdict()}

    def stand_in(self, record: Mapping[str, Any]) -> Result:
        """Return a result of which the declaration is known, and not how it is found."""
        said = dict(record["variable"])
        variable = Variable(**{**said, "dims": tuple(map(str, said["dims"]))})
        return Result(str(record["name"]), variable, _unknown, tuple(map(str, record["needs"])))


def _unknown(run: object) -> Any:
    raise LookupError("the code of this result's plug-in was not run")


PLUGIN_RESULTS = _Results("results", Result, OF_PLUGINS)
