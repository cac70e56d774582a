"""Viscosity, density and pressure-viscosity of an oil, from its grade or datasheet.

ISO 3448 names a grade by its kinematic viscosity at 40 °C; the viscosity index (ISO
2909, ASTM D2270) gives that at 100 °C; ASTM D341 joins the two.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

KELVIN = 273.15
"""0 °C [K]."""
GRADES_TEXT = """
    2 3 5 7 10 15 22 32 46 68
    100 150 220 320 460 680 1000 1500 2200 3200
"""
GRADES = tuple(map(int, GRADES_TEXT.split()))
"""ISO 3448: kinematic viscosity at 40 °C [mm²/s], within ±10 %."""
USUAL_INDEX = 95.0
"""Viscosity index of a mineral oil that states none (ISO 3448, Annex)."""
CENTISTOKES = 1e-6  # m²/s
# ASTM D2270: Y up to, then L = a Y² + b Y + c and H = d Y² + e Y + f, all in mm²/s
INDEX = (
    (3.8, 1.14673, 1.7576, -0.109, 0.84155, 1.5521, -0.077),
    (4.4, 3.38095, -15.4952, 33.196, 0.78571, 1.7929, -0.183),
    (5.0, 2.5000, -7.2143, 13.812, 0.82143, 1.5679, 0.119),
    (6.4, 0.10100, 16.6350, -45.469, 0.04985, 9.1613, -18.557),
    (7.0, 3.35714, -23.5643, 78.466, 0.22619, 7.7369, -16.656),
    (7.7, 0.01191, 21.4750, -72.870, 0.79762, -0.7321, 14.610),
    (9.0, 0.41858, 16.1558, -56.040, 0.05794, 10.5156, -28.240),
    (12.0, 0.88779, 7.5527, -16.600, 0.26665, 6.7015, -10.810),
    (15.0, 0.76720, 10.7972, -38.180, 0.20073, 8.4658, -22.490),
    (18.0, 0.97305, 5.3135, -2.200, 0.28889, 5.9741, -4.930),
    (22.0, 0.97256, 5.2500, -0.980, 0.24504, 7.4160, -16.730),
    (28.0, 0.91413, 7.4759, -21.820, 0.20323, 9.1267, -34.230),
    (40.0, 0.87031, 9.7157, -50.770, 0.18411, 10.1015, -46.750),
    (55.0, 0.84703, 12.6752, -133.310, 0.17029, 11.4866, -80.620),
    (70.0, 0.85921, 11.1009, -83.190, 0.17130, 11.3680, -76.940),
    (math.inf, 0.83531, 14.6731, -216.246, 0.16841, 11.8493, -96.947),
)
PRESSURE = {"mineral": (0.010471, 0.1348), "pao": (0.010326, 0.0507)}
"""k and s of ``α = k η^s``, α in mm²/N and η in mPa·s: AGMA 925-A03."""


class Oil(NamedTuple):
    """An oil by its datasheet.

    Parameters
    ----------
    viscosity_40, viscosity_100 : kinematic viscosity at 40 and 100 °C [m²/s]
    density_15 : density at 15 °C [kg/m³]
    base : mineral or pao
    """

    viscosity_40: float
    viscosity_100: float
    density_15: float
    base: str = "mineral"


def of_grade(
    grade: int,
    index: float = USUAL_INDEX,
    density: float | None = None,
    base: str = "mineral",
) -> Oil:
    """Return the oil of an ISO VG grade at the middle of its range.

    Parameters
    ----------
    grade : ISO VG [mm²/s at 40 °C]
    index : viscosity index [1]
    density : at 15 °C [kg/m³]; None: estimated
    base : mineral or pao

    Raises
    ------
    ValueError : no such viscosity index
    """
    at_100 = viscosity_at_100(float(grade), index)
    return of_datasheet(CENTISTOKES * grade, CENTISTOKES * at_100, density, base)


def of_datasheet(
    at_40: float, at_100: float, density: float | None = None, base: str = "mineral"
) -> Oil:
    """Return the oil of a datasheet.

    Where no density is given, it is estimated by ``ρ₁₅ = 43.37 log₁₀ ν₄₀ + 805.5`` with
    ν₄₀ in mm²/s: ISO/TR 15144-1:2014, mineral oils.

    Parameters
    ----------
    at_40, at_100 : kinematic viscosity at 40 and 100 °C [m²/s]
    density : at 15 °C [kg/m³]; None: estimated
    base : mineral or pao
    """
    if density is None:
        density = 43.37 * math.log10(at_40 / CENTISTOKES) + 805.5
    return Oil(at_40, at_100, density, base)


def viscosity_index(at_40: float, at_100: float) -> float:
    """Return the viscosity index of two kinematic viscosities [1].

    Parameters
    ----------
    at_40, at_100 : kinematic viscosity at 40 and 100 °C [mm²/s]

    References
    ----------
    ASTM D2270, procedure A up to an index of 100, procedure B above.
    """
    of_index_0, of_index_100 = _reference(at_100)
    if at_40 >= of_index_100:
        return 100.0 * (of_index_0 - at_40) / (of_index_0 - of_index_100)

    exponent = math.log10(of_index_100 / at_40) / math.log10(at_100)
    return 100.0 + (10.0**exponent - 1.0) / 0.00715


def _reference(at_100: float) -> tuple[float, float]:
    """Return L and H of ASTM D2270 [mm²/s].

    L and H are the viscosities at 40 °C of oils of index 0 and 100 that have the given
    viscosity at 100 °C.
    """
    row = next(row for row in INDEX if at_100 <= row[0])
    _, *coefficients = row
    of_index_0 = _parabola(coefficients[:3], at_100)
    of_index_100 = _parabola(coefficients[3:], at_100)
    return of_index_0, of_index_100


def _parabola(coefficients: Sequence[float], x: float) -> float:
    """Return ``a x² + b x + c``."""
    a, b, c = coefficients
    return a * x**2 + b * x + c


def viscosity_at_100(at_40: float, index: float) -> float:
    """Return the kinematic viscosity at 100 °C of an index [mm²/s], by bisection.

    Parameters
    ----------
    at_40 : kinematic viscosity at 40 °C [mm²/s]
    index : viscosity index [1]

    Raises
    ------
    ValueError : no oil of that viscosity has the index
    """
    low = 2.0
    high = at_40
    if not viscosity_index(at_40, low) < index < viscosity_index(at_40, high):
        raise ValueError(
            f"no oil of {at_40:g} mm²/s at 40 °C has a viscosity index of {index:g}"
        )
    for _ in range(80):
        middle = 0.5 * (low + high)
        if viscosity_index(at_40, middle) < index:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def kinematic_viscosity(oil: Oil, temperature: float) -> float:
    """Return the kinematic viscosity [m²/s], ``lg lg (ν + 0.7) = A − B lg T``.

    Parameters
    ----------
    oil : its viscosities at 40 and 100 °C give A and B
    temperature : T [K]

    Source: ASTM D341, ν in mm²/s from 2 upwards.
    """
    at_40 = _double_logarithm(oil.viscosity_40)
    at_100 = _double_logarithm(oil.viscosity_100)
    cold = math.log10(40.0 + KELVIN)
    hot = math.log10(100.0 + KELVIN)

    slope = (at_40 - at_100) / (hot - cold)
    value = at_40 - slope * (math.log10(temperature) - cold)
    return CENTISTOKES * (10.0 ** (10.0**value) - 0.7)


def _double_logarithm(viscosity: float) -> float:
    """Return ``lg lg (ν + 0.7)`` with ν in mm²/s of a kinematic viscosity [m²/s]."""
    return math.log10(math.log10(viscosity / CENTISTOKES + 0.7))


def density(oil: Oil, temperature: float) -> float:
    """Return the density at a temperature, ``ρ = ρ₁₅ − 0.7 (T − 289 K)`` [kg/m³].

    Parameters
    ----------
    oil : its density at 15 °C is ρ₁₅
    temperature : T [K]

    Source: ISO/TR 15144-1:2014.
    """
    return oil.density_15 - 0.7 * (temperature - 289.0)


def dynamic_viscosity(oil: Oil, temperature: float) -> float:
    """Return the dynamic viscosity, ``η = ν ρ`` [Pa·s].

    Parameters
    ----------
    oil : gives ν and ρ
    temperature : [K]
    """
    return kinematic_viscosity(oil, temperature) * density(oil, temperature)


def pressure_viscosity(oil: Oil, temperature: float) -> float:
    """Return an estimate of the pressure-viscosity coefficient, ``α = k η^s`` [1/Pa].

    Parameters
    ----------
    oil : gives η; its base gives k and s
    temperature : [K]

    Source: AGMA 925-A03; for mineral oils the same as ISO/TR 15144-1 at 38 °C.
    """
    k, s = PRESSURE[oil.base]
    millipascal_seconds = 1e3 * dynamic_viscosity(oil, temperature)
    return 1e-6 * k * millipascal_seconds**s
