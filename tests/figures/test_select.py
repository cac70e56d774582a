import pytest

from wearlab.figures.select import index_of


@pytest.mark.parametrize(
    "asked, found", [(1100, [1]), ("1100 rpm", [1]), ("3720 min^-1", []), ([800, 3720.0], [0, 2])]
)
def test_labels_in_the_units_of_the_file(asked, found):
    if found:
        assert index_of(asked, [800.0, 1100.0, 3720.0], "speed", "figure 1", "rpm") == found
    else:
        with pytest.raises(ValueError, match="select.speed"):
            index_of(asked, [800.0, 1100.0, 3720.0], "speed", "figure 1", "rpm")


@pytest.mark.parametrize(
    "cycle, title", [(0, "unworn"), (2e6, "3 million cycles"), (6e7, "100 million cycles")]
)
def test_the_nearest_wear_state(plot, cycle, title):
    one = plot(kind="wear-profile", select={"cycle": cycle, "case": "static", "flank": "gear"})
    assert one.title == f"Wear depth along the flank, gear, static, {title}" or title in one.title
    assert len(one.panels[0].curves) == 1


def test_several_states_in_the_order_asked(plot):
    one = plot(kind="wear-profile", select={"update": [0, -1], "case": "static", "flank": "gear"})
    assert [entry.text for entry in one.legend] == ["unworn", "100 million cycles"]
