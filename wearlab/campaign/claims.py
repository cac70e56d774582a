"""Claims of a campaign about its runs, and notes with numbers read off the runs."""

import re
from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

from pydantic import BaseModel, ConfigDict, ValidationError

from wearlab import nearest, options, units
from wearlab.campaign.blocks import CampaignError, blocks_of
from wearlab.campaign.marks import without_marks
from wearlab.query.formula import AmountError, amount, parse_formula, spelled_out
from wearlab.query.keys import QueryError

if TYPE_CHECKING:
    import xarray as xr

Written = str | int | float
ABSENT = "—"
NAME = re.compile(r"[^\W\d]\w*")
PLACEHOLDER = re.compile(r"(?<![\\\w^])\{([^{}:]+)(?::([^{}:]*))?\}")
FORMAT = re.compile(r"(\+?(?:\.\d)?[efg])(?: (\S.*))?")


class ClaimSpec(options.ClosedTable):
    """What a campaign says of its runs; ``wearlab check --claims`` compares them."""

    name: str
    """a word for it, which notes and messages use"""
    quantity: str
    """formula of variables, such as `max(wear_depth[flank=sun, update=-1])`: + - * /
    max min mean sum range abs where largest_at smallest_at"""
    select: dict[str, Written] = options.option({})
    """dimension = label, for every variable of the formula [the base]"""
    value: Written
    """what it is, with its unit"""
    tolerance: Written
    """how far it may be off: in the unit of the value, or `5 %` of it (of a value in %:
    in points)"""
    printed: Written | None = None
    """what the source prints, where runs differ from it [the value]"""
    source: str | None = None
    """paper and figure, such as `W23 Fig. 7`"""
    why: str | None = None
    """why runs differ from the source"""
    loose: str | None = None
    """why a tolerance is over a quarter of the value, after it: `5 %: rough lives`"""

    @property
    def formula(self) -> str:
        """The quantity at its places."""
        places = ", ".join(
            f"{dim}='{label}'" if isinstance(label, str) else f"{dim}={label!r}"
            for dim, label in self.select.items()
        )
        return f"({self.quantity})[{places}]" if places else self.quantity

    @property
    def unit(self) -> str:
        """The unit of the value, "" for a plain number."""
        return _measured(self.value)[1]

    @property
    def bounds(self) -> tuple[float, float]:
        """Between which numbers it holds, in its unit."""
        value, unit = _measured(self.value)
        tolerance, tolerance_unit = _measured(self.tolerance)
        is_relative = tolerance_unit == "%" and unit != "%"
        width = abs(value) * tolerance / 100.0 if is_relative else tolerance
        return value - width, value + width

    def is_loose(self, share: float) -> bool:
        """Whether the tolerance is over a share of the value.

        Parameters
        ----------
        share : largest tolerance over the value
        """
        low, high = self.bounds
        width = (high - low) / 2.0
        middle = abs(low + high) / 2.0
        tolerance, tolerance_unit = _measured(self.tolerance)
        is_relative = tolerance_unit == "%" and self.unit != "%"
        if is_relative:
            return tolerance > 100.0 * share
        return width > share * middle * (1.0 + 1e-9)

    @property
    def source_number(self) -> float:
        """What the source prints, in the unit of the value."""
        return _measured(self.value if self.printed is None else self.printed)[0]


def _measured(written: Written) -> tuple[float, str]:
    """Return the number and the unit of what a file writes, "" for a plain number."""
    if isinstance(written, str):
        number, unit = units.split(written)
        return float(number), unit
    return float(written), ""


def read_claims(blocks: Any) -> tuple[ClaimSpec, ...]:
    """Return all ``[[claim]]`` blocks.

    Parameters
    ----------
    blocks : what the file has under ``claim``

    Raises
    ------
    CampaignError : one is malformed, its formula cannot be read, or its name stands
        twice
    """
    claims = blocks_of(ClaimSpec, blocks, "claim")
    problems = [
        f"claim[{number}].{problem}"
        for number, claim in enumerate(claims)
        for problem in (*_name_problems(claim, claims[:number]), *_problems(claim))
    ]
    if problems:
        raise CampaignError(problems)
    return claims


