"""What there is to tell of one run: its state, its results, its scene as written."""

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from json import dumps, loads
from math import isclose
from textwrap import wrap
from typing import TYPE_CHECKING, Any, NamedTuple

from wearlab import sources, units
from wearlab.query.keys import Key, scene_key
from wearlab.store import Store, outcome

if TYPE_CHECKING:
    from wearlab.store.catalogue import Entry

MAX_ITEMS = 3  # of a longer list
MAX_LIST_LENGTH = 100  # characters of a list in JSON
MAX_TEXT_LENGTH = 24  # characters of a value in a table
LINE_WIDTH = 96
GROUP_WIDTH = 20
NOT_AMONG_RESULTS = re.compile(
    "(count_|run_time_).*|verdict|end_reason|life|service_life"
)
"""Results that tell how a run was computed rather than what, and those that stand by
its head."""
ERRORS = {"calibrated_wear_coefficient": "error_estimate_wear_coefficient"}
"""Estimates of the errors of single results; those of the head stand there."""
INDEX = re.compile(r"\[\d+\]|\.\d+(?=\.|$)")
"""Numbers of tables of a list in a key of a scene."""

Stored = Mapping[str, dict[str, Any]]
"""Variables of a run: dims and attrs by name."""
Written = Mapping[str, Sequence[str]]
"""Quantities as a file wrote them, by dotted key."""


def value_text(value: Any) -> str:
    """Return a value as tables show it.

    Parameters
    ----------
    value : a number, a text, or None
    """
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def results(stored: Stored, entry: "Entry") -> list[tuple[str, ...]]:
    """Return name, value, unit and meaning of every number or word that came out.

    Parameters
    ----------
    stored : variables of the run
    entry : of the run, with its results
    """
    rows: list[tuple[str, ...]] = []
    for name, variable in stored.items():
        value = entry.summary.get(name)
        if variable["dims"] or value is None or is_long(value):
            continue
        if NOT_AMONG_RESULTS.fullmatch(name):
            continue
        attributes = variable["attrs"]
        text, unit = as_shown(value, attributes)
        error = entry.summary.get(ERRORS.get(name, ""))
        if error is not None:
            two_digits = float(f"{error:.2g}")
            text += f" ± {as_shown(two_digits, attributes)[0]}"
        rows.append((name, text, unit, str(attributes.get("long_name", ""))))
    return rows


def as_shown(value: Any, attributes: Mapping[str, Any]) -> tuple[str, str]:
    """Return a value in the unit in which it is shown, and that unit.

    Parameters
    ----------
    value : in the stored unit
    attributes : of the variable, with ``units`` and ``display_units``
    """
    unit = str(attributes.get("units", ""))
    display_unit = str(attributes.get("display_units", unit))
    if isinstance(value, int | float) and display_unit not in (unit, "", "1"):
        value = units.convert(float(value), unit, display_unit)
    return value_text(value), "" if display_unit == "1" else display_unit


def groups(stored: Stored) -> list[str]:
    """Return names of what is stored along some dimension, in lines, by their groups.

    Parameters
    ----------
    stored : variables of the run
    """
    from wearlab import schema

    names_by_group: dict[str, list[str]] = {}
    for name in dict.fromkeys((*schema.VARIABLES, *stored)):
        if name in stored and stored[name]["dims"] not in ([], [name]):
            group = schema.origin_of(name)[0] if name in schema.VARIABLES else "others"
            names_by_group.setdefault(group, []).append(name)
    lines = []
    for group, names in names_by_group.items():
        lines += wrap(
            ", ".join(names),
            LINE_WIDTH,
            initial_indent=f"{group:<{GROUP_WIDTH}}",
            subsequent_indent=" " * GROUP_WIDTH,
        )
    return lines


def written_in(store: Store, run_id: str) -> Written:
    """Return quantities as the file of the last campaign with this run wrote them.

    Parameters
    ----------
    store : with records of campaigns
    run_id : of the run

    Returns
    -------
    by dotted key, {} where no record has them
    """
    catalogue = store.archive.catalogue
    campaigns = catalogue.read(
        "SELECT DISTINCT key, recorded FROM members JOIN campaigns ON campaign = key "
        "WHERE run = ? ORDER BY recorded DESC",
        [run_id],
    )
    for key, _ in campaigns:
        written = catalogue.record_of(key).get("written")
        if isinstance(written, dict) and written:
            return {
                name: texts
                for name, texts in written.items()
                if isinstance(texts, list)
            }
    return {}


def in_file_units(path: str, value: Any, written: Written | None = None) -> str:
    """Return a value of a scene as files write it.

    A quantity has its unit; anything else is JSON.

    Parameters
    ----------
    path, value : key and value of the scene
    written : quantities as the file wrote them, see `written_in`: a value has its text
        there, or their unit
    """
    numbers = value if isinstance(value, list) else [value]
    name = INDEX.sub("", path)
    key = scene_key(name, False)
    if not key.quantity or not all(units.is_number(number) for number in numbers):
        return _shortened(value)

    texts = _quantities(name, written or {}, key.quantity)
    shown = [_quantity_text(number, texts, key) for number in numbers]
    if len(shown) > MAX_ITEMS + 1:
        shown = [*shown[:MAX_ITEMS], f"… {len(shown)} in all"]
    return f"[{', '.join(shown)}]" if isinstance(value, list) else shown[0]


class _Quantity(NamedTuple):
    """A quantity as a file wrote it, and its value in SI."""

    value: float
    text: str


