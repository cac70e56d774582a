"""What of a campaign is updated: runs, observations and unknowns of every case."""

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from wearlab.assembly import sets, wear_checks
from wearlab.campaign import Axis, Campaign, Case
from wearlab.campaign.distributions import Distribution, SampleTable, draw
from wearlab.campaign.update import FACTOR
from wearlab.campaign.update_options import (
    THICKNESS,
    Data,
    Days,
    Fleet,
    Limit,
    Replaced,
    UnitBlock,
    UpdateSpec,
)
from wearlab.gears.specification import GearError
from wearlab.scene import Scene
from wearlab.scene.problems import not_a_choice
from wearlab.store import Store
from wearlab.store.outcome import last_line, place
from wearlab.units import is_quantity, split
from wearlab.updating import measured_flanks, measurements, run_curves, unit_clock
from wearlab.updating.calendar import Calendar
from wearlab.updating.measurements import Observed, OperatingRecord, UpdateError
from wearlab.updating.today import with_today

DRAW = "draw"
DEPTHS = ("max_wear_depth", "wear_depth", THICKNESS)
ERRORS = {
    "life",
    "error_estimate_life",
    "error_estimate_wear_depth",
}  # told by the first run
ALWAYS = ("verdict", "end_reason", *ERRORS)


@dataclass(frozen=True)
class Subject:
    """One case with what was measured of it.

    Parameters
    ----------
    label : of the case, with its place in the sweeps
    scene : as the campaign has it
    spec : the campaign's [update]
    limit : what ends the life
    observations : those that belong to this case
    record : what really ran until now
    calendar : which day it was after how many operating hours
    drawn : values of the unknowns that cost runs, by key, as a campaign file would
        write them
    longer : times its own limits at which the runs end
    renewals : which gears were replaced when, in words
    ahead : runs of the scenarios, in the order of the file
    """

    label: str
    scene: Scene
    spec: UpdateSpec
    limit: Limit
    observations: tuple[Observed, ...]
    record: OperatingRecord | None = None
    calendar: Calendar | None = None
    drawn: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)
    longer: float = 1.0
    renewals: str = ""
    ahead: tuple[run_curves.RunHistory, ...] = ()

    @property
    def prior(self) -> Distribution | None:
        """What is known of the factor on the wear coefficient before.

        None: it is what the runs have.
        """
        return self.spec.unknown.get(FACTOR)

    @property
    def replaced(self) -> list[tuple[int, Replaced]]:
        """The replacements in this case or unit, each with its place in the file."""
        numbered = enumerate(self.spec.replaced)
        return [one for one in numbered if one[1].unit in (None, self.label)]

    @property
    def costly(self) -> dict[str, Distribution]:
        """The unknowns that cost runs."""
        return {key: prior for key, prior in self.spec.unknown.items() if key != FACTOR}

    @property
    def first(self) -> Scene:
        """The scene of its first run."""
        return next(self._each())

    @cached_property
    def scenes(self) -> tuple[Scene, ...]:
        """The scenes of its runs: one, or one a draw."""
        return tuple(self._each())

    def _each(self) -> Iterator[Scene]:
        base = _lengthened(self.scene, self.longer)
        if not self.drawn:
            yield base
            return
        lean = base.replace(
            "store.variables", sorted(required_variables(self.observations, self.limit))
        )  # draws are many
        assert (
            lean.id
        )  # what its sections say is then known to all that differ from it in one
        for point in zip(*self.drawn.values(), strict=True):
            yield lean.replace(dict(zip(self.drawn, point, strict=True)))

    @property
    def conditions(self) -> dict[str, Scene]:
        """A scene of each condition of what really ran, under what it is called."""
        return (
            {}
            if self.record is None
            else self.record.scenes(_lengthened(self.scene, self.longer))
        )

    def campaign(self, title: str, scenes: Sequence[Scene]) -> Campaign:
        """Return scenes as a campaign with the axis ``draw``."""
        cases = tuple(Case("base", scene, {DRAW: i}) for i, scene in enumerate(scenes))
        return Campaign(
            f"{title}: {self.label}",
            None,
            {},
            cases,
            (Axis(DRAW, tuple(range(len(cases)))),),
        )


Subjects = Sequence[Subject]
Measurements = tuple[tuple[Observed, ...], OperatingRecord | None, Calendar | None]


