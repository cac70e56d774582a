"""An outside march of W23's planetary set: lives and forces without the dynamics and
the lives of wearlab.

    python tests/benchmarks/outside_march.py --torque 90 134 150 --forces 134

The equations of motion and the forces are those of ``tests/support/outside_set.py``;
sliding, Archard's law and its integration over the cycles are written out below. A
motion is marched until it repeats, and averaged where it does not; wear takes midpoint
steps. Shared are tables alone: compliances and gaps of worn flanks over the phase, the
damping of a mesh, by what phase the ring's meshes lag the sun's, and the matrices that
spread and level wear inside contact patches of one width each. With
``--patch following`` the widths are those of the forces of every step
(``tests/support/outside_patch.py``).
"""

import argparse
import sys
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import expm

from wearlab.assembly import build
from wearlab.campaign import load
from wearlab.scene import Scene
from wearlab.simulation import simulate

sys.path[:0] = [str(Path(__file__).parents[1] / "support")]
from outside_patch import outside_patch  # noqa: E402
from outside_set import (  # noqa: E402
    PLANETS,
    Scratch,
    geometry,
    lags,
    march,
    meshes,
    pins_of,
    train,
)

CAMPAIGN = Path(__file__).parents[2] / "campaigns/planetary_torque.toml"
ROUNDS = 3
"""How often a state by itself is marched, felt as wide as the round before loads it."""
COEFFICIENT = 2.85e-16
"""k of every life, nearly that of the campaign [m²/N]."""
REPEATS, PATIENCE, AVERAGED = 5e-6, 300, 96
"""Change of the state over a period that is none; periods waited for it; periods
averaged without."""


class Motion(NamedTuple):
    """Where a march ends: state, widths of the steps (n_steps,) in mesh periods, mean
    normal forces (n_steps, 2, n_mesh, n_pairs), extremes, periods read.
    """

    state: np.ndarray
    width: np.ndarray
    normal: np.ndarray
    extremes: np.ndarray
    periods: int


