"""One table: every variable of a dataset, its dimensions, units and meaning.

Nothing else in wearlab spells a unit or a long name; labelling, figures, tables and
exports read them here. The table is `variables.toml`; a group of it is what one part of
a scene makes.
"""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from wearlab.nearest import meant
from wearlab.plugins import Registry
from wearlab.results import OF_PLUGINS, RESULTS
from wearlab.units import UnitError, convert
from wearlab.variable import Result, VariableGroup
from wearlab.variable import Variable as Variable

TABLE = tomllib.loads(
    (Path(__file__).parent / "variables.toml").read_text(encoding="utf-8")
)
DIMENSIONS: dict[str, str] = TABLE["dimensions"]
"""What each dimension counts."""


def _group(table: dict[str, Any]) -> VariableGroup:
    """Return a group of the table with the declarations of its variables."""
    variables = {
        name: Variable(tuple(dims.split()), *texts)
        for name, (dims, *texts) in table["variables"].items()
    }
    return VariableGroup(table["name"], table["needs"], variables)


GROUPS = tuple(map(_group, TABLE["group"]))
GROUP_OF = {name: group for group in GROUPS for name in group.variables}
"""The group of each variable of the table."""
VARIABLES: dict[str, Variable] = {
    name: group.variables[name] for name, group in GROUP_OF.items()
}
VARIABLES |= {name: result.variable for name, result in RESULTS.items()}
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
    group = GROUP_OF[name]
    return group.name, group.needs


def attributes(name: str) -> dict[str, str]:
    """Return the CF attributes of a variable: units, long_name, comment if any.

    Parameters
    ----------
    name : a key of `VARIABLES`
    """
    texts = VARIABLES[name]._asdict() | {"coverage_content_type": _content(name)}
    return {key: text for key, text in texts.items() if text and key != "dims"}


def _content(name: str) -> str:
    """Return what a variable is for catalogues, a code of ISO 19115-1.

    ACDD 1.3 names these codes.
    """
    group = GROUP_OF.get(name)
    if group is not None and group.name == "coordinates":
        return "coordinate"
    for content, beginnings in CONTENTS.items():
        if name.startswith(beginnings):
            return content
    return "modelResult"


class _Results(Registry):
    """Results of plug-ins: each is a variable as if wearlab declared it."""

    def problem(self, value: Result) -> str:
        """Return which dimension, unit or need of a result is unknown."""
        if value.name in VARIABLES and value.name not in self.table:
            return "wearlab has a variable of this name: give yours another"
        variable = value.variable
        for name in variable.dims:
            if name not in DIMENSIONS:
                return f"{name!r} is no dimension{meant(name, DIMENSIONS)}"
        for name in value.needs:
            if name not in VARIABLES:
                return f"{name!r} is no variable{meant(name, VARIABLES)}"
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
        """Return a result with its declaration and without its function."""
        fields = dict(record["variable"])
        fields["dims"] = tuple(map(str, fields["dims"]))
        needs = tuple(map(str, record["needs"]))
        return Result(str(record["name"]), Variable(**fields), _not_run, needs)


def _not_run(run: object) -> Any:
    """Refuse to compute a result whose code was not run."""
    raise LookupError("the code of this result's plug-in was not run")


PLUGIN_RESULTS = _Results("results", Result, OF_PLUGINS)
