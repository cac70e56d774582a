"""Gear materials by the names that workshops use, and conversions of hardness numbers.

Elastic constants and densities are those of the standards or handbooks named; a
hardness is the middle of what the heat treatment usually gives, and is assumed where
the scene states none. Plastics soften with temperature: their constants hold dry at
23 °C.

A Vickers number is a force in kgf over the area of the indentation in mm²: ``H =
9.80665 MPa · HV``. Rockwell numbers are read from ASTM E140-12b, Table 1
(non-austenitic steels; the same steels as ISO 18265:2013, Table A.1, which differs by
up to 2 HRC); Brinell numbers (tungsten carbide ball) by ``HBW = 0.95 HV``, which ISO
18265 Table A.1 follows within 0.5 %. Conversions are valid within the tables' ranges
only, and no better than some 5 %.
"""

from typing import Any, NamedTuple

KGF_PER_MM2 = 9.80665e6  # Pa
BRINELL_PER_VICKERS = 0.95
HRC_RANGE = (20.0, 68.0)
HBW_RANGE = (76.0, 618.0)
STEEL = "ISO 6336-2:2016 (E = 206 GPa, ν = 0.3)"
"""Source of the elastic constants of steels."""
E140_ROWS = """
    238 243 248 254 260 266 272 279 286 294
    302 310 318 327 336 345 354 363 372 382
    392 402 412 423 434 446 458 471 484 498
    513 528 544 560 577 595 613 633 653 674
    697 720 746 772 800 832 865 900 940
"""
VICKERS_OF_HRC = tuple(map(int, E140_ROWS.split()))
"""Vickers numbers of 20, 21 … 68 HRC: ASTM E140-12b, Table 1."""


class HardnessError(ValueError):
    """A hardness number outside the range of the table that converts it."""


def vickers_of_rockwell(number: float) -> float:
    """Return the Vickers number of a Rockwell C number, linear between table rows.

    Parameters
    ----------
    number : Rockwell C number, 20 to 68 HRC

    Raises
    ------
    HardnessError : outside 20 to 68 HRC
    """
    _check_range(number, HRC_RANGE, "HRC", "ASTM E140, Table 1")

    lowest_hrc = HRC_RANGE[0]
    row = min(int(number - lowest_hrc), len(VICKERS_OF_HRC) - 2)
    first, second = VICKERS_OF_HRC[row : row + 2]
    return first + (number - lowest_hrc - row) * (second - first)


def vickers_of_brinell(number: float) -> float:
    """Return the Vickers number of a Brinell number, ``HV = HBW / 0.95``.

    Parameters
    ----------
    number : Brinell number, 76 to 618 HBW

    Raises
    ------
    HardnessError : outside 76 to 618 HBW
    """
    _check_range(number, HBW_RANGE, "HBW", "ISO 18265, Table A.1")
    return number / BRINELL_PER_VICKERS


def _check_range(
    number: float, limits: tuple[float, float], scale: str, table: str
) -> None:
    """Raise a `HardnessError` where a number is outside the range of a table."""
    low, high = limits
    if not low <= number <= high:
        raise HardnessError(
            f"{number:g} {scale} is outside {low:g} to {high:g} {scale}, "
            f"the range of {table}; "
            "give HV, or a pressure such as '7 GPa'"
        )


