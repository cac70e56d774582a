"""Files of gear measuring machines: ``.mka`` (curves) and ``.mew`` (values).

The labels of these files are in the machine's language; what stands in them is told by
codes. Curves are turned to the sign that machines print: material beyond the nominal
flank is positive, so that wear and tip relief are negative.
"""

import math
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.files import read_regular, regular
from wearlab.tables.cells import TableError

CURVES = "KS.MK.FILE"
VALUES = "KS.MW.FILE"
MAX_BYTES = 50_000_000
KEPT_MEASUREMENTS = 8
HEAD_BYTES = 2000
"""Of a file's beginning, in which its format shows."""
MAX_POINTS = 1_000_000
"""Points of one trace."""
LARGEST_DEVIATION = 1e4
"""Beyond it stands no deviation of a flank, but a mark for none [µm]."""
ENCODINGS = ("utf-8-sig", "gbk", "latin-1")
SIDES = ("left", "right")

MODULE, TEETH, HELIX, PRESSURE_ANGLE, SHIFT, FACE_WIDTH, TIP_DIAMETER = range(21, 28)
PROFILE_BEGIN, PROFILE_END = 41, 44
LEAD_BEGIN, LEAD_END = 61, 64
OF_BOTH_SIDES = (PROFILE_BEGIN, PROFILE_END, LEAD_BEGIN, LEAD_END)
"""Codes with a number for the left side and one for the right."""
USED = (MODULE, TEETH, HELIX, PRESSURE_ANGLE, FACE_WIDTH, *OF_BOTH_SIDES)
"""Codes by which curves have their place."""
AXES = {"profile": "z", "lead": "xd"}
"""What the head of a curve says after its count: where it stands."""
NAME = 7
CONVENTIONS = {
    165: ("R_FHB", "1"),
    178: ("LVORZ", "1"),
    179: ("BZGFL", "1"),
    180: ("BZGPR", "0"),
}
"""Code → (setting, value) of signs and references that this reader knows."""
SIGN_OF_CURVES = 178
SIGNS = {
    ("profile", "left"): -1.0,
    ("profile", "right"): 1.0,
    ("lead", "left"): -1.0,
    ("lead", "right"): -1.0,
}
"""Raw curve → printed sign."""
NO_VALUE = {-9999.0: "not measured", 8999.0: "not available"}
"""What stands for no value in a ``.mew``, and what it says."""

CODE = re.compile(r"\s*(\d{1,5})\s+:(.*)")
TITLE = re.compile(r"\s*(profile?|flankenlinie|lead|helix|tooth trace)\s*:\s*$", re.I)
TRACE = re.compile(
    r"\s*(?P<elsewhere>[^:/]*:)?[^:]*:\s*(?P<tooth>\d+)\s*(?P<tag>[a-z]?)\s*"
    r"(?P<plane>/[^/]*?)?\s*(?P<side>links|rechts|left|right)\s*/\s*"
    r"(?P<count>\d+)\s+[^\d=]*?(?P<axis>[zxd])\s*=\s*(?P<at>\S+)\s*$",
    re.I,
)
HEAD = re.compile(
    r"(?:zahn|tooth|links|rechts|left|right)\b.*/\s*\d+\s+[^\d=]*?[zxd]\s*=", re.I
)
"""What every head of a tooth's curve has."""
LONGEST_HEAD = 500
"""Characters: no head of a curve is longer."""
NUMBERS_OF_A_CURVE = 6
"""A line of as many numbers belongs to a curve."""
PITCH_SIDE = re.compile(r"\s*(linke|left|rechte|right)\b", re.I)
PITCH_HEAD = re.compile(r"\bfp\b.*\bFp\b")


class Trace(NamedTuple):
    """One measured curve.

    Parameters
    ----------
    kind : profile or lead
    tooth : number of the tooth
    side : left or right
    face_position : of a profile, from mid-face; None of a lead [m]
    is_main : whether it is the tooth's curve; not a trace beside it for twist or
        topography
    deviation : of each point, printed sign, NaN where undefined [m]
    """

    kind: str
    tooth: int
    side: str
    face_position: float | None
    is_main: bool
    deviation: Array


class Pitch(NamedTuple):
    """The pitch table of one side.

    Parameters
    ----------
    single : f_p of each tooth [m]
    cumulative : F_p of each tooth [m]
    """

    single: Array
    cumulative: Array