def _name_problems(claim: ClaimSpec, earlier: Sequence[ClaimSpec]) -> Iterator[str]:
    """Yield what is wrong with the name of a claim that follows earlier ones."""
    if not NAME.fullmatch(claim.name):
        yield f"name: {claim.name!r} is no word of letters, digits and _"
    if claim.name in [previous.name for previous in earlier]:
        yield f"name: {claim.name!r} stands twice: choose another"


def _problems(claim: ClaimSpec) -> Iterator[str]:
    """Yield what is wrong with the formula and the numbers of a claim."""
    try:
        parse_formula(claim.formula)
    except QueryError as error:
        yield f"quantity: {error}"

    value_unit = ""
    for key in ("value", "tolerance", "printed"):
        written = getattr(claim, key)
        if written is None:
            continue
        try:
            number, unit = _measured(written)
        except units.UnitError as error:
            yield f"{key}: {error}"
            continue
        if key == "value":
            value_unit = unit
        is_relative = key == "tolerance" and unit == "%"
        if unit != value_unit and not is_relative:
            yield (
                f"{key}: {written!r} is not in {value_unit or 'plain numbers'}, the "
                "unit of the value"
            )
        if key == "tolerance" and not (isfinite(number) and number >= 0.0):
            yield f"{key}: {written!r} is no width"


def spelled_note(note: str, claims: Sequence[ClaimSpec]) -> str:
    """Return a note whose placeholders name no claims, and each has its format.

    Its quotations and words of direction stand in it as readers see them.

    Parameters
    ----------
    note : with placeholders ``{formula:.2f unit}`` or ``{claim:.2f}``; the unit of a
        claim is that of its value
    claims : of the campaign

    Raises
    ------
    ValueError : a formula or a format cannot be read, or no claim is called so
    """
    by_name = {claim.name: claim for claim in claims}
    return PLACEHOLDER.sub(
        lambda match: _spelled_placeholder(match, by_name), without_marks(note)
    )


def _spelled_placeholder(match: re.Match[str], claims: Mapping[str, ClaimSpec]) -> str:
    """Return a placeholder with formulas in place of claims, and with its format."""
    formula = match[1].strip()
    written_format = match[2]
    claim = claims.get(formula.lstrip("+- "))
    if written_format is None and claim is None:
        if NAME.fullmatch(formula):
            remedy = nearest.meant(formula, claims)
            raise ValueError(f"{match[0]}: no claim is called so{remedy}")
        return match[0]

    number_format = ".3g" if written_format is None else written_format
    parts = FORMAT.fullmatch(number_format.strip())
    if parts is None:
        raise ValueError(
            f"{match[0]}: {written_format!r} is no format such as '.2f um'"
        )
    unit = parts[2] or (claim.unit if claim else "")
    formulas = {name: other.formula for name, other in claims.items()}
    spelled = spelled_out(formula, formulas)
    return f"{{{spelled}:{parts[1]} {unit}".rstrip() + "}"


def filled(note: str, grid: "xr.Dataset") -> str:
    """Return a note with the numbers of the runs in place of its placeholders.

    Parameters
    ----------
    note : as `spelled_note` returns it
    grid : the campaign as the store has it
    """
    numbers = {reading.placeholder: reading.number for reading in _read_off(note, grid)}
    return refilled(note, numbers)


class _Reading(NamedTuple):
    """A placeholder of a note, its number as text, and why that is a dash."""

    placeholder: str
    number: str
    problem: str = ""


def _read_off(note: str, grid: "xr.Dataset") -> Iterator[_Reading]:
    """Yield what the runs say of each placeholder of a spelled note."""
    for match in _placeholders(note):
        digits, _, unit = match[2].partition(" ")
        try:
            number = format(amount(match[1], grid, unit), digits)
        except AmountError as error:
            yield _Reading(match[0], ABSENT, str(error))
        else:
            yield _Reading(match[0], number)


