"""States to release flanks from: of one mode each, evenly spread over
phases and amplitudes.
"""

from itertools import islice

import numpy as np
import pytest
from benchmark_pair import BenchmarkPair, mesh_period
from scipy.linalg import eigh

from wearlab.dynamics.steady.coexisting import AMPLITUDE, releases
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.dynamics.steady.response import Response

DEFLECTION = 1e-5


@pytest.fixture(scope="module")
def response() -> Response:
    pair = BenchmarkPair(backlash=None)
    return Periodic().solve(
        pair.system(), pair.tables(pair.grid(60)), mesh_period(1860.0)
    )


def modal(response: Response, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return of every mode its rate, its mesh deflection, and complex
    amplitudes in some releases.
    """
    system = response.system
    square, shapes = eigh(
        system.in_contact(response.tables.mean_stiffness), system.mass
    )
    states = np.array(list(islice(releases(response, DEFLECTION), count)))
    off = states - response.state[:, :-1].mean(axis=(0, 1))
    rates = np.sqrt(square)
    place, speed = (part @ system.mass @ shapes for part in (off[:, :3], off[:, 3:]))
    return rates, system.direction[0] @ shapes, place - 1j * speed / rates


def test_each_release_is_of_one_mode_that_the_mesh_drives(response: Response) -> None:
    _, felt, swings = modal(response, 60)
    driven = np.abs(felt) > 1e-6 * np.abs(felt).max()
    assert driven.sum() == 2  # gears that are alike swing in phase without the mesh
    shares = np.abs(swings) / np.abs(swings).max(axis=1, keepdims=True)
    assert (
        np.all((shares > 0.5).sum(axis=1) == 1)
        and not (shares > 1e-6)[:, ~driven].any()
    )
    assert set((shares > 0.5).sum(axis=0)) == {0, 30}


def test_amplitudes_are_those_of_force_or_energy(response: Response) -> None:
    rates, felt, swings = modal(response, 400)
    static = eigh(
        response.system.in_contact(response.tables.mean_stiffness), response.system.mass
    )[1].T
    energy = np.sum((static @ response.system.load / rates) ** 2)
    for mode in np.flatnonzero(np.abs(felt) > 1e-6 * np.abs(felt).max()):
        sizes = np.abs(swings[:, mode])
        sizes = sizes[sizes > 0.5 * np.abs(swings).max(axis=1)]
        unit = min(DEFLECTION / abs(felt[mode]), np.sqrt(energy) / rates[mode])
        assert AMPLITUDE[0] < sizes.min() / unit < 1.1 * AMPLITUDE[0]
        assert 0.9 * AMPLITUDE[1] < sizes.max() / unit < AMPLITUDE[1]


def test_phases_and_amplitudes_leave_no_gap(response: Response) -> None:
    """Whatever phase and logarithm of the amplitude: one of n releases is as near as on
    a square lattice.
    """
    _, felt, swings = modal(response, 48)
    mode = int(np.abs(felt).argmax())
    own = swings[np.abs(swings[:, mode]) > 0.5 * np.abs(swings).max(axis=1), mode]
    assert len(own) == 24
    amplitudes = np.log(np.abs(own)) / np.log(AMPLITUDE[1] / AMPLITUDE[0])
    places = np.stack([np.angle(own) / (2.0 * np.pi), amplitudes], -1)
    anywhere = np.random.default_rng(1).uniform(size=(2000, 2))
    apart = (anywhere[:, None] - places + 0.5) % 1.0 - 0.5
    assert np.hypot(*apart.T).min(axis=0).max() < 1.1 * np.sqrt(0.5 / 24)


def test_a_sequence_goes_on_where_another_ended(response: Response) -> None:
    whole = list(islice(releases(response, DEFLECTION), 12))
    rest = list(islice(releases(response, DEFLECTION, 5), 7))
    np.testing.assert_array_equal(whole[5:], rest)
