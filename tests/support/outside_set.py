"""W23's planetary set in motion, written out: nothing of wearlab but tables of its
contact.

Mass, springs, dashpots, directions and lags of the meshes are W23's, Eqs. 1–14 with the
misprints mended. Pairs that share a gear body push as an active set, ``N_p = max(0, F_p
+ c (k̃_p/Σ k̃) ẋ_p)``; Runge–Kutta steps do not look for the instants at which contact
changes.
"""

from itertools import pairwise
from typing import Any, NamedTuple

import numba
import numpy as np

from wearlab.mesh.profile import lookup
from wearlab.scene import Scene

PLANETS = 3
AT_REST = np.zeros((PLANETS, 2))
"""Pins where they belong [m]."""


class Train(NamedTuple):
    """The set: 18 coordinates (x, y, u) of sun, ring, carrier and planets.

    Meshes sun–planet, planet–ring.
    """

    inverse: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    direction: np.ndarray
    load: np.ndarray
    dashpot: np.ndarray
    backlash: np.ndarray


class Meshes(NamedTuple):
    """Pairs at start, middle and end of the steps of a mesh period.

    Absent ones have no compliance.
    """

    width: np.ndarray
    compliance: np.ndarray
    gap: np.ndarray
    gap_rate: np.ndarray


def geometry(scene: Scene) -> dict[str, Any]:
    """Return teeth, base radii [m] and operating pressure angles
    [rad] from module and centre distance.
    """
    gears = scene.gears
    teeth = {
        name: int(getattr(gears, name).teeth) for name in ("sun", "planet", "ring")
    }
    radius = {
        name: 0.5 * gears.module * z * np.cos(gears.pressure_angle)
        for name, z in teeth.items()
    }
    pins = 0.5 * gears.carrier.pin_circle_diameter
    sums = (radius["sun"] + radius["planet"], radius["ring"] - radius["planet"])
    return {
        "teeth": teeth,
        "radius": radius | {"carrier": pins},
        "angle": [np.arccos(r / pins) for r in sums],
    }


def train(scene: Scene, dashpot: list[float], pins: np.ndarray = AT_REST) -> Train:
    """Return the set from masses, supports and the torque on the sun.

    ``pins``: (n, 2) by how much the axes of the planets are off [m]. A displaced pin
    pushes its planet by ``K p``, and the carrier back.
    """
    of = geometry(scene)
    gears = scene.gears
    held = scene.dynamics.supports
    members = ["sun", "ring", "carrier", *["planet"] * PLANETS]
    heavy = {m: getattr(gears, m).mass for m in set(members)}
    turning = {
        m: getattr(gears, m).inertia / of["radius"][m] ** 2 for m in set(members)
    }
    mass = np.array(
        [value for m in members for value in (heavy[m], heavy[m], turning[m])]
    )
    k, c = np.zeros((2, 18, 18))

    def spring(row: np.ndarray, stiffness: float, ratio: float, weight: float) -> None:
        k[:] += stiffness * np.outer(row, row)
        c[:] += 2.0 * ratio * np.sqrt(stiffness * weight) * np.outer(row, row)

    unit = np.eye(18)
    force = scene.operation.torque / of["radius"]["sun"] * unit[2]
    direction = np.zeros((6, 18))
    for at, m in enumerate(("sun", "ring", "carrier")):
        own = getattr(held, m)
        for axis in (0, 1):
            spring(
                unit[3 * at + axis], own.radial_stiffness, own.damping_ratio, heavy[m]
            )
        if own.tangential_stiffness:
            spring(
                unit[3 * at + 2],
                own.tangential_stiffness,
                own.damping_ratio,
                turning[m],
            )
    for n in range(PLANETS):
        psi = 2.0 * np.pi * n / PLANETS
        own = 9 + 3 * n
        for axis, arm in ((0, -np.sin(psi)), (1, np.cos(psi))):
            row = unit[6 + axis] - unit[own + axis] + arm * unit[8]
            spring(
                row,
                held.planet.radial_stiffness,
                held.planet.damping_ratio,
                heavy["planet"],
            )
            force = force - held.planet.radial_stiffness * pins[n, axis] * row
        for kind, (other, angle, turns) in enumerate(
            ((0, -of["angle"][0], 1.0), (3, of["angle"][1], -1.0))
        ):
            row = direction[PLANETS * kind + n]
            push = np.array([-np.sin(psi + angle), np.cos(psi + angle)])
            row[other : other + 2] = push
            row[own : own + 2] = -push
            row[other + 2], row[own + 2] = 1.0, turns
    speed = (
        scene.operation.speed
        * of["teeth"]["sun"]
        / (of["teeth"]["sun"] + of["teeth"]["ring"])
    )
    for at in range(6):  # the carrier's frame turns
        x = 3 * at
        y = 3 * at + 1
        c[x, y] -= 2.0 * speed * mass[x]
        c[y, x] += 2.0 * speed * mass[x]
        k[x, x] -= speed**2 * mass[x]
        k[y, y] -= speed**2 * mass[x]
    backlash = np.full(6, scene.mesh.normal_backlash)
    return Train(
        1.0 / mass, k, c, direction, force, np.repeat(dashpot, PLANETS), backlash
    )


