"""Days of fleets whose truth is known: ``python
tests/benchmarks/department_truths.py [fleets] [first seed]``.

Fourteen gearboxes as a maintenance department has them: a workbook with sheets of gauge
depths, weighings and iron in the oil, a new pinion in one of them, and a fifth more
load from January on: last January, in a record of loads, or next January, as a
scenario. The true days are read off real runs with the loads as stages, that of the new
pinion beside its worn gear. Printed is how many of them lie in the 90 % intervals.
"""

import sys
import tempfile
from dataclasses import dataclass
from datetime import date, timedelta
from pathlib import Path

import numpy as np
import xarray as xr
from openpyxl import Workbook

import wearlab as wl

FLEETS = 5
UNITS = 14
USUAL, HARDER = 400, 480  # N m
RPM = 750
LIMIT = 80e-6  # m
TODAY = date(2026, 6, 30)
LAST_JANUARY, NEXT_JANUARY = date(2026, 1, 1), date(2027, 1, 1)
OIL = 40.0 * 0.87  # kg
GEARBOX = """
title = "Mixer gearboxes"
[gears]
kind           = "external-pair"
module         = "4 mm"
pressure_angle = "20 deg"
face_width     = "40 mm"
material       = "18CrNiMo7-6"
[gears.pinion]
teeth                     = 21
profile_shift_coefficient = 0.4
[gears.gear]
teeth = 58
[operation]
torque = "{torque} N*m"
speed  = "750 rpm"
[wear]
load          = "static"
coefficient   = {{ model = "constant", value = "1e-18 m^2/N" }}
contact_patch = "none"
until         = {{ depth = "80 um", flank = "pinion" }}
"""
UPDATE = """
[update]
limit = { depth = "80 um", flank = "pinion" }
today = "2026-06-30"
[update.unknown]
"wear.coefficient.factor" = { lognormal = { median = 1.0, cov = 3.0 } }
[[update.data]]
file     = "gearboxes.xlsx"
sheet    = "gauge"
quantity = "max_wear_depth"
flank    = "pinion"
columns  = { unit = "gearbox", date = "date", hours = "hours", value = "depth" }
error    = { sd = "2 um" }
[[update.data]]
file     = "gearboxes.xlsx"
sheet    = "weighings"
quantity = "worn_mass"
member   = "pinion"
columns  = { unit = "gearbox", date = "date", value = "loss" }
error    = { sd = "10 mg" }
[[update.data]]
file     = "gearboxes.xlsx"
sheet    = "oil"
quantity = "worn_mass"
member   = "all"
columns  = { unit = "gearbox", date = "date", value = "Fe", oil_changed = "changed" }
oil      = { volume = "40 l" }
error    = { sd = "0.5 ppm", relative = 0.1, gain_sd = 0.5 }
"""
RECORD = """
[update.record]
file    = "loads.csv"
columns = { unit = "gearbox", date = "date", torque = "torque", speed = "speed" }
units   = { torque = "N*m", speed = "rpm" }
"""
SCENARIO = """
[[update.scenario]]
label         = "load + 20 %"
from          = 2027-01-01
torque_factor = 1.2
"""


@dataclass(frozen=True)
class Gearbox:
    """One gearbox of a fleet, as nobody in the department knows it.

    Parameters
    ----------
    name : of the unit
    factor : on the wear coefficient
    began : first day of operation
    hours_a_day : of operation
    """

    name: str
    factor: float
    began: date
    hours_a_day: float

    def hours(self, day: date) -> float:
        """Return the operating hours on a day."""
        return self.hours_a_day * (day - self.began).days