SCALES: Any = {
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
    return KGF_PER_MM2 * float(SCALES[scale](number))


class NamedMaterial(NamedTuple):
    """A material of the catalogue.

    Parameters
    ----------
    youngs_modulus, poisson_ratio, density : [Pa], [1], [kg/m³]
    hardness : usual hardness of the flank [Pa], None where a hardness number says
        nothing
    treatment : what the hardness belongs to, in words
    source : where the constants come from
    """

    youngs_modulus: float
    poisson_ratio: float
    density: float
    hardness: float | None
    treatment: str
    source: str


def _steel(treatment: str, hardness: float) -> NamedMaterial:
    """Return a steel by its heat treatment, and the hardness that it gives [Pa]."""
    return NamedMaterial(
        youngs_modulus=206e9,
        poisson_ratio=0.3,
        density=7830.0,
        hardness=hardness,
        treatment=treatment,
        source=STEEL,
    )


def _case_hardened() -> NamedMaterial:
    """Return a case-hardened steel."""
    treatment = "60 HRC, case-hardened (ISO 6336-5: 58 to 64 HRC)"
    return _steel(treatment, pressure_of(60.0, "HRC"))


def _iron(
    modulus: float, poisson_ratio: float, density: float, brinell: float, source: str
) -> NamedMaterial:
    """Return a cast iron by its constants [Pa], [1], [kg/m³] and its Brinell number."""
    return NamedMaterial(
        youngs_modulus=modulus,
        poisson_ratio=poisson_ratio,
        density=density,
        hardness=pressure_of(brinell, "HB"),
        treatment=f"{brinell:g} HB, as cast",
        source=source,
    )


def _plastic(
    modulus: float, poisson_ratio: float, density: float, source: str
) -> NamedMaterial:
    """Return a plastic by its constants [Pa], [1], [kg/m³]."""
    return NamedMaterial(
        youngs_modulus=modulus,
        poisson_ratio=poisson_ratio,
        density=density,
        hardness=None,
        treatment="dry, 23 °C",
        source=source,
    )


MATERIALS: dict[str, NamedMaterial] = {
    "steel": NamedMaterial(206e9, 0.3, 7830.0, None, "", "L16 Table 1"),
    "16MnCr5": _case_hardened(),
    "20MnCr5": _case_hardened(),
    "18CrNiMo7-6": _case_hardened(),
    "17CrNiMo6": _case_hardened(),
    "18CrMo4": _case_hardened(),
    "42CrMo4": _steel("300 HV, quenched and tempered", pressure_of(300.0, "HV")),
    "34CrNiMo6": _steel("310 HV, quenched and tempered", pressure_of(310.0, "HV")),
    "31CrMoV9": _steel("700 HV, nitrided", pressure_of(700.0, "HV")),
    "C45": _steel("200 HB, normalised", pressure_of(200.0, "HB")),
    "EN-GJL-250": _iron(
        110e9, 0.26, 7200.0, 210.0, "EN 1561:2011, Annex (103-118 GPa)"
    ),
    "EN-GJS-400-15": _iron(169e9, 0.275, 7100.0, 155.0, "EN 1563:2018, Annex"),
    "EN-GJS-700-2": _iron(176e9, 0.275, 7200.0, 260.0, "EN 1563:2018, Annex"),
    "POM": _plastic(2.8e9, 0.35, 1410.0, "VDI 2736-1:2016, POM-C"),
    "PA66": _plastic(3.0e9, 0.38, 1140.0, "VDI 2736-1:2016, PA 66"),
}
ALIASES = {
    "cast iron": "EN-GJL-250",
    "GG25": "EN-GJL-250",
    "GGG40": "EN-GJS-400-15",
    "GGG70": "EN-GJS-700-2",
    "POM-C": "POM",
    "PA 66": "PA66",
    "1.6587": "18CrNiMo7-6",
    "1.7131": "16MnCr5",
    "1.7147": "20MnCr5",
    "1.7225": "42CrMo4",
    "1.0503": "C45",
}
"""Other names of materials of the catalogue: older standards, material numbers."""


def catalogue_name(name: str) -> str | None:
    """Return the catalogue's name of a material, None where it has no such material.

    Parameters
    ----------
    name : a key of `MATERIALS` or `ALIASES`; capitals and blanks do not count
    """
    names = {_plain(key): key for key in MATERIALS}
    names |= {_plain(alias): key for alias, key in ALIASES.items()}
    return names.get(_plain(name))


def _plain(name: str) -> str:
    """Return a name in small letters without blanks."""
    return name.lower().replace(" ", "")
