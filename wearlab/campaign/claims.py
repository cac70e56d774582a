"""What a campaign says of its runs: claims with tolerances, and notes with numbers read off the runs."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ConfigDict

from wearlab import nearest, options, units
from wearlab.campaign.inheritance import CampaignError, is_list_of, modelled
from wearlab.query.formula import names_in, parse_formula, spelled_out
from wearlab.query.grammar import QueryError
from wearlab.scene.problems import shown

if TYPE_CHECKING:
    import xarray as xr

Written = str | int | float
ABSENT = "—"
NAME = re.compile(r"[^\W\d]\w*")
PLACEHOLDER = re.compile(r"(?<![\\\w^])\{([^{}:]+)(?::([^{}:]*))?\}")
FORMAT = re.compile(r"(\+?(?:\.\d)?[efg])(?: (\S.*))?")


class ClaimSpec(BaseModel):
    """Something that a campaign says of its runs, which ``wearlab check --claims`` holds against them."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = options.option(..., "a word for it, which notes and messages use")
    quantity: str = options.option(
        ...,
        "formula of variables, such as `max(wear_depth[flank=sun, update=-1])`: + - * / max min "
        "mean range abs largest_at smallest_at",
    )
    select: dict[str, Written] = options.option(
        {}, "dimension = label, for every variable of the formula", derived="the base"
    )
    value: Written = options.option(..., "what it is, with its unit")
    tolerance: Written = options.option(
        ..., "how far it may be off: in the unit of the value, or `5 %` of it (of a value in %: in points)"
    )
    printed: Written | None = options.option(
        None, "what the source prints, where runs differ from it", derived="the value"
    )
    source: str | None = options.option(None, "paper and figure, such as `W23 Fig. 7`", derived="none")
    why: str | None = options.option(None, "why runs differ from the source", derived="none")

    @property
    def formula(self) -> str:
        """The quantity at its places."""
        places = ", ".join(f"{dim}={_label(label)}" for dim, label in self.select.items())
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


def _label(label: Written) -> str:
    return f"'{label}'" if isinstance(label, str) else repr(label)


def _measured(written: Written) -> tuple[float, str]:
    if isinstance(written, str):
        number, unit = units.split(written)
        return float(number), unit
    return float(written), ""


def read_claims(blocks: Any) -> tuple[ClaimSpec, ...]:
    """Return all ``[[claim]]`` blocks.

    Raises
    ------
    CampaignError : one is malformed, its formula cannot be read, or its name stands twice
    """
    if not is_list_of(blocks, dict):
        raise CampaignError([f"claim: {shown(blocks)} is no list of tables: write [[claim]]"])
    claims = tuple(modelled(ClaimSpec, block, f"claim[{number}]") for number, block in enumerate(blocks))
    problems = [line for number, claim in enumerate(claims) for line in _wrong(number, claim, claims)]
    if problems:
        raise CampaignError(problems)
    return claims


def _wrong(number: int, claim: ClaimSpec, claims: Sequence[ClaimSpec]) -> Iterator[str]:
    where, unit = f"claim[{number}]", ""
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
            yield f"{where}.{key}: {given!r} is not in {unit or 'plain numbers'}, the unit of the value"
        if key == "tolerance" and not (isfinite(size) and size >= 0.0):
            yield f"{where}.{key}: {given!r} is no width"


def note_problems(notes: Sequence[str | None], claims: Sequence[ClaimSpec]) -> list[str]:
    """Return what is wrong with the placeholders of the notes of figures."""
    problems = []
    for number, note in enumerate(notes):
        try:
            spelled_note(note or "", claims)
        except (QueryError, ValueError) as error:
            problems.append(f"figure[{number}].note: {error}")
    return problems


def spelled_note(note: str, claims: Sequence[ClaimSpec]) -> str:
    """Return a note whose placeholders name variables alone, no claims, and each has its format.

    Parameters
    ----------
    note : with placeholders ``{formula:.2f unit}`` or ``{claim:.2f}``; a claim has its own unit
    claims : of the campaign

    Raises
    ------
    ValueError : a formula or a format cannot be read, or no claim is called so
    """
    known = {claim.name: claim for claim in claims}
    formulas = {claim.name: claim.formula for claim in claims}

    def spelled(found: re.Match[str]) -> str:
        formula, written = found[1].strip(), found[2]
        claim = known.get(formula.lstrip("+- "))
        if written is None and claim is None:
            if NAME.fullmatch(formula):
                raise ValueError(f"{found[0]}: no claim is called so{nearest.meant(formula, known)}")
            return found[0]
        form = FORMAT.fullmatch((written if written is not None else ".3g").strip())
        if form is None:
            raise ValueError(f"{found[0]}: {written!r} is no format such as '.2f um'")
        unit = form[2] or (claim.unit if claim else "")
        return f"{{{spelled_out(formula, formulas)}:{form[1]} {unit}".rstrip() + "}"

    return PLACEHOLDER.sub(spelled, note)


def filled(note: str, grid: "xr.Dataset", problems: list[str] | None = None) -> str:
    """Return a note with the numbers of the runs in place of its placeholders.

    Parameters
    ----------
    note : as `spelled_note` returns it
    grid : the campaign as the store has it
    problems : takes why a number is not there; its place then holds a dash
    """
    from wearlab.query.amounts import AmountError, amount

    def number(found: re.Match[str]) -> str:
        form = FORMAT.fullmatch(found[2] or "")
        if form is None:
            return found[0]
        try:
            return format(amount(found[1], grid, form[2] or ""), form[1])
        except AmountError as error:
            if problems is not None:
                problems.append(str(error))
            return ABSENT

    return PLACEHOLDER.sub(number, note)


@dataclass(frozen=True)
class Checked:
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
        return self.measured is not None and low - slack <= self.measured <= high + slack


def check_claims(claims: Sequence[ClaimSpec], grid: "xr.Dataset") -> Iterator[Checked]:
    """Yield every claim of a campaign with what the runs say."""
    from wearlab.query.amounts import AmountError, amount

    formulas: Mapping[str, str] = {claim.name: claim.formula for claim in claims}
    for claim in claims:
        others = {name: text for name, text in formulas.items() if name != claim.name}
        try:
            yield Checked(claim, amount(spelled_out(claim.formula, others), grid, claim.unit))
        except AmountError as error:
            yield Checked(claim, None, str(error))


def unfilled(campaign: Any, grid: "xr.Dataset") -> list[str]:
    """Return why numbers in the notes of a campaign's figures cannot be read off its runs."""
    problems: list[str] = []
    for number, spec in enumerate(campaign.figures, 1):
        own: list[str] = []
        filled(spelled_note(spec.note or "", campaign.claims), grid, own)
        problems += [f"figure {number} ({spec.kind}): note: {line}" for line in own]
    return problems


def unknown_names(campaign: Any, known: Sequence[str]) -> list[str]:
    """Return one line for each name in a claim or a note that no run can have.

    Parameters
    ----------
    campaign : its claims and figures
    known : variables, dimensions and axes
    """
    claims = getattr(campaign, "claims", ())
    told = [(f"claim {claim.name}", claim.formula) for claim in claims]
    for number, spec in enumerate(campaign.figures, 1):
        note = spelled_note(getattr(spec, "note", None) or "", claims)
        told += [(f"figure {number}: note", f[1]) for f in PLACEHOLDER.finditer(note) if f[2] is not None]
    own = {claim.name for claim in claims}
    return [
        f"{where}: {named.name!r} is no variable{nearest.meant(named.name, known)}"
        for where, formula in told
        for named in names_in(parse_formula(formula))
        if named.name not in own and named.name not in known
    ]
