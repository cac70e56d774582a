"""Hardness numbers: Rockwell C, Brinell and Vickers to the pressure that Archard's law divides by.

A Vickers number is a force in kgf over the area of the indentation in mm²: ``H = 9.80665 MPa · HV``. Rockwell
numbers are read from ASTM E140-12b, Table 1 (non-austenitic steels; the same steels as ISO 18265:2013,
Table A.1, which differs by up to 2 HRC); Brinell numbers (tungsten carbide ball) by ``HBW = 0.95 HV``, which
ISO 18265 Table A.1 follows within 0.5 %. Conversions are valid within the tables' ranges only, and no better
than some 5 %.
"""

from collections.abc import Callable

KGF_PER_MM2 = 9.80665e6  # Pa
BRINELL_PER_VICKERS = 0.95
HRC_RANGE = (20.0, 68.0)
HBW_RANGE = (76.0, 618.0)
# ASTM E140-12b, Table 1: Vickers numbers of 20, 21 ... 68 HRC
VICKERS_OF_HRC = (
    *(238, 243, 248, 254, 260, 266, 272, 279, 286, 294, 302, 310, 318, 327, 336, 345, 354, 363, 372, 382),
    *(392, 402, 412, 423, 434, 446, 458, 471, 484, 498, 513, 528, 544, 560, 577, 595, 613, 633, 653, 674),
    *(697, 720, 746, 772, 800, 832, 865, 900, 940),
)


class HardnessError(ValueError):
    """A hardness number outside the range of the table that converts it."""


def vickers_of_rockwell(number: float) -> float:
    """Return the Vickers number of a Rockwell C number, linear between the table's rows.

    Raises
    ------
    HardnessError : outside 20 to 68 HRC
    """
    _within(number, HRC_RANGE, "HRC", "ASTM E140, Table 1")
    place = number - HRC_RANGE[0]
    low = min(int(place), len(VICKERS_OF_HRC) - 2)
    return VICKERS_OF_HRC[low] + (place - low) * (VICKERS_OF_HRC[low + 1] - VICKERS_OF_HRC[low])


def vickers_of_brinell(number: float) -> float:
    """Return the Vickers number of a Brinell number, ``HV = HBW / 0.95``.

    Raises
    ------
    HardnessError : outside 76 to 618 HBW
    """
    _within(number, HBW_RANGE, "HBW", "ISO 18265, Table A.1")
    return number / BRINELL_PER_VICKERS


def _within(number: float, limits: tuple[float, float], scale: str, table: str) -> None:
    if not limits[0] <= number <= limits[1]:
        raise HardnessError(
            f"{number:g} {scale} is outside {limits[0]:g} to {limits[1]:g} {scale}, the range of {table}; "
            "give HV, or a pressure such as '7 GPa'"
        )


SCALES: dict[str, Callable[[float], float]] = {
    "HV": float,
    "HRC": vickers_of_rockwell,
    "HB": vickers_of_brinell,
    "HBW": vickers_of_brinell,
}


def pressure_of(number: float, scale: str) -> float:
    """Return the pressure that a hardness number stands for [Pa].

    Parameters
    ----------
    number : on the scale
    scale : a key of `SCALES`

    Raises
    ------
    HardnessError : outside the range of the scale's table
    """
    return KGF_PER_MM2 * SCALES[scale](number)
