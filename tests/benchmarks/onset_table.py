"""The onset of contact of every way in against elements alone, static and vibrating.

The judge is :mod:`.corner_elements`: outlines, unilateral contact of flanks and
corners, contacts that stiffen with the load they carry. Moving, its forces of each pair
over phase and deflection are tabled, and one degree of freedom is marched by Runge and
Kutta's method until it repeats. The mesh frequency is 0.6 of the natural one, the
damping ratio 0.07; nothing of the package is in it. :mod:`.defaults_table` prints the
table.
"""

import time
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from corner_elements import OPTIONS, PAIRS, load_corners, meetings

from wearlab.assembly.mesh import build_analyses
from wearlab.assembly.sets import PairOfSet
from wearlab.dynamics.forces.mesh_forces import extremes
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.steady.response import deflection_at
from wearlab.dynamics.system import System
from wearlab.mesh.clock import Mesh, locate_within_steps, sampling
from wearlab.mesh.contact import ContactAnalysis
from wearlab.mesh.excitation import MeshFlanks, stage_tables
from wearlab.mesh.force import Dashpot, Deflections, flank_forces
from wearlab.mesh.harmonics import mesh_error
from wearlab.mesh.profile import lookup
from wearlab.mesh.stages import stage_grid
from wearlab.scene import Scene

Array = np.ndarray[Any, np.dtype[np.float64]]

WAYS: dict[str, dict[str, Any]] = {
    "tip corners (default)": {"extended_contact": True},
    "tip corners, exact contact": {"extended_contact": True, "contact": "exact"},
    "jump at A and E": {"extended_contact": False},
}
PHASES, DEFLECTIONS, MOST = 97, 48, 3.0
"""Phases and deflections of the judge's table, the latter up to so many static ones."""
TUNED, DAMPED = 0.6, 0.07
STEPS, PERIODS = 600, 40
REFINEMENT = 3


class Judged(NamedTuple):
    """One mesh by elements alone: shares of the pairs (n_phases, n_pairs), and force
    tables.

    ``force`` (n_phases, n_deflections, n_pairs) [N] over ``phase`` and ``deflection``
    [m].
    """

    phase: Array
    share: Array
    deflection: Array
    force: Array


class Moving(NamedTuple):
    """A steady response: the largest mesh force, and the force of the pair that enters
    at A [N].
    """

    largest: float
    entering: float


def judged(one: PairOfSet) -> Judged:
    """Return what elements alone say of a mesh."""
    options = OPTIONS._replace(refinement=REFINEMENT)
    phase = np.linspace(0.0, 1.0, PHASES)
    known = load_corners(one.pair, one.load, phase, options)
    _, each = meetings(one.pair, phase, options)
    deflection = np.linspace(0.0, MOST * known.deflection.max(), DEFLECTIONS)
    force = np.zeros((PHASES, DEFLECTIONS, len(PAIRS)))
    for i, meeting in enumerate(each):
        guess = known.force[i, meeting.number]
        for k in range(1, DEFLECTIONS):
            guess = meeting.forces(
                float(deflection[k]) / one.pair.driving.base_radius, guess
            )
            arm = (
                np.array([touch.arm[0] for touch in meeting.touches])
                / one.pair.driving.base_radius
            )
            force[i, k, meeting.number] = arm * guess
    return Judged(phase, known.force / one.load, deflection, force)


class Mover(NamedTuple):
    """One degree of freedom that the mesh moves: mass [kg], damping
    [N s/m], mesh period [s].
    """

    mass: float
    damping: float
    period: float


def mover(stiffness: float, tuned: float = TUNED) -> Mover:
    """Return a unit mass on the mean stiffness, excited at a share of
    its natural frequency.
    """
    natural = np.sqrt(stiffness)
    return Mover(1.0, 2.0 * DAMPED * natural, 2.0 * np.pi / (tuned * natural))


def judged_moving(judge: Judged, load: float, stiffness: float, moved: Mover) -> Moving:
    """March one degree of freedom on the tabled forces until it repeats."""
    damping = moved.damping
    period = moved.period
    total = judge.force.sum(axis=2)
    spacing = judge.deflection[1]

    def value(table: Array, phase: float, x: float) -> float:
        i = phase * (PHASES - 1)
        k = x / spacing
        if k <= 0.0:
            return 0.0
        a = min(int(i), PHASES - 2)
        b = min(int(k), DEFLECTIONS - 2)
        u = i - a
        v = k - b
        return float(
            (1 - u) * ((1 - v) * table[a, b] + v * table[a, b + 1])
            + u * ((1 - v) * table[a + 1, b] + v * table[a + 1, b + 1])
        )

    def rate(phase: float, x: float, v: float) -> tuple[float, float]:
        force = value(total, phase, x)
        return v, (load - force - (damping * v if force > 0.0 else 0.0)) / moved.mass

    h = period / STEPS
    x = load / stiffness
    v = 0.0
    largest, entering = 0.0, 0.0
    for count in range(PERIODS * STEPS):
        at = count % STEPS / STEPS
        half = at + 0.5 / STEPS
        end = at + 1.0 / STEPS
        if count >= (PERIODS - 1) * STEPS:
            largest = max(largest, value(total, at, x))
            entering = (
                value(judge.force[..., PAIRS.index(0)], 0.0, x)
                if at == 0.0
                else entering
            )
        a1, b1 = rate(at, x, v)
        a2, b2 = rate(half, x + 0.5 * h * a1, v + 0.5 * h * b1)
        a3, b3 = rate(half, x + 0.5 * h * a2, v + 0.5 * h * b2)
        a4, b4 = rate(end, x + h * a3, v + h * b3)
        x = x + h * (a1 + 2 * a2 + 2 * a3 + a4) / 6
        v = v + h * (b1 + 2 * b2 + 2 * b3 + b4) / 6
    return Moving(largest, entering)


