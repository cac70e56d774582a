"""Estimates of the numerical error of a life over the face: of its steps, and of nodes and slices.

The first and the last state are evaluated once more with half the nodes and half the slices; what the wear
rate changes by there, relative to the fastest, counts for all that was worn.
"""

import time

import numpy as np
from scipy.interpolate import interp1d

from wearlab.arrays import Array
from wearlab.dynamics.forces.extremes import extremes
from wearlab.life import coupled, history
from wearlab.mesh.face.grid import FaceGrid
from wearlab.scene import Scene, build
from wearlab.simulation import estimates, operating, twins

WEIGHT, OF_ENDS = 0.5, 1.5
"""Of the rougher twin's change of rate: a third is what halving a grid of second order leaves. At the ends of
the face of spur gears, and of slices apart, an outermost slice has the gap of its middle: that is of first
order at most, and leaves all of it or more (tests/validation/face_life_estimates.py)."""


BUSY = 0.5
"""Share of the fastest rate from which a node counts: where wear is deepest."""


def rougher(scene: Scene, parts: build.Parts) -> build.Parts:
    """Return the physics of a scene on half the nodes and half the slices."""
    mesh = scene.mesh
    for kind in parts.gears.kinds:
        fewer = {"face_points": max(3, build.face.slices_of(scene, kind) // 2)}
        own = scene.mesh.of(kind.section).model_copy(update=fewer)
        mesh = mesh.model_copy(update={kind.section: own} if kind.section else fewer)
    numerics = scene.numerics.model_copy(update={"profile_points": build.mesh.profile_points(scene) // 2})
    return build.build(scene.model_copy(update={"mesh": mesh, "numerics": numerics}))


def estimated_over_face(
    stage: operating.Stage, lived: history.History, inherited: float = 0.0
) -> estimates.Estimates:
    """Estimate the errors of a life at its kept states.

    Parameters
    ----------
    stage : what runs, in all its conditions
    lived : its history
    inherited : error of the wear that the run starts from [m]
    """
    if lived.life is None:
        return estimates.Estimates(None, None, None)
    clock = time.perf_counter()
    rougher_parts = tuple(rougher(parts.scene, parts) for parts in stage.parts)
    together = operating.taking_turns(rougher_parts, stage.weight)
    ends = [lived.state[0], lived.state[-1]]
    rough = [together.evaluate(_moved(stage.first, rougher_parts[0], state.wear)) for state in ends]
    share = max(
        _apart(stage.first, rougher_parts[0], fine, twin) for fine, twin in zip(ends, rough, strict=True)
    )
    share *= _weight(stage.first)
    force = _forces(lived, rough)
    stage.first.coupling.account.seconds["estimates"] += time.perf_counter() - clock
    steps = np.interp(lived.cycle, lived.life.cycle, lived.life.accumulated_error)
    start = lived.state[0].wear
    worn = np.array(
        [
            max(float((own - before).max()) for own, before in zip(state.wear, start, strict=True))
            for state in lived.state
        ]
    )
    life = None
    if lived.life.worn_out:
        life = lived.life.error_estimate_life + share * float(lived.life.cycle[-1])
    return estimates.Estimates(inherited + steps + share * worn, force, life)


def _weight(parts: build.Parts) -> float:
    """Return what of the change of a rougher twin's rate is an error [1]."""
    assert parts.face is not None
    contacts = [kind.contact for kind in parts.face.kinds]
    apart = any(contact.solid is None and contact.shear_length == 0.0 for contact in contacts)
    return OF_ENDS if apart or not contacts[0].helix.angle else WEIGHT


def _moved(parts: build.Parts, twin: build.Parts, wear: coupled.Wear) -> coupled.Wear:
    """Return the wear of a state at the slices and nodes of the rougher twin, each (2, n_face, n) [m]."""
    return tuple(
        moved(own, fine, rough) for own, fine, rough in zip(wear, _grids(parts), _grids(twin), strict=True)
    )


def _grids(parts: build.Parts) -> list[FaceGrid]:
    assert parts.face is not None
    return [kind.contact.grid for kind in parts.face.kinds]


def _apart(parts: build.Parts, twin: build.Parts, fine: coupled.WearState, rough: coupled.WearState) -> float:
    """Return by how much the rate of the rougher twin differs where wear is fastest, over the fastest [1]."""
    fastest = max(float(rate.max()) for rate in fine.rate)
    if fastest == 0.0:
        return 0.0
    off = [0.0]
    for own, other, grid, its in zip(fine.rate, rough.rate, _grids(parts), _grids(twin), strict=True):
        off += np.abs(moved(other, its, grid) - own)[own >= BUSY * fastest].tolist()
    return max(off) / fastest


def _forces(lived: history.History, rough: list[coupled.WearState]) -> tuple[twins.ForceErrors, ...] | None:
    """Return by how much the largest mesh forces of the rougher twin differ, the larger of both states [N].

    The same for the mesh force at any phase and for bearings, which do not carry more. None without dynamics.
    """
    if not lived.state[0].responses:
        return None
    ends = zip((lived.state[0], lived.state[-1]), rough, strict=True)
    off = max(
        float(np.abs(extremes(fine.responses[0]).largest - extremes(twin.responses[0]).largest).max())
        for fine, twin in ends
    )
    each = np.full(len(lived.state), off)
    return (twins.ForceErrors(each, each, each),)


def moved(values: Array, own: FaceGrid, wanted: FaceGrid) -> Array:
    """Return values at slices and nodes of another grid, linear between them, (2, n_face, n).

    Parameters
    ----------
    values : (2, n_face, n) on the grid ``own``
    own, wanted : grids of one pair
    """
    along = interp1d(
        _apart_at_steps(own), values, axis=2, bounds_error=False, fill_value=(values[..., 0], values[..., -1])
    )(_apart_at_steps(wanted))
    ends = (along[:, 0], along[:, -1])
    across = interp1d(own.position, along, axis=1, bounds_error=False, fill_value=ends)
    return np.asarray(across(wanted.position))


def _apart_at_steps(grid: FaceGrid) -> Array:
    """Return path positions in which the node before a step lies before the one after it, (n,) [m]."""
    position = grid.profile.position
    return position + 1e-9 * (position[-1] - position[0]) * np.arange(len(position))
