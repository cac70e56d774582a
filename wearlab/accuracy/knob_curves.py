"""Work–precision curves of knobs that change the model.

The answer at the finest setting of a knob is its reference.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from wearlab.accuracy.ladder import Rung, WorkPrecision, measured_rungs, timing
from wearlab.accuracy.reference import Reference, tight_steps
from wearlab.accuracy.steady import Steady, relative_error, steady
from wearlab.arrays import Array
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.steady.response import Response
from wearlab.scene import Scene, mesh

PROFILE_POINTS = (25, 51, 101, 201, 401, 801, 1601)
FINEST_POINTS = 3201
PHASE_POINTS = (8, 16, 32, 64, 128, 256, 512)
FINEST_PHASES = 8192
HARMONICS = (1, 2, 3, 5, 8, 12, 20, 40)
MAX_HARMONICS = 160
TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
STEPS_ERROR = 2.5e-8
"""Relative error of the steps while other knobs are turned."""


class Solution(NamedTuple):
    """The steady state of a scene at its own settings.

    Parameters
    ----------
    problem : the steady state as a problem
    force : (n_periods, n_mesh · n_phases) elastic mesh forces [N]
    response : of the dynamics
    """

    problem: Steady
    force: Array
    response: Response


def knob_curves(
    problem: Steady, report: Callable[[str], None]
) -> Iterator[WorkPrecision]:
    """Yield the curves of profile points, tolerance and harmonics.

    Harmonics are only those of an excitation by Fourier series.

    Parameters
    ----------
    problem : steady state of the scene
    report : called with the name of the curve that comes next
    """
    report("profile_points")
    scene = problem.scene
    steps = tight_steps(problem, STEPS_ERROR)
    fine = scene.replace("numerics.steps_per_period", steps)
    truth = _solved(fine.replace("numerics.profile_points", FINEST_POINTS)).force
    yield _knob(fine, "numerics.profile_points", PROFILE_POINTS, truth)

    report("tolerance")
    yield _knob(scene, "numerics.tolerance", TOLERANCES, truth)

    section = scene.gears.descriptor.sections[0]
    if scene.mesh.of(section).excitation.chosen == "fourier":
        report("harmonics")
        yield _harmonics_curve(fine)


def _harmonics_curve(scene: Scene) -> WorkPrecision:
    """Return the curve over the harmonics of stiffness and errors."""
    truth = _solved(with_harmonics(scene, MAX_HARMONICS)).force

    def rung_of(count: int) -> Rung:
        return _knob_rung(with_harmonics(scene, count), count, truth)

    return WorkPrecision(
        "harmonics",
        "stiffness_harmonics",
        "mesh_force",
        "wearlab",
        measured_rungs(HARMONICS, rung_of),
        "error_harmonics alike",
    )


def with_harmonics(scene: Scene, count: int) -> Scene:
    """Return the scene with a number of harmonics of all meshes.

    Parameters
    ----------
    scene : which may write them under ``mesh`` or under each kind of mesh
    count : harmonics of stiffness and of errors
    """
    excitation = {"stiffness_harmonics": count, "error_harmonics": count}
    changes = {"excitation": excitation}
    sections = [
        name for name in mesh.OWN_MESHES if getattr(scene.mesh, name) is not None
    ]
    if sections:
        return scene.replace("mesh", dict.fromkeys(sections, changes))
    return scene.replace("mesh", changes)


def _knob(
    scene: Scene, key: str, values: tuple[float, ...], truth: Array
) -> WorkPrecision:
    """Return the curve of the values of a key."""

    def rung_of(value: float) -> Rung:
        return _knob_rung(scene.replace(key, value), value, truth)

    name = key.rpartition(".")[2]
    rungs = measured_rungs(values, rung_of)
    return WorkPrecision(name, name, "mesh_force", "wearlab", rungs)


def _knob_rung(scene: Scene, setting: float, truth: Array) -> Rung:
    """Return the rung of a scene: error of its steady state, time of a wear state."""
    solution = _solved(scene)
    coupling = solution.problem.parts.coupling
    wear = coupling.unworn()
    return Rung(
        setting,
        error=relative_error(solution.force, truth),
        seconds=timing(lambda: coupling.evaluate(wear)),
        work=solution.response.counts.right_hand_sides,
    )


def _solved(scene: Scene) -> Solution:
    """Return the steady state of a scene at its own settings."""
    problem = steady(scene)
    response = problem.solve(problem.vibration)
    force = problem.force_of(problem.vibration, response)
    return Solution(problem, force, response)


def phase_points_curve(problem: Steady, answer: Reference) -> WorkPrecision:
    """Return the error of the dynamic factor over the number of stored phases.

    Parameters
    ----------
    problem, answer : the scene and its answer
    """
    response = answer.response
    vibration = problem.with_steps(tight_steps(problem), Periodic())

    def largest_force(points: int) -> float:
        phase = np.arange(points) / points
        return float(problem.force_of(vibration, response, phase).max())

    truth = largest_force(FINEST_PHASES)

    def rung_of(points: int) -> Rung:
        error = abs(largest_force(points) / truth - 1.0)
        return Rung(points, error, timing(lambda: largest_force(points)), points)

    rungs = measured_rungs(PHASE_POINTS, rung_of)
    return WorkPrecision(
        "phase_points", "phase_points", "dynamic_factor", "wearlab", rungs
    )
