"""The section ``[update]`` as files write it, and read: what was measured, in SI."""

from collections.abc import Sequence
from datetime import date as date_
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from annotated_types import Ge, Le, Lt, MinLen
from pydantic import ValidationInfo, field_validator, model_validator

from wearlab import nearest
from wearlab.campaign import axes, distributions
from wearlab.campaign.blocks import CampaignError
from wearlab.campaign.scenario import Scenario
from wearlab.options import (
    POSITIVE,
    ClosedTable,
    Count,
    Density,
    Depth,
    Mass,
    Volume,
    option,
)
from wearlab.scene.problems import not_a_choice, shown
from wearlab.schema import VARIABLES

SECTION = "update"
THICKNESS = "tooth_thickness"
WHEN = ("cycle", "hours", "mesh_cycles", "date")
WHERE = ("diameter", "roll_angle", "path_position")
DESCRIPTION = ("side", "teeth", "x", "y", "zero", "direction", "continuation")
"""Options that describe a measured flank, as ``wear.initial`` has them."""
UNSTATED = ("sheet", "decimal", "at", "unit", *DESCRIPTION)
"""Options of files that the identity of an update leaves out where nothing is said."""
OIL_AGES = ("oil_hours", "oil_changed")
PREVIOUS = "previous"
ALL_MEMBERS = "all"
PPM = "ppm"
MAX_DRAWS = 100_000
HOURS_A_YEAR = 8784.0  # of the longest
CHANGES = ("none", "once", "running-in")
POPULATION_DEFAULTS = {
    "spread": {"lognormal": {"median": 0.3, "cov": 1.0}},
    "straying": {"lognormal": {"median": 0.2, "cov": 1.0}},
    "power": {"lognormal": {"median": 1.0, "cov": 0.2}},
}
POPULATION_MIN = {"straying": 0.0, "power": 0.05}  # of numbers
POPULATION_LIMIT = 10.0  # of numbers
DATE_FORMAT: Any = option(
    None,
    'how dates are written, such as "%d/%m/%Y"',
    derived="found out; refused where it has two meanings",
)


class Columns(ClosedTable):
    """Which column of a file says what."""

    cycle: str | None = None
    """cycles of the reference gear [hours or mesh_cycles]"""
    hours: str | None = None
    """operating hours [cycle or mesh_cycles]"""
    mesh_cycles: str | None = None
    """mesh cycles [cycle or hours]"""
    date: str | None = None
    """dates, ISO 8601 or as Excel writes them; they need update.calendar [cycle or
    hours]"""
    unit: str | None = None
    """which unit of a fleet the row is of [there is one]"""
    value: str | None = None
    """what was measured [the quantity's name]"""
    sd: str | None = None
    """standard error of each value, added to the error's"""
    oil_hours: str | None = None
    """operating hours of the oil at the sample: what is in it came in since [oil
    changes are not known]"""
    oil_changed: str | None = None
    """date of the last oil change before the sample [oil changes are not known]"""
    below: str | None = None
    """a limit of detection: where the value is empty, it was below this [none is]"""
    diameter: str | None = None
    """diameter at which a profile was measured"""
    roll_angle: str | None = None
    """roll angle at which a profile was measured"""
    path_position: str | None = None
    """path position at which a profile was measured"""

    @model_validator(mode="after")
    def _one_of_each(self) -> "Columns":
        """Refuse two columns that say the same thing."""
        kinds = {
            "when": WHEN,
            "where on the flank": WHERE,
            "since when the oil was used": OIL_AGES,
        }
        for kind, names in kinds.items():
            columns = [name for name in names if getattr(self, name) is not None]
            if len(columns) > 1 and columns != ["hours", "date"]:
                raise ValueError(f"{' and '.join(columns)} both say {kind}; name one")
        return self


