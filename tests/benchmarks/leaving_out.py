"""What each absent part of a scene saves, and that leaving it out changes nothing: a
table to print.

``python tests/benchmarks/leaving_out.py`` runs one wearing state of a spur pair, of a
planetary set and of a helical pair in pairs of scenes; with a file, such as
``docs/evidence/leaving_out.json``, it keeps the numbers there, of the sets that are
named after it alone. In the first of each pair a part is present but without effect, in
the second it is absent. The results agree; time and bytes of the stored run do not.
Linear contact is not an option but a proof: where no gap can open, the period map is
affine and one pass finds the orbit that a march finds in hundreds of periods.

Times are those of the processor, with compiled kernels: both scenes take turns, and the
shortest of many turns counts, because whatever else a machine does only adds. Quarters
of the turns tell how well a saving is known; one that is smaller is called nil.
"""

import json
import sys
import time
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from wearlab.campaign import load
from wearlab.scene import Scene
from wearlab.scene.identity import MODEL_VERSION

CAMPAIGNS = Path(__file__).parents[2] / "campaigns"

TURNS = 80
QUARTERS = 4
NIL = 0.01
"""Least saving of time that is told from none [1]."""
BASE: dict[str, Any] = {
    "gears": {
        "kind": "external-pair",
        "module": "3 mm",
        "face_width": "20 mm",
        "pinion": {"teeth": 50, "roughness_ra": "0.3 um"},
        "gear": {"teeth": 50, "roughness_ra": "0.3 um"},
    },
    "operation": {"torque": "340 N*m", "speed": "1860 rpm"},
    "mesh": {"damping": "1000 N*s/m"},
    "dynamics": {"model": "torsional"},
    "wear": {
        "coefficient": {"model": "constant", "value": "9.65e-19 m^2/N"},
        "load": "instant",
    },
}
Change = dict[str, Any]


class Part(NamedTuple):
    """A part, as a change of the base scene that has no effect, and the change that
    leaves it out.

    Parameters
    ----------
    name : what is left out
    present, absent : dotted key → value as a campaign file writes it, None: no such key
    tolerance : largest relative difference of results that counts as none; 0: not a bit
    base : campaign file of the scene that is changed; empty: `BASE`
    """

    name: str
    present: Change
    absent: Change
    tolerance: float
    base: str = ""


EVEN = {"mesh.stiffness": {"model": "constant", "value": "300 N/um", "of": "mesh"}}
FINE = {"numerics.steps_per_period": 256}
THIN_OIL = {"viscosity": "1e-5 Pa*s", "pressure_viscosity": "1e-8 1/Pa"}
PARTS = (
    Part(
        "dynamics",
        EVEN,
        EVEN | {"wear.load": "static", "dynamics": None, "mesh.damping": None},
        1e-9,
    ),
    # Sums in another order: 1.3e-12 on a processor without fused multiply-add.
    Part("friction", {"dynamics.friction": {"coefficient": 0.0}}, {}, 1e-3),
    Part("back contact", {"mesh.normal_backlash": "1 mm"}, {}, 0.0),
    Part(
        "film factor", {"lubricant": THIN_OIL, "wear.coefficient.film": True}, {}, 0.0
    ),
    Part(
        "torque fluctuation",
        {
            "operation.torque_fluctuation": {
                "order": 1,
                "amplitude": "0 N*m",
                "phase": "0 deg",
            }
        },
        {},
        0.0,
    ),
    # Steps of Runge–Kutta's method as many that both agree.
    Part(
        "integration until steady (contact proven linear)",
        FINE | {"dynamics.method": "rk4"},
        FINE,
        1e-5,
    ),
    Part("wear over cycles", {"wear.until": {"cycles": 1e6}}, {}, 1e-12),
    Part("the wear law", {}, {"wear": None}, 0.0),
)
WEAR = {"coefficient": {"model": "constant", "value": "1e-18 m^2/N"}, "load": "instant"}
"""Of the scenes of campaign files: one wear state."""
PLANETARY = "base/planetary_ngw11_vibration.toml"
HELICAL = "helical_coupled.toml"
NO_TORQUE = {"order": 1, "amplitude": "0 N*m", "phase": "0 deg"}


