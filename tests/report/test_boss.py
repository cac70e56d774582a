"""What a page tells first: the answer in words, the gears with their
symbols, teeth that touch.
"""

import math
import re

import numpy as np
import pytest

from wearlab.assembly.sheet import thickness
from wearlab.campaign.blocks import CampaignError, modelled
from wearlab.campaign.campaign import PARTS, ReportSpec
from wearlab.gears.outline import drawing, half_tooth
from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import Basics, GearSpec
from wearlab.report.answer import CaseAnswer, _deepest_point, _sentences
from wearlab.report.conditions import _axis_name
from wearlab.report.page import FOLDER


def pair(teeth=(25, 40)):
    specs = [
        GearSpec(name=name, teeth=z)
        for name, z in zip(("pinion", "gear"), teeth, strict=True)
    ]
    return gear_pair(
        *specs, Basics(0.003, pressure_angle=math.radians(20.0), face_width=0.02)
    )


def points(path):
    numbers = [
        float(x)
        for x in path.replace("M", " ").replace("L", " ").replace("Z", " ").split()
    ]
    return np.array(numbers).reshape(-1, 2)


def test_the_outline_is_the_tooth():
    gear = pair().driving
    radius, angle = half_tooth(gear)
    assert radius[0] == pytest.approx(gear.root_radius, rel=1e-6) and radius[
        -1
    ] == pytest.approx(gear.tip_radius)
    at = np.interp(gear.reference_radius, radius, angle)
    assert 2.0 * at * gear.reference_radius == pytest.approx(
        thickness(gear), rel=1e-3
    )  # linear between points
    assert thickness(gear) == pytest.approx(math.pi * 3e-3 / 2.0)


def test_flanks_touch_at_the_pitch_point_and_the_path_is_perpendicular_to_them():
    one = drawing(pair())
    line = np.array(one.line, float)
    along = line[2:] - line[:2]
    assert math.degrees(math.atan2(abs(along[1]), abs(along[0]))) == pytest.approx(
        20.0, abs=0.01
    )
    assert np.hypot(*along) * 3.0 == pytest.approx(
        1e3 * (pair().path.E - pair().path.A), rel=1e-3
    )
    for _, path in one.bodies:
        outline = points(path)
        distance = np.hypot(*outline.T)
        near = outline[np.argsort(distance)[:2]]
        tangent = near[1] - near[0]
        assert distance.min() < 0.2 and abs(tangent @ along) < 0.1 * np.hypot(
            *tangent
        ) * np.hypot(*along)


def test_bodies_lie_on_their_own_sides():
    (_, upper), (_, lower) = drawing(pair()).bodies
    assert points(upper)[:, 1].min() < -4.0 and points(upper)[
        :, 1
    ].max() == pytest.approx(1.0, abs=0.02)
    assert points(lower)[:, 1].max() > 4.0 and points(lower)[
        :, 1
    ].min() == pytest.approx(-1.0, abs=0.02)


def test_sentences_name_the_limit_the_range_and_the_error():
    cases = [
        CaseAnswer("a", "10 h", "", "", "0.02 %", "", 0.0),
        CaseAnswer("b", "20 h", "", "", "0.03 %", "", 0.0),
    ]
    said = list(_sentences(cases, [36e3, 72e3], 3, "20 µm of wear", 2.0))
    assert (
        said[0] == "20 µm of wear is reached after 10 h (a) to 20 h (b) of operation."
    )
    assert said[1] == "1 of 3 cases do not reach it in the time that was asked for."
    assert "were that 2 times as large or small, 10 h would be 5 h or 20 h" in said[2]
    assert (
        said[3]
        == "The numerical error of the life is estimated at up to 0.03 %, little "
        "beside that."
    )


def test_equal_lives_are_told_once_and_a_page_says_where_the_flank_is_deepest():
    cases = [
        CaseAnswer(name, "10 h", "", "", "", "", 1.0, "pinion", 0.0, 0.054)
        for name in "ab"
    ]
    said = list(_sentences(cases, [36e3, 36e3 + 1e-6], 2, "20 µm of wear", 2.0))
    assert (
        said[0]
        == "20 µm of wear on the pinion is reached after 10 h of operation in both "
        "cases."
    )
    assert list(_deepest_point(cases)) == [
        "The pinion is worn deepest at diameter 54.00 mm."
    ]
    assert (
        _axis_name("amount", "gears.pinion.tip_relief.amount")
        == "pinion tip relief amount"
    )
    assert _axis_name("k", "wear.coefficient.value") == "k"


def test_what_is_drawn_inline_needs_no_style_sheet():
    """A printer of PDFs knows no style sheet inside an SVG: whatever is drawn has its
    colour with it.
    """
    template = (FOLDER / "page.html").read_text(encoding="utf-8")
    shapes = re.findall(r"<(?:path|line|circle|text|rect) [^>]*", template)
    assert len(shapes) >= 6 and all(
        re.search(r"(?:fill|stroke)=.(?:#|\{\{)", shape) for shape in shapes
    )


def test_report_chooses():
    assert modelled(ReportSpec, {}, "report").sections == PARTS
    chosen = {"sections": ["answer", "figures"], "lead": "x"}
    assert modelled(ReportSpec, chosen, "report").sections == ("answer", "figures")
    with pytest.raises(CampaignError, match="report"):
        modelled(ReportSpec, {"sections": ["anser"]}, "report")
    with pytest.raises(CampaignError, match="report"):
        modelled(ReportSpec, {"wear_coefficient_factor": 0.5}, "report")