class Outside:
    """The set of a scene, marched.

    Parameters
    ----------
    scene : W23's set
    steps : Runge–Kutta steps of a mesh period, at least
    """

    def __init__(self, scene: Scene, steps: int) -> None:
        parts = build(scene)
        self.scene = scene
        self.steps = steps
        self.coupling = parts.coupling
        system = parts.vibration.system
        sampling = parts.vibration.sampling
        self.kind_of = np.array([mesh.kind for mesh in sampling.meshes])
        errors = [float(mesh.error.slow.value(0.0)) for mesh in sampling.meshes]
        self.pins = pins_of(scene, np.array(errors))
        self.train = train(
            scene, [system.mesh_damping[0], system.mesh_damping[PLANETS]], self.pins
        )
        self.lag = lags(scene, sampling.meshes[PLANETS].lag)
        teeth = geometry(scene)["teeth"]
        relative = (
            scene.operation.speed * teeth["ring"] / (teeth["sun"] + teeth["ring"])
        )
        self.period = 2.0 * np.pi / (teeth["sun"] * relative)
        self.forces: list[np.ndarray] | None = None
        self.state = np.zeros(36)
        self.state[:18] = np.linalg.lstsq(
            self.train.stiffness + 3e8 * self.train.direction.T @ self.train.direction,
            self.train.load,
        )[0]

    def side_of(self, kind: int) -> int:
        """Return 0 for a kind of mesh with the sun, 1 for one with the ring."""
        return int(np.flatnonzero(self.kind_of == kind)[0]) // PLANETS

    def felt(self, wear: Any) -> Any:
        """Return the wear that the meshes feel, by the forces of the step before."""
        if self.forces is None:
            return tuple(
                kind.felt(depth)
                for kind, depth in zip(self.coupling.kinds, wear, strict=True)
            )
        felt = []
        kinds = zip(self.coupling.kinds, wear, self.forces, strict=True)
        for kind, depth, force in kinds:
            averaging = outside_patch(kind, force).averaging
            felt.append((averaging @ depth.ravel()).reshape(depth.shape))
        return tuple(felt)

    def steady(self, wear: Any) -> Motion:
        """March until the motion repeats, else average.

        The next march starts where this one ends.
        """
        felt = self.felt(wear)
        m = meshes(self.coupling, wear, self.lag, self.steps, self.kind_of, felt)
        normal = np.zeros((len(m.width), 2, *m.gap.shape[2:]))
        extremes = np.zeros((2, 6))
        extremes[0] = np.inf
        extremes[1] = -np.inf
        count = m.gap.shape[3]
        scratch = Scratch(
            *(
                np.zeros(shape)
                for shape in (count, count, (count, count), (count, 2), (6, count + 1))
            ),
            *(np.zeros(shape) for shape in ((4, 36), 36)),
        )
        state = self.state.copy()
        repeats = False
        for _ in range(PATIENCE):
            before = state.copy()
            march(self.train, m, self.period, state, scratch, normal, extremes, False)
            size = np.r_[
                np.full(18, np.abs(state[:18]).max()),
                np.full(18, np.abs(state[18:]).max()),
            ]
            repeats = bool((np.abs(state - before) < REPEATS * size).all())
            if repeats:
                break
        periods = 1 if repeats else AVERAGED
        for _ in range(periods):
            march(self.train, m, self.period, state, scratch, normal, extremes, True)
        self.state = state
        return Motion(state, m.width, normal / periods, extremes, periods)

    def tooth_forces(self, motion: Motion) -> list[np.ndarray]:
        """Return the mean force on a pair at the nodes of each kind
        of flank, (n,) each [N].
        """
        width = motion.width
        start = np.concatenate([[0.0], np.cumsum(width)[:-1]])
        self.forces = []
        for kind, physics in enumerate(self.coupling.kinds):
            grid = physics.analysis.grid
            found = []
            for mesh in np.flatnonzero(self.kind_of == kind):
                nodes = np.zeros(len(grid.contact_position))
                own = (start + 0.5 * width - self.lag[mesh]) % 1.0 - 0.5 * width
                segment = (
                    np.searchsorted(grid.breaks, own + 0.5 * width, side="right") - 1
                )
                for s, count in enumerate(grid.intervals):
                    inside = np.flatnonzero(segment == s)
                    inside = inside[np.argsort(own[inside])]
                    phase = np.stack(
                        [own[inside], own[inside] + width[inside]], axis=1
                    ).ravel()
                    at = np.linspace(grid.breaks[s], grid.breaks[s + 1], count + 1)
                    for p in np.flatnonzero(grid.first[s] >= 0):
                        force = np.interp(
                            at, phase, motion.normal[inside, :, mesh, p].ravel()
                        )
                        nodes[grid.first[s, p] : grid.first[s, p] + count + 1] = force
                found.append(nodes[grid.on_flank])
            self.forces.append(np.mean(found, axis=0))
        return self.forces

    def pointwise(self, forces: list[np.ndarray]) -> list[np.ndarray]:
        """Return Archard's law of both kinds, ``k (F/B) |1 − v_other/v_own|`` times
        passes, (2, n) each.
        """
        of = geometry(self.scene)
        k = float(self.scene.wear.coefficient.value)
        z = of["teeth"]
        r = of["radius"]
        passes = (PLANETS, z["sun"] / z["planet"], PLANETS * z["sun"] / z["ring"])
        found = []
        sides = (("sun", "planet", -1.0), ("planet", "ring", 1.0))
        for kind, physics in enumerate(self.coupling.kinds):
            side = self.side_of(kind)
            one, two, sense = sides[side]
            s = physics.analysis.grid.position
            arms = (
                np.tan(of["angle"][side]) * np.array([[r[one]], [r[two]]])
                + np.array([[1.0], [sense]]) * s
            )
            speeds = arms / np.array([[z[one]], [z[two]]])
            slides = (
                np.abs(1.0 - speeds[::-1] / speeds)
                * np.array(passes[side : side + 2])[:, None]
            )
            found.append(k * forces[kind] / self.scene.gears.face_width * slides)
        return found

    def grown(
        self, wear: Any, forces: list[np.ndarray], cycles: float
    ) -> list[np.ndarray]:
        """Return the wear some cycles later while forces stay: ``h' = S r + D h``
        exactly, nowhere less. Sun and ring meet all planets in turn: theirs is the mean
        of what their meshes do.
        """
        found = [np.array(depth) for depth in wear]
        fed = self.pointwise(forces)
        for side in (0, 1):
            kinds = [k for k in range(len(found)) if self.side_of(k) == side]
            count = found[kinds[0]].shape[1]
            met_by_all = slice(side * count, (side + 1) * count)
            own = slice((1 - side) * count, (2 - side) * count)
            size = (1 + len(kinds)) * count
            whole = np.zeros((size + 1, size + 1))
            shared = slice(0, count)
            for place, k in enumerate(kinds, start=1):
                patch = outside_patch(self.coupling.kinds[k], forces[k])
                levels = patch.levels
                added = patch.spreading @ fed[k].ravel() + levels @ found[k].ravel()
                mine = slice(place * count, (place + 1) * count)
                whole[shared, shared] += levels[met_by_all, met_by_all] / len(kinds)
                whole[shared, mine] += levels[met_by_all, own] / len(kinds)
                whole[shared, size] += added[met_by_all] / len(kinds)
                whole[mine, shared] = levels[own, met_by_all]
                whole[mine, mine] = levels[own, own]
                whole[mine, size] = added[own]
            gain = np.maximum(0.0, expm(cycles * whole)[:size, size])
            for place, k in enumerate(kinds, start=1):
                found[k][side] += gain[shared]
                found[k][1 - side] += gain[place * count : (place + 1) * count]
        return found

    def life(
        self, depth: float, longest: float
    ) -> tuple[float, list[tuple[float, float, Motion]]]:
        """Return the cycles until the sun is so deep, and (depth, cycle, motion) of
        every step.

        ``longest``: wear of a step of the midpoint rule, shorter ones at first [m]
        """
        wear = list(self.coupling.unworn())
        cycle = 0.0
        told = []
        while True:
            motion = self.steady(tuple(wear))
            deep = float(wear[0][0].max())
            told.append((deep, cycle, motion))
            forces = self.tooth_forces(motion)
            fastest = float(self.pointwise(forces)[0][0].max())
            step = min(longest, 0.5e-6 + 0.5 * deep) / fastest
            middle = self.grown(wear, forces, 0.5 * step)
            halfway = self.steady(tuple(middle))
            after = self.grown(wear, self.tooth_forces(halfway), step)
            reached = float(after[0][0].max())
            if reached >= depth:
                return cycle + step * (depth - deep) / (reached - deep), told
            wear = after
            cycle = cycle + step


