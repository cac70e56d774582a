"""One table: every variable of a dataset, its dimensions, unit, display unit and meaning, and what makes it.

Nothing else in wearlab spells a unit or a long name; labelling, figures, tables and
exports read them here. The table is `variables.toml`; a group of it is what one part of
a scene makes.
"""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from wearlab.nearest import meant
from wearlab.plugins import Sort
from wearlab.results import OF_PLUGINS, RESULTS
from wearlab.units import UnitError, convert
from wearlab.variable import Result, VariableGroup
from wearlab.variable import Variable as Variable

TABLE = tomllib.loads(
    (Path(__file__).parent / "variables.toml").read_text(encoding="utf-8")
)
DIMENSIONS: dict[str, str] = TABLE["dimensions"]
"""What each dimension counts."""
GROUPS = tuple(
    VariableGroup(
        group["name"],
        group["needs"],
        {
            name: Variable(tuple(dims.split()), *words)
            for name, (dims, *words) in group["variables"].items()
        },
    )
    for group in TABLE["group"]
)
VARIABLES: dict[str, Variable] = {
    **{
        name: variable for group in GROUPS for name, variable in group.variables.items()
    },
    **{name: result.variable for name, result in RESULTS.items()},
}
ON_AXES: dict[str, str] = TABLE["on_axes"]
"""What axes of figures say of variables whose long name is long."""
OVER_FACE = frozenset(TABLE["over_face"])
"""Variables with one more dimension, ``face`` before ``profile``, where flanks have a
width."""
QUALITY = (
    "error_estimate",
    "estimate_quality",
    "residual",
    "verdict",
    "validity",
    "model_error",
)
CONTENTS = {
    "qualityInformation": QUALITY,
    "auxiliaryInformation": ("run_time", "count", "steps_cycle"),
}
"""Beginnings of names of what is no result of the model."""
ON_REQUEST = tuple(
    name
    for group in TABLE["group"]
    if "on_request" in group
    for name in group["variables"]
)
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
    named = VARIABLES[name]._asdict() | {"coverage_content_type": _content(name)}
    return {key: value for key, value in named.items() if value and key != "dims"}


def _content(name: str) -> str:
    """Return what a variable is for catalogues, as ACDD 1.3 names it after ISO 19115-1."""
    if any(group.name == "coordinates" and name in group.variables for group in GROUPS):
        return "coordinate"
    return next(
        (content for content, begins in CONTENTS.items() if name.startswith(begins)),
        "modelResult",
    )


class _Results(Sort):
    """Results of plug-ins: each is a variable as if wearlab declared it."""

    def wrong(self, value: Result) -> str:
        """Return which dimension, unit or need of a result nobody knows."""
        if value.name in VARIABLES and value.name not in self.known:
            return "wearlab has a variable of this name: give yours another"
        variable = value.variable
        dims = list(DIMENSIONS)
        for said, known in ((variable.dims, dims), (value.needs, list(VARIABLES))):
            for name in said:
                if name not in known:
                    what = "dimension" if known is dims else "variable"
                    return f"{name!r} is no {what}{meant(name, known)}"
        try:
            convert(1.0, variable.units, variable.display_units)
        except UnitError as error:
            return (
                f"units = {variable.units!r}, display_units = "
                f"{variable.display_units!r}: {error}"
            )
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
        return {
            "name": value.name,
            "needs": list(value.needs),
            "variable": value.variable._asdict(),
        }

    def stand_in(self, record: Mapping[str, Any]) -> Result:
        """Return a result of which the declaration is known, and not how it is found."""
        said = dict(record["variable"])
        variable = Variable(**{**said, "dims": tuple(map(str, said["dims"]))})
        return Result(
            str(record["name"]), variable, _unknown, tuple(map(str, record["needs"]))
        )


def _unknown(run: object) -> Any:
    raise LookupError("the code of this result's plug-in was not run")


PLUGIN_RESULTS = _Results("results", Result, OF_PLUGINS)