class Measurement(NamedTuple):
    """A measured gear.

    Parameters
    ----------
    file : its path
    name : of the gear
    codes : code → numbers that stand behind it
    labels : code → its label in the machine's language
    traces : the curves, in the order of the file
    pitch : side → its table
    """

    file: str
    name: str
    codes: dict[int, tuple[float, ...]]
    labels: dict[int, str]
    traces: tuple[Trace, ...]
    pitch: dict[str, Pitch]

    def number(self, code: int, side: str = "left") -> float:
        """Return a number behind a code: one for both sides, or left and right.

        Parameters
        ----------
        code : such as 21, the normal module
        side : left or right

        Raises
        ------
        TableError : the file has no such number
        """
        numbers = self.codes.get(code, ())
        if not numbers:
            raise TableError(
                f"{self.file}: code {code} is missing, so that the curves have no "
                "place: export the measurement whole"
            )
        number = numbers[min(SIDES.index(side), len(numbers) - 1)]
        if number in NO_VALUE:
            raise TableError(
                f"{self.file}: code {code}, {side} side: {NO_VALUE[number]}"
            )
        return number

    @property
    def base_radius(self) -> float:
        """Radius of the base circle, ``m_n z cos α_t / (2 cos β)`` [m]."""
        helix = math.radians(self.number(HELIX))
        normal = math.radians(self.number(PRESSURE_ANGLE))
        transverse = math.atan(math.tan(normal) / math.cos(helix))
        module = 1e-3 * self.number(MODULE) / math.cos(helix)
        return 0.5 * module * abs(self.number(TEETH)) * math.cos(transverse)

    def teeth(self, kind: str, side: str) -> tuple[int, ...]:
        """Return the teeth of which there is a curve.

        Parameters
        ----------
        kind : profile or lead
        side : left or right
        """
        return tuple(trace.tooth for trace in self._main(kind, side))

    def roll_length(self, side: str, count: int) -> Array:
        """Return the length of roll of the points of a profile, (count,) [m].

        Points stand evenly in the length of roll ``√(r² − r_b²)`` between the diameters
        at which the machine began and ended.

        Parameters
        ----------
        side : left or right
        count : points of the profile
        """
        ends = [
            self._roll(1e-3 * self.number(code, side))
            for code in (PROFILE_BEGIN, PROFILE_END)
        ]
        return np.linspace(ends[0], ends[1], count)

    def _roll(self, diameter: float) -> float:
        """Return the length of roll at a diameter [m]."""
        squared = (0.5 * diameter) ** 2 - self.base_radius**2
        if squared < 0.0:
            raise TableError(
                f"{self.file}: the profile begins at {1e3 * diameter:g} mm, below the "
                f"base circle of {2e3 * self.base_radius:.6g} mm: codes 21 to 24 and "
                "41 contradict each other"
            )
        return math.sqrt(squared)

    def face_positions(self, side: str, count: int) -> Array:
        """Return where the points of a lead lie, from mid-face, (count,) [m].

        Parameters
        ----------
        side : left or right
        count : points of the lead
        """
        middle = 0.5 * self.number(FACE_WIDTH)
        begin, end = (self.number(code, side) for code in (LEAD_BEGIN, LEAD_END))
        return 1e-3 * (np.linspace(begin, end, count) - middle)

    def curve(self, kind: str, side: str, teeth: str | int) -> tuple[Array, Array]:
        """Return a profile or lead of one tooth, or the mean of all.

        Parameters
        ----------
        kind : profile or lead
        side : left or right
        teeth : "mean", or the number of a tooth

        Returns
        -------
        abscissa (length of roll, or place on the face) and deviation [m], both (n,), of
        the points that are defined on every tooth that is asked for

        Raises
        ------
        TableError : there is no such curve, or curves have different counts of points
        """
        traces = self._main(kind, side)
        if teeth != "mean":
            traces = [trace for trace in traces if trace.tooth == teeth]
        if not self.traces:
            raise TableError(
                f"{self.file}: there are values in it and no curves: export the curves "
                "of the measurement (.mka)"
            )
        if not traces:
            present = ", ".join(map(str, self.teeth(kind, side))) or "none"
            raise TableError(
                f"{self.file}: there is no {kind} of {_asked(teeth)}, {side} side; "
                f"teeth with one: {present}"
            )

        twice = [
            tooth for tooth, n in Counter(t.tooth for t in traces).items() if n > 1
        ]
        if twice:
            raise TableError(
                f"{self.file}: tooth {twice[0]} has more than one {kind} of the {side} "
                "side: leave one of them in the file"
            )
        counts = {len(trace.deviation) for trace in traces}
        if len(counts) > 1:
            raise TableError(
                f"{self.file}: {kind}s of the {side} side have "
                f"{' and '.join(map(str, sorted(counts)))} points, so that they have "
                "no mean: name one tooth with teeth"
            )
        count = counts.pop()
        places = (
            self.roll_length(side, count)
            if kind == "profile"
            else self.face_positions(side, count)
        )
        stacked = np.stack([trace.deviation for trace in traces])
        defined = np.all(np.isfinite(stacked), axis=0)
        return places[defined], stacked.mean(axis=0)[defined]

    def _main(self, kind: str, side: str) -> list[Trace]:
        """Return the curves of a kind and side that are the teeth's own."""
        return [
            trace
            for trace in self.traces
            if trace.is_main and trace.kind == kind and trace.side == side
        ]