class TrueWear:
    """Wear of a gearbox over its hours, by a real run with its loads as stages.

    Parameters
    ----------
    scene : of the gearbox
    unit : with its coefficient and hours
    harder_from : day from which the load is harder, None never
    worn_gear : the wear of the gear when the pinion was new [none]
    """

    def __init__(self, scene, unit, harder_from=None, worn_gear=None):
        self.unit = unit
        usual_hours = np.inf if harder_from is None else unit.hours(harder_from)
        last_torque = USUAL if np.isinf(usual_hours) else HARDER
        stages = [{"torque": f"{last_torque} N*m", "speed": f"{RPM} rpm"}]
        if 0.0 < usual_hours < np.inf:
            cycles = 60.0 * RPM * usual_hours
            stages.insert(0, stages[0] | {"torque": f"{USUAL} N*m", "cycles": cycles})
        changes = {"operation": {"stage": stages}} if len(stages) > 1 else {}
        if len(stages) == 1:
            changes["operation.torque"] = f"{last_torque} N*m"
        changes["wear.coefficient.factor"] = unit.factor
        self.run = wl.simulate(scene.replace(changes | (worn_gear or {})))
        self.run_hours = self.run.operating_hours.values / 3600.0
        self.depth = self.run.max_wear_depth.sel(flank="pinion").values
        self.pinion_mass = self.run.worn_mass.sel(member="pinion").values
        self.iron = self.run.worn_mass.sum("member").values

    def at(self, wear: np.ndarray, day: date) -> float:
        """Return a wear on a day."""
        return float(np.interp(self.unit.hours(day), self.run_hours, wear))

    @property
    def last_day(self) -> date:
        """The day on which the limit is reached."""
        hours = float(np.interp(LIMIT, self.depth, self.run_hours))
        return self.unit.began + timedelta(days=hours / self.unit.hours_a_day)

    def gear_on(self, day: date, file: Path) -> dict:
        """Return the gear's wear on a day as initial wear, its profile in a file."""
        profiles = self.run.wear_depth.sel(flank="gear").values
        after = int(np.searchsorted(self.run_hours, self.unit.hours(day)))
        pair = self.run_hours[after - 1 : after + 1]
        share = (self.unit.hours(day) - pair[0]) / (pair[1] - pair[0])
        profile = (1.0 - share) * profiles[after - 1] + share * profiles[after]
        place = self.run.path_position.sel(flank="gear").values
        order = np.argsort(place)
        pairs = zip(place[order].tolist(), profile[order].tolist(), strict=True)
        rows = [f"{x!r},{depth!r}" for x, depth in pairs]
        file.write_text("\n".join(["path_position [m],depth [m]", *rows]))
        columns = {"x": "path_position", "y": "depth", "continuation": "hold"}
        return {"wear.initial.gear": {"file": str(file), **columns}}