def studies(campaign: Campaign, today: date | None = None) -> tuple[Subject, ...]:
    """Return what a campaign's [update] asks for, case by case.

    Parameters
    ----------
    campaign : with an [update]
    today : the day from which what is overdue is judged [update.today, else that of
        this machine]

    Raises
    ------
    UpdateError : it has none, a file cannot be read, or a case cannot be updated
    """
    spec = campaign.update
    if spec is None:
        raise UpdateError(
            "update: the campaign has no [update] section: nothing was measured"
        )
    if spec.fleet is not None:
        units = _units(campaign.cases[0].scene, spec, spec.fleet)
        return with_today(units, today or spec.today)
    (observations, record, calendar) = _measured(
        spec, None, spec.calendar, campaign.cases
    )
    subjects = []
    for case in campaign.cases:
        case_observations = tuple(
            measured_flanks.of_scene(observed, case.scene)
            for observed in observations
            if not observed.data.cases or case.label in observed.data.cases
        )
        label = ", ".join(
            [case.label, *(f"{k}={v}" for k, v in place(campaign, case).items())]
        )
        limit = _limit(
            case.scene, spec, "" if len(campaign.cases) == 1 else f"case {label!r}: "
        )
        refuse_too_deep(case.scene, case_observations, limit)
        refuse_reversed(case.scene, case_observations, limit, record)
        study = Subject(
            label, case.scene, spec, limit, case_observations, record, calendar
        )
        if study.costly:
            if record is not None:
                key = next(iter(study.costly))
                raise UpdateError(
                    f"update.record: goes with the unknown {FACTOR} alone, not {key}"
                )
            table = SampleTable(method="sobol", n=spec.draws, seed=spec.seed)
            study = replace(study, drawn=draw(table, study.costly, "update.unknown"))
        subjects.append(study)
    return with_today(subjects, today or spec.today)


def refuse_too_deep(
    scene: Scene, observations: Sequence[Observed], limit: Limit
) -> None:
    """Refuse wear, measured or a limit, that is deeper than the teeth are thick.

    Its unit is another.

    Raises
    ------
    UpdateError : with file, line and value, or the limit's path
    """
    try:
        gears = sets.build_set(scene.in_heaviest_condition)
    except GearError:
        return  # the run says so
    deep = [
        (
            "update.limit.depth: {} mm",
            limit.value,
            limit.where,
            "look at its unit, or give less",
        )
    ]
    for block in (
        observed
        for observed in observations
        if observed.data.quantity in DEPTHS and len(observed)
    ):
        i = int(np.argmax(np.nan_to_num(block.value)))
        data = block.data
        text = f"{data.file}: line {block.row[i]}: {data.quantity} of {{}} mm"
        deep.append(
            (text, block.value[i], data.where, f"look at its unit, {data.place}.units")
        )
    for text, value, where, remedy in deep[limit.quantity != "max_wear_depth" :]:
        if value >= (thickest := wear_checks.thickest(gears, where)):
            thick = f"is deeper than a tooth is thick, {1e3 * thickest:.4g} mm"
            raise UpdateError(f"{text.format(f'{1e3 * value:.4g}')} {thick}: {remedy}")


def refuse_reversed(
    scene: Scene,
    observations: Sequence[Observed],
    limit: Limit,
    record: OperatingRecord | None,
) -> None:
    """Refuse what an update cannot tell where a record has rows of negative torque.

    They wear back flanks, which the runs of its conditions do not have.

    Parameters
    ----------
    scene : of the case
    observations : what was measured
    limit : what ends the life
    record : what ran

    Raises
    ------
    UpdateError : back flanks are worn more than front ones, are those of planets, or
        matter to what is measured
    """
    if record is None or record.reversed_work == 0.0:
        return
    rows = "update.record: rows of negative torque wear back flanks"
    if not scene.gears.descriptor.is_pair:
        raise UpdateError(
            f"{rows}, and in a planetary set either flank of a planet is the back of "
            "the other: leave such rows out"
        )
    if record.reversed_work >= 1.0:
        raise UpdateError(
            f"{rows} more than the others wear front flanks, which alone are told: "
            "give all torques the other sign, and operation.drive_flank the other side"
        )
    measured = {
        observed.data.place: observed.data.quantity
        for observed in observations
        if len(observed)
    }
    measured["update.limit"] = limit.quantity
    for place_of_quantity, quantity in measured.items():
        if quantity not in ("max_wear_depth", "wear_depth"):
            raise UpdateError(
                f"{rows}, which {place_of_quantity}, {quantity}, would have to count: "
                "give depths of the front flanks, or leave such rows out"
            )