def refilled(note: str, numbers: Mapping[str, str]) -> str:
    """Return a note with numbers in place of its placeholders, or dashes.

    Parameters
    ----------
    note : as `spelled_note` returns it
    numbers : as text, by placeholder
    """
    texts = {match[0]: numbers.get(match[0], ABSENT) for match in _placeholders(note)}
    return PLACEHOLDER.sub(lambda match: texts.get(match[0], match[0]), note)


def _placeholders(note: str) -> Iterator[re.Match[str]]:
    """Yield the places of a spelled note that numbers take."""
    return (
        match
        for match in PLACEHOLDER.finditer(note)
        if FORMAT.fullmatch(match[2] or "")
    )


class Checked(NamedTuple):
    """A claim and what the runs say.

    Parameters
    ----------
    claim : as the file has it
    measured : in the unit of the claim, None when the runs do not have it
    reason : why they do not
    """

    claim: ClaimSpec
    measured: float | None
    reason: str = ""

    @property
    def holds(self) -> bool:
        """Whether the runs are within the tolerance."""
        if self.measured is None:
            return False
        low, high = self.claim.bounds
        rounding = 1e-9 * max(abs(low), abs(high))
        return low - rounding <= self.measured <= high + rounding


def _spelled(claims: Sequence[ClaimSpec]) -> Iterator[tuple[ClaimSpec, str]]:
    """Yield every claim with its formula, in which no other claim is named."""
    for claim in claims:
        formulas = {
            referenced.name: referenced.formula
            for referenced in claims
            if referenced.name != claim.name
        }
        yield claim, spelled_out(claim.formula, formulas)


class MeasuredClaim(BaseModel):
    """What runs say of a claim; what else a file tells of it is not read.

    Parameters
    ----------
    name, formula, unit : of the claim, no other claim named in the formula
    measured : in that unit, None when the runs do not have it
    reason : why they do not
    """

    model_config = ConfigDict(frozen=True)

    name: str
    formula: str
    unit: str
    measured: float | None
    reason: str = ""


class ClaimRecord(BaseModel):
    """What ``wearlab check --claims --json`` writes of a campaign's claims and notes.

    Parameters
    ----------
    runs : ids of the runs that were there: they know scene and model version
    claims : with their numbers
    numbers : what stands for each placeholder of a note
    unfilled : why some have a dash
    """

    model_config = ConfigDict(frozen=True)

    runs: tuple[str, ...]
    claims: tuple[MeasuredClaim, ...]
    numbers: dict[str, str]
    unfilled: tuple[str, ...] = ()

    @classmethod
    def read(cls, text: str | bytes, name: str) -> "ClaimRecord":
        """Return the record that a file holds.

        Parameters
        ----------
        text : of the file
        name : what messages call the file

        Raises
        ------
        ValueError : it holds something else
        """
        try:
            return cls.model_validate_json(text)
        except ValidationError as error:
            first = error.errors()[0]
            place = "".join(f"{part}: " for part in first["loc"])
            raise ValueError(
                f"{name}: {place}{first['msg']}; give what `wearlab check FILE "
                "--claims --json` wrote"
            ) from None


def measure(campaign: Any, grid: "xr.Dataset") -> ClaimRecord:
    """Return what the runs of a campaign say of its claims and notes.

    Parameters
    ----------
    campaign : its claims and figures
    grid : the campaign as the store has it
    """
    claims = tuple(
        _measured_claim(claim, formula, grid)
        for claim, formula in _spelled(campaign.claims)
    )
    numbers: dict[str, str] = {}
    unfilled: list[str] = []
    for place, note in _notes(campaign):
        for reading in _read_off(note, grid):
            numbers[reading.placeholder] = reading.number
            if reading.problem:
                unfilled.append(f"{place}: {reading.problem}")

    is_done = grid["status"].values == "done"
    runs = dict.fromkeys(grid["run_id"].values[is_done].ravel().tolist())
    return ClaimRecord(
        runs=tuple(runs), claims=claims, numbers=numbers, unfilled=tuple(unfilled)
    )


