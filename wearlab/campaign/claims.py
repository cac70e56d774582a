"""What a campaign says of its runs: claims with tolerances, and notes with numbers read off the runs."""

import re
from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

from pydantic import BaseModel, ConfigDict, ValidationError

from wearlab import nearest, options, units
from wearlab.campaign.blocks import CampaignError, blocks_of
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
    """Something that a campaign says of its runs, which ``wearlab check --claims`` holds against them."""

    name: str
    """a word for it, which notes and messages use"""
    quantity: str
    """formula of variables, such as `max(wear_depth[flank=sun, update=-1])`: + - * /
    max min mean range abs largest_at smallest_at"""
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
        size, of = _measured(self.tolerance)
        width = abs(value) * size / 100.0 if of == "%" != unit else size
        return value - width, value + width

    @property
    def source_number(self) -> float:
        """What the source prints, in the unit of the value."""
        return _measured(self.value if self.printed is None else self.printed)[0]


def _measured(written: Written) -> tuple[float, str]:
    if isinstance(written, str):
        number, unit = units.split(written)
        return float(number), unit
    return float(written), ""


def read_claims(blocks: Any) -> tuple[ClaimSpec, ...]:
    """Return all ``[[claim]]`` blocks.

    Raises
    ------
    CampaignError : one is malformed, its formula cannot be read, or its name stands
        twice
    """
    claims = blocks_of(ClaimSpec, blocks, "claim")
    problems = [
        line
        for number, claim in enumerate(claims)
        for line in _wrong(number, claim, claims)
    ]
    if problems:
        raise CampaignError(problems)
    return claims


def _wrong(number: int, claim: ClaimSpec, claims: Sequence[ClaimSpec]) -> Iterator[str]:
    where = f"claim[{number}]"
    unit = ""
    if not NAME.fullmatch(claim.name):
        yield f"{where}.name: {claim.name!r} is no word of letters, digits and _"
    if claim.name in [other.name for other in claims[:number]]:
        yield f"{where}.name: {claim.name!r} stands twice: choose another"
    try:
        parse_formula(claim.formula)
    except QueryError as error:
        yield f"{where}.quantity: {error}"
    for key in ("value", "tolerance", "printed"):
        given = getattr(claim, key)
        try:
            size, own = (0.0, unit) if given is None else _measured(given)
        except units.UnitError as error:
            yield f"{where}.{key}: {error}"
            continue
        unit = own if key == "value" else unit
        if own != unit and not (key == "tolerance" and own == "%"):
            yield (
                f"{where}.{key}: {given!r} is not in {unit or 'plain numbers'}, the "
                "unit of the value"
            )
        if key == "tolerance" and not (isfinite(size) and size >= 0.0):
            yield f"{where}.{key}: {given!r} is no width"


def spelled_note(note: str, claims: Sequence[ClaimSpec]) -> str:
    """Return a note whose placeholders name variables alone, no claims, and each has its format.

    Parameters
    ----------
    note : with placeholders ``{formula:.2f unit}`` or ``{claim:.2f}``; a claim has its
        own unit
    claims : of the campaign

    Raises
    ------
    ValueError : a formula or a format cannot be read, or no claim is called so
    """
    known = {claim.name: claim for claim in claims}
    formulas = {claim.name: claim.formula for claim in claims}

    def spelled(found: re.Match[str]) -> str:
        formula = found[1].strip()
        written = found[2]
        claim = known.get(formula.lstrip("+- "))
        if written is None and claim is None:
            if NAME.fullmatch(formula):
                raise ValueError(
                    f"{found[0]}: no claim is called so{nearest.meant(formula, known)}"
                )
            return found[0]
        form = FORMAT.fullmatch((written if written is not None else ".3g").strip())
        if form is None:
            raise ValueError(f"{found[0]}: {written!r} is no format such as '.2f um'")
        unit = form[2] or (claim.unit if claim else "")
        return f"{{{spelled_out(formula, formulas)}:{form[1]} {unit}".rstrip() + "}"

    return PLACEHOLDER.sub(spelled, note)


def filled(note: str, grid: "xr.Dataset") -> str:
    """Return a note with the numbers of the runs in place of its placeholders.

    Parameters
    ----------
    note : as `spelled_note` returns it
    grid : the campaign as the store has it
    """
    return refilled(note, {place: number for place, number, _ in _read_off(note, grid)})


def _read_off(note: str, grid: "xr.Dataset") -> Iterator[tuple[str, str, str]]:
    """Yield each placeholder of a spelled note, what stands for it, and why that is a dash."""
    for found in _placeholders(note):
        digits, _, unit = found[2].partition(" ")
        try:
            yield found[0], format(amount(found[1], grid, unit), digits), ""
        except AmountError as error:
            yield found[0], ABSENT, str(error)


def refilled(note: str, numbers: Mapping[str, str]) -> str:
    """Return a note with numbers that were measured in place of its placeholders, or dashes."""
    there = {found[0]: numbers.get(found[0], ABSENT) for found in _placeholders(note)}
    return PLACEHOLDER.sub(lambda found: there.get(found[0], found[0]), note)


