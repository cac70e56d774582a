"""Units whose gears were replaced, parted: gears of one age are one part.

The wear of a part counts from the cycle at which it was new, h(f (N − N₁)), by a run
that begins with the wear of its mates at N₁. In a fleet every part has a wear
coefficient of its own, drawn from the population as that of a unit is: a new part
starts from what all the others tell, and the one that came out goes on to tell of them.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import NamedTuple

import numpy as np
import xarray as xr

from wearlab.arrays import Array, Index
from wearlab.campaign.update_options import ALL_MEMBERS
from wearlab.scene import Scene
from wearlab.updating import answers, data_blocks, replacements, run_curves
from wearlab.updating.cases import Subject, Subjects
from wearlab.updating.measurements import Observed, UpdateError
from wearlab.updating.run_curves import Clock, RunHistory, Runs
from wearlab.updating.study_runs import Runner

ROUND_OFF = 1e-9  # of a cycle that is told by hours
UNTIL = 1e-9  # of a cycle, by which a value may be after the replacement of its gear


class Service(NamedTuple):
    """Gears of one age, from when they were new until they were replaced.

    Parameters
    ----------
    gears : their names
    begin, end : cycles of the unit; the end is ∞ of those in service
    of_all_until : cycle until which what is measured of all gears together is told by
        this part; 0 of one that tells none of it
    """

    gears: tuple[str, ...]
    begin: float
    end: float
    of_all_until: float = 0.0


@dataclass(frozen=True)
class ServicePart:
    """Gears of one age of a unit, or a whole unit in which nothing was replaced.

    Parameters
    ----------
    study : the unit, with the measurements of this part
    run : its wear over the cycles of the unit
    """

    study: Subject
    run: RunHistory


@dataclass(frozen=True)
class FleetParts:
    """Parts of a fleet.

    Parameters
    ----------
    in_service : of each unit the one whose wear ends its life
    others : those that were measured besides
    """

    in_service: Sequence[ServicePart]
    others: Sequence[ServicePart]

    def with_studies(self, studies: Subjects) -> "FleetParts":
        """Return them with other studies of those in service.

        Parameters
        ----------
        studies : one of each
        """
        pairs = zip(self.in_service, studies, strict=True)
        in_service = [replace(part, study=study) for part, study in pairs]
        return replace(self, in_service=in_service)

    @property
    def renewals(self) -> str:
        """Which gears of which units were replaced when, in words."""
        texts = [
            f"{part.study.label}: {part.study.renewals}"
            for part in self.in_service
            if part.study.renewals
        ]
        return "; ".join(texts)


def parts_of_fleet(studies: Subjects, runs: Runs, runner: Runner) -> FleetParts:
    """Return the parts of all units.

    Parameters
    ----------
    studies, runs : what was asked, and the run, of every unit
    runner : of the runs of new parts
    """
    in_service = []
    others = []
    for study, run in zip(studies, runs, strict=True):
        if not study.replaced:
            in_service.append(ServicePart(study, run))
            continue
        main, *besides = parts_of_unit(study, run, runner)
        in_service.append(main)
        others += [part for part in besides if _is_measured(part.study)]
    return FleetParts(in_service, others)


def needs_parts(study: Subject) -> bool:
    """Whether a case is parted by its gears, and not run on from one to the next.

    Parameters
    ----------
    study : with gears that were replaced
    """
    places = [observed.data.where for observed in study.observations]
    return study.record is not None or ALL_MEMBERS in places


def with_parts(
    study: Subject, run: RunHistory, runner: Runner
) -> tuple[Subject, RunHistory]:
    """Return a case parted by its gears, and one history of all.

    The parts share one wear coefficient.

    Parameters
    ----------
    study : with gears that were replaced
    run : of its first gears
    runner : of the runs of new parts
    """
    parts = parts_of_unit(study, run, runner)
    observations = []
    points = []
    for part in parts:
        pairs = zip(part.study.observations, part.run.points, strict=True)
        for observed, asked in pairs:
            if len(observed) or part is parts[0]:
                clock = asked.clock or part.run.clock
                observations.append(observed)
                points.append(asked._replace(clock=clock, begin=part.run.new_cycle))
    parted = replace(parts[0].study, observations=tuple(observations))
    return parted, replace(parts[0].run, points=tuple(points))


def parts_of_unit(study: Subject, run: RunHistory, runner: Runner) -> list[ServicePart]:
    """Return the parts of a unit, first the one whose wear ends its life.

    Parameters
    ----------
    study : with gears that were replaced
    run : of its first gears
    runner : of the runs of new parts

    Raises
    ------
    UpdateError : a gear is not there, or a measurement or limit does not say of which
        gear it is
    """
    first = runner.stored(study, study.first)
    flanks = first["flank"].astype(str).values.tolist()
    gears = list(dict.fromkeys(map(run_curves.gear, flanks)))
    limit_gear = replacements.gear_of(study.limit.where, gears, "update.limit")
    events = replacements.replacements_of(study, first, gears)
    factor = _factor_until(study, run, events[0].cycle)

    parts: list[tuple[Service, ServicePart]] = []
    worn_runs: dict[str, tuple[RunHistory, xr.Dataset]] = {}
    for begin, services in groupby(
        _services(gears, events, run.start), lambda service: service.begin
    ):
        of_this_age = list(services)
        new = {gear for service in of_this_age for gear in service.gears}
        scene = study.scene
        if begin > run.start:
            scene = _with_worn_mates(scene, flanks, new, worn_runs, begin, factor)
        for service in of_this_age:
            part = _part_of(replace(study, scene=scene), run, service, runner, first)
            parts.append((service, part))
        stored = runner.stored(part.study, part.study.first)
        worn_runs |= {gear: (part.run, stored) for gear in new}

    described = "; ".join(
        f"{' and '.join(event.members)} new at {event.cycle:.6g} cycles"
        for event in events
    )

    def comes_later(pair: tuple[Service, ServicePart]) -> bool:
        service, _ = pair
        return not (limit_gear in service.gears and np.isinf(service.end))

    ordered = [part for _, part in sorted(parts, key=comes_later)]
    return [
        replace(part, study=replace(part.study, renewals=described)) for part in ordered
    ]


def _services(
    gears: Sequence[str],
    events: Sequence[replacements.Replacement],
    start: float,
) -> list[Service]:
    """Return gears of one age, the oldest first."""
    gears_by_span: dict[tuple[float, float], list[str]] = {}
    for gear in gears:
        new_at = [event.cycle for event in events if gear in event.members]
        begins = [start, *new_at]
        for begin, end in zip(begins, [*new_at, np.inf], strict=True):
            gears_by_span.setdefault((begin, end), []).append(gear)
    ages = sorted({begin for begin, _ in gears_by_span})
    untold = dict(zip(ages, [*ages[1:], np.inf], strict=True))
    return [
        # of each age the first part tells of all gears together
        Service(tuple(of_one_age), begin, end, untold.pop(begin, 0.0))
        for (begin, end), of_one_age in sorted(gears_by_span.items())
    ]


def _factor_until(study: Subject, run: RunHistory, cycle: float) -> float:
    """Return the median factor by what was measured of a unit until a cycle."""
    blocks = data_blocks.select_by_cycle(
        answers.blocks_of(study, (run,)), run, np.less_equal, cycle
    )
    median = answers.answer_of(study, (run,), blocks).factor(np.array([0.5]))[0]
    return float(f"{median:.{replacements.DIGITS}g}")


def _with_worn_mates(
    scene: Scene,
    flanks: Sequence[str],
    new: set[str],
    worn_runs: Mapping[str, tuple[RunHistory, xr.Dataset]],
    cycle: float,
    factor: float,
) -> Scene:
    """Return a scene whose gears are new, and their mates as worn as they were."""
    worn = {}
    for flank in flanks:
        gear = run_curves.gear(flank)
        if gear in new:
            continue
        run, stored = worn_runs[gear]
        run_cycle = run.equivalent_cycle(np.array(cycle), np.array(factor))
        wear = replacements.worn_profile(stored, flank, float(run_cycle))
        if wear:
            worn[f"wear.initial.{flank}"] = wear
    return scene.replace(worn) if worn else scene


def _part_of(
    study: Subject,
    first_run: RunHistory,
    service: Service,
    runner: Runner,
    first: xr.Dataset,
) -> ServicePart:
    """Return a part: its measurements, and its run over the cycles of the unit."""
    by = service.begin - first_run.start
    record = study.record
    if record is not None and by > 0.0:
        record = record.since(by * first_run.seconds_per_cycle)
    of_part = tuple(_observations_of_part(study, first, service))
    alone = replace(study, record=record, observations=of_part)
    ((run, *_),) = runner.run([alone])
    return ServicePart(replace(study, observations=of_part), _later(run, by))


def _observations_of_part(
    study: Subject, first: xr.Dataset, service: Service
) -> Iterator[Observed]:
    """Yield every block with its values of a part, at cycles since that was new."""
    gears = list(dict.fromkeys(map(run_curves.gear, map(str, first["flank"].values))))
    start = float(first["cycle"].values[0])
    for observed in study.observations:
        data = observed.data
        gear = replacements.gear_of(data.where, gears, data.place)
        end = service.end if gear in service.gears else 0.0
        if gear == ALL_MEMBERS:
            _refuse_totals_of_all(observed)
            end = service.of_all_until
        cycle = run_curves.cycles_of(first, observed)
        after_begin = (cycle > service.begin) | (service.begin <= start)
        rows = np.flatnonzero(after_begin & (cycle <= end + UNTIL) & (end > 0.0))
        part = replacements.with_rows(observed, rows)
        by = service.begin - start
        since = run_curves.since_of(first, observed)
        if since is not None:
            if gear == ALL_MEMBERS:
                _refuse_wear_of_old_gears(observed, rows, since, service.begin)
            since = np.maximum(since[rows] - by, start)
        yield replace(part, clock="cycle", time=cycle[rows] - by, since=since)


def _refuse_wear_of_old_gears(
    observed: Observed, rows: Index, since: Array, begin: float
) -> None:
    """Refuse what all gears lost since before one was new: the old one's wear counts.

    Parameters
    ----------
    observed : the block
    rows : its values that a part is told by
    since : (n,) cycle from which each value counts [1]
    begin : cycle at which the part was new [1]
    """
    of_both = rows[since[rows] < begin * (1.0 - ROUND_OFF) - UNTIL]
    if of_both.size:
        line = observed.row[of_both[0]]
        raise UpdateError(
            f'{observed.data.file}: line {line}: "all" counts from before a gear was '
            "replaced, so that it holds what the old one lost, too: give the oil's "
            "change with the gear (columns.oil_hours, columns.oil_changed), add a "
            "value at that time, or leave the line out"
        )


def _refuse_totals_of_all(observed: Observed) -> None:
    """Refuse what all gears together have lost since the first cycle, new ones too."""
    if observed.since is None and observed.data.since is None:
        raise UpdateError(
            f'{observed.data.place}.member: "all" since the first cycle is not known '
            "where a gear was replaced: say since when values count by "
            'columns.oil_hours, columns.oil_changed or since = "previous", or name a '
            "gear"
        )


def _later(run: RunHistory, by: float) -> RunHistory:
    """Return the run of a part that was new so many cycles after its unit."""
    if by <= 0.0:
        return run
    begin = run.start + by
    points = []
    for asked in run.points:
        clock = None if asked.clock is None else _later_clock(asked.clock, by)
        since = None if asked.since is None else asked.since + by
        cycle = asked.cycle + by
        points.append(
            asked._replace(cycle=cycle, clock=clock, begin=begin, since=since)
        )
    if run.clock is None:
        clock = replacements.clock_from(begin, run.start, run.end)
    else:
        clock = _later_clock(run.clock, by)
    return replace(run, points=tuple(points), clock=clock, new_at=begin)


def _later_clock(clock: Clock, by: float) -> Clock:
    """Return a clock that begins so many cycles later, and stands until then."""
    before = clock.cycle[0] + min(by - 1.0, 0.0)
    return Clock(
        np.append(before, clock.cycle + by),
        np.append(clock.equal[0], clock.equal),
        clock.off,
    )


def _is_measured(study: Subject) -> bool:
    """Whether anything of a part was measured."""
    return any(len(observed) for observed in study.observations)