class ErrorBlock(ClosedTable):
    """How far measurements are off."""

    sd: str | float | dict[str, Any] | None = None
    """standard error of a single value, with its unit; a distribution where it is
    unknown"""
    relative: Annotated[float, Ge(0.0), Lt(10.0)] | None = None
    """standard error over what is measured, an unknown gain with it"""
    offset_sd: str | float | None = None
    """standard error that all values of one inspection share"""
    gain_sd: Annotated[float, Ge(0.0), Lt(2.0)] | None = None
    """standard deviation of an unknown gain, 1 in the mean, that all values of the
    block share: of a sensor and the way to it, of a balance's scale [the gain is 1]"""
    drift: str | float | dict[str, Any] | None = None
    """discrepancy = accumulating: how far the wear itself strays from the model's
    within a million cycles, growing with the root of the cycles (Wiener); a
    distribution where it is unknown"""

    def read(self, unit: str, where: str, *, by_column: bool = False) -> "ErrorModel":
        """Return the errors in SI of a quantity.

        Parameters
        ----------
        unit : of the quantity
        where : place of the errors in the file
        by_column : whether a column has the standard errors of the values

        Raises
        ------
        CampaignError : there are none, or they do not go together
        """
        sd = _positive(self.sd, unit, f"{where}.sd")
        drift = _positive(self.drift, unit, f"{where}.drift")
        offset = _positive(self.offset_sd, unit, f"{where}.offset_sd")
        relative = self.relative or 0.0
        gain = self.gain_sd or 0.0
        if sd is None and not relative and not by_column:
            raise CampaignError(
                f"{where}: required: sd (a value with its unit, or a distribution), "
                "relative, or columns.sd"
            )
        if gain and (offset or drift is not None):
            raise CampaignError(
                f"{where}.gain_sd: goes with independent errors: leave out offset_sd "
                "and drift, or the gain"
            )
        return ErrorModel(sd, relative, offset or 0.0, drift, gain)


def _positive(written: Any, unit: str, where: str) -> Any:
    """Return a positive number [SI], or its distribution; None stays None."""
    if written is None:
        return None
    if not isinstance(written, dict):
        return _number(written, unit, where)
    if not distributions.is_distribution(written):
        raise CampaignError(
            f"{where}: {shown(written)} is neither a value nor a distribution"
        )
    distribution = distributions.read_distribution(written, where)
    if distribution.below(0.0) > 0.0:
        raise CampaignError(
            f"{where}: is negative at times; truncate it, or take a log-normal"
        )
    if distribution.unit is None and unit not in ("1", ""):
        raise CampaignError(f"{where}: its values need the quantity's unit")
    distributions.in_unit(1.0, distribution.unit or unit, unit, where)
    return distribution


def _number(written: Any, unit: str, where: str) -> float:
    """Return a positive number in a unit."""
    value, written_unit = distributions.number_of(written, where)
    if written_unit is None and unit not in ("1", ""):
        raise CampaignError(
            f"{where}: {shown(written)} is no quantity: write a number with its unit"
        )
    value = distributions.in_unit(value, written_unit or unit, unit, where)
    if not value > 0.0:
        raise CampaignError(f"{where}: {shown(written)} must be greater than 0")
    return value


class TableFile(ClosedTable):
    """A file with a table, and how it is read where it does not tell."""

    file: Path
    """table: text, in which comments begin with #, or a workbook"""
    sheet: str | None = None
    """sheet of a workbook [the only one that holds a table]"""
    decimal: Literal[".", ","] | None = None
    """decimal sign of the file [found out; refused where it has two meanings]"""

    def __repr_args__(self) -> Any:
        """Return what the identity of an update is made of: what is said."""
        return [
            (name, value)
            for name, value in super().__repr_args__()
            if value is not None or name not in UNSTATED
        ]


class OilFill(ClosedTable):
    """Oil that holds what is worn: values are iron in it, ppm (mg/kg)."""

    volume: Annotated[Volume, POSITIVE]
    """oil in the gearbox"""
    density: Annotated[Density, POSITIVE] = 870.0
    """of the oil"""

    @property
    def per_share(self) -> float:
        """The mass of iron per share of the oil's mass [kg]."""
        return self.volume * self.density