def lags(scene: Scene, between: float) -> np.ndarray:
    """Return by what phase each mesh lags the first, (6,).

    ``between``: the first of the ring's.
    """
    teeth = geometry(scene)["teeth"]
    place = np.arange(PLANETS) / PLANETS
    return np.concatenate([teeth["sun"] * place, between - teeth["ring"] * place]) % 1.0


def pins_of(scene: Scene, errors: np.ndarray) -> np.ndarray:
    """Return where pins are off, (n, 2) [m], from what both meshes of each make of it.

    ``errors``: (2 n,) of the meshes, sun–planet first [m]: ``e = n·p``, n the normal.
    """
    direction = train(scene, [0.0, 0.0]).direction
    pins = []
    for n in range(PLANETS):
        own = slice(9 + 3 * n, 11 + 3 * n)
        normals = -direction[[n, PLANETS + n], own]
        pins.append(np.linalg.solve(normals, errors[[n, PLANETS + n]]))
    return np.array(pins)


def meshes(
    coupling: Any,
    wear: Any,
    lag: np.ndarray,
    steps: int,
    kind_of: np.ndarray,
    felt: Any = None,
) -> Meshes:
    """Return the pairs of all meshes: the tables that are shared.

    ``kind_of``: kind of every mesh; ``felt``: the wear that the meshes feel, None: as
    under the load of unworn flanks.
    """
    grids = [kind.analysis.grid for kind in coupling.kinds]
    cuts = [
        (grids[kind].breaks + late) % 1.0
        for kind, late in zip(kind_of, lag, strict=True)
    ]
    edges = np.unique(np.round(np.concatenate([[0.0, 1.0], *cuts]), 12))
    inside = [
        np.linspace(a, b, 1 + int(np.ceil(steps * (b - a)))) for a, b in pairwise(edges)
    ]
    start = np.concatenate([x[:-1] for x in inside])
    end = np.concatenate([x[1:] for x in inside])
    phase = np.stack([start, 0.5 * (start + end), end], axis=1)
    count = max(grid.n_pairs for grid in grids)
    gap = np.full((len(start), 3, len(lag), count), np.inf)
    compliance = np.full((*gap.shape, count), np.inf)
    of_kinds = list(coupling.flanks(wear, felt=felt))
    for m, kind in enumerate(kind_of):
        flanks = of_kinds[kind]
        grid = flanks.analysis.grid
        turns = np.floor(phase[:, 1] - lag[m])[:, None]
        own = phase - lag[m] - turns
        segment = np.searchsorted(grid.breaks, own[:, 1], side="right") - 1
        alone, apart, cross = flanks.analysis.at(
            flanks.nodes, lookup(grid, own, np.repeat(segment, 3))
        )
        shape = (len(start), 3, grid.n_pairs)
        gap[:, :, m, : grid.n_pairs] = apart.reshape(shape)
        for p in range(grid.n_pairs):
            compliance[:, :, m, p, p] = alone[:, p].reshape(shape[:2])
            for q in range(p):
                shared = cross[p - 1 - q, :, p].reshape(shape[:2])
                compliance[:, :, m, p, q] = compliance[:, :, m, q, p] = shared
    first, middle, last = np.moveaxis(np.where(np.isfinite(gap), gap, 0.0), 1, 0)
    slope = [
        4.0 * middle - 3.0 * first - last,
        last - first,
        first - 4.0 * middle + 3.0 * last,
    ]
    return Meshes(
        end - start,
        compliance,
        gap,
        np.stack(slope, axis=1) / (end - start)[:, None, None, None],
    )


