"""A planetary set written out, its meshes tabled by formulas: plain
enough for any other integrator.
"""

from typing import Any

import numpy as np
from planetary_arguments import rigid_set, rotating, translating

from wearlab.dynamics.rigid import balanced_torques, effective_masses
from wearlab.dynamics.supports import damping_by_ratio
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageGrid, StageTables

BASE = {"sun": 21.145e-3, "ring": 83.515e-3, "planet": 30.655e-3}
PIN = 56.5e-3
ALPHA = {"sun_planet": np.deg2rad(23.534), "planet_ring": np.deg2rad(20.685)}
INERTIA = {"sun": 146e-6, "planet": 297e-6, "ring": 17440e-6, "carrier": 11178e-6}
MASS = {"sun": 0.53, "planet": 0.35, "ring": 1.85, "carrier": 4.5}
RADIAL = {"sun": 10e6, "planet": 58e6, "ring": 1000e6, "carrier": 195e6}
MEAN = {"sun_planet": 2.5e8, "planet_ring": 3.5e8}
ANGLES = 2.0 * np.pi * np.arange(3) / 3
SPEED = 1000.0 * np.pi / 30.0
CARRIER = SPEED * 20.0 / 99.0
PERIOD = 2.0 * np.pi / (20.0 * (SPEED - CARRIER))
PITCH = 2.0 * np.pi * BASE["sun"] / 20.0
OFFSET = np.array([0.0, 2 / 3, 1 / 3, 0.3, 0.3 + 2 / 3, 0.3 + 1 / 3]) % 1.0
RATIO = np.repeat([1.55, 1.8], 3)
ENTRY = np.repeat([-5e-3, -6e-3], 3)
BREAKS = np.unique(
    np.round(
        np.concatenate(
            [OFFSET, (OFFSET + RATIO - 1) % 1, (OFFSET - ENTRY / PITCH) % 1]
        ),
        12,
    )
)
RIGID = rigid_set(MASS, INERTIA, BASE, PIN, ALPHA, ANGLES)
DAMPING = {
    mesh: 0.14 * np.sqrt(MEAN[mesh] * mass)
    for mesh, mass in effective_masses(RIGID).items()
}


def planetary(
    torque: float = 90.0, carrier_stiffness: float = 1e7, **changes: Any
) -> System:
    tangential = {"ring": 57.6e6, "carrier": carrier_stiffness}
    torques = {"sun": torque}
    if carrier_stiffness < 1e6:
        torques["carrier"] = balanced_torques(RIGID, torque)["carrier"]
    given: dict[str, Any] = {
        "rigid": RIGID,
        "radial_stiffness": RADIAL,
        "tangential_stiffness": tangential,
        "carrier_speed": CARRIER,
        "torque": torques,
        "radial_damping": {
            m: damping_by_ratio(0.03, RADIAL[m], MASS[m]) for m in RADIAL
        },
        "tangential_damping": {
            "ring": 600.0,
            "carrier": 1e3 if carrier_stiffness >= 1e6 else 0.0,
        },
        "mesh_damping": DAMPING,
    }
    return translating(**(given | changes))


def torsional(**changes: Any) -> System:
    given: dict[str, Any] = {
        "rigid": RIGID,
        "sun_torque": 90.0,
        "mesh_damping": DAMPING,
    }
    return rotating(**(given | changes))


def pairs(mesh: int, phase: Any, middle: Any, mu: float) -> list[tuple[Any, Any, Any]]:
    """Stiffness, Λμ and position of both pairs of a mesh at a phase of the clock."""
    own_middle = (middle - OFFSET[mesh]) % 1.0
    own = own_middle + phase - middle
    found = []
    for j in (0, 1):
        x = own + j
        inside = own_middle + j < RATIO[mesh]
        stiffness = np.where(
            inside, 2.0e8 * (1.0 - 0.35 * (2.0 * x / RATIO[mesh] - 1.0) ** 2), 0.0
        )
        sliding = np.where(
            inside, mu * np.sign(ENTRY[mesh] + (own_middle + j) * PITCH), 0.0
        )
        found.append((stiffness, sliding, ENTRY[mesh] + x * PITCH))
    return found


def tables(
    grid: StageGrid, mu: float | None = None, amplitude: float = 1e-6
) -> StageTables:
    phase = grid.phase
    middle = (grid.start + 0.5 * grid.width)[:, None] * np.ones(3)
    values = [pairs(m, phase, middle, mu or 0.0) for m in range(6)]
    k, sliding, position = (
        np.ascontiguousarray(
            np.stack([np.stack([v[i] for v in mesh], -1) for mesh in values], 2)
        )
        for i in range(3)
    )
    angle = 2.0 * np.pi * phase[..., None] + np.arange(6)
    rubbing = (None, None) if mu is None else (sliding, sliding * position)
    error = amplitude * np.sin(angle)
    rate = amplitude * 2.0 * np.pi * np.cos(angle)
    return StageTables(grid.width, k, np.zeros_like(k), error, rate, None, *rubbing)
