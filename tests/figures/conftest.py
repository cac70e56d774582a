"""A small store of made-up runs, every number of which tells where it came from."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from made_up import SPEEDS, Axis, Campaign, Case, put, run

from wearlab.figures.drawing import draw
from wearlab.figures.kind import FigureRequest, read
from wearlab.figures.plotting import plotted
from wearlab.store import Store


@pytest.fixture(scope="session")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    store = Store(tmp_path_factory.mktemp("figures") / "store")
    store.archive.create()
    for index, speed in enumerate((*SPEEDS, None)):
        put(store, f"{index}" * 32, run(speed))
    put(store, "f" * 32, None)
    return store


@pytest.fixture(scope="session")
def campaign() -> Campaign:
    """Three speeds and a static case, all there."""
    cases = [Case("base", f"{i}" * 32, {"speed": i}) for i in range(3)]
    return Campaign(
        (*cases, Case("static", "3" * 32)),
        (Axis("speed", SPEEDS, "rpm", "operation.speed"),),
    )


@pytest.fixture
def holed(campaign: Campaign) -> Campaign:
    """The same, with the second speed failed and the third never run."""
    cases = list(campaign.cases)
    cases[1], cases[2] = replace(cases[1], id="f" * 32), replace(cases[2], id="e" * 32)
    return replace(campaign, cases=tuple(cases))


def asked(**wishes: Any) -> FigureRequest:
    return read(SimpleNamespace(**wishes), 1, None)


@pytest.fixture(scope="session")
def plot(store: Store, campaign: Campaign):
    """Return a function that makes a figure as data, without drawing it."""
    grid = store.open(campaign)
    return lambda **wishes: plotted(grid, asked(**wishes))[0]


@pytest.fixture
def drawn(store: Store, campaign: Campaign, tmp_path: Path):
    """Return a function that draws figures of a campaign and returns the files."""

    def drawing(
        *wishes: dict[str, Any], of: Campaign = campaign, to: str = "out"
    ) -> list[Path]:
        specs = tuple(SimpleNamespace(**one) for one in wishes)
        return draw(replace(of, figures=specs), store, tmp_path / to)

    return drawing