def shares(analysis: ContactAnalysis, phase: Array) -> Array:
    """Return the share of each of the judge's pairs in the static
    load, (n_phases, n_pairs) [1].
    """
    grid = analysis.grid
    segment = np.clip(
        np.searchsorted(grid.breaks, phase, side="right") - 1,
        0,
        len(grid.intervals) - 1,
    )
    nodes = analysis.nodes(np.zeros((2, len(grid.position))))
    state = analysis.quasistatic(nodes, lookup(grid, phase, segment))
    found = np.zeros((len(phase), len(PAIRS)))
    for slot, number in enumerate(grid.pair_numbers):
        found[:, PAIRS.index(int(number))] = state.force[:, slot] / analysis.load
    return found


def moving(analysis: ContactAnalysis, moved: Mover) -> Moving:
    """Return the steady response of one degree of freedom by the package."""
    grid = analysis.grid
    mass = np.array([moved.mass])
    touching = MeshFlanks(
        analysis, analysis.nodes(np.zeros((2, len(grid.position)))), None
    )
    mesh = Mesh(0, 0.0, mesh_error(()))
    steps = stage_grid(grid.breaks[:-1], STEPS)
    tables = stage_tables(
        [touching], sampling([grid], (mesh,), grid.breaks, steps), None
    )
    none = np.zeros((1, 1))
    one = np.eye(1)
    damping = np.array([moved.damping])
    load = np.array([analysis.load])
    system = System(
        ("mesh.x",), mass[:, None], none, none, one, load, damping, False, mass
    )
    response = Periodic().solve(system, tables, moved.period, None)
    delta = deflection_at(response, steps, np.zeros(1))[0][0, 0]
    where = locate_within_steps(grid, [0.0], np.zeros((1, 1)), np.array([1e-6]))
    pair = flank_forces(
        touching, where, Deflections(delta, 0.0 * delta), Dashpot(0.0), 1.0
    ).pair
    return Moving(
        float(extremes(response).largest[0]),
        float(pair[0, list(grid.pair_numbers).index(0)]),
    )


class Onset(NamedTuple):
    """One way in on one mesh.

    Parameters
    ----------
    way : its name
    share : largest error of the share of a pair in the static load [1]
    largest, entering : errors of the largest mesh force and of the force of the pair
        that enters, moving [1]
    seconds : that a contact analysis takes [s]
    """

    way: str
    share: float
    largest: float
    entering: float
    seconds: float


def of_mesh(scene: Scene, one: PairOfSet) -> Iterator[Onset]:
    """Judge every way in on one mesh."""
    section = (
        f"mesh.{one.section}."
        if one.section and scene.mesh.sun_planet is not None
        else "mesh."
    )
    plain = scene.replace(f"{section}stiffness", "finite-element")
    judge = judged(one)
    analyses = {}
    for name, asked in WAYS.items():
        case = plain
        for key, value in asked.items():
            case = case.replace(f"{section}{key}", value)
        analyses[name] = build_analyses(case, [one])[0]
    default = analyses["tip corners (default)"]
    nodes = default.nodes(np.zeros((2, len(default.grid.position))))
    stiffness = float(
        default.grid.phase_nodes[1]
        @ default.quasistatic(nodes, default.at_nodes).tangent
    )
    truth = judged_moving(judge, one.load, stiffness, mover(stiffness))
    for name, analysis in analyses.items():
        unworn = np.zeros((2, len(analysis.grid.position)))
        analysis.quasistatic(analysis.nodes(unworn), analysis.at_nodes)
        begun = time.process_time()
        for _ in range(5):
            analysis.quasistatic(analysis.nodes(unworn), analysis.at_nodes)
        cost = (time.process_time() - begun) / 5
        static = float(
            np.abs(shares(analysis, judge.phase[:-1]) - judge.share[:-1]).max()
        )
        own = moving(analysis, mover(stiffness))
        yield Onset(
            name,
            static,
            own.largest / truth.largest - 1.0,
            own.entering / truth.entering - 1.0,
            cost,
        )
