"""Tables that a scene refers to: read once, so that their contents are part of the scene."""

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from wearlab.options import Stored
from wearlab.tables import ReadTable, TableError, in_unit, read_table
from wearlab.units import comparable

Words = Mapping[str, str]
Numbers = tuple[float, ...]
Profile = tuple[str, str, Numbers, Numbers, Numbers | None]
ABSCISSAE = {"phase": "1", "path_position": "m"}


def read_stiffness(given: dict[str, Any], base: Path | None) -> dict[str, Any]:
    """Return the options of a tabulated stiffness with the file's contents in SI.

    Parameters
    ----------
    given : the options as written; contents that were read before stay
    base : folder that a relative path starts from
    """
    if "along" in given and _stored(given.get("abscissa"), given.get("stiffness")):
        return given
    keys = ("along", "abscissa", "stiffness")
    _refuse_written(given, keys, "{file, of, units}")
    units = named_texts({"units": {}, **given}, "units", '{ stiffness = "N/um" }')
    return given | dict(
        zip(keys, stiffness_table(named_file(given), units, base), strict=True)
    )


def _refuse_written(given: dict[str, Any], keys: Sequence[str], wanted: str) -> None:
    """Refuse what is read from a file where it is written, and options without a file."""
    if written := [key for key in keys if key in given]:
        raise ValueError(f"{written[0]!r} is read from file, not written")
    if "file" not in given:
        raise ValueError(f"'file' is required: {wanted}")


PROFILE_ABSCISSAE = {
    "diameter": "m",
    "roll_angle": "rad",
    "roll_length": "m",
    "path_position": "m",
}
PROFILE_ORDINATES = ("depth", "deviation")
FACE = "face_position"
"""Where on the face points of a flank lie, from mid-face: beside one of these, or alone
in a lead."""


def read_profile(given: dict[str, Any], base: Path | None) -> dict[str, Any]:
    """Return the options of a measured flank with the file's contents in SI.

    Parameters
    ----------
    given : the options as written; contents that were read before stay
    base : folder that a relative path starts from
    """
    if (
        "x" in given
        and "y" in given
        and _stored(given.get("abscissa"), given.get("ordinate"))
    ):
        return given
    keys = ("x", "y", "abscissa", "ordinate", "across")
    _refuse_written(given, keys[2:], "{file, x, y, units}")
    return given | dict(zip(keys, profile_table(given, base), strict=True))


def profile_table(given: dict[str, Any], base: Path | None) -> Profile:
    """Return what abscissa and ordinate of a measured flank are, and their values [m] or [rad].

    Last where each point lies on the face [m]; None of a profile, which was measured at
    one place alone, and of a lead, whose abscissa that is.

    Raises
    ------
    TableError
        When the file cannot be read, lacks a column or a unit, or is not in order.
    """
    return profile_of(read_table((base or Path()) / named_file(given)), given)


def profile_of(table: ReadTable, given: dict[str, Any]) -> Profile:
    """Return what `profile_table` does, of a table that was read."""
    units = (
        named_texts(given, "units", '{ diameter = "mm", depth = "um" }')
        if "units" in given
        else {}
    )
    mapped = (
        named_texts(given, "columns", '{ deviation = "Abweichung" }')
        if "columns" in given
        else {}
    )
    if unknown := set(mapped) - {*PROFILE_ABSCISSAE, FACE, *PROFILE_ORDINATES}:
        known = ", ".join((*PROFILE_ABSCISSAE, FACE, *PROFILE_ORDINATES))
        raise TableError(f"columns: {', '.join(sorted(unknown))}: expected {known}")
    faced = table.meant(FACE, mapped) is not None
    alone = faced and not any(
        name in mapped or table.meant(name, mapped) for name in PROFILE_ABSCISSAE
    )
    abscissae = (FACE,) if alone else tuple(PROFILE_ABSCISSAE)
    x = _column(given.get("x"), table, mapped, abscissae, "x")
    y = _column(given.get("y"), table, mapped, PROFILE_ORDINATES, "y")
    abscissa = _of_table(table, mapped, units, x, PROFILE_ABSCISSAE.get(x, "m"))
    ordinate = _of_table(table, mapped, units, y, "m")
    across = _of_table(table, mapped, units, FACE, "m") if faced and not alone else None
    for place, rows in traces(across, len(abscissa)).items():
        lines = (
            f": lines {table.lines[rows[0]]} to {table.lines[rows[-1]]}, {FACE} "
            f"{1e3 * place:g} mm"
        )
        _check_order(
            [abscissa[row] for row in rows],
            x,
            table.file + ("" if across is None else lines),
        )
    if across is not None and len(set(across)) == 1:
        raise TableError(
            f"{table.file}: {FACE} is {1e3 * across[0]:g} mm in every row: give "
            "several traces over the "
            "face, or a file without that column for a profile that holds all over it"
        )
    return x, y, abscissa, ordinate, across


