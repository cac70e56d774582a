"""Hardness numbers against the tables they are read from."""

import pytest

from wearlab.materials.grades import (
    KGF_PER_MM2,
    pressure_of,
    vickers_of_rockwell,
)
from wearlab.units import UnitError, quantity


@pytest.mark.parametrize(
    "hrc, hv", [(20, 238), (40, 392), (60, 697), (62, 746), (68, 940), (60.5, 708.5)]
)
def test_rockwell_by_astm_e140(hrc, hv):
    assert vickers_of_rockwell(hrc) == pytest.approx(hv)


def test_the_whole_table_as_a_maker_of_testers_prints_it():
    """ASTM E140 Table 1, 68 down to 20 HRC:
    https://www.phase2plus.com/hardness-testers/conversion-charts.
    """
    printed = (
        "940 900 865 832 800 772 746 720 697 674 653 633 613 595 577 560 544 528 513 "
        "498 484 471 458 446 434 "
        "423 412 402 392 382 372 363 354 345 336 327 318 310 302 294 286 279 272 266 "
        "260 254 248 243 238"
    )
    assert [vickers_of_rockwell(n) for n in range(68, 19, -1)] == [
        float(hv) for hv in printed.split()
    ]


@pytest.mark.parametrize("hb, hv", [(190, 200), (285, 300), (380, 400)])
def test_brinell_by_iso_18265(hb, hv):
    assert pressure_of(hb, "HB") == pytest.approx(KGF_PER_MM2 * hv, rel=1e-9)


def test_numbers_are_quantities_of_hardness():
    assert quantity("700 HV 10", "hardness") == pytest.approx(6.864655e9)
    assert quantity("60 HRC", "hardness") == pytest.approx(6.835235e9)
    assert quantity("7 GPa", "hardness") == 7e9


@pytest.mark.parametrize("text", ["72 HRC", "19 HRC", "700 HB"])
def test_outside_the_table_is_refused_with_its_range(text):
    with pytest.raises(
        UnitError, match=r"is outside .* the range of (ASTM E140|ISO 18265).*give HV"
    ):
        quantity(text, "hardness")


def test_no_hardness_but_where_hardness_is_meant():
    with pytest.raises(UnitError, match="HRC"):
        quantity("60 HRC", "pressure")
