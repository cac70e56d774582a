"""What people wait for, row by row: each row runs and returns its times.

``python tests/benchmarks/waiting_rows.py ROW CHECKOUT`` prints the times of one row as
JSON, of the package and the campaigns in a checkout. ``waiting.py`` calls it.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

Times = dict[str, float]
"""What was measured, its unit in brackets → value."""

COMMAND = (sys.executable, "-P", "-c", "from wearlab.cli import main; main()")
"""The command line, of the package that is measured wherever it is called from."""
WORKERS = 2

PAIR: dict[str, Any] = {
    "gears": {
        "kind": "external-pair",
        "module": "3 mm",
        "pressure_angle": "20 deg",
        "face_width": "20 mm",
        "pinion": {"teeth": 50},
        "gear": {"teeth": 50},
    },
    "operation": {"torque": "340 N*m", "speed": "1100 rpm"},
    "wear": {
        "coefficient": {"model": "constant", "value": "9.65e-19 m^2/N"},
        "load": "static",
        "until": {"cycles": 1e8},
    },
}
"""A pair of standard gears that wears under its static load."""


def cases(checkout: Path, file: str) -> list[Any]:
    """Return the cases of a campaign file."""
    import wearlab as wl

    return list(wl.load(checkout / "campaigns" / file).cases)


def second_run(scenes: Iterable[Any]) -> Times:
    """Return the processor time of some scenes that this process has run before."""
    from wearlab.simulation import simulate

    scenes = list(scenes)
    for scene in scenes:
        simulate(scene)
    begun = time.process_time()
    for scene in scenes:
        simulate(scene)
    return {"cpu [s]": time.process_time() - begun}


def each_of(scenes: Iterable[Any]) -> Times:
    """Return the mean processor time of all scenes but the first, which warms up."""
    from wearlab.simulation import simulate

    first, *others = scenes
    simulate(first)
    begun = time.process_time()
    for scene in others:
        simulate(scene)
    return {"cpu a run [ms]": 1e3 * (time.process_time() - begun) / len(others)}


def wall(*arguments: str, **environment: str) -> float:
    """Return how long a command of wearlab takes by the clock [s]."""
    begun = time.perf_counter()
    subprocess.run(
        [*COMMAND, *arguments],
        check=True,
        stdout=subprocess.DEVNULL,
        env=os.environ | environment,
    )
    return time.perf_counter() - begun


def w23_campaign(checkout: Path) -> Times:
    """Run W23 Fig. 12, ten lives, with compiled kernels."""
    file = str(checkout / "campaigns" / "planetary_speed.toml")
    wall("compile", file)
    with tempfile.TemporaryDirectory() as store:
        return {"wall [s]": wall("run", file, "--store", store)}


def w23_life(checkout: Path) -> Times:
    """Run one life of W23 Fig. 12, at 300 rpm."""
    return second_run([cases(checkout, "planetary_speed.toml")[0].scene])


def helical_life(checkout: Path) -> Times:
    """Run one life of a helical pair that vibrates."""
    return second_run([cases(checkout, "helical_coupled.toml")[0].scene])


def friction_set(checkout: Path) -> Times:
    """Run two cases of a planetary set with tooth friction."""
    found = cases(checkout, "planetary_friction.toml")
    return second_run(case.scene for case in found[:2])


def spur_speeds(checkout: Path) -> Times:
    """Run L16's pair at five speeds, and under static load."""
    return second_run(case.scene for case in cases(checkout, "spur_speeds.toml"))


def internal_levels(checkout: Path) -> Times:
    """Run worn internal pairs with exact contact."""
    found = cases(checkout, "internal_wear_levels.toml")
    return second_run(case.scene for case in found)


def static_life(checkout: Path) -> Times:
    """Run static lives of gears that the process knows, at other torques."""
    (scene,) = (
        case.scene
        for case in cases(checkout, "spur_speeds.toml")
        if case.label == "static"
    )
    torques = ("299 N*m", *(f"{torque} N*m" for torque in range(300, 305)))
    return each_of(scene.replace("operation.torque", torque) for torque in torques)


def new_gears(checkout: Path) -> Times:
    """Run static lives of pairs whose module or teeth the process does not know."""
    module = [("gears.module", f"{3.0 + 0.1 * k:.1f} mm") for k in range(6)]
    teeth = [("gears.gear.teeth", 50 + k) for k in range(1, 6)]
    return each_of(changed(PAIR, key, value) for key, value in (*module, *teeth))