def traces(across: Sequence[float] | None, count: int) -> dict[float, list[int]]:
    """Return the rows of each trace of a measured flank by its place on the face, rising [m].

    >>> traces([0.01, 0.01, -0.01, -0.01], 4)
    {-0.01: [2, 3], 0.01: [0, 1]}
    """
    found: dict[float, list[int]] = {}
    for row in range(count):
        found.setdefault(0.0 if across is None else across[row], []).append(row)
    return dict(sorted(found.items()))


def _check_order(abscissa: Sequence[float], x: str, whose: str) -> None:
    if any(b < a for a, b in pairwise(abscissa)) and any(
        b > a for a, b in pairwise(abscissa)
    ):
        raise TableError(
            f"{whose}: {x} neither rises nor falls throughout; sort the rows by {x}"
        )
    if any(c == a for a, c in zip(abscissa, abscissa[2:], strict=False)):
        raise TableError(
            f"{whose}: {x} has the same value three times; twice marks a step"
        )


def _of_table(
    table: ReadTable, mapped: Words, units: Words, name: str, wanted: str
) -> Numbers:
    """Return a column in SI, by the unit that the campaign file gives, else by the one in the header."""
    header = table.meant(name, mapped)
    if header is None:
        raise _lacking(table, repr(mapped.get(name, name)), name, name)
    unit = units.get(name) or table.units[header] or ("1" if wanted == "1" else None)
    return tuple(in_unit(table.numbers(header), unit, wanted, name).tolist())


def _lacking(table: ReadTable, expected: str, key: str, name: str) -> TableError:
    """Return the refusal of a table without the column of a key, which may be named."""
    return TableError(
        f"{table.file}: columns are {', '.join(table.names)}; expected {expected} for "
        f"{key}, "
        f'or name it: columns = {{ {name} = "…" }} ({table.understood})'
    )


def _column(
    asked: Any,
    table: ReadTable,
    mapped: Mapping[str, str],
    known: tuple[str, ...],
    key: str,
) -> str:
    """Return the quantity meant: the one asked for or mapped, or the only known one of the file."""
    if asked is not None and asked not in known:
        raise TableError(f"{key}: {asked!r} is not one of {', '.join(known)}")
    chosen = [name for name in known if name in mapped]
    present = chosen or [
        name for name in known if table.meant(name, mapped) is not None
    ]
    if asked is None and len(present) > 1:
        raise TableError(
            f"{table.file} has columns {' and '.join(present)}; say which with {key}"
        )
    picked = asked if asked is not None else next(iter(present), None)
    if picked is None or table.meant(picked, mapped) is None:
        raise _lacking(table, picked or " or ".join(known), key, picked or known[0])
    return str(picked)


DUTY = {"torque": "N*m", "speed": "rad/s"}
USUAL = {"torque": "N*m", "speed": "rpm"}
"""Units as campaign files have them."""
TIMES = ("s", "1")
"""What shares of time may be: durations, or parts of a whole."""


def duty_table(
    file: str, columns: Words, units: Words, base: Path | None
) -> tuple[Numbers, ...]:
    """Return torques [N m], speeds [rad/s] and shares of time (in their own proportions) of a load table.

    Parameters
    ----------
    file, base : the CSV file, and the folder that a relative path starts from
    columns : headers of torque, speed and share, where they differ from these names
    units : their units; shares without one are parts of a whole

    Raises
    ------
    TableError
        When the file cannot be read, lacks a column or a unit, or a value is
        impossible.
    """
    if unknown := {*columns, *units} - {*DUTY, "share"}:
        raise TableError(
            f"{', '.join(sorted(unknown))}: expected torque, speed and share"
        )
    table = read_table((base or Path()) / file)
    columns = {**columns, **_by_unit(table, columns)}
    known = {name: table.meant(name, columns) for name in (*DUTY, "share")}
    lacking = {
        name: "…"
        for name, header in known.items()
        if header is None and name not in columns
    }
    if lacking:
        raise TableError(
            f"{table.file}: columns are {', '.join(table.names)}; none is called "
            f"{', '.join(lacking)}: "
            f"columns = {_written(lacking)} ({table.understood})"
        )
    told = {
        name
        for name, header in known.items()
        if units.get(name) or table.units.get(header or "")
    }
    bare = {name: unit for name, unit in USUAL.items() if name not in told}
    if bare and all(known.values()):
        lacking_units = " and ".join(f"units.{name}" for name in bare)
        raise TableError(f"{lacking_units} required: units = {_written(bare)}")
    torque, speed = (
        _of_table(table, columns, units, name, wanted) for name, wanted in DUTY.items()
    )
    share = _times(table, columns, units)
    if min(torque) < 0.0 or min(speed) <= 0.0 or min(share) < 0.0 or sum(share) <= 0.0:
        raise TableError(
            f"{file}: torques and shares must not be negative, speeds must be positive"
        )
    return torque, speed, share