def _part(
    base: str, name: str, present: Change, absent: Change, tolerance: float = 0.0
) -> Part:
    """Return a part of a set that wears."""
    return Part(name, present, absent, tolerance, base)


SETS: dict[str, tuple[Part, ...]] = {
    "spur pair": PARTS,
    "planetary set": (
        _part(
            PLANETARY, "friction", {"dynamics.friction": {"coefficient": 0.0}}, {}, 1e-3
        ),
        _part(
            PLANETARY,
            "back contact",
            {"mesh.normal_backlash": "1 mm"},
            {"mesh.normal_backlash": None},
        ),
        _part(
            PLANETARY,
            "torque fluctuation",
            {"operation.torque_fluctuation": NO_TORQUE},
            {},
        ),
        _part(PLANETARY, "wear over cycles", {"wear.until": {"cycles": 1e6}}, {}, 1e-9),
        _part(PLANETARY, "the wear law", {}, {"wear": None}),
    ),
    "helical pair": (
        _part(
            HELICAL,
            "crowning",
            {"gears.pinion.lead_crowning": "0 um"},
            {"gears.pinion.lead_crowning": None},
        ),
        _part(
            HELICAL,
            "misalignment",
            {"mesh.misalignment": "0 um"},
            {"mesh.misalignment": None},
        ),
        _part(HELICAL, "back contact", {"mesh.normal_backlash": "1 mm"}, {}),
        _part(
            HELICAL,
            "torque fluctuation",
            {"operation.torque_fluctuation": NO_TORQUE},
            {},
        ),
        _part(HELICAL, "wear over cycles", {"wear.until": {"cycles": 1e6}}, {}, 1e-9),
        _part(HELICAL, "the wear law", {}, {"wear": None}),
    ),
}
LONG_TURNS = 12
"""Turns of the sets that take longer than the spur pair."""
COMPARED = ("dynamic_mesh_force", "tooth_force", "wear_rate", "wear_depth")


class Saving(NamedTuple):
    """What leaving a part out saves.

    Parameters
    ----------
    name : the part
    seconds : (present, absent) shortest time of contact, dynamics and wear [s]
    known : how well the saved share of the time is known [1]
    size : (present, absent) bytes of the stored run
    difference : largest relative difference of what both scenes compute, in the first
        state [1]
    tolerance : what counts as none [1]
    """

    name: str
    seconds: tuple[float, float]
    known: float
    size: tuple[int, int]
    difference: float
    tolerance: float

    @property
    def saved(self) -> float:
        """Share of the time that is saved [1]."""
        return 1.0 - self.seconds[1] / self.seconds[0]

    @property
    def text(self) -> str:
        """The share of the time that is saved, for people."""
        least = max(NIL, self.known)
        if abs(self.saved) <= least:
            return f"nil (< {100 * least:.0f} %)"
        return f"{100 * self.saved:.0f} % ± {100 * least:.0f}"


def scene(change: Change, base: str = "") -> Scene:
    """Return the base scene, or that of a campaign file, with a change."""
    changed = Scene.from_mapping(BASE)
    if base:
        whole = load(CAMPAIGNS / base).cases[0].scene.replace("wear", None)
        changed = whole.replace("wear", WEAR)
    for key, value in change.items():
        if value is not None:
            changed = changed.replace(key, value)
    for key, value in change.items():
        if value is None:
            changed = changed.replace(key, None)
    return changed


def saving(part: Part, turns: int = TURNS) -> Saving:
    """Run both scenes of a part, compiled before, and return what its absence saves."""
    from wearlab.simulation import simulate
    from wearlab.store.netcdf import to_image

    scenes = scene(part.present, part.base), scene(part.absent, part.base)
    datasets = [simulate(one) for one in scenes]
    for one in scenes:
        _run(one)
    seconds = np.array([[_timed(one) for one in scenes] for _ in range(turns)])
    slow, fast = seconds.min(axis=0)
    sizes = [len(to_image(dataset)[0]) for dataset in datasets]
    return Saving(
        part.name,
        (float(slow), float(fast)),
        apart([seconds[k::QUARTERS] for k in range(QUARTERS)]),
        (sizes[0], sizes[1]),
        _difference(datasets[0], datasets[1]),
        part.tolerance,
    )


