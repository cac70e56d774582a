"""Other attractors of the states of a life: what one state has found is looked for in its neighbours."""

from pathlib import Path

import numpy as np
import pytest

from wearlab.campaign import load
from wearlab.dynamics.coexisting import FURTHER, RELEASES, Search, Tries
from wearlab.dynamics.response import Response
from wearlab.simulation import attractors, simulate

LIVES = Path(__file__).parents[2] / "campaigns" / "spur_1dof.toml"


def test_states_that_wear_little_have_the_same_other_attractor() -> None:
    data = simulate(load(LIVES).cases[0].scene)
    assert str(data.verdict.values) == "coexisting"
    assert list(data.attractor_search.values[:4]) == ["another found"] * 4
    largest = data.coexisting_force_max.values[:4].ravel()
    assert np.all(largest > 2.0 * data.dynamic_mesh_force.max(("phase", "mesh")).values[:4].ravel())
    assert np.all(np.abs(np.diff(largest)) < 0.05 * largest[1:]) and np.all(np.diff(largest) != 0.0)
    assert int(data.count_attractor_starts) < RELEASES  # by far: those after the first state took none


def test_states_try_other_releases_and_look_for_what_their_neighbours_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of four states, the third finds one by a release, the others by what it found, the first not at all."""
    asked: list[tuple[str, Tries, int]] = []
    states = {name: _Named(name) for name in ("first", "second", "third", "fourth")}

    def search(response: Response, method: object, most: int, tries: Tries) -> Search:
        name = str(response)
        asked.append((name, tries, most))
        finds = name == "third" or (tries.near is not None and name != "first")
        rival = _Named(f"beside the {name}") if finds else None
        return Search(rival, 0 if tries.near is not None else tries.releases, 5)  # type: ignore[arg-type]

    monkeypatch.setattr(attractors, "coexisting", search)
    searches = attractors._searches([*states.values()], None, 1000)  # type: ignore[arg-type, list-item]
    names = [name for name, _, _ in asked]
    assert names == ["first", "second", "third", "fourth", "second", "first"]
    near = [None if tries.near is None else str(tries.near) for _, tries, _ in asked]
    assert near == [None, None, None, "beside the third", "beside the third", "beside the second"]
    first = RELEASES, RELEASES + FURTHER, RELEASES + 2 * FURTHER
    assert [tries.first for _, tries, _ in asked] == [0, *first, 0, 0]
    assert [tries.releases for _, tries, _ in asked] == [RELEASES, *[FURTHER] * 3, 0, 0]
    assert [search.rival is not None for search in searches] == [False, True, True, True]
    assert [search.starts for search in searches] == [RELEASES, FURTHER, FURTHER, 0]
    assert [search.periods for search in searches] == [5, 10, 5, 5]
    assert [most for _, _, most in asked] == [250, 330, 490, 970, 960, 950]


class _Named:
    """A response with a name and two integration steps a mesh period."""

    def __init__(self, name: str) -> None:
        self.name, self.tables = name, self
        self.width = np.full(2, 0.5)

    def __str__(self) -> str:
        return self.name