class DataBlock(TableFile):
    """Measurements of one quantity."""

    quantity: str
    """worn_mass, max_wear_depth, wear_depth, tooth_thickness, or a stored variable
    along update"""
    member: str | None = None
    """gear that was weighed, "all" for the mass of all together [required where there
    are several]"""
    flank: str | None = None
    """flank that was measured [required where there are several]"""
    case: str | tuple[str, ...] | None = None
    """the case or cases these belong to [all cases are compared with them]"""
    columns: Columns = Columns()
    """names of the columns"""
    units: dict[str, str] = option({})
    """unit of each column that has one [plain numbers]"""
    error: ErrorBlock = ErrorBlock()
    """how far the values are off; required, or columns.sd"""
    select: dict[str, Any] = option({})
    """dimension = label, such as harmonic, order, mesh [none]"""
    date_format: str | None = DATE_FORMAT
    since: Annotated[float, Ge(0.0)] | str | None = None
    """values count from this cycle, or from the "previous" inspection [from cycle 0]"""

    oil: OilFill | None = None
    """values are iron in the oil: worn_mass since its last change [values are of the
    quantity itself]"""
    at: Annotated[float, Ge(0.0)] | str | date_ | None = None
    """of a flank that was measured once, its file described as in wear.initial: cycles,
    hours ("5000 h") or a date [columns say when]"""
    unit: str | None = None
    """of a fleet, with at: the unit whose flank was measured [required there]"""
    side: Literal["left", "right"] | None = None
    """of a measuring machine's file (.mka): which side of the teeth [required there]"""
    teeth: Literal["mean"] | Count | None = None
    """of a measuring machine's file: the number of one tooth [the mean of all]"""
    x: Literal["diameter", "roll_angle", "roll_length", "path_position"] | None = None
    """with at: column that says where on the flank [the one the file has]"""
    y: Literal["depth", "deviation"] | None = None
    """with at: column that says how much [the one the file has]"""
    zero: Literal["as-measured", "max", "pitch", "tip", "root", "line"] | None = None
    """with at: what counts as unworn [the values as they are]"""
    direction: Literal["normal", "tooth-thickness"] | None = None
    """with at: along the flank normal, or across the tooth [along the normal]"""
    continuation: Literal["refuse", "hold", "slope", "zero"] | None = None
    """with at: beyond what was measured, as of wear.initial [refused]"""

    @field_validator("quantity")
    @classmethod
    def _varies(cls, quantity: str) -> str:
        """Refuse a quantity that does not vary over the life."""
        stored = [name for name, var in VARIABLES.items() if "update" in var.dims]
        valid = [*stored, THICKNESS]
        if quantity not in valid:
            remedy = nearest.meant(
                quantity, valid, "; `wearlab variables` lists what is stored"
            )
            raise ValueError(f"{quantity!r} is no variable along update{remedy}")
        return quantity

    @field_validator("since")
    @classmethod
    def _begins(cls, since: float | str | None) -> float | str | None:
        """Refuse a word other than "previous"."""
        if isinstance(since, str) and since != PREVIOUS:
            raise ValueError(f"{not_a_choice(since, (PREVIOUS,))}, or a cycle")
        return since

    @model_validator(mode="after")
    def _one_flank(self) -> "DataBlock":
        """Refuse a measured flank that lacks something, with all that it lacks."""
        stated = [key for key in ("at", *DESCRIPTION) if getattr(self, key) is not None]
        is_curve = self.file.suffix.lower() == ".mka"
        if not stated and not is_curve and self.unit is not None:
            raise ValueError(
                "unit belongs to a flank that was measured once (at): of a table, "
                "columns.unit names the column that says which unit a row is of"
            )
        remedies = self._lacks_of_a_flank() if stated or is_curve else []
        if remedies:
            about = f"{stated[0]} belongs to" if stated else "the file is"
            raise ValueError(
                f"{about} a flank that was measured once: {'; '.join(remedies)}"
            )
        return self

    def _lacks_of_a_flank(self) -> list[str]:
        """Return what a flank that was measured once needs besides."""
        remedies = []
        if self.at is None:
            remedies.append("say when, such as at = '5000 h'")
        if self.quantity != "wear_depth":
            remedies.append("give quantity = 'wear_depth'")
        if self.flank is None:
            remedies.append("give flank = 'pinion' or another")
        if self.columns != Columns():
            instead = "" if self.at is None else ", or at"
            remedies.append(f"leave out columns{instead}")
        return remedies

    @model_validator(mode="after")
    def _one_gear(self) -> "DataBlock":
        """Refuse a member beside a flank."""
        if self.member is not None and self.flank is not None:
            raise ValueError("give a member or a flank, not both")
        return self

    def read(self, number: int) -> "Data":
        """Return the block with its errors in SI.

        Parameters
        ----------
        number : place of the block in the file, from 1

        Raises
        ------
        CampaignError : these are wrong, or columns say a place where there is none
        """
        where = f"{SECTION}.data[{number - 1}]"
        if self.oil is None and any(getattr(self.columns, name) for name in OIL_AGES):
            raise CampaignError(
                f"{where}.oil: required with columns of the oil's age: oil = "
                '{ volume = "60 l" }'
            )
        error = self.error.read(
            "1" if self.oil else unit_of(self.quantity),
            f"{where}.error",
            by_column=self.columns.sd is not None,
        )
        if self.oil is not None:
            error = self._of_mass(error, where)

        names_place = any(getattr(self.columns, name) is not None for name in WHERE)
        has_place = self.quantity in ("wear_depth", THICKNESS)
        if names_place != has_place and self.at is None:
            problem = "has no place for" if names_place else "needs one of"
            raise CampaignError(
                f"{where}.quantity: {self.quantity} {problem} the columns "
                f"{', '.join(WHERE)}"
            )
        return Data.model_construct(**{**dict(self), "number": number, "error": error})

    def _of_mass(self, error: "ErrorModel", where: str) -> "ErrorModel":
        """Return errors in ppm of iron as those of the mass in the oil.

        Raises
        ------
        CampaignError : the block is none of worn mass in oil
        """
        assert self.oil is not None
        if self.quantity != "worn_mass":
            raise CampaignError(
                f"{where}.quantity: {self.quantity}: iron in the oil is worn_mass"
            )
        if self.error.drift is not None or not isinstance(error.sd, float | None):
            raise CampaignError(
                f"{where}.error: of iron in the oil, give relative, a sd in ppm, and "
                "gain_sd"
            )
        if self.since is not None and any(
            getattr(self.columns, name) for name in OIL_AGES
        ):
            raise CampaignError(
                f"{where}.since: the column of the oil's age says since when values "
                "count: leave one of them out"
            )
        sd = None if error.sd is None else float(error.sd) * self.oil.per_share
        offset_sd = error.offset_sd * self.oil.per_share
        return error._replace(sd=sd, offset_sd=offset_sd)