def apart(groups: Sequence[Any]) -> float:
    """Return how far groups of turns, (n, 2) seconds each, are apart
    in what is saved [1].
    """
    if not all(map(len, groups)):
        return 1.0
    savings = [
        1.0 - fast / slow for slow, fast in (group.min(axis=0) for group in groups)
    ]
    return float(max(savings) - min(savings))


def _timed(one: Scene) -> float:
    """Return the processor time of a run without estimates and the
    search for further attractors [s].
    """
    begun = time.process_time()
    _run(one)
    return time.process_time() - begun


def _run(one: Scene) -> None:
    """Build a scene, let it live, and work out everything that is
    stored of its states.
    """
    from wearlab.simulation.dataset import contact, dynamics, path
    from wearlab.simulation.life_run import integrate_life
    from wearlab.simulation.operating import operating_conditions

    (stage,) = operating_conditions(one)
    parts = stage.first
    states = integrate_life(one, (stage,)).state
    contact.mesh_values(parts, states)
    path.path_values(parts, states)
    if parts.vibration is not None:
        dynamics.dynamic_values(parts, states)


def _difference(first: Any, second: Any) -> float:
    """Return the largest relative difference of the compared
    variables in the states both have.
    """
    found = [np.inf]
    for name in COMPARED:
        if name in first and name in second:
            a = first[name].values[:1]
            b = second[name].values[:1]
            scale = np.abs(a).max()
            found.append(
                float(np.abs(a - b).max() / scale)
                if scale > 0.0
                else float(np.abs(b).max())
            )
    if (
        "wear_depth" in first
        and "wear_depth" in second
        and first.sizes["update"] == second.sizes["update"]
    ):
        a = first.wear_depth.values[-1]
        b = second.wear_depth.values[-1]
        found.append(float(np.abs(a - b).max() / (np.abs(a).max() or 1.0)))
    return max(found[1:], default=np.inf)


HEADS = ("left out", "time", "saved", "stored", "saved", "largest difference")


def row(found: Saving) -> tuple[str, ...]:
    """Return what leaving a part out saves, for people."""
    (slow, fast) = found.seconds
    (large, small) = found.size
    return (
        found.name,
        f"{1e3 * slow:.2f} → {1e3 * fast:.2f} ms",
        found.text,
        f"{large / 1e3:.0f} → {small / 1e3:.0f} kB",
        f"{1.0 - small / large:.0%}",
        f"{found.difference:.0e}" if found.difference else "0",
    )


def print_table(rows: Sequence[Sequence[str]]) -> None:
    """Print rows in columns as wide as what they hold."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for one in rows:
        print(
            "  ".join(
                f"{text:<{width}}" for text, width in zip(one, widths, strict=True)
            ).rstrip()
        )


def main(arguments: Sequence[str]) -> None:
    """Print the tables, and keep the numbers in a file where one is given."""
    file = Path(arguments[0]) if arguments else None
    for name in arguments[1:] or SETS:
        turns = TURNS if name == "spur pair" else LONG_TURNS
        savings = [saving(part, turns) for part in SETS[name]]
        print(name)
        print_table([HEADS, *(row(found) for found in savings)])
        if file is not None:
            keep(file, name, savings)


def keep(file: Path, name: str, savings: Sequence[Saving]) -> None:
    """Keep what was measured of one set beside what the file has of others."""
    everything = json.loads(file.read_text()) if file.exists() else {}
    everything[name] = {
        "date": datetime.now(UTC).date().isoformat(),
        "model_version": MODEL_VERSION,
        "parts": [found._asdict() for found in savings],
    }
    file.write_text(json.dumps(everything, indent=1, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
