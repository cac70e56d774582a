"""The units of a fleet with what was measured of each, and the law that they share."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.updating import data_blocks, interval_blocks, kalman
from wearlab.updating.fleet_law import (
    Shared,
)
from wearlab.updating.run_curves import RunHistory
from wearlab.updating.sheet_doubts import log_of_doubt

SMALLEST_SHARE = 0.1  # of its mean course that a unit is worn


class SheetReading(NamedTuple):
    """A unit, if some of its sheets are sound.

    Parameters
    ----------
    unit : with its sound sheets
    aside : with the sheet that has a scale of its own, None where all are sound
    log_prior : log of the probability of that before
    """

    unit: "FleetMember"
    aside: "FleetMember | None"
    log_prior: float


@dataclass(frozen=True)
class FleetMember:
    """A unit: its name, its run, and what was measured of it.

    Parameters
    ----------
    name, run, blocks : of the unit
    foreseen : block of which an inspection is foreseen: at a cycle it, and blocks after
        it, do not count yet
    """

    name: str
    run: RunHistory
    blocks: data_blocks.Blocks
    foreseen: int | None = None

    @property
    def now(self) -> float:
        """The last inspection [cycles]; when it was new where there was none."""
        return float(max(self.cycles, default=self.run.new_cycle))

    @cached_property
    def inspections(self) -> list[tuple[int, kalman.Inspection]]:
        """The inspections and the block of each, in order of time.

        Those of one time in order of blocks.
        """
        numbered = enumerate(self.blocks)
        inspections = [
            (n, inspection)
            for n, block in numbered
            for inspection in data_blocks.inspections_of(block, self.run, n)
        ]
        return sorted(inspections, key=lambda inspection: inspection[1].cycle)

    @cached_property
    def cycles(self) -> Array:
        """The times of inspections, rising [cycles]."""
        return np.unique([inspection.cycle for _, inspection in self.inspections])

    @cached_property
    def sheets(self) -> list[str]:
        """The names of those sheets that tell where the unit stands.

        Each but once; a block with an unknown gain has a scale of its own anyway.
        """
        names = [
            block.data.sheet_name
            for block in self.blocks
            if len(block.rows) and not block.data.error.gain_sd
        ]
        return list(dict.fromkeys(names))

    @cached_property
    def readings(self) -> tuple[SheetReading, ...]:
        """The unit if all of its sheets are sound, and if one is not, each in turn."""
        log_all_sound, log_doubt = log_of_doubt(len(self.sheets))
        readings = [SheetReading(self, None, log_all_sound)]
        for doubted in self.sheets if len(self.sheets) > 1 else ():
            aside = self._with_sheet(doubted, kept=True)
            sound = self._with_sheet(doubted, kept=False)
            readings.append(SheetReading(sound, aside, log_doubt))
        return tuple(readings)

    def _with_sheet(self, name: str, *, kept: bool) -> "FleetMember":
        """Return the unit with one sheet alone, or with all others."""
        blocks = [
            block
            if (block.data.sheet_name == name) is kept
            else replace(block, rows=block.rows[:0])
            for block in self.blocks
        ]
        return replace(self, blocks=tuple(blocks))

    @property
    def whole(self) -> list[int]:
        """The blocks without places on the flank.

        What was measured, and what ends the life, first.
        """
        numbers = [
            n
            for n, block in enumerate(self.blocks)
            if block.observed.place_kind is None
            and not interval_blocks.stands_apart(block)
        ]
        curves = [points.curve is not self.run.limit for points in self.run.points]
        return sorted(
            numbers, key=lambda n: (not len(self.blocks[n].observed), curves[n])
        )

    @cached_property
    def strayed(self) -> tuple[Array, Array]:
        """Where each measurement would be but a small share of the mean course.

        They are the cycles of the measurements, and those of the run in which so much
        would be worn, (n,) each.
        """
        run = self.run
        cycles = [np.zeros(0)]
        run_cycles = [np.zeros(0)]
        for number in self.whole:
            block = self.blocks[number]
            points = run.points[number]
            value = points.curve.value[:, 0]
            if not len(block.rows) or value[-1] <= value[0]:
                continue
            worn = np.maximum(data_blocks.largest_values(block) - value[0], 0.0)
            far = points.curve.first_above(value[0] + worn / SMALLEST_SHARE)
            cycle = run.equal(points.cycle[block.rows], points.clock)
            has_run = cycle > 0.0
            cycles.append(cycle[has_run])
            run_cycles.append(far[has_run] - run.start)
        return np.concatenate(cycles), np.concatenate(run_cycles)

    def largest_log_factor(self, shared: Shared) -> float:
        """Return the ln f up to which a unit is compared, infinite without values.

        Beyond, each of its values would be but a small share of its mean course: it
        would have strayed back to almost new. A normal law does, a gear does not; and
        in nothing else do two sheets that contradict each other agree.

        Parameters
        ----------
        shared : what units share
        """
        cycle, run_cycle = self.strayed
        if not len(cycle):
            return np.inf
        ratio = cycle / shared.reference
        equal = shared.reference * np.min(ratio**shared.power, axis=0)
        largest = float(np.max(run_cycle * self.run.factor / equal))
        return float(np.log(largest)) if largest > 0.0 else np.inf

    def inspected(self, cycles: Array) -> Index:
        """Return how many inspections there had been by cycles, (cycles,).

        Parameters
        ----------
        cycles : times, (cycles,)
        """
        foreseen = self._first_foreseen
        rows = [(time.cycle, n >= foreseen) for n, time in self.inspections]
        cycle, is_later_block = np.array(rows).reshape(-1, 2).T
        at = cycles[:, None]
        now_known = (cycle == at) & (is_later_block == 0.0)
        return np.sum((cycle < at) | now_known, axis=1)

    @property
    def _first_foreseen(self) -> int:
        """The first block that is foreseen at a cycle, past the last where none is."""
        return len(self.blocks) if self.foreseen is None else self.foreseen

    def up_to(self, cycle: float) -> "FleetMember":
        """Return the unit with what had been measured by a cycle.

        Parameters
        ----------
        cycle : until which measurements count
        """
        n = self._first_foreseen
        until = data_blocks.select_by_cycle(self.blocks, self.run, np.less_equal, cycle)
        earlier = data_blocks.select_by_cycle(self.blocks, self.run, np.less, cycle)
        return replace(self, blocks=(*until[:n], *earlier[n:]))