def _placeholders(note: str) -> Iterator[re.Match[str]]:
    """Yield the places of a spelled note that numbers take."""
    return (
        found
        for found in PLACEHOLDER.finditer(note)
        if FORMAT.fullmatch(found[2] or "")
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
        low, high = self.claim.bounds
        slack = 1e-9 * max(abs(low), abs(high))
        return (
            self.measured is not None and low - slack <= self.measured <= high + slack
        )


def _spelled(claims: Sequence[ClaimSpec]) -> Iterator[tuple[ClaimSpec, str]]:
    """Yield every claim with its formula, in which no other claim is named."""
    formulas: Mapping[str, str] = {claim.name: claim.formula for claim in claims}
    for claim in claims:
        others = {name: text for name, text in formulas.items() if name != claim.name}
        yield claim, spelled_out(claim.formula, others)


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
    """What runs say of a campaign's claims and notes, as ``wearlab check --claims --json`` writes it.

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

        Raises
        ------
        ValueError : it holds something else
        """
        try:
            return cls.model_validate_json(text)
        except ValidationError as error:
            first = error.errors()[0]
            where = "".join(f"{part}: " for part in first["loc"])
            raise ValueError(
                f"{name}: {where}{first['msg']}; give what `wearlab check FILE "
                "--claims --json` wrote"
            ) from None


def measured(campaign: Any, grid: "xr.Dataset") -> ClaimRecord:
    """Return what the runs of a campaign say of its claims and notes."""
    claims = []
    for claim, formula in _spelled(campaign.claims):
        told: dict[str, Any] = {
            "name": claim.name,
            "formula": formula,
            "unit": claim.unit,
        }
        try:
            claims.append(
                MeasuredClaim(**told, measured=amount(formula, grid, claim.unit))
            )
        except AmountError as error:
            claims.append(MeasuredClaim(**told, measured=None, reason=str(error)))
    numbers: dict[str, str] = {}
    unfilled: list[str] = []
    for where, note in _notes(campaign):
        for place, number, problem in _read_off(note, grid):
            numbers[place] = number
            unfilled += [f"{where}: {problem}"] if problem else []
    runs = tuple(
        dict.fromkeys(
            grid["run_id"].values[grid["status"].values == "done"].ravel().tolist()
        )
    )
    return ClaimRecord(
        runs=runs, claims=tuple(claims), numbers=numbers, unfilled=tuple(unfilled)
    )


def check_record(
    campaign: Any, record: ClaimRecord, stale: str = ""
) -> tuple[list[Checked], list[str]]:
    """Return every claim with what runs said of it, and which numbers of notes they do not tell.

    Parameters
    ----------
    campaign : its claims and figures
    record : what the runs said
    stale : why that is no more to be taken, "" when it is
    """
    told = {one.name: one for one in record.claims}
    checked = []
    for claim, formula in _spelled(campaign.claims):
        one = told.get(claim.name)
        if stale or one is None or (one.formula, one.unit) != (formula, claim.unit):
            checked.append(
                Checked(
                    claim,
                    None,
                    stale or "not measured, or by another formula; measure anew",
                )
            )
        else:
            checked.append(Checked(claim, one.measured, one.reason))
    asked = (
        (where, found[0])
        for where, note in _notes(campaign)
        for found in _placeholders(note)
    )
    lacking = [
        f"{where}: {place}" for where, place in asked if place not in record.numbers
    ]
    return checked, [
        *record.unfilled,
        *(f"{line}: not measured; measure anew" for line in lacking),
    ]


def stale(campaign: Any, record: ClaimRecord) -> str:
    """Return why a record is not of a campaign's runs as they are today, "" when it is."""
    ids = {case.id for case in campaign.cases}
    moved = [case for case in campaign.cases if case.id not in record.runs]
    lost = len(set(record.runs) - ids)
    if moved:
        places = (
            f"{axis.name}={axis.values[moved[0].position[axis.name]]} "
            f"{axis.units or ''}"
            for axis in campaign.axes
            if axis.name in moved[0].position
        )
        first = ", ".join(
            [moved[0].label, *(place.replace(".0 ", " ").rstrip() for place in places)]
        )
        return (
            f"{len({case.id for case in moved})} of {len(ids)} runs were not "
            "measured, or with another scene "
            f"or model version, the first {first}; measure anew"
        )
    return (
        f"{lost} runs that were measured are no longer of the campaign; measure anew"
        if lost
        else ""
    )


def _notes(campaign: Any) -> Iterator[tuple[str, str]]:
    """Yield where each note of a campaign's figures stands, and the note, its placeholders spelled out."""
    known = getattr(campaign, "claims", ())
    for number, spec in enumerate(campaign.figures, 1):
        yield (
            f"figure {number} ({spec.kind}): note",
            spelled_note(getattr(spec, "note", None) or "", known),
        )


def unknown_names(campaign: Any, known: Sequence[str]) -> list[str]:
    """Return one line for each name in a claim or a note that no run can have.

    Parameters
    ----------
    campaign : its claims and figures
    known : variables, dimensions and axes
    """
    claims = getattr(campaign, "claims", ())
    told = [(f"claim {claim.name}", claim.formula) for claim in claims]
    told += [
        (where, found[1])
        for where, note in _notes(campaign)
        for found in _placeholders(note)
    ]
    own = {claim.name for claim in claims}
    return [
        f"{where}: {named.name!r} is no variable{nearest.meant(named.name, known)}"
        for where, formula in told
        for named in parse_formula(formula).names
        if named.name not in own and named.name not in known
    ]