class LimitBlock(ClosedTable):
    """The wear that ends the life."""

    depth: Annotated[Depth, POSITIVE] | None = None
    """largest wear depth [worn_mass, or wear.until.depth]"""
    worn_mass: Annotated[Mass, POSITIVE] | None = None
    """worn mass [depth]"""
    flank: str | None = None
    """flank whose depth counts [whichever is deepest]"""
    member: str | None = None
    """member whose mass counts [required with worn_mass]"""

    @model_validator(mode="after")
    def _one_limit(self) -> "LimitBlock":
        """Refuse two limits, none, or one with the wrong place."""
        if (self.depth is None) == (self.worn_mass is None):
            raise ValueError("give either depth or worn_mass")
        if self.depth is not None and self.member is not None:
            raise ValueError("member belongs to worn_mass; a depth has a flank")
        if self.worn_mass is not None and self.flank is not None:
            raise ValueError("flank belongs to a depth; a worn mass has a member")
        return self

    def read(self) -> "Limit":
        """Return the limit in SI."""
        if self.worn_mass is not None:
            return Limit("worn_mass", self.worn_mass, self.member)
        return Limit("max_wear_depth", self.depth or 0.0, self.flank)


class Days(ClosedTable):
    """Which day it was after how many operating hours, and how the hours go on."""

    date: date_
    """a day, such as 2026-03-01"""
    hours: Annotated[float, Ge(0.0)] | None = None
    """operating hours on that day [those of the last inspection]"""
    hours_per_year: Annotated[float, POSITIVE, Le(HOURS_A_YEAR)]
    """operating hours in a year from then on; 8766 without a stop"""


