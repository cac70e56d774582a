"""How often the search for other attractors finds one where there is one.

``python tests/benchmarks/coexisting_table.py [SCENES] [SEED]`` draws pairs
(:mod:`.drawn_scenes`) with ratios of damping of 0.005 to 0.05 and backlash, from far
below their resonance to twice above it. Which of them have another attractor is found
by brute force: :data:`DENSE` releases at random states, each marched until it has
settled. Prints in how many of these scenes the search finds one, six releases along the
line of action do; then the same of a stiff and hardly damped pair whose damping is
perturbed.
"""

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import drawn_scenes
import numpy as np
from drawn_scenes import external_pair, internal_pair
from numpy.typing import NDArray

from wearlab.assembly import build
from wearlab.campaign import load
from wearlab.dynamics.steady.coexisting import coexisting
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.steady.response import Response
from wearlab.dynamics.steady.shooting import Shooting
from wearlab.gears.specification import GearError
from wearlab.scene import Scene

Array = NDArray[np.float64]
EDGES = Path(__file__).parents[2] / "campaigns" / "extremes" / "benchmark_edges.toml"
STIFF = "stiff, hardly damped"
SCENES, SEED, DENSE = 100, 20261123, 100
SHARE, PERTURBED = 1e-9, 40
"""By how much more the bearings of the stiff pair are damped from one try to the next,
and tries."""
SPEED_RATIO = (0.15, 2.2)
DAMPING = (0.005, 0.05)
BACKLASH = (1e-6, 3e-4)
LARGEST = (0.5, 100.0)
"""Force of a random release over the mean mesh force."""
SIX = (
    (-1.0, True),
    (-2.0, True),
    (-1.0, False),
    (2.0, False),
    (-8.0, True),
    (3.0, True),
)
"""Approach of the flanks over the mean deflection, of all coordinates or of the last
alone."""
APART = 1e-2
"""Distance from the response, over the mean deflection, at which a motion that has
settled is another."""


class Row(NamedTuple):
    """Whether a response has another attractor, and what finds one.

    Parameters
    ----------
    there : brute force or one of the others finds one
    six, search : six releases do, the search does
    """

    there: bool
    six: bool
    search: bool


def steady(scene: Scene) -> tuple[Response, Periodic] | None:
    """Return the response of a pair on which a search is made, None where none is."""
    parts = build(scene)
    vibration = parts.vibration
    state = parts.coupling.evaluate(parts.coupling.unworn())
    if (
        vibration is None
        or state.response is None
        or not isinstance(vibration.method, Periodic)
    ):
        return None
    found = state.response
    return (found, vibration.method) if found.period and found.verdict.unique else None


def drawn(seed: int, number: int) -> tuple[Response, Periodic] | None:
    """Return the response of a pair of a seed, None where there are
    no such gears or nothing repeats.
    """
    rng = np.random.default_rng([seed, number])
    kind = internal_pair if number % 5 == 4 else external_pair
    drawn_scenes.SPEED_RATIO = SPEED_RATIO
    table: dict[str, Any] = kind(rng, ("torsional", "spur-3dof")[number % 2])
    ratio = float(np.exp(rng.uniform(*np.log(DAMPING))))
    backlash = float(np.exp(rng.uniform(*np.log(BACKLASH))))
    table["mesh"] |= {"damping_ratio": ratio, "normal_backlash": f"{backlash} m"}
    table["dynamics"].pop("friction", None)
    del table["wear"], table["numerics"]
    try:
        return steady(Scene.from_mapping(table))
    except GearError:
        return None


def deflection(response: Response) -> float:
    """Return the mean mesh deflection [m]."""
    n = len(response.system.load)
    state = (
        response.state[:, :-1, :n] @ response.system.direction.T
        - response.tables.error[:, 0]
    )
    return float(np.abs(state.mean(axis=(0, 1))).max())


