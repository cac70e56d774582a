"""``wearlab schema``: everything a campaign file may say, as JSON Schema.

Every leaf has a description; a quantity also ``unit`` (the SI unit it is kept in) and
``examples``; a key whose default is not a value has ``derived``, what its absence
means.
"""

import json
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, Literal

from pydantic import ConfigDict

from wearlab import slots, units
from wearlab.campaign import (
    campaign,
    case,
    cases,
    claims,
    distributions,
    update_options,
)
from wearlab.options import ClosedTable, OptionTable
from wearlab.plugins import Plugin, brought
from wearlab.scene.sections import Sections

DIALECT = "https://json-schema.org/draft/2020-12/schema"
LIMITS = {
    "gt": "exclusiveMinimum",
    "ge": "minimum",
    "lt": "exclusiveMaximum",
    "le": "maximum",
}
MAX_ROUND_LENGTH = 8  # characters of a default that is a round number
SOURCES = {
    "L16": "Liu, Yang & Zhang 2016, Tribology International, "
    "doi:10.1016/j.triboint.2016.05.006",
    "W23": "Wang & Zhang 2023, Machines 11(2) 149, doi:10.3390/machines11020149",
    "Y23": "Y. Wang et al. 2023, mesh relationship and mesh stiffness of internal "
    "spur gears with tooth wear",
    "B23": "Bai & Ning 2023, Lubricants 11(6) 255, doi:10.3390/lubricants11060255",
    "wearlab": "a decision of this package",
}
Names = str | tuple[str, ...]


class Spaced(ClosedTable):
    """Values between two ends, both included."""

    linspace: tuple[float, float, int] | None = None
    """[first, last, how many], equal differences [another generator]"""
    logspace: tuple[float, float, int] | None = None
    """[first, last, how many], equal ratios [another generator]"""
    integers: tuple[int, int] | None = None
    """[first, last] in whole numbers, both included [another generator]"""
    unit: str | None = None
    """unit of the values [plain numbers]"""


class Lognormal(ClosedTable):
    """Log-normally distributed values."""

    median: float | str
    """median, with its unit where the key has one"""
    cov: float
    """coefficient of variation: standard deviation over mean"""


class NormalTable(ClosedTable):
    """Normally distributed values."""

    mean: float | str
    """mean, with its unit where the key has one"""
    sd: float | str
    """standard deviation, with its unit where the key has one"""


class WeibullTable(ClosedTable):
    """Weibull-distributed values."""

    scale: float | str
    """63.2 % of the values lie below, with its unit where the key has one"""
    shape: float
    """exponent"""


class DrawnTable(ClosedTable):
    """Values drawn from one distribution.

    It stands in a block with ``sample``, or at an unknown of an update.
    """

    lognormal: Lognormal | None = None
    """log-normal [another generator]"""
    normal: NormalTable | None = None
    """normal [another generator]"""
    uniform: tuple[float | str, float | str] | None = None
    """[low, high], uniform [another generator]"""
    loguniform: tuple[float | str, float | str] | None = None
    """[low, high], uniform in the logarithm [another generator]"""
    triangular: tuple[float | str, float | str, float | str] | None = None
    """[low, mode, high], triangular [another generator]"""
    weibull: WeibullTable | None = None
    """Weibull [another generator]"""
    truncate: tuple[float | str, float | str] | None = None
    """[low, high], values outside are not drawn [not truncated]"""


class Sweep(OptionTable):
    """A block of dotted keys, each to a list of values.

    They advance together, blocks multiply.
    """

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, list[Any] | Spaced | DrawnTable]

    name: str | None = None
    """name of the axis [the first key's last word]"""
    labels: list[str] | None = None
    """names of values that are tables or lists [the values]"""
    sample: distributions.SampleTable | None = None
    """draw the values of every key that has a distribution [keys list their values]"""


class ExpectedValue(ClosedTable):
    """The value of a variable, and how far from it counts as met."""

    value: float | str
    """value, with its unit where the variable has one"""
    tolerance: float | str
    """absolute, in the value's unit; a plain number beside a value with a unit is
    relative"""


class Expect(OptionTable):
    """What a case is expected to come to, ``<variable> = {value, tolerance}`` included.

    A case's table is merged over the file's, unless it has another verdict.
    """

    model_config = ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, ExpectedValue]

    verdict: Literal[case.VERDICTS] | None = None  # type: ignore[valid-type]
    """verdict of the run [any]"""
    response_period: int | None = None
    """mesh periods; 0 is aperiodic [any]"""
    end_reason: str | None = None
    """with what the reason of the end begins [any]"""


