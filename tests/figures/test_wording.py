import numpy as np
import pytest

from wearlab.figures.wording import axis_label, cycles, power_of_ten, typeset


@pytest.mark.parametrize(
    "units, printed",
    [
        ("um", "µm"),
        ("N/um", "N/µm"),
        ("N*m", "N·m"),
        ("m^2/N", "m²/N"),
        ("deg", "°"),
        ("1", ""),
        ("%", "%"),
        ("N m-1", "N/m"),
        ("m2 N-1", "m²/N"),
        ("rad s-1", "rad/s"),
        ("degC", "°C"),
        ("mm**2", "mm²"),
        ("kg*mm^2", "kg·mm²"),
        ("rpm", "rpm"),
        ("s-1", "1/s"),
    ],
)
def test_units_in_type(units, printed):
    assert typeset(units) == printed


@pytest.mark.parametrize(
    "count, text",
    [
        (0, "0 cycles"),
        (12, "12 cycles"),
        (45_000, "45,000 cycles"),
        (2e7, "20 million cycles"),
        (3e9, "3 billion cycles"),
    ],
)
def test_wear_states(count, text):
    assert cycles(count).text == text


@pytest.mark.parametrize(
    "largest, units, power",
    [
        (1e8, "1", 6),
        (5e4, "1", 3),
        (9.65e-19, "m^2/N", -19),
        (12e3, "N", 0),
        (0.05, "m", 0),
        (0.0, "m", 0),
    ],
)
def test_powers_of_ten(largest, units, power):
    assert power_of_ten([np.array([0.0, largest, np.nan])], units) == power


def test_axis_labels():
    assert axis_label("wear cycles", "1", 6) == "Wear cycles (millions)"
    assert axis_label("λ ratio", "1", 0) == "λ ratio"
    assert axis_label("RMS", "um", 0) == "RMS (µm)"