def _asked(teeth: str | int) -> str:
    """Return what was asked for, in words."""
    return "any tooth" if teeth == "mean" else f"tooth {teeth}"


def is_measurement(content: bytes) -> bool:
    """Tell whether the bytes of a file are those of such a measurement.

    Parameters
    ----------
    content : at least the beginning of the file
    """
    head = content[:200].lstrip(b"\xef\xbb\xbf \t\r\n")
    return head.startswith(b"HEADER") and b"KS.M" in head


def is_measurement_file(path: str | Path) -> bool:
    """Tell whether a file is such a measurement; refuse one of another format by name.

    Parameters
    ----------
    path : the file; False where it cannot be read, which its reader will say

    Raises
    ------
    TableError : it is a GDE file, which wearlab does not read
    """
    try:
        with regular(path) as file:
            head = file.read(HEAD_BYTES)
    except OSError:
        return False

    if head.lstrip(b"\xef\xbb\xbf").startswith(b"<") and b"gde" in head.lower():
        raise TableError(
            f"{path}: a GDE file (VDI/VDE 2610), which is not read: export the curves "
            "as .mka or as CSV with columns diameter and deviation"
        )
    return is_measurement(head)


def read_measurement(path: str | Path) -> Measurement:
    """Return what a measuring machine wrote.

    Parameters
    ----------
    path : ``.mka`` or ``.mew``

    Raises
    ------
    TableError : it cannot be read, is another kind of file, holds signs or references
        that are not known, or curves with another count of points than it states
    """
    try:
        stamp = Path(path).stat()
        return _read(str(path), stamp.st_mtime_ns, stamp.st_size)
    except OSError as error:
        raise TableError(f"{path}: {error.strerror or error}") from None


@lru_cache(maxsize=KEPT_MEASUREMENTS)
def _read(path: str, modified: int, size: int) -> Measurement:
    """Return what a file holds, once for each of its versions."""
    return measurement_of(read_regular(path, MAX_BYTES), path)


def measurement_of(content: bytes, file: str) -> Measurement:
    """Return the measurement in the bytes of a file.

    Parameters
    ----------
    content : the bytes
    file : its path, for messages

    Raises
    ------
    TableError : as of `read_measurement`
    """
    if not is_measurement(content):
        raise TableError(
            f"{file}: it does not begin with HEADER KS.MK.FILE or KS.MW.FILE: export "
            "the curves (.mka) or values (.mew) of the measurement"
        )
    text = _decoded(content)
    lines = text.splitlines()
    _require_whole(text, file)
    has_values_alone = VALUES in lines[0]
    codes, labels, words = _codes(lines, file)
    if not has_values_alone:
        _check_conventions(words, file)

    undefined = _undefined(lines)
    middle = 0.5 * codes[FACE_WIDTH][0] if codes.get(FACE_WIDTH) else 0.0
    teeth = codes.get(TEETH, ())
    traces = tuple(_traces(lines, undefined, middle, file))
    last = max((trace.tooth for trace in traces), default=0)
    if teeth and last > abs(teeth[0]):
        raise TableError(
            f"{file}: a curve of tooth {last}, and {abs(teeth[0]):g} teeth by code "
            f"{TEETH}: export the measurement anew"
        )
    return Measurement(
        file,
        " ".join(words.get(NAME, ())),
        codes,
        labels,
        traces,
        _pitch_tables(lines, teeth, file),
    )