def new_angle(checkout: Path) -> Times:
    """Run static lives of pairs whose pressure angle the process does not know."""
    angles = (f"{20.0 + 0.5 * k:.1f} deg" for k in range(6))
    return each_of(changed(PAIR, "gears.pressure_angle", angle) for angle in angles)


def changed(table: dict[str, Any], key: str, value: Any) -> Any:
    """Return the scene of a table in which one value is another."""
    from wearlab.campaign import load

    return load(table).cases[0].scene.replace(key, value)


def hundred_runs(checkout: Path) -> Times:
    """Run a hundred static lives into a store, and under joblib without one."""
    sweep = {"operation.torque": {"linspace": [100.0, 300.0, 100], "unit": "N*m"}}
    return through_store(PAIR | {"sweep": [sweep]})


def through_store(campaign: dict[str, Any]) -> Times:
    """Return how long a campaign takes with a store, and under joblib that keeps
    nothing but the life of each run.
    """
    from joblib import Parallel, delayed

    import wearlab as wl

    scenes = [case.scene for case in wl.load(campaign).cases]
    begun = time.perf_counter()
    with tempfile.TemporaryDirectory() as store:
        wl.run(campaign, store, workers=WORKERS, progress=False)
    stored = time.perf_counter()
    Parallel(n_jobs=WORKERS)(delayed(life)(scene) for scene in scenes)
    alone = time.perf_counter()
    return {
        "store, wall [s]": stored - begun,
        "joblib, wall [s]": alone - stored,
        "store over joblib [1]": (stored - begun) / (alone - stored),
    }


def life(scene: Any) -> float:
    """Return the cycles that a scene lived."""
    from wearlab.simulation import simulate

    return float(simulate(scene).cycle[-1])


def races(names: tuple[str, ...], target: float) -> Times:
    """Return how many times our time to an error the best marching peer takes."""
    from race import LANDING, OURS, race
    from races import scenes

    from wearlab.accuracy.steady import steady

    found = {}
    for name, scene in scenes():
        if any(part in name for part in names):
            entries = {
                entry.contestant.role: entry
                for entry in race(steady(scene), (target,))[target]
            }
            slower = entries[LANDING].over(entries[OURS])
            found[f"{name}: peer over ours [1]"] = float(
                sorted(slower)[len(slower) // 2]
            )
    return found


def l16_race(checkout: Path) -> Times:
    """Race L16's pair to 1e-6 against CyRK's best method, tables included."""
    return races(("1860 rpm", "3720 rpm"), 1e-6)


def other_races(checkout: Path) -> Times:
    """Race an internal pair and a set with tooth friction against the same."""
    return races(("internal", "friction"), 1e-3)


def first_run(checkout: Path) -> Times:
    """Run README's first campaign with nothing compiled, then draw its figures."""
    file = str(checkout / "campaigns" / "spur_speeds.toml")
    with tempfile.TemporaryDirectory() as folder:
        at, store, drawn = (str(Path(folder) / name) for name in ("cache", "s", "f"))
        Path(at).mkdir()
        return {
            "run, wall [s]": wall("run", file, "--store", store, WEARLAB_CACHE=at),
            "figures, wall [s]": wall(
                "figures", file, "--store", store, "--out", drawn, WEARLAB_CACHE=at
            ),
        }


class Row(NamedTuple):
    """One row of the table.

    Parameters
    ----------
    measure : checkout → times
    long : takes minutes
    """

    measure: Callable[[Path], Times]
    long: bool = False


ROWS = {
    "w23-campaign": Row(w23_campaign, long=True),
    "w23-life": Row(w23_life),
    "helical-life": Row(helical_life),
    "friction-set": Row(friction_set),
    "spur-speeds": Row(spur_speeds),
    "internal-levels": Row(internal_levels),
    "static-life": Row(static_life),
    "new-gears": Row(new_gears),
    "new-angle": Row(new_angle),
    "hundred-runs": Row(hundred_runs, long=True),
    "l16-race": Row(l16_race, long=True),
    "other-races": Row(other_races, long=True),
    "first-run": Row(first_run, long=True),
}


def require_package_of(checkout: Path) -> None:
    """Refuse to measure another package than that of the checkout.

    Raises
    ------
    SystemExit
        When Python finds another one.
    """
    import wearlab

    found = Path(wearlab.__file__).resolve()
    if checkout.resolve() not in found.parents:
        sys.exit(f"{checkout} is not what Python finds as wearlab, but {found}")


if __name__ == "__main__":
    name, checkout = sys.argv[1:]
    sys.path.insert(0, str(Path(checkout) / "tests" / "benchmarks"))
    require_package_of(Path(checkout))
    print(json.dumps(ROWS[name].measure(Path(checkout))))