class CheckBlock(ClosedTable):
    """What is true of the synthetic twins of ``--check``.

    It is given where that is not what the study believes.
    """

    error: ErrorBlock | None = None
    """true errors of every block of data [those that the data have in this file]"""
    power: Annotated[float, POSITIVE] = 1.0
    """true wear is the model's after cycles to this power, equal at the last
    inspection"""

    def read(self, data: Sequence[DataBlock]) -> "TrueModel":
        """Return what is true of twins with such blocks of data.

        Parameters
        ----------
        data : blocks of the file

        Raises
        ------
        CampaignError : errors are wrong
        """
        if self.error is None:
            return TrueModel(None, self.power)
        where = f"{SECTION}.check.error"
        errors = tuple(
            self.error.read(unit_of(block.quantity), where) for block in data
        )
        return TrueModel(errors, self.power)


class PopulationBlock(ClosedTable):
    """What the units of a fleet share."""

    spread: dict[str, Any] | None = None
    """standard deviation of ln k between units, as a distribution: it is unknown
    [log-normal, median 0.3, cov 1]"""
    straying: float | dict[str, Any] | None = None
    """how far the wear of a unit strays from its mean course until `reference`, over
    the wear until then (Wiener); a distribution where it is unknown, 0: not at all
    [log-normal, median 0.2, cov 1]"""
    power: float | dict[str, Any] | None = None
    """wear is the model's after cycles to this power, equal at `reference`; 1: as the
    model's [log-normal, median 1, cov 0.2]"""
    reference: Annotated[float, POSITIVE] | None = None
    """operating hours at which k, straying and power are said [median of the
    inspections]"""

    def read(self, units: "Sequence[UnitBlock]") -> "Fleet":
        """Return a fleet of such units, what they share as numbers and distributions.

        Parameters
        ----------
        units : blocks of the file

        Raises
        ------
        CampaignError : a number or a distribution is wrong, or two units have one name
        """
        names = [unit.name for unit in units]
        for number, name in enumerate(names):
            if name in names[:number]:
                raise CampaignError(
                    f"{SECTION}.unit[{number}].name: {name!r} is there already: give "
                    "each unit its own"
                )
        shared = {
            name: _shared(getattr(self, name), name) for name in POPULATION_DEFAULTS
        }
        units_by_key = tuple(
            unit.model_copy(update={"scene": axes.swept_keys(unit.scene)})
            for unit in units
        )
        values = {**dict(self), **shared, "units": units_by_key}
        return Fleet.model_construct(**values)


def _shared(
    written: float | dict[str, Any] | None, name: str
) -> float | distributions.Distribution:
    """Return a number, or a distribution of what is positive."""
    where = f"{SECTION}.population.{name}"
    law = POPULATION_DEFAULTS[name] if written is None else written
    if isinstance(law, dict):
        return _positive(law, "1", where)
    smallest = POPULATION_MIN[name]
    if not smallest <= law < POPULATION_LIMIT:
        raise CampaignError(f"{where}: {law:g} is not from {smallest:g} to 10")
    return law


class UnitBlock(ClosedTable):
    """One unit of a fleet."""

    name: str
    """as the column `unit` calls it"""
    scene: dict[str, Any] = option({})
    """dotted key = value: what is different of this unit [as the others]"""
    calendar: Days | None = None
    """date, hours and hours_per_year of this unit [columns, or update.calendar]"""


class RecordColumns(ClosedTable):
    """Which column of a load record says what."""

    hours: str | None = None
    """operating hours at which a condition begins [date]"""
    date: str | None = None
    """when a condition begins; speed 0 is a standstill [hours]"""
    duration: str | None = None
    """hours in a bin, whose order is not known [hours, date or cycles]"""
    cycles: str | None = None
    """revolutions of the input member in a bin, in place of its hours [hours, date or
    duration]"""
    torque: str | tuple[str, str] = "torque"
    """input torque, or two columns of its range, from and to, of which the middle
    counts"""
    speed: str | tuple[str, str] = "speed"
    """input speed, or two columns of its range"""
    unit: str | None = None
    """which unit of a fleet the row is of [all units ran alike]"""

    @model_validator(mode="after")
    def _one_time(self) -> "RecordColumns":
        """Refuse two columns of time, or none."""
        columns = (self.hours, self.date, self.duration, self.cycles)
        count = sum(column is not None for column in columns)
        if count != 1:
            raise ValueError(
                f"name one of hours, date, duration, cycles, not {count} of them"
            )
        return self