def _decoded(content: bytes) -> str:
    """Return the text; labels may be garbled, codes and numbers are ASCII."""
    for encoding in ENCODINGS:
        try:
            return content.decode(encoding)
        except UnicodeDecodeError:
            continue
    return content.decode("latin-1")


def _require_whole(text: str, file: str) -> None:
    """Refuse a text whose last number may have been cut: no line end follows it."""
    *before, last = text.splitlines(keepends=True)
    words = last.split()
    has_end = last.splitlines()[0] != last
    if before and not has_end and words and _number(words[-1]) is not None:
        raise TableError(
            f"{file}: it ends in the middle of a line, with {words[-1][:40]}, which "
            "may be half a number: export the measurement anew, or end that line where "
            "it is whole"
        )


def _codes(
    lines: Sequence[str], file: str
) -> tuple[dict[int, tuple[float, ...]], dict[int, str], dict[int, tuple[str, ...]]]:
    """Return numbers, label and words behind each code."""
    codes: dict[int, tuple[float, ...]] = {}
    labels: dict[int, str] = {}
    words: dict[int, tuple[str, ...]] = {}
    for line in lines:
        match = CODE.match(line)
        if match is None:
            continue
        code = int(match[1])
        label, *fields = match[2].split(":")
        texts = " ".join(fields).split()
        numbers = [number for text in texts if (number := _number(text)) is not None]
        if code in USED and words.get(code, tuple(texts)) != tuple(texts):
            raise TableError(
                f"{file}: code {code} stands twice, with {' '.join(words[code])} and "
                f"{' '.join(texts)}: export the measurement anew"
            )
        if code in OF_BOTH_SIDES and len(numbers) != len(texts):
            raise TableError(
                f"{file}: code {code} says {' '.join(texts)}, which is no number for "
                "each side: export the measurement anew"
            )
        codes[code] = tuple(numbers)
        labels[code] = label.rstrip(". ")
        words[code] = tuple(texts)
    return codes, labels, words


def _number(text: str) -> float | None:
    """Return a number such as ``.25`` or ``1d5``, None where a text is none."""
    try:
        number = float(text.replace("d", "e").replace("D", "E"))
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def _check_conventions(words: dict[int, tuple[str, ...]], file: str) -> None:
    """Refuse signs and references that this reader does not know."""
    for code, (setting, value) in CONVENTIONS.items():
        found = words.get(code)
        if found is None and code != SIGN_OF_CURVES:
            continue
        if found is None or len(found) < 2 or (found[0], found[1]) != (setting, value):
            raise TableError(
                f"{file}: code {code} says {' '.join(found or ('nothing',))}, and only "
                f"{setting} {value} is known: export the measurement with that setting"
            )


def _undefined(lines: Sequence[str]) -> float:
    """Return the number at or below which a value is undefined."""
    for line in lines:
        texts = line.split()
        if len(texts) > 1 and texts[0] == "UNDEFINED":
            number = _number(texts[1])
            return -math.inf if number is None else number + 1.0
    return -math.inf


def _traces(
    lines: Sequence[str], undefined: float, middle: float, file: str
) -> Iterator[Trace]:
    """Yield the curves, each under the last title before it."""
    kind = ""
    end = 0
    for place, line in enumerate(lines):
        title = TITLE.match(line)
        if title is not None:
            kind = "profile" if title[1].lower().startswith("profil") else "lead"
            continue
        begin = line[:LONGEST_HEAD]
        if PITCH_HEAD.search(begin):
            kind = ""  # rows of many numbers below it are no curve's

        match = TRACE.match(line) if line == begin else None
        if match is None and HEAD.search(begin):
            raise TableError(
                f"{file}, line {place + 1}: {line.strip()[:60]!r} cannot be read as "
                "the head of a curve: export the measurement anew"
            )
        if match is None:
            if kind and place >= end and _is_of_a_curve(line):
                raise TableError(
                    f"{file}, line {place + 1}: numbers that belong to no curve: "
                    "export the measurement anew"
                )
            continue
        _require_title(match, kind, f"{file}, line {place + 1}")
        count = int(match["count"])
        numbers, end = _numbers_below(lines, place, count)
        if not kind:
            continue
        side = "left" if match["side"].lower() in ("links", "left") else "right"
        values = _values(numbers, count, undefined, f"{file}, line {place + 1}")
        at = _number(match["at"])
        yield Trace(
            kind,
            int(match["tooth"]),
            side,
            1e-3 * (at - middle) if kind == "profile" and at is not None else None,
            not (match["elsewhere"] or match["tag"] or match["plane"]),
            1e-6 * SIGNS[kind, side] * values,
        )


