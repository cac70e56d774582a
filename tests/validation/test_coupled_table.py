"""Tables of docs/evidence/coupled_lives.md say their model version.

Today's code gives some of their lives.
"""

import re

import pytest
from coupled_table import BEGIN, END, PAGE, TOP

from wearlab.campaign import load
from wearlab.simulation import simulate


@pytest.fixture(scope="module")
def section():
    return PAGE.read_text(encoding="utf-8").split(BEGIN)[1].split(END)[0]


def told(section, figure, row, column):
    """Return a life of a table [1e7 cycles] and its estimated error."""
    table = [
        line
        for line in section.split(f"W23 Fig. {figure}:")[1].splitlines()
        if line.startswith("|")
    ]
    heads = [cell.strip() for cell in table[0].split("|")]
    cells = next(line for line in table if line.startswith(f"| {row} |")).split("|")
    life, error = cells[heads.index(column)].split("±")
    return float(life), float(error)


def test_the_tables_say_their_model_version(section):
    assert re.search(r"^Runs of model version \d+", section, re.MULTILINE)


@pytest.mark.parametrize(
    "campaign, row",
    [
        ("planetary_torque", "static, consistent"),
        ("planetary_torque_as_published", "static, as published"),
    ],
)
def test_static_lives_of_the_page_are_those_of_this_code(section, campaign, row):
    """Their k is calibrated anew on the life of 134 N·m, 1500 rpm."""
    cases = load(TOP / "campaigns" / f"{campaign}.toml").cases
    scene = next(
        case.scene
        for case in cases
        if case.label == "static load" and case.scene.operation.torque == 150.0
    )
    life, error = told(section, 11, row, "150 N·m")
    assert float(simulate(scene).life) * 1e-7 == pytest.approx(life, abs=error + 5e-4)