class RecordBlock(TableFile):
    """What really ran until now.

    From its end on the conditions of ``[operation]`` go on.
    """

    file: Path
    """table: a row holds until the next one, or is a bin"""
    columns: RecordColumns
    """names of the columns"""
    units: dict[str, str] = option({})
    """unit of each column that has one [those of its header]"""
    date_format: str | None = DATE_FORMAT
    hours_per_year: Annotated[float, POSITIVE, Le(8784.0)] | None = None
    """operating hours in a year of those rows, by dates, in which speed is not 0
    [without a row of a standstill, those of update.calendar; else every hour between
    the dates]"""

    @property
    def place(self) -> str:
        """How messages call it."""
        return f"{SECTION}.record"


class Replaced(ClosedTable):
    """Gears that were replaced by new ones.

    Their mates went on as worn as they were.
    """

    members: Annotated[tuple[str, ...], MinLen(1)]
    """gears that were new then"""
    unit: str | None = None
    """unit of a fleet in which they were replaced [there is one]"""
    cycle: Annotated[float, Ge(0.0)] | None = None
    """cycles of the reference gear at which it was [hours or date]"""
    hours: Annotated[float, Ge(0.0)] | None = None
    """operating hours at which it was [cycle or date]"""
    date: date_ | None = None
    """the day, by update.calendar with its hours, or by a table with hours and dates
    [cycle or hours]"""

    @model_validator(mode="after")
    def _one_time(self) -> "Replaced":
        """Refuse two times, or none."""
        times = (self.cycle, self.hours, self.date)
        if sum(time is not None for time in times) != 1:
            raise ValueError("give one of cycle, hours, date")
        return self


class Decision(ClosedTable):
    """What changes and inspections cost, in any currency."""

    planned: Annotated[float, POSITIVE]
    """cost of a planned change"""
    failure: Annotated[float, POSITIVE]
    """cost of reaching the limit in operation, its change included"""
    inspection: Annotated[float, POSITIVE] | None = None
    """cost of one more inspection [none is considered]"""
    horizon_hours: Annotated[float, POSITIVE] | None = None
    """operating hours from the last inspection on until which costs count, changes
    included [cost per hour of a cycle from new to change alone]"""

    @field_validator("failure")
    @classmethod
    def _dearer(cls, failure: float, info: ValidationInfo) -> float:
        """Refuse a failure that costs no more than a planned change."""
        planned = info.data.get("planned", 0.0)
        if failure <= planned:
            raise ValueError(
                f"{failure:g} is not more than the planned change, {planned:g}: then "
                "nothing is gained by changing before"
            )
        return failure


