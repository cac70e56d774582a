"""Other attractors of the states of a life: what one state has found
is looked for in its neighbours.
"""

from typing import Any

import numpy as np
import pytest
from scenes import CAMPAIGNS, external_pair

from wearlab.campaign import load
from wearlab.dynamics.steady.coexisting import FURTHER, RELEASES, Search, Tries
from wearlab.dynamics.steady.response import Response
from wearlab.scene import Scene
from wearlab.simulation import attractors, simulate

LIVES = CAMPAIGNS / "spur_1dof.toml"


def test_states_that_wear_little_have_the_same_other_attractor() -> None:
    data = simulate(load(LIVES).cases[0].scene)
    assert str(data.verdict.values) == "coexisting"
    assert list(data.attractor_search.values[:4]) == ["another found"] * 4
    largest = data.coexisting_force_max.values[:4].ravel()
    assert np.all(
        largest
        > 2.0 * data.dynamic_mesh_force.max(("phase", "mesh")).values[:4].ravel()
    )
    assert np.all(np.abs(np.diff(largest)) < 0.05 * largest[1:]) and np.all(
        np.diff(largest) != 0.0
    )
    assert (
        int(data.count_attractor_starts) <= RELEASES + FURTHER
    )  # those of the alike states took none


def test_states_try_other_releases_and_look_for_what_their_neighbours_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of four states, the third finds one by a release, the others by what it found,
    the first not at all.
    """
    asked: list[tuple[str, Tries, int]] = []
    states = {name: _Named(name) for name in ("first", "second", "third", "fourth")}

    def search(response: Response, method: object, most: int, tries: Tries) -> Search:
        name = str(response)
        asked.append((name, tries, most))
        finds = name == "third" or (tries.near is not None and name != "first")
        rival = _Named(f"beside the {name}") if finds else None
        return Search(
            rival, 0 if tries.near is not None else tries.releases, 5, spent=5.0
        )  # type: ignore[arg-type]

    monkeypatch.setattr(attractors.coexisting, "coexisting", search)
    searched: Any = [*states.values()]
    nothing: Any = None
    found = attractors._searches(searched, nothing, 1000)
    searches = [one.search for one in found]
    names = [name for name, _, _ in asked]
    assert names == ["first", "second", "third", "fourth", "second", "first"]
    near = [None if tries.near is None else str(tries.near) for _, tries, _ in asked]
    assert near == [
        None,
        None,
        None,
        "beside the third",
        "beside the third",
        "beside the second",
    ]
    first = RELEASES, RELEASES + FURTHER, RELEASES + 2 * FURTHER
    assert [tries.first for _, tries, _ in asked] == [0, *first, 0, 0]
    assert [tries.releases for _, tries, _ in asked] == [RELEASES, *[FURTHER] * 3, 0, 0]
    assert [search.rival is not None for search in searches] == [
        False,
        True,
        True,
        True,
    ]
    assert [search.starts for search in searches] == [RELEASES, FURTHER, FURTHER, 0]
    assert [search.periods for search in searches] == [10, 10, 5, 5]
    assert [most for _, _, most in asked] == [250, 330, 490, 970, 960, 950]


PAIR = {
    "gears": external_pair(
        {"teeth": 29, "inertia": "7300 kg*mm^2", "mass": "2 kg"},
        {"teeth": 43, "inertia": "7300 kg*mm^2", "mass": "3 kg"},
    ),
    "operation": {"torque": "30 N*m", "speed": "7700 rpm"},
    "mesh": {
        "stiffness": {"model": "constant", "value": "2.4e8 N/m"},
        "extended_contact": False,
        "damping_ratio": 0.008,
        "normal_backlash": "40 um",
    },
    "dynamics": {"model": "torsional"},
}


def test_the_worst_attractor_found_is_told_and_all_are_listed() -> None:
    """The first one found has a fifth of the force of the worst: two of four random
    releases end on that.
    """
    data = simulate(Scene.from_mapping(PAIR))
    largest = data.rival_force_max.values[0, 0]
    assert largest[0] == pytest.approx(16925.0, rel=1e-3) and np.all(
        np.diff(largest) < 0.0
    )
    assert 3206.0 == pytest.approx(largest[1], rel=1e-3)
    for name in ("period", "multiplier", "force_min", "force_max"):
        assert np.array_equal(
            data[f"coexisting_{name}"], data[f"rival_{name}"].isel(rival=0)
        )


class _Named:
    """A response with a name and two integration steps a mesh period."""

    def __init__(self, name: str) -> None:
        self.name, self.tables = name, self
        self.width = np.full(2, 0.5)

    def __str__(self) -> str:
        return self.name
