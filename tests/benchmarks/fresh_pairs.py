"""Fresh pairs by the defaults beside finite elements: do they lie within the line that
the run shows?

``python tests/benchmarks/fresh_pairs.py [SEED]`` draws three pairs, writes each as the
shortest campaign that makes it vibrate, runs it, and prints beside its numbers those of
elements alone: mean transmission error and mesh stiffness under the static load
(:mod:`.corner_elements`), the share of the load of a pair, and the largest mesh force
of the moving pair (:mod:`.onset_table`, at the scene's own mass, damping and speed),
each with what the run's `model_error` allows.
"""

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from corner_elements import load_corners
from onset_table import Mover, judged, judged_moving, shares
from stiffness_table import drawn

import wearlab
from wearlab.assembly import build
from wearlab.gears.specification import GearError
from wearlab.mesh.stiffnesses.finite_element import STIFFNESS_OFF
from wearlab.scene import Scene
from wearlab.simulation.dataset.model_errors import ERROR_OFF, FORCE_OFF, SHARE_OFF

SEED = 20261122
KINDS = (False, False, True)
"""Which of the pairs are internal."""
TUNED = (0.25, 1.1)
"""Mesh over natural frequency, drawn between these."""
PHASES = np.linspace(0.0, 1.0, 49)


class Compared(NamedTuple):
    """One number of a run beside that of elements.

    Parameters
    ----------
    name : of the number, with its unit
    run, elements : what both say
    off : how far they are apart [1]
    allowed : how far the run's own model-error line says that they may be [1]
    """

    name: str
    run: float
    elements: float
    off: float
    allowed: float


def campaign(table: dict[str, Any], speed: float) -> str:
    """Return the shortest campaign of a vibrating pair, as text."""
    gears = table["gears"]
    operation = table["operation"]
    mate = "ring" if "ring" in gears else "gear"

    def inline(given: dict[str, Any]) -> str:
        words = {
            name: f'"{value}"' if isinstance(value, str) else f"{value:g}"
            for name, value in given.items()
        }
        return (
            "{ "
            + ", ".join(f"{name} = {value}" for name, value in words.items())
            + " }"
        )

    return f"""title = "Fresh pair"

[gears]
kind = "{gears["kind"]}"
module = "{gears["module"]}"
face_width = "{gears["face_width"]}"
pinion = {inline(gears["pinion"])}
{mate} = {inline(gears[mate])}

[operation]
torque = "{operation["torque"]}"
speed = "{speed:.0f} rpm"

[mesh]
damping_ratio = 0.07

[dynamics]
model = "torsional"
"""


def rounded(table: dict[str, Any]) -> dict[str, Any]:
    """Return a drawn pair with three digits, as one would write it."""
    if isinstance(table, dict):
        return {name: rounded(value) for name, value in table.items()}
    if isinstance(table, float):
        return float(f"{table:.3g}")
    if isinstance(table, str) and table.split(" ")[0].replace(".", "").isdigit():
        number, unit = table.split(" ")
        return (
            f"{float(number):.3g} {unit}"
            if float(number) < 1000
            else f"{float(number):.0f} {unit}"
        )
    return table


def fresh(seed: int) -> Iterator[str]:
    """Yield the campaigns of three pairs that exist and run between
    the drawn shares of their resonance.
    """
    rng = np.random.default_rng(seed)
    for internal in KINDS:
        while True:
            table = rounded(drawn(rng, internal))
            tuned = float(rng.uniform(*TUNED))
            try:
                scene = scene_of(campaign(table, 1000.0))
                build(scene)
            except GearError:
                continue
            natural = float(wearlab.simulate(scene).critical_speed.max()) * 30.0 / np.pi
            yield campaign(table, tuned * natural)
            break


def scene_of(text: str) -> Scene:
    """Return the scene of a campaign's text."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "fresh.toml"
        file.write_text(text)
        return wearlab.load(file).cases[0].scene


def compared(text: str) -> Iterator[Compared]:
    """Run a campaign and yield its numbers beside those of elements."""
    scene = scene_of(text)
    data = wearlab.simulate(scene).isel(update=0, mesh=0)
    parts = build(scene)
    one = parts.gears.kinds[0]
    vibration = parts.vibration
    analysis = parts.kinds[0].analysis
    assert vibration is not None
    known = load_corners(one.pair, one.load, PHASES)
    error = np.interp(PHASES, data.phase, data.static_transmission_error, period=1.0)
    off = error / known.deflection - 1.0
    worst = int(np.abs(off).argmax())
    yield Compared(
        "static transmission error, µm, where most off",
        1e6 * error[worst],
        1e6 * known.deflection[worst],
        float(off[worst]),
        STIFFNESS_OFF,
    )
    means = [
        float(np.trapezoid(values, PHASES)) for values in (error, known.deflection)
    ]
    yield Compared(
        "its mean, µm",
        1e6 * means[0],
        1e6 * means[1],
        means[0] / means[1] - 1.0,
        ERROR_OFF,
    )
    mine = shares(analysis, PHASES[:-1])
    theirs = known.force[:-1] / one.load
    at = np.unravel_index(np.abs(mine - theirs).argmax(), mine.shape)
    yield Compared(
        "share of the load of a pair, where most off",
        mine[at],
        theirs[at],
        float(mine[at] - theirs[at]),
        SHARE_OFF,
    )
    system = vibration.system
    moved = Mover(
        float(system.mass[0, 0]), float(system.mesh_damping[0]), vibration.period
    )
    truth = judged_moving(judged(one), one.load, one.load / means[1], moved).largest
    largest = float(data.mesh_force_max)
    yield Compared(
        "largest mesh force, N", largest, truth, largest / truth - 1.0, FORCE_OFF
    )


def main(words: list[str]) -> None:
    """Print the campaigns, and the table in Markdown."""
    lines = [
        "| pair | number | run | elements | off | line of the run | |",
        "|---|---|---|---|---|---|---|",
    ]
    for count, text in enumerate(fresh(int(words[0]) if words else SEED), 1):
        print(text, flush=True)
        for row in compared(text):
            verdict = "within" if abs(row.off) <= row.allowed else "beyond"
            lines.append(
                f"| {count} | {row.name} | {row.run:.5g} | {row.elements:.5g} | "
                f"{100 * row.off:+.2f} % | "
                f"{100 * row.allowed:.1f} % | {verdict} |"
            )
    print("\n".join(lines))


if __name__ == "__main__":
    main(sys.argv[1:])