class UpdateBlock(ClosedTable):
    """What was measured, what is unknown, and which wear ends the life."""

    limit: LimitBlock | None = None
    """the wear that ends the life [wear.until]"""
    discrepancy: Literal["drifting-rate", "accumulating", "none"] = "drifting-rate"
    """what may be wrong with the model itself: the wear rate drifts, as a power of the
    cycles, by one change or by running-in; or noise accumulates (error.drift); or
    nothing. Of a fleet, the rate drifts by update.population"""
    draws: Annotated[int, Ge(1), Le(MAX_DRAWS)] = 4000
    """draws from the posterior, and runs for unknowns besides wear's factor"""
    seed: Annotated[int, Ge(0), Lt(2**63)] = 0
    """seed of all draws"""
    calendar: Days | None = None
    """so that the life ends on a day [cycles and hours only]"""
    today: date_ | None = None
    """the day from which what is overdue is judged, where there is a calendar [the day
    on which `wearlab update` runs]"""
    check: CheckBlock | None = None
    """what is true of the twins of --check [what the study believes]"""
    unknown: dict[str, Any]
    """dotted key = distribution: what is not known"""
    record: RecordBlock | None = None
    """what really ran until now: loads and speeds [the conditions of the scene all
    along]"""
    change: Literal[CHANGES] = "none"  # type: ignore[valid-type]
    """whether k itself may have changed: once between two inspections, or after
    running-in; the evidence decides"""
    replaced: tuple[Replaced, ...] = ()
    """gears that were replaced by new ones: their wear counts from then on, that of
    their mates goes on"""
    scenario: tuple[Scenario, ...] = ()
    """what if: other loads, speeds or oils from some day on, with the day on which each
    case or unit reaches the limit then"""
    decision: Decision | None = None
    """what changes cost: when to change, and whether to look first [no advice]"""
    population: PopulationBlock | None = None
    """what the units of a fleet share: spread, straying, power [there is one unit]"""
    unit: tuple[UnitBlock, ...] = ()
    """units of a fleet whose scene or calendar is their own"""
    data: tuple[DataBlock, ...] = ()
    """what was measured"""


class Limit(NamedTuple):
    """The wear that ends the life [SI].

    ``where`` is its flank or member, None where it is not said.
    """

    quantity: Literal["max_wear_depth", "worn_mass"]
    value: float
    where: str | None = None


class ErrorModel(NamedTuple):
    """Errors of one block [SI of the quantity].

    A distribution is in the unit that it says.
    """

    sd: float | distributions.Distribution | None = None
    relative: float = 0.0
    offset_sd: float = 0.0
    drift: float | distributions.Distribution | None = None
    gain_sd: float = 0.0


class Data(DataBlock):
    """One ``[[update.data]]`` block, read.

    Parameters
    ----------
    number : its place in the file, from 1
    error : how far the values are off
    """

    number: int
    error: ErrorModel  # type: ignore[assignment]

    @property
    def where(self) -> str | None:
        """The member or flank that was measured."""
        return self.flank if self.member is None else self.member

    @property
    def sheet_name(self) -> str:
        """Under what its values count as one sheet: what one machine measured does."""
        return self.place if self.at is None else f"{self.flank} measured"

    @property
    def cases(self) -> tuple[str, ...]:
        """The cases it belongs to, none: all."""
        return (self.case,) if isinstance(self.case, str) else self.case or ()

    @property
    def place(self) -> str:
        """How messages call it."""
        return f"{SECTION}.data[{self.number - 1}]"

    @property
    def label(self) -> str:
        """The quantity, where it was measured, and what of it was selected."""
        place = [self.where] if self.where else []
        selected = [
            f"{dim}_{value}".replace("_-", "_minus_")
            for dim, value in self.select.items()
        ]
        return "_".join([self.quantity, *place, *selected]).replace(" ", "_")

    @property
    def si(self) -> str:
        """The SI unit of the quantity."""
        return unit_of(self.quantity)


class TrueModel(NamedTuple):
    """What is true of synthetic twins.

    Parameters
    ----------
    errors : of each block of data, None: those of the file
    power : of the cycles
    """

    errors: tuple[ErrorModel, ...] | None
    power: float


class Fleet(PopulationBlock):
    """A fleet: what its units share, known or not, and the units of the file."""

    spread: distributions.Distribution  # type: ignore[assignment]
    straying: float | distributions.Distribution  # type: ignore[assignment]
    power: float | distributions.Distribution  # type: ignore[assignment]
    units: tuple[UnitBlock, ...]


class UpdateSpec(UpdateBlock):
    """A whole ``[update]``, read."""

    limit: Limit | None = None  # type: ignore[assignment]
    data: tuple[Data, ...] = ()
    check: TrueModel | None = None  # type: ignore[assignment]
    fleet: Fleet | None = None


def unit_of(quantity: str) -> str:
    """Return the SI unit of a quantity that may be measured, "1" for a plain number.

    Parameters
    ----------
    quantity : of a block of data
    """
    return "m" if quantity == THICKNESS else VARIABLES[quantity].units