class Fleet:
    """Fourteen gearboxes with their true days, and what was measured of them.

    Parameters
    ----------
    folder : for its files
    seed : of all that is drawn
    is_recorded : whether the load was raised last January; else it will be next
    """

    def __init__(self, folder, seed, is_recorded):
        self.folder = folder
        self.is_recorded = is_recorded
        self.rng = np.random.default_rng([14, seed])
        self.torque = HARDER if is_recorded else USUAL
        (folder / "gearbox.toml").write_text(GEARBOX.format(torque=self.torque))
        self.scene = wl.load(folder / "gearbox.toml").cases[0].scene
        self.middle = np.exp(0.4 * self.rng.standard_normal())
        self.spread = self.rng.uniform(0.15, 0.4)
        self.gain = 0.6 * np.exp(0.2 * self.rng.standard_normal())
        self.replaced = int(self.rng.integers(UNITS))
        self.rows = {"gauge": [], "weighings": [], "oil": []}
        self.loads = ["date,gearbox,torque,speed"]
        self.days = {}
        self.days_if_harder = {}
        for number in range(UNITS):
            self._add(number)

    def factor(self) -> float:
        """Return the factor of another pinion on the wear coefficient."""
        return float(self.middle * np.exp(self.spread * self.rng.standard_normal()))

    def _add(self, number: int) -> None:
        """Draw a gearbox, what it goes through and what is measured of it."""
        factor = self.factor()
        hours_a_day = self.rng.uniform(11.0, 20.0)
        life = TrueWear(self.scene, Gearbox("", factor, TODAY, 24.0)).run_hours[-1]
        age = min(self.rng.uniform(0.35, 0.9) * life / hours_a_day, 3000.0)
        began = TODAY - timedelta(days=round(age))
        unit = Gearbox(f"GB-{number + 1:02d}", factor, began, hours_a_day)
        harder_from = LAST_JANUARY if self.is_recorded else None
        wear = TrueWear(self.scene, unit, harder_from)
        looks = self._looks(began)
        self.days[unit.name] = wear.last_day

        last = TrueWear(self.scene, unit, NEXT_JANUARY) if harder_from is None else wear
        if number == self.replaced:
            self.changed = began + timedelta(days=round(0.45 * age))
            before = [day for day in looks if day <= self.changed]
            self._measure(unit, wear, before, unit)
            worn_gear = wear.gear_on(self.changed, self.folder / "gear.csv")
            new = Gearbox(unit.name, self.factor(), self.changed, hours_a_day)
            wear = TrueWear(self.scene, new, harder_from, worn_gear)
            looks = [day for day in looks if day > self.changed]
            self._measure(new, wear, looks, unit)
            self.days[unit.name] = wear.last_day
            if harder_from is None:
                last = TrueWear(self.scene, new, NEXT_JANUARY, worn_gear)
        else:
            self._measure(unit, wear, looks, unit)
        self.days_if_harder[unit.name] = last.last_day
        self._record(unit)

    def _looks(self, began: date) -> list[date]:
        """Return the days of inspections."""
        shares = np.sort(self.rng.uniform(0.15, 0.97, self.rng.integers(2, 6)))
        days = [began + timedelta(days=round(s * (TODAY - began).days)) for s in shares]
        return sorted(set(days))

    def _measure(self, part, wear, looks, unit) -> None:
        """Measure a part of a unit on some days, with errors."""
        rng = self.rng
        for day in looks:
            depth = 1e6 * wear.at(wear.depth, day) + rng.normal(0.0, 2.0)
            loss = 1e6 * wear.at(wear.pinion_mass, day) + rng.normal(0.0, 10.0)
            earliest = day - timedelta(days=int(rng.integers(60, 120)))
            filled = max(earliest, part.began)
            iron = 1e6 * (wear.at(wear.iron, day) - wear.at(wear.iron, filled))
            ppm = self.gain * iron / OIL * np.exp(rng.normal(0.0, 0.1))
            ppm = max(ppm + rng.normal(0.0, 0.3), 0.1)
            first = (unit.name, day)
            self.rows["gauge"].append((*first, round(unit.hours(day)), round(depth, 1)))
            self.rows["weighings"].append((*first, round(loss)))
            self.rows["oil"].append((*first, round(ppm, 1), filled))

    def _record(self, unit: Gearbox) -> None:
        """Write down the loads of a gearbox."""
        if unit.began < LAST_JANUARY:
            self.loads.append(f"{unit.began},{unit.name},{USUAL},{RPM}")
        raised = max(unit.began, LAST_JANUARY)
        self.loads.append(f"{raised},{unit.name},{HARDER},{RPM}")
        self.loads.append(f"{TODAY},{unit.name},,")

    def answer(self) -> xr.Dataset:
        """Return what an update foresees of every unit."""
        heads = {
            "gauge": ["gearbox", "date", "hours", "depth [um]"],
            "weighings": ["gearbox", "date", "loss [mg]"],
            "oil": ["gearbox", "date", "Fe [ppm]", "changed"],
        }
        book = Workbook()
        book.remove(book.active)
        for name, rows in self.rows.items():
            sheet = book.create_sheet(name)
            for row in (heads[name], *rows):
                sheet.append(list(row))
        book.save(self.folder / "gearboxes.xlsx")
        (self.folder / "loads.csv").write_text("\n".join(self.loads) + "\n")
        text = 'title = "Fourteen gearboxes"\nextends = "gearbox.toml"\n' + UPDATE
        text += RECORD if self.is_recorded else SCENARIO
        text += "\n[[update.replaced]]\n"
        text += f'unit = "GB-{self.replaced + 1:02d}"\nmembers = ["pinion"]\n'
        text += f"date = {self.changed}\n"
        file = self.folder / "gearboxes.toml"
        file.write_text(text)
        tree = wl.update(wl.load(file), wl.Store(self.folder / "store"), progress=False)
        return tree["predictions"].to_dataset()


def held(days: dict[str, date], quantiles: xr.DataArray) -> dict[str, bool]:
    """Return of which units the true day lies in the 90 % interval."""
    names = quantiles["unit"].values.tolist()
    rows = zip(names, quantiles.values[:, [0, -1]].tolist(), strict=True)
    return {name: low <= str(days[name]) <= high for name, (low, high) in rows}


def main(fleets: int, first: int) -> None:
    """Print how many true days lie in the intervals, fleet by fleet."""
    for seed in range(first, first + fleets):
        for is_recorded in (False, True):
            with tempfile.TemporaryDirectory() as folder:
                fleet = Fleet(Path(folder), seed, is_recorded)
                predictions = fleet.answer()
            found = held(fleet.days, predictions["end_of_life_quantile"])
            new = found[f"GB-{fleet.replaced + 1:02d}"]
            said = "load raised, in a record" if is_recorded else "load as ever"
            line = f"{said}: {sum(found.values())} of {len(found)}, new pinion: {new}"
            if not is_recorded:
                ahead = predictions["scenario_end_of_life_quantile"][:, 0]
                if_harder = held(fleet.days_if_harder, ahead)
                line += f"; if raised next January: {sum(if_harder.values())}"
            print(f"seed {seed}: {line}", flush=True)


if __name__ == "__main__":
    main(
        int(sys.argv[1]) if len(sys.argv) > 1 else FLEETS,
        int(sys.argv[2]) if len(sys.argv) > 2 else 0,
    )