@numba.njit(cache=True)
def shared_force(c: Any, x: Any, active: Any, work: Any, found: Any) -> None:
    """Fill ``found`` (n_pairs, 2) with forces and slopes, ``C F = x``
    of the pairs that push.
    """
    count = len(x)
    for p in range(count):
        active[p] = x[p] > 0.0 and x[p] < np.inf
    while True:
        worst = -1
        least = 0.0
        for i in range(
            count
        ):  # rows of pairs that are out say that their force is none
            for j in range(count):
                alone = 1.0 if i == j else 0.0
                work[i, j] = c[i, j] if active[i] and active[j] else alone
            found[i, 0], found[i, 1] = (x[i], 1.0) if active[i] else (0.0, 0.0)
        for i in range(count):
            for k in range(i + 1, count):
                factor = work[k, i] / work[i, i]
                for j in range(i, count):
                    work[k, j] -= factor * work[i, j]
                for j in range(2):
                    found[k, j] -= factor * found[i, j]
        for i in range(count - 1, -1, -1):
            for j in range(2):
                for k in range(i + 1, count):
                    found[i, j] -= work[i, k] * found[k, j]
                found[i, j] /= work[i, i]
            if found[i, 0] < least:
                worst = i
                least = found[i, 0]
        if worst < 0:
            return
        active[worst] = False


@numba.njit(cache=True)
def rate(
    set_: Any,
    m: Any,
    step: int,
    stage: int,
    frequency: float,
    state: Any,
    s: Any,
    out: Any,
) -> None:
    """Fill ``out`` with d(q, q̇)/dt.

    ``s.force`` (n_mesh, n_pairs + 1): of pairs, last elastic of the mesh.
    """
    pairs = m.gap.shape[3]
    for row in range(18):
        total = set_.load[row]
        for col in range(18):
            total -= (
                set_.stiffness[row, col] * state[col]
                + set_.damping[row, col] * state[18 + col]
            )
        out[row] = state[18 + row]
        out[18 + row] = total
    for i in range(m.gap.shape[2]):
        delta, speed = 0.0, 0.0
        for row in range(18):
            delta += set_.direction[i, row] * state[row]
            speed += set_.direction[i, row] * state[18 + row]
        c = set_.dashpot[i]
        for p in range(pairs):
            s.x[p] = delta - m.gap[step, stage, i, p]
        shared_force(m.compliance[step, stage, i], s.x, s.active, s.work, s.found)
        slope = s.found[:, 1].sum()
        normal = 0.0
        s.force[i, pairs] = s.found[:, 0].sum()
        for p in range(pairs):
            push = s.found[p, 0]
            s.force[i, p] = 0.0
            if push > 0.0:
                approach = speed - m.gap_rate[step, stage, i, p] * frequency
                s.force[i, p] = max(0.0, push + c * s.found[p, 1] / slope * approach)
                normal += s.force[i, p]
        back = -set_.backlash[i] - delta
        if back > 0.0:
            for p in range(pairs):
                s.x[p] = 1.0 if m.gap[step, stage, i, p] < np.inf else 0.0
            shared_force(m.compliance[step, stage, i], s.x, s.active, s.work, s.found)
            stiffness = s.found[:, 1].sum()
            normal -= max(0.0, stiffness * back - c * speed)
            s.force[i, pairs] -= stiffness * back
        for row in range(18):
            out[18 + row] -= normal * set_.direction[i, row]
    for row in range(18):
        out[18 + row] *= set_.inverse[row]


class Scratch(NamedTuple):
    """Memory of a march."""

    x: np.ndarray
    active: np.ndarray
    work: np.ndarray
    found: np.ndarray
    force: np.ndarray
    slopes: np.ndarray
    between: np.ndarray


@numba.njit(cache=True)
def march(
    set_: Any,
    m: Any,
    period: float,
    state: Any,
    s: Any,
    sums: Any,
    extremes: Any,
    reads: bool,
) -> None:
    """Advance the state by a mesh period by Kutta's method.

    Where it reads, add forces at the ends of steps.

    ``sums``: (n_steps, 2, n_mesh, n_pairs) of normal forces; ``extremes``: (2, n_mesh)
    of the elastic force
    """
    pairs = m.gap.shape[3]
    frequency = 1.0 / period
    k = s.slopes
    for step in range(len(m.width)):
        h = m.width[step] * period
        for stage, at, share in ((0, 0, 0.5), (1, 1, 0.5), (2, 1, 1.0), (3, 2, 0.0)):
            if stage == 0:
                s.between[:] = state
            rate(set_, m, step, at, frequency, s.between, s, k[stage])
            if reads and stage == 0:
                sums[step, 0] += s.force[:, :pairs]
                for i in range(len(s.force)):
                    extremes[0, i] = min(extremes[0, i], s.force[i, pairs])
                    extremes[1, i] = max(extremes[1, i], s.force[i, pairs])
            for row in range(36):
                s.between[row] = state[row] + share * h * k[stage, row]
        for row in range(36):
            state[row] += (
                h / 6.0 * (k[0, row] + 2.0 * (k[1, row] + k[2, row]) + k[3, row])
            )
        if reads:
            rate(set_, m, step, 2, frequency, state, s, k[0])
            sums[step, 1] += s.force[:, :pairs]
