"""Records of points: what a store or a picture holds of them, planted ones too."""

import pytest

from wearlab.tables.points import Points

CURVE = Points("curve.csv", "x,y\n1,2\n")
FLANK = Points("flank.csv", "diameter [m],depth [m]\n0.1,1e-6\n", "pinion", "tip")


@pytest.mark.parametrize("points", [CURVE, FLANK])
def test_a_record_comes_back(points):
    assert Points.recorded(points.record()) == points


@pytest.mark.parametrize(
    "planted",
    [5, "ab", {}, [], ["a"], ["a", 1], list("abcde"), ["a", "b", "pinion", "junk"]],
)
def test_what_no_wearlab_wrote_is_refused(planted):
    with pytest.raises(ValueError, match="record of points"):
        Points.recorded(planted)


def test_a_flank_is_written_anew_with_points_whatever_its_file_had():
    assert CURVE.decimal(",") == ","
    assert FLANK.decimal(",") == "."