def _units(scene: Scene, spec: UpdateSpec, fleet: Fleet) -> tuple[Subject, ...]:
    """Return what is asked of a fleet, unit by unit.

    Units are those that the files name, and those named besides.
    """
    if FACTOR not in spec.unknown:
        raise UpdateError(
            f"update.unknown.{FACTOR}: required of a fleet: what is known of its "
            "median before"
        )
    named = {unit.name: unit for unit in fleet.units}
    names = dict.fromkeys(
        [*(name for data in spec.data for name in measurements.units_of(data)), *named]
    )
    _refuse_unknown_units(spec, list(names))
    subjects = []
    for name in names:
        unit = named.get(name, UnitBlock(name=name))
        changed = scene.replace(dict(unit.scene)) if unit.scene else scene
        limit = _limit(changed, spec, f"unit {name!r}: ")
        days = unit.calendar or spec.calendar
        alone = (Case(name, changed, {}),)
        measured = _measured(spec, name, days, alone, common=unit.calendar is None)
        refuse_too_deep(changed, measured[0], limit)
        refuse_reversed(changed, measured[0], limit, measured[1])
        subjects.append(Subject(name, changed, spec, limit, *measured))
    return tuple(subjects)


def _refuse_unknown_units(spec: UpdateSpec, names: Sequence[str]) -> None:
    """Refuse replacements in units that are not there."""
    for number, event in enumerate(spec.replaced):
        if event.unit not in names:
            place = f"update.replaced[{number}].unit"
            raise UpdateError(f"{place}: {not_a_choice(str(event.unit), names)}")


def _measured(
    spec: UpdateSpec,
    unit: str | None,
    days: Days | None,
    of_cases: Sequence[Case],
    *,
    common: bool = False,
) -> Measurements:
    """Return the observations, the record and the calendar of a case or a unit.

    ``common`` says whether the calendar is that of a whole fleet.
    """
    clock = unit_clock.clock_of(spec, unit, days, common=common)
    observations = tuple(
        _observed(data, unit, clock.of_dates, of_cases) for data in spec.data
    )
    return observations, clock.record, clock.calendar


def _observed(
    data: Data, unit: str | None, calendar: Calendar | None, of_cases: Sequence[Case]
) -> Observed:
    """Return the observations of a block, of a fleet those of one unit."""
    if data.at is None:
        return measurements.read_observations(data, calendar, unit)
    if data.unit != unit:
        return measured_flanks.nothing_of(data)
    return measured_flanks.read_flank(data, _scene_measured(data, of_cases), calendar)


def _scene_measured(data: Data, of_cases: Sequence[Case]) -> Scene:
    """Return the scene of the first case that a block belongs to."""
    scenes = [case.scene for case in of_cases if case.label in data.cases]
    return scenes[0] if scenes else of_cases[0].scene


def _limit(scene: Scene, spec: UpdateSpec, about: str) -> Limit:
    """Return what ends the life of a scene.

    Refuse one from which no coefficient can be inferred.
    """
    if scene.wear is None or (until := scene.wear.until) is None:
        raise UpdateError(
            f"{about}wear.until: required: a run that wears is what k is inferred from"
        )
    try:
        run_curves.refuse_stages(scene)
    except UpdateError as error:
        raise UpdateError(f"{about}{error}") from None
    if FACTOR in spec.unknown and isinstance(scene.wear.coefficient, dict):
        message = (
            "the members have coefficients of their own: name one, such as "
            '"wear.coefficient.sun.factor"; '
        )
        message += "it costs runs, as the other flanks go on as they are"
        raise UpdateError(f"{about}update.unknown.{FACTOR}: {message}")
    if spec.limit is None and until.depth is None:
        message = (
            'required: wear.until has no depth; such as limit = { depth = "200 um" }'
        )
        raise UpdateError(f"{about}update.limit: {message}")
    return spec.limit or Limit("max_wear_depth", float(until.depth or 0.0), until.flank)


def _lengthened(scene: Scene, times: float) -> Scene:
    """Return a scene whose limits are farther off.

    Snapshots go on as they do, and some in between.
    """
    if times == 1.0 or scene.wear is None or scene.wear.until is None:
        return scene
    until = scene.wear.until
    snapshots = scene.wear.snapshots
    ends = until.model_dump(
        include={"cycles", "mesh_cycles", "hours"}, exclude_none=True
    )
    longer: dict[str, Any] = {
        f"wear.until.{key}": end * times for key, end in ends.items()
    }
    if until.depth is not None:
        longer["wear.until.depth"] = f"{until.depth * times!r} m"
    if snapshots is not None and snapshots.depth is not None:
        last = snapshots.depth[-1]
        depths = [
            *snapshots.depth,
            *np.arange(last, last * times, 0.1 * last)[1:].tolist(),
        ]
        longer["wear.snapshots.depth"] = [f"{depth!r} m" for depth in depths]
    return scene.replace(longer)