def _by_unit(table: ReadTable, columns: Mapping[str, str]) -> dict[str, str]:
    """Return the column of each quantity that no name tells and the unit of one column alone does."""
    found: dict[str, str] = {}
    for name, wanted in (*DUTY.items(), *(("share", time) for time in TIMES)):
        if name in {*columns, *found} or table.meant(name, columns) is not None:
            continue
        taken = {*columns.values(), *found.values()}
        free = [one for one in table.names if one not in taken and table.units[one]]
        alone = [one for one in free if comparable(table.units[one], wanted)]
        if len(alone) == 1:
            found[name] = alone[0]
    return found


def _written(options: Mapping[str, str]) -> str:
    each = (
        f"{name} = {json.dumps(value, ensure_ascii=False)}"
        for name, value in options.items()
    )
    return f"{{ {', '.join(each)} }}"


def _times(table: ReadTable, columns: Words, units: Words) -> Numbers:
    header = table.meant("share", columns)
    unit = units.get("share") or (table.units[header] if header else "") or "1"
    wanted = next((time for time in TIMES if comparable(unit, time)), TIMES[-1])
    return _of_table(table, columns, {"share": unit}, "share", wanted)


def named_file(given: dict[str, Any]) -> str:
    """Return the name of the file that a table's contents stand in.

    Raises
    ------
    TableError : it is no text
    """
    if not isinstance(given["file"], str):
        raise TableError(f"file: {given['file']!r} is no text: the name of a CSV file")
    return given["file"]


def named_texts(given: dict[str, Any], key: str, example: str) -> dict[str, str]:
    """Return a table of texts by column, such as units.

    Raises
    ------
    TableError : it is something else
    """
    texts = given[key]
    if not isinstance(texts, dict):
        raise TableError(f"{key}: {texts!r} is no table: write {key} = {example}")
    if wrong := [column for column, text in texts.items() if not isinstance(text, str)]:
        raise TableError(
            f"{key}.{wrong[0]}: {texts[wrong[0]]!r} is no text: write {key} = {example}"
        )
    return texts


def _stored(*columns: Any) -> bool:
    """Say whether these are columns of numbers that a scene has already read."""
    return all(
        isinstance(column, list | tuple)
        and column
        and all(isinstance(number, Stored) for number in column)
        for column in columns
    )


def stiffness_table(
    file: str, units: Words, base: Path | None
) -> tuple[str, Numbers, Numbers]:
    """Return what the abscissa is, the abscissa [1] or [m], and the stiffness [N/m].

    Raises
    ------
    TableError
        When the file cannot be read, lacks a column or a unit, or descends.
    """
    table = read_table((base or Path()) / file)
    along = next((name for name in ABSCISSAE if table.find(name)), None)
    if along is None or table.find("stiffness") is None:
        wanted = "phase or path_position, and stiffness"
        raise TableError(
            f"{file}: columns are {', '.join(table.names)}; expected {wanted}"
        )
    x = _of_table(table, {}, units, along, ABSCISSAE[along])
    k = _of_table(table, {}, units, "stiffness", "N/m")
    if any(b < a for a, b in pairwise(x)):
        raise TableError(
            f"{file}: {along} descends; an abscissa that stands twice marks a jump"
        )
    if any(c == a for a, c in zip(x, x[2:], strict=False)):
        raise TableError(
            f"{file}: {along} has the same value three times; twice marks a jump"
        )
    if min(k) < 0.0 or max(k) <= 0.0:
        raise TableError(
            f"{file}: stiffness {min(k):g} N/m; it must not be negative, nor zero "
            "everywhere"
        )
    return along, x, k