class CampaignFile(Sections):
    """A campaign of wearlab: the file together with those it extends."""

    title: str = ""
    """title [the name of the file]"""
    reference: str | None = None
    """where the study comes from, such as a DOI"""
    extends: Names = ()
    """files that this one differs from; later ones win; relative to this file"""
    drop: Names = ()
    """sections or dotted keys of the extended files to do without"""
    metadata: campaign.Metadata = campaign.Metadata()
    """who made it; no part of any run's identity"""
    plugins: tuple[str, ...] = ()
    """Python files, relative to this one, or entry points of the group
    wearlab.variants, that add variants; run only with --plugins"""
    sweep: tuple[Sweep, ...] = ()
    """lists of values; the product of all blocks is run"""
    case: tuple[cases.CaseBlock, ...] = ()
    """named differences from the file"""
    exclude: Names = ()
    """conditions on keys, contact_ratio, total_contact_ratio, mesh_frequency and
    speed_ratio; cases that meet one are not run"""
    figure: tuple[campaign.FigureSpec, ...] = ()
    """figures drawn from the datasets"""
    claim: tuple[claims.ClaimSpec, ...] = ()
    """what the file says of its runs, for `wearlab check --claims`"""
    readings: tuple[str, ...] = ()
    """two CSV tables of what sources print, each entered by itself: with them `wearlab
    check --claims` holds every number and word of direction of titles and notes"""
    expect: Expect | None = None
    """expected outcome, of every case or of its own; no part of any run's identity"""
    report: campaign.ReportSpec = campaign.ReportSpec()
    """what the page of `wearlab report` tells"""
    update: update_options.UpdateBlock | None = None
    """what was measured and what is unknown, for `wearlab update`; no part of any run's
    identity"""


def _changed(
    value: Any, change: Callable[[dict[str, Any]], dict[str, Any]], names: bool = False
) -> Any:
    """Return a schema with every table of keywords changed, the inner ones first.

    Parameters
    ----------
    value : a piece of the schema
    change : what becomes of a table
    names : whether its keys are names of properties, not keywords
    """
    if isinstance(value, list):
        return [_changed(inner, change) for inner in value]
    if not isinstance(value, dict):
        return value
    table = {}
    for key, inner in value.items():
        holds_names = key in ("properties", "$defs")
        table[key] = _changed(inner, change, holds_names)
    return table if names else change(table)


def _plain(table: dict[str, Any]) -> dict[str, Any]:
    """Return a table without titles and nulls; limits and defaults as written."""
    plain = {
        LIMITS.get(key, key): inner for key, inner in table.items() if key != "title"
    }
    if isinstance(plain.get("default"), dict | None):
        plain = _with_chosen_default(plain)
    if "anyOf" in plain:
        plain["anyOf"] = [kind for kind in plain["anyOf"] if kind != {"type": "null"}]
        if len(plain["anyOf"]) == 1:
            only_kind = plain.pop("anyOf")[0]
            plain = {**only_kind, **plain}
    if "required" in plain:
        properties = plain["properties"]
        plain["required"] = [key for key in plain["required"] if key in properties]
        named = properties.get("name", {}).get("description", "")
        if "of the catalogue" in named:  # its name gives the rest
            needed = plain.pop("required")
            plain["anyOf"] = [{"required": ["name"]}, {"required": needed}]
    if "unit" in plain and isinstance(plain.get("default"), int | float):
        example = plain["examples"][0]
        plain["default"] = _written(plain["default"], plain["unit"], example)
    return plain


def _with_chosen_default(table: dict[str, Any]) -> dict[str, Any]:
    """Return a table whose default is a choice, no table and no null.

    What else the table of a default has stands at its keys.
    """
    plain = dict(table)
    default = plain.pop("default", None) or {}
    plain["default"] = default.get("model", default.get("method"))
    return {key: inner for key, inner in plain.items() if inner is not None}


def _written(default: float, unit: str, example: str) -> str:
    """Return a default in the unit of the example, where it is a round number there."""
    usual_unit = units.split(example)[1]
    number = f"{units.convert(default, unit, usual_unit):.12g}"
    if len(number) < MAX_ROUND_LENGTH:
        return f"{number} {usual_unit}"
    return f"{default:g} {unit}"


def schema_json() -> str:
    """Return the JSON Schema of a campaign file.

    Every option has its unit, default, meaning and source.
    """
    schema = _changed(CampaignFile.model_json_schema(), _plain)
    required = {"required": schema.pop("required")}
    extending = {"required": ["extends"]}
    whole = {
        "$schema": DIALECT,
        "title": "wearlab campaign",
        "sources": SOURCES,
        **schema,
        "anyOf": [required, extending],
    }
    return json.dumps(whole, indent=2, ensure_ascii=False)


def added_json(plugins: Iterable[Plugin]) -> str:
    """Return the JSON Schemas of the variants of plug-ins, by slot and name.

    Parameters
    ----------
    plugins : that have brought variants
    """
    hashes = {plugin.sha256 for plugin in plugins}
    schemas: dict[str, dict[str, Any]] = {}
    for name, variant in brought():
        if variant.origin is not None and variant.origin.sha256 in hashes:
            schema = _changed(variant.model_json_schema(), _plain)
            schemas.setdefault(variant.slot.key, {})[name] = schema
    return json.dumps(schemas, indent=2, ensure_ascii=False)


def editors_schema() -> str:
    """Return the JSON Schema of one file.

    What a file that it extends may give is optional.
    """
    schema = _changed(json.loads(schema_json()), _partial)
    return json.dumps(schema, indent=1, ensure_ascii=False)


def _partial(table: dict[str, Any]) -> dict[str, Any]:
    """Return a table that demands no key; a part of it may be of any variant."""
    plain = {
        key: part for key, part in table.items() if key not in ("required", "oneOf")
    }
    if "oneOf" in table:
        plain["anyOf"] = table["oneOf"]
    if plain.get("anyOf") and not any(plain["anyOf"]):
        del plain["anyOf"]
    return plain


slots.WHEN_CHANGED.append(partial(CampaignFile.model_rebuild, force=True))