def required_variables(observations: Sequence[Observed], limit: Limit) -> set[str]:
    """Return the variables that an update reads."""
    quantities = {
        limit.quantity,
        *(inspections.data.quantity for inspections in observations),
    }
    rates = (
        {"wear_depth", "wear_rate"} if quantities & {*DEPTHS} else set()
    )  # a depth goes with its rate
    return (
        (quantities - {THICKNESS})
        | {"max_wear_depth", "effective_wear_coefficient", *ALWAYS}
        | rates
    )


def history_variables(study: Subject) -> set[str]:
    """Return the variables that the histories of a study are made of."""
    names = required_variables(study.observations, study.limit) | {
        "cycle",
        "operating_hours",
    }
    names |= {
        name
        for block in study.observations
        for name in (block.place_kind, block.clock)
        if name
    }
    if any(block.place_kind for block in study.observations):
        names.add(run_curves.FACE_POSITION)
    names |= {
        "roll_angle" for block in study.observations if block.data.quantity == THICKNESS
    }
    names |= (
        {"wear_depth", "wear_rate", "path_position", "worn_mass"}
        if study.spec.replaced
        else set()
    )
    return names - {"verdict", "end_reason"}  # those are for people


RunsRead = dict[Hashable, dict[str, xr.Dataset]]
"""Stored runs that were read, by their ids and variables."""


def histories(
    study: Subject, store: Store, runs_read: RunsRead | None = None
) -> run_curves.Runs:
    """Return what the stored runs of a study say.

    Parameters
    ----------
    study : the case
    store : where the runs are kept
    runs_read : those that were read before, to which these are added: units of a fleet
        share a run [none]

    Raises
    ------
    UpdateError : none of them is there
    """
    names = history_variables(study)
    ids = [scene.id for scene in study.scenes]
    runs_read = {} if runs_read is None else runs_read
    key = (*ids, frozenset(names))
    if key not in runs_read:
        runs_read[key] = run_curves.read_runs(
            store, dict.fromkeys(ids), names - ERRORS, ERRORS
        )
    runs = runs_read[key]
    if len(ids) == 1 and not runs:
        entry = store.archive.heads(ids).get(ids[0])
        reason = (
            "is not there"
            if entry is None
            else f"{entry.state} {last_line(store.archive.find(ids[0]).reason)}"
        )
        raise UpdateError(f"{study.label}: its run {reason}".strip())
    found_histories = []
    for i, (run_id, scene) in enumerate(zip(ids, study.scenes, strict=True)):
        try:
            if run_id in runs:
                history = run_curves.history_of(
                    runs[run_id], scene, study.observations, study.limit
                )
                found_histories.append(replace(history, draw=i))
        except UpdateError:
            if i == 0:
                raise
    if not found_histories:
        raise UpdateError(f"{study.label}: none of its {len(ids)} runs has data")
    return found_histories


def condition_histories(
    study: Subject, scenes: Mapping[str, Scene], store: Store
) -> run_curves.Runs:
    """Return what the stored runs of conditions say, in order.

    Parameters
    ----------
    study : the case
    scenes : under what each is called
    store : where the runs are kept
    """
    runs = stored_runs(study, scenes, store)
    return [
        run_curves.history_of(run, scene, study.observations, study.limit)
        for run, scene in zip(runs, scenes.values(), strict=True)
    ]


def stored_runs(
    study: Subject, scenes: Mapping[str, Scene], store: Store
) -> list[xr.Dataset]:
    """Return the stored runs of named scenes, in order.

    Parameters
    ----------
    study : the case
    scenes : under what each is called
    store : where the runs are kept

    Raises
    ------
    UpdateError : one of them has no data
    """
    ids = dict.fromkeys(scene.id for scene in scenes.values())
    runs = run_curves.read_runs(store, ids, history_variables(study))
    for name, scene in scenes.items():
        if scene.id not in runs:
            reason = last_line(store.archive.find(scene.id).reason)
            raise UpdateError(f"{study.label}: {name}: {reason}")
    return [runs[scene.id] for scene in scenes.values()]


def plain_number(value: float | str) -> float:
    """Return the number of a value as a campaign file writes it, in its own unit.

    Parameters
    ----------
    value : a number, or a quantity with its unit
    """
    return float(split(value)[0]) if is_quantity(value) else float(value)