def _numbers_below(
    lines: Sequence[str], head: int, count: int
) -> tuple[list[float], int]:
    """Return the numbers below the head of a curve, and the line where they end."""
    read: list[float] = []
    for place in range(head + 1, len(lines)):
        numbers = [_number(text) for text in lines[place].split()]
        if not numbers or None in numbers or len(read) >= count:
            return read, place
        read += [number for number in numbers if number is not None]
    return read, len(lines)


def _is_of_a_curve(line: str) -> bool:
    """Say whether a line holds many numbers and nothing else."""
    texts = line.split()
    has_numbers_alone = all(_number(text) is not None for text in texts)
    return has_numbers_alone and len(texts) >= NUMBERS_OF_A_CURVE


def _require_title(match: re.Match[str], kind: str, place: str) -> None:
    """Refuse a curve of a tooth that does not stand under a title of its kind."""
    is_elsewhere = match["elsewhere"] or match["tag"] or match["plane"]
    if not kind and not is_elsewhere:
        raise TableError(
            f"{place}: a curve stands under no title, profile or lead: export the "
            "measurement anew"
        )
    if not is_elsewhere and match["axis"].lower() not in AXES[kind]:
        raise TableError(
            f"{place}: a curve under the title of a {kind} says {match['axis']} =, as "
            "others do: export the measurement anew"
        )


def _values(
    numbers: Sequence[float], count: int, undefined: float, place: str
) -> Array:
    """Return the values of a curve, NaN where undefined [µm]."""
    if count > MAX_POINTS:
        raise TableError(
            f"{place}: {count} points of one curve: export the measurement anew"
        )
    if len(numbers) != count:
        raise TableError(
            f"{place}: {count} values are announced and {len(numbers)} follow: export "
            "the measurement anew"
        )
    read = np.array(numbers)
    read = np.where(read <= undefined, np.nan, read)
    beyond = np.flatnonzero(np.abs(read) > LARGEST_DEVIATION)
    if beyond.size:
        raise TableError(
            f"{place}: {read[beyond[0]]:g} um is no deviation of a flank; the line "
            "UNDEFINED says which number means none: export the measurement anew"
        )
    return read


def _pitch_tables(
    lines: Sequence[str], teeth: Sequence[float], file: str
) -> dict[str, Pitch]:
    """Return the pitch table of each side: rows of tooth, f_p, F_p, F_r."""
    side = ""
    tables = {}
    for place, line in enumerate(lines):
        match = PITCH_SIDE.match(line)
        if match is not None:
            side = "left" if match[1].lower() in ("linke", "left") else "right"
        elif side and PITCH_HEAD.search(line[:LONGEST_HEAD]):
            pitch = _pitch(lines, place, file)
            count = len(pitch.single)
            if teeth and count != abs(teeth[0]):
                raise TableError(
                    f"{file}, line {place + 1}: {count} teeth in the pitch table, "
                    f"{abs(teeth[0]):g} by code {TEETH}: export the measurement anew"
                )
            if side in tables:
                raise TableError(
                    f"{file}, line {place + 1}: a second pitch table of the {side} "
                    "side: leave one of them in the file"
                )
            tables[side] = pitch
    return tables


def _pitch(lines: Sequence[str], place: int, file: str) -> Pitch:
    """Return the rows below the head of a pitch table; teeth count from 1."""
    rows: list[list[float]] = []
    for line in lines[place + 1 :]:
        numbers = [_number(text) for text in line.split()]
        if not numbers:
            if rows:
                break
            continue
        if None in numbers or len(numbers) < 3:
            break
        rows.append([number for number in numbers if number is not None])

    if not rows:
        raise TableError(
            f"{file}, line {place + 1}: the pitch table has no row of tooth, f_p and "
            "F_p: export the measurement anew"
        )
    if len(set(map(len, rows))) > 1:
        raise TableError(
            f"{file}, line {place + 1}: rows of the pitch table have different counts "
            "of numbers: export the measurement anew"
        )
    if [row[0] for row in rows] != list(range(1, len(rows) + 1)):
        raise TableError(
            f"{file}, line {place + 1}: the teeth of the pitch table are not 1, 2, "
            "3 …: export the measurement anew"
        )
    table = 1e-6 * np.array([row[1:3] for row in rows]).reshape(-1, 2)
    return Pitch(table[:, 0], table[:, 1])