def _quantities(name: str, written: Written, kind: str) -> list[_Quantity]:
    """Return the quantities that a file wrote at a key, or at the one above."""
    from wearlab.campaign.reading import MAX_QUANTITIES_OF_KEY

    above = name.rpartition(".")[0]
    texts = written.get(name) or written.get(above, ())
    quantities = []
    for text in texts[:MAX_QUANTITIES_OF_KEY]:
        with suppress(units.UnitError):  # what others recorded, or one of another kind
            quantities.append(_Quantity(units.quantity(text, kind), text))
    return quantities


def _quantity_text(value: float, quantities: Sequence[_Quantity], key: Key) -> str:
    """Return a value as the file wrote it, else in the unit of the first quantity."""
    for quantity in quantities:
        if quantity.text and isclose(quantity.value, value, rel_tol=1e-9):
            return quantity.text

    file_units = (units.split(quantity.text)[1] for quantity in quantities)
    for unit in (*file_units, key.display_unit):
        with suppress(units.UnitError):  # the unit of a scale of hardness
            return f"{units.convert(float(value), key.unit, unit):.6g} {unit}"
    return f"{float(value):.6g} {key.unit}"


def _shortened(value: Any) -> str:
    """Return a value of a scene as JSON, of a long list its first items."""
    text = dumps(value, ensure_ascii=False)
    if not isinstance(value, list) or len(text) <= MAX_LIST_LENGTH:
        return text
    first = ", ".join(
        dumps(element, ensure_ascii=False) for element in value[:MAX_ITEMS]
    )
    return f"[{first}, … {len(value)} in all]"


def is_long(value: Any) -> bool:
    """Say whether a value is a text that would widen a table; it stands below.

    Parameters
    ----------
    value : a result
    """
    if not isinstance(value, str):
        return False
    return len(value) > MAX_TEXT_LENGTH or "\n" in value


def facts(store: Store, entry: "Entry") -> dict[str, Any]:
    """Return what a run is: its state and results, its remarks, its origin and file.

    What there is nothing of is empty.

    Parameters
    ----------
    store : where the run is
    entry : of the run
    """
    return {
        "id": entry.id,
        "state": store.archive.state_of(entry),
        "wear states": _why_one_state(entry),
        "verdict": entry.summary.get("verdict"),
        "result": [
            headline.with_error for headline in outcome.headlines(entry.summary)
        ],
        **_remarks(store, entry),
        **_lineage(store, entry),
        **_author(store, entry),
        **_file(store, entry),
        **_code(entry),
    }


def _why_one_state(entry: "Entry") -> str | None:
    """Return why flanks that may wear have one state: nothing says until when."""
    from wearlab.scene.summary import REMEDY

    scene = loads(entry.scene or "{}")
    wear = scene.get("wear")
    if entry.state != "done" or not wear:
        return None
    stages = (scene.get("operation") or {}).get("stage")
    if wear.get("until") or stages:
        return None
    return f"one: no cycles pass; {REMEDY}"


def _remarks(store: Store, entry: "Entry") -> dict[str, list[str]]:
    """Return campaigns, tags and notes of a run."""
    members = store.archive.catalogue.members([entry.id])
    campaigns = [f"{member.campaign} ({member.label})" for member in members]
    remarks = store.remarks(entry.id)
    return {
        "campaigns": list(dict.fromkeys(campaigns)),
        "tags": [remark.text for remark in remarks if remark.what == "tag"],
        "notes": [
            f"{remark.text} ({remark.who}, {remark.when[:10]})"
            for remark in remarks
            if remark.what == "note"
        ],
    }


def _lineage(store: Store, entry: "Entry") -> dict[str, Any]:
    """Return the runs that a run rests on, and those that rest on it."""
    from wearlab.store import provenance

    return {
        "goes on from": [str(step) for step in provenance.lineage(store, entry)],
        "continued by": provenance.children(store, entry.id),
        "calibrated by": entry.calibration or None,
        "calibrates": provenance.children(store, entry.id, outcome.CALIBRATION),
    }


def _author(store: Store, entry: "Entry") -> dict[str, str]:
    """Return who made a run, as the metadata of its first campaign say."""
    from wearlab.store import provenance

    members = store.archive.catalogue.members([entry.id])
    metadata = members[0].metadata if members else {}
    return {key: metadata[key] for key in provenance.WHO if key in metadata}


def _file(store: Store, entry: "Entry") -> dict[str, Any]:
    """Return the file of a run, and when it was made."""
    path = store.archive.files.path(entry.id)
    return {
        "file": str(path) if entry.state == "done" else None,
        "bytes": entry.size,
        "sha256": entry.sha256,
        "started": entry.started,
        "run time": outcome.seconds_text(entry.seconds),
    }


def _code(entry: "Entry") -> dict[str, Any]:
    """Return the code that made a run."""
    is_other_code = sources.is_other_code(entry.source_hash)
    return {
        "source hash": entry.source_hash,
        "wearlab": entry.wearlab_version,
        "model version": entry.summary.get("model_version"),
        "commit": entry.summary.get("commit"),
        "made by": "other code" if is_other_code else "this code",
    }


def flat(scene: Any, path: str = "") -> list[tuple[str, Any]]:
    """Return a scene's values by dotted key, tables of a list numbered.

    What is absent is left out.

    Parameters
    ----------
    scene : a scene, or a part of it, as tables and lists
    path : key of the part
    """
    if scene is None:
        return []
    if isinstance(scene, dict):
        parts = {f"{path}.{key}" if path else key: part for key, part in scene.items()}
    elif isinstance(scene, list) and any(isinstance(block, dict) for block in scene):
        parts = {f"{path}[{number}]": block for number, block in enumerate(scene)}
    else:
        return [(path, scene)]
    return [pair for key, part in parts.items() for pair in flat(part, key)]