def scene_at(torque: float, patch: str = "elastic") -> Scene:
    """Return W23's set at 1500 rpm under a torque [N m], with a contact patch."""
    found = next(
        case.scene for case in load(CAMPAIGN).cases if case.scene.dynamics is not None
    )
    coefficient = {"model": "constant", "value": f"{COEFFICIENT} m^2/N"}
    return found.replace(
        {
            "operation.torque": f"{torque} N*m",
            "wear.coefficient": coefficient,
            "wear.contact_patch": patch,
        }
    )


def worn_of(run: Any, like: Any, depth: float) -> tuple[np.ndarray, ...]:
    """Return the wear of a run when its sun is so deep, of both kinds."""
    rows = run.wear_depth.isel(update=update_at(run, depth))
    of = [
        rows.sel(flank=name).dropna("profile").values
        for name in ("sun", "planet-sun", "planet-ring", "ring")
    ]
    return tuple(
        np.stack(of[2 * kind : 2 * kind + 2])[:, : like[kind].shape[1]]
        for kind in range(2)
    )


def update_at(run: Any, depth: float) -> int:
    """Return which update of a run has its sun nearest to a depth [m]."""
    return int(np.argmin(np.abs(run.max_wear_depth.sel(flank="sun").values - depth)))


def told_of_forces(run: Any, outside: Outside, depth: float) -> str:
    """Return the largest elastic force of a sun–planet mesh on the
    profiles of the run, in words.
    """
    own = float(
        run.mesh_force_max.isel(update=update_at(run, depth)).values[:PLANETS].max()
    )
    wear = worn_of(run, outside.coupling.unworn(), depth)
    for _ in range(ROUNDS):
        found = outside.steady(wear)
        outside.tooth_forces(found)
    ours = float(found.extremes[1, :PLANETS].max())
    return (
        f"{depth * 1e6:.0f} um: largest force {ours:.0f} N outside, {own:.0f} N of "
        "the run, "
        f"{ours / own - 1.0:+.2%}; {found.periods} periods read"
    )


def told_of_life(run: Any, outside: Outside, depth: float, longest: float) -> str:
    """Return the life to a depth in words, beside that of the run."""
    began = time.perf_counter()
    own = float(run.life)
    life, told = outside.life(depth, longest)
    averaged = [deep for deep, _, motion in told if motion.periods > 1]
    moves = f", from {min(averaged) * 1e6:.0f} um on" if averaged else ""
    return (
        f"life {life:.5g} outside, {own:.5g} of the run, {life / own - 1.0:+.2%}; "
        "estimate of the run "
        f"{float(run.error_estimate_life) / own:.2%}, "
        f"{str(run.estimate_quality.values)!r}; "
        f"{len(told)} steps, no repeating motion in {len(averaged)}{moves}; "
        f"{time.perf_counter() - began:.0f} s"
    )


def main() -> None:
    """Print lives and largest forces, outside and the run's own."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--torque",
        type=float,
        nargs="*",
        default=[90.0, 134.0, 150.0],
        help="of lives [N m]",
    )
    parser.add_argument(
        "--forces",
        type=float,
        nargs="*",
        default=[134.0],
        help="torques of forces [N m]",
    )
    parser.add_argument(
        "--depth",
        type=float,
        default=400.0,
        help="of the sun at the end of a life [um]",
    )
    parser.add_argument(
        "--step", type=float, default=6.0, help="longest step of wear [um]"
    )
    parser.add_argument("--steps", type=int, default=600, help="of a mesh period")
    parser.add_argument("--patch", default="elastic", choices=["elastic", "following"])
    asked = parser.parse_args()
    depth = asked.depth * 1e-6
    for torque in sorted({*asked.torque, *asked.forces}):
        scene = scene_at(torque, asked.patch).replace(
            "wear.until", {"depth": f"{asked.depth} um", "flank": "sun"}
        )
        run = simulate(scene)
        if torque in asked.forces:
            outside = Outside(scene, asked.steps)
            for worn in (100e-6, depth):
                print(
                    f"{torque:g} N m, {told_of_forces(run, outside, worn)}", flush=True
                )
        if torque in asked.torque:
            told = told_of_life(
                run, Outside(scene, asked.steps), depth, asked.step * 1e-6
            )
            print(f"{torque:g} N m: {told}", flush=True)


if __name__ == "__main__":
    main()