def _measured_claim(
    claim: ClaimSpec, formula: str, grid: "xr.Dataset"
) -> MeasuredClaim:
    """Return what runs say of one claim, whose formula names no other claim."""
    number = None
    reason = ""
    try:
        number = amount(formula, grid, claim.unit)
    except AmountError as error:
        reason = str(error)
    return MeasuredClaim(
        name=claim.name,
        formula=formula,
        unit=claim.unit,
        measured=number,
        reason=reason,
    )


def check_record(
    campaign: Any, record: ClaimRecord, stale: str = ""
) -> tuple[list[Checked], list[str]]:
    """Return every claim with what runs said of it, and which notes lack numbers.

    Parameters
    ----------
    campaign : its claims and figures
    record : what the runs said
    stale : why the record no longer counts, "" when it does
    """
    recorded = {claim.name: claim for claim in record.claims}
    checked = []
    for claim, formula in _spelled(campaign.claims):
        entry = recorded.get(claim.name)
        if stale:
            checked.append(Checked(claim, None, stale))
        elif entry is None or (entry.formula, entry.unit) != (formula, claim.unit):
            reason = "not measured, or by another formula; measure anew"
            checked.append(Checked(claim, None, reason))
        else:
            checked.append(Checked(claim, entry.measured, entry.reason))

    unmeasured = [
        f"{place}: {match[0]}: not measured; measure anew"
        for place, note in _notes(campaign)
        for match in _placeholders(note)
        if match[0] not in record.numbers
    ]
    return checked, [*record.unfilled, *unmeasured]


def stale(campaign: Any, record: ClaimRecord) -> str:
    """Return why a record is not of a campaign's runs as they are today, "" when it is.

    Parameters
    ----------
    campaign : its cases and axes
    record : what runs said
    """
    ids = {case.id for case in campaign.cases}
    unmeasured = [case for case in campaign.cases if case.id not in record.runs]
    if unmeasured:
        return (
            f"{len({case.id for case in unmeasured})} of {len(ids)} runs were not "
            "measured, or with another scene or model version, the first "
            f"{_place_of_case(unmeasured[0], campaign.axes)}; measure anew"
        )
    if removed := len(set(record.runs) - ids):
        return (
            f"{removed} runs that were measured are no longer of the campaign; "
            "measure anew"
        )
    return ""


def _place_of_case(case: Any, axes: Sequence[Any]) -> str:
    """Return the label of a case and its place on each axis, as a message says them."""
    places = [
        f"{axis.name}={axis.values[case.position[axis.name]]} {axis.units or ''}"
        for axis in axes
        if axis.name in case.position
    ]
    texts = (place.replace(".0 ", " ").rstrip() for place in places)
    return ", ".join([case.label, *texts])


def _notes(campaign: Any) -> Iterator[tuple[str, str]]:
    """Yield place and spelled note of each figure of a campaign."""
    claims = getattr(campaign, "claims", ())
    for number, spec in enumerate(campaign.figures, 1):
        note = spelled_note(getattr(spec, "note", None) or "", claims)
        yield f"figure {number} ({spec.kind}): note", note


def unknown_names(campaign: Any, known: Sequence[str]) -> list[str]:
    """Return one line for each name in a claim or a note that no run can have.

    Parameters
    ----------
    campaign : its claims and figures
    known : variables, dimensions and axes
    """
    claims = getattr(campaign, "claims", ())
    formulas = [(f"claim {claim.name}", claim.formula) for claim in claims]
    formulas += [
        (place, match[1])
        for place, note in _notes(campaign)
        for match in _placeholders(note)
    ]
    valid = {claim.name for claim in claims}.union(known)
    return [
        f"{place}: {named.name!r} is no variable{nearest.meant(named.name, known)}"
        for place, formula in formulas
        for named in parse_formula(formula).names
        if named.name not in valid
    ]
