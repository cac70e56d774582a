import pytest

from wearlab.figures import FigureError
from wearlab.figures.runs import index_of

SPEEDS = [800.0, 1100.0, 3720.0]


@pytest.mark.parametrize(
    "asked, found", [(1100, [1]), ("1100 rpm", [1]), ([800, 3720.0], [0, 2])]
)
def test_labels_in_the_units_of_the_file(asked, found):
    assert index_of(asked, SPEEDS, "speed", "figure 1", "rpm") == found


def test_another_unit():
    assert index_of("62 rev/s", SPEEDS, "speed", "figure 1", "rpm") == [2]
    with pytest.raises(FigureError, match=r"select\.speed = '1100 Hz' is not there"):
        index_of("1100 Hz", SPEEDS, "speed", "figure 1", "rpm")


@pytest.mark.parametrize(
    "cycle, text",
    [
        (0, "unworn"),
        (2e6, "3 million cycles (50 h)"),
        (6e7, "100 million cycles (1,670 h)"),
    ],
)
def test_the_nearest_wear_state(plot, cycle, text):
    one = plot(
        kind="wear-profile", select={"cycle": cycle, "case": "static", "flank": "gear"}
    )
    assert one.title.split(", ")[0] == "Wear depth along the flank"
    assert set(one.title.replace("1,670", "1670").split(", ")[1:]) == {
        "static",
        text.replace("1,670", "1670"),
        "gear",
    }
    assert len(one.panels[0].curves) == 1


def test_several_states(plot):
    one = plot(
        kind="wear-profile",
        select={"update": [0, -1], "case": "static", "flank": "gear"},
    )
    assert [entry.text for entry in one.legend] == [
        "unworn",
        "100 million cycles (1,670 h)",
    ]