def random_states(
    response: Response, count: int, rng: np.random.Generator
) -> list[Array]:
    """Return states about the mean one, each with one random mode at
    a random phase and amplitude.
    """
    system = response.system
    every = response.modes
    numbers = np.flatnonzero(every.excited() & (every.frequency > 0.0))
    states = []
    for _ in range(count):
        mode = rng.choice(numbers)
        turn = rng.uniform(0.0, 2.0 * np.pi)
        shape = every.shape[mode] / float(every.shape[mode] @ system.direction[0])
        shape = shape * deflection(response) * np.exp(rng.uniform(*np.log(LARGEST)))
        velocity = -2.0 * np.pi * every.frequency[mode] * np.sin(turn) * shape
        mean = response.state[:, :-1].mean(axis=(0, 1))
        states.append(mean + np.concatenate([np.cos(turn) * shape, velocity]))
    return states


def six_states(response: Response) -> list[Array]:
    """Return the six releases along the line of action that searches used to make."""
    direction = response.system.direction[0]
    scale = deflection(response)
    states = []
    for approach, spread in SIX:
        state = np.zeros(2 * len(direction))
        if spread:
            state[: len(direction)] = (
                approach * scale * direction / (direction @ direction)
            )
        else:
            last = int(np.flatnonzero(direction)[-1])
            state[last] = approach * scale / direction[last]
        states.append(state)
    return states


def elsewhere(response: Response, method: Periodic, states: Iterable[Array]) -> int:
    """Return how many of the motions from some states settle elsewhere: marched to the
    end, never shot.
    """
    away = 0
    shooting = Shooting(response.system, response.tables, response.mesh_period)
    n = len(response.system.load)
    limit = APART * deflection(response)
    for state in states:
        for transient in method.transients(shooting):
            state = shooting.integrate(state, transient)[0][-1]
            apart = np.abs(response.state[:, 0, :n] - state[:n]).max(axis=1).min()
            if apart <= limit or not np.isfinite(state).all():
                break
        else:
            away += 1
    return away


def holds(response: Response, method: Periodic, rival: Response | None) -> bool:
    """Whether a motion that begins a thousandth off a rival does not
    end on the response.
    """
    return (
        rival is not None
        and elsewhere(response, method, [rival.state[0, 0] * 1.001]) == 1
    )


def row(
    response: Response, method: Periodic, rng: np.random.Generator | None = None
) -> Row:
    """Return the row of a response.

    Without random states another attractor is known to be there.
    """
    search = holds(response, method, coexisting(response, method).rival)
    six = elsewhere(response, method, six_states(response)) > 0
    dense = (
        rng is None
        or elsewhere(response, method, random_states(response, DENSE, rng)) > 0
    )
    return Row(dense or six or search, six, search)


def tell(title: str, rows: list[Row]) -> None:
    """Print a line of the table."""
    there, six, search = (sum(column) for column in zip(*rows, strict=True))
    print(f"| {title} | {len(rows)} | {there} | {six} | {search} |", flush=True)


def stiff(share: float) -> Row:
    """Return the row of the stiff pair with its bearings damped by ``share`` more."""
    (case,) = (case for case in load(EDGES).cases if case.label == STIFF)
    solved = steady(case.scene)
    assert solved is not None
    response, method = solved
    system = response.system._replace(damping=response.system.damping * (1.0 + share))
    return row(
        method.solve(system, response.tables, response.mesh_period, response), method
    )


if __name__ == "__main__":
    scenes, seed = (
        int(given) for given in (*sys.argv[1:], *(SCENES, SEED)[len(sys.argv) - 1 :])
    )
    print(
        "| scenes | searched | with another attractor | six releases find one | the "
        "search finds one |"
    )
    print("|---|---|---|---|---|")
    rng = np.random.default_rng(seed)
    steady_pairs = [
        pair
        for pair in (drawn(seed, number) for number in range(scenes))
        if pair is not None
    ]
    tell(
        "drawn pairs", [row(response, method, rng) for response, method in steady_pairs]
    )
    tell(STIFF, [stiff(SHARE * number) for number in range(PERTURBED)])
