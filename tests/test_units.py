import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wearlab import units
from wearlab.materials.grades import SCALES
from wearlab.units import KINDS, USUAL, UnitError, convert, is_quantity, quantity, split


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("20 mm", "length", 0.02),
        ("20mm", "length", 0.02),
        ("0.3 um", "depth", 3e-7),
        ("0.3 µm", "depth", 3e-7),  # micro sign
        ("0.3 μm", "depth", 3e-7),  # Greek mu
        ("-5 um", "depth", -5e-6),
        ("0 um", "depth", 0.0),
        ("20 deg", "angle", math.radians(20)),
        ("20°", "angle", math.radians(20)),
        ("340 N*m", "torque", 340.0),
        ("340 N m", "torque", 340.0),
        ("340 N·m", "torque", 340.0),
        ("340 Nm", "torque", 340.0),
        ("0.34 kNm", "torque", 340.0),
        ("3.4e2 N*m", "torque", 340.0),
        ("7300 kg*mm^2", "inertia", 7.3e-3),
        ("7300 kg·mm²", "inertia", 7.3e-3),
        ("7300 kg mm2", "inertia", 7.3e-3),
        ("1150 N/um", "stiffness", 1.15e9),
        ("5360 N s/m", "damping", 5360.0),
        ("5360 N*s*m^-1", "damping", 5360.0),
        ("1e6 N*m/rad", "torsional stiffness", 1e6),
        ("206 GPa", "pressure", 206e9),
        ("12 mPa*s", "viscosity", 0.012),
        ("16 1/GPa", "pressure-viscosity coefficient", 1.6e-8),
        ("16 GPa⁻¹", "pressure-viscosity coefficient", 1.6e-8),
        ("9.65e-19 m^2/N", "wear coefficient", 9.65e-19),
        ("9.65e-10 mm^3/Nm", "wear coefficient", 9.65e-19),
        ("9.65e-10 mm³/(N·m)", "wear coefficient", 9.65e-19),
        ("60 degC", "temperature", 333.15),
        ("60 °C", "temperature", 333.15),
        ("333.15 K", "temperature", 333.15),
        ("2 h", "time", 7200.0),
    ],
)
def test_texts_become_si(text, kind, value):
    assert quantity(text, kind) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    "unit", ["rpm", "1/min", "min^-1", "min⁻¹", "min**-1", "min-1", "r/min", "rev/min"]
)
def test_revolutions_per_minute_in_every_spelling(unit):
    assert quantity(f"1500 {unit}", "speed") == pytest.approx(
        1500 * 2 * math.pi / 60, rel=1e-15
    )


def test_radians_per_second_are_kept():
    assert quantity("25 rad/s", "speed") == 25.0


@pytest.mark.parametrize("text", ["25 Hz", "25 1/s", "25 s^-1", "25 kHz"])
def test_a_frequency_is_no_speed(text):
    with pytest.raises(UnitError, match=r"neither radians nor revolutions.*1100 rpm"):
        quantity(text, "speed")


@pytest.mark.parametrize(
    ("value", "kind", "said"),
    [
        (
            340,
            "torque",
            r"340 has no unit: write a torque with its unit, such as '340 N\*m'",
        ),
        (340.5, "torque", "340.5 has no unit"),
        ("340", "torque", "has no unit"),
        (True, "torque", "True is no quantity"),
        (None, "torque", "None is no quantity"),
        ([3], "torque", "is no quantity"),
        ("N*m", "torque", "write a torque"),
        ("nan N*m", "torque", "write a torque"),
        ("inf N*m", "torque", "write a torque"),
        ("1e999 N*m", "torque", "not finite"),
        ("340 mm", "torque", "'mm' is not a unit like"),
        (
            "340 Nmn",
            "torque",
            r"not a known unit; did you mean 'N\*m'|did you mean 'Nm'",
        ),
        ("340 J", "torque", "unit of energy"),
        ("340 N*m/rad", "torque", "one counts angle"),
        ("3 N*m", "torsional stiffness", "one counts angle"),
        ("20 %", "angle", "not a unit like 'rad'"),
        ("20 ppm", "angle", "not a unit like 'rad'"),
        ("20 grad", "angle", "'grad' is 'deg' or 'gon'"),
        ("20 Grad", "angle", "'Grad' is 'deg' or 'gon'"),
        ("1.2.3 mm", "length", "write a length"),
        ("1,5 mm", "length", "has a comma: the decimal sign is a point"),
        ("3*4 mm", "length", "not a known unit"),
        ("3 mm*2", "length", "not a known unit"),
        ("3 2 mm", "length", "not a known unit"),
        ("3 mm mm", "length", "not a unit like"),
        ("3 (mm", "length", "not a known unit"),
        ("3 __import__('os')", "length", "not a known unit"),
        ("0.012 MPa*s", "viscosity", "outside the plausible range"),
        ("20 km", "length", "outside the plausible range"),
        (
            "1.6e-8 1/GPa",
            "pressure-viscosity coefficient",
            "outside the plausible range",
        ),
    ],
)
def test_traps_are_closed(value, kind, said):
    with pytest.raises(UnitError, match=said):
        quantity(value, kind)


def test_messages_carry_the_value():
    with pytest.raises(UnitError, match=r"^'3 mm': "):
        quantity("3 mm", "torque")


@pytest.mark.parametrize("kind", KINDS.values(), ids=lambda kind: kind.name)
def test_every_example_and_usual_unit_is_of_its_kind(kind):
    assert quantity(kind.example, kind.name) != 0.0
    for unit in kind.units:
        if unit in SCALES:
            assert quantity(f"{60 if unit == 'HRC' else 100} {unit}", kind.name) > 1e8
            continue
        assert (
            quantity(f"0 {unit}", kind.name) in (0.0, 273.15)
            or kind.name == "temperature"
        )


@given(st.floats(1e-3, 1e4), st.sampled_from(["rpm", "rad/s", "deg/s"]))
def test_conversion_goes_back(value, unit):
    assert convert(convert(value, unit, "rad/s"), "rad/s", unit) == pytest.approx(
        value, rel=4e-16
    )


@pytest.mark.parametrize(
    ("value", "source", "target", "result"),
    [
        (3720 * math.pi / 30, "rad s-1", "rpm", 3720.0),
        (1e-6, "m", "um", 1.0),
        (3e8, "N m-1", "N/um", 300.0),
        (9e-19, "m2 N-1", "m^2/N", 9e-19),
        (1e-9, "m2 N-1", "mm^3/Nm", 1.0),
        (0.5, "1", "%", 50.0),
        (7200.0, "s", "h", 2.0),
        (math.pi, "rad", "deg", 180.0),
        (1e9, "Pa", "GPa", 1.0),
        (1e9, "Pa", "MPa", 1000.0),
        (1500.0, "N", "kN", 1.5),
        (340.0, "N m", "N*m", 340.0),
        (5.0, "mm", "mm", 5.0),
        (0.0, "degC", "K", 273.15),
    ],
)
def test_display_units(value, source, target, result):
    assert convert(value, source, target) == pytest.approx(result, rel=1e-15)


def test_arrays_convert_and_keep_their_shape():
    assert np.array_equal(
        convert(np.array([[1.0, 2.0]]), "mm", "um"), [[1000.0, 2000.0]]
    )


@pytest.mark.parametrize(
    "pair",
    [("m", "N"), ("Hz", "rpm"), ("rad/s", "Hz"), ("N*m", "N*m/rad"), ("m", "metrr")],
)
def test_other_dimensions_do_not_convert(pair):
    with pytest.raises(UnitError):
        convert(1.0, *pair)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_are_split_as_written(value):
    number, unit = split(f"{value!r} mm")
    assert float(number) == value and unit == "mm"


def test_what_looks_like_a_quantity():
    assert is_quantity("1.1e3 rpm") and is_quantity("20mm") and is_quantity("-3 um")
    assert not any(map(is_quantity, ("rk4", "1100", 3.0, True, "", "static", "e5 mm")))


def test_pint_waits_for_the_first_unit():
    code = (
        "import sys, wearlab.units, wearlab.campaign; print([m for m in sys.argv[1:] "
        "if m in sys.modules])"
    )
    heavy = ["pint", "numba", "xarray", "scipy", "matplotlib", "dask"]
    done = subprocess.run(
        [sys.executable, "-c", code, *heavy], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("one", USUAL)
def test_usual_units_are_those_of_pint_to_the_last_bit(one):
    factor, root = units._registry().get_root_units(units._unit(one))
    assert (float(factor), str(root)) == USUAL[one]


@pytest.mark.parametrize(
    "text, remedy",
    [
        ("2,5 mm", "write '2.5 mm'"),
        ("1,000 mm", "'1.000 mm', or '1000 mm' for thousands"),
        ("-,5 mm", "-.5"),
    ],
)
def test_a_decimal_comma_is_named(text, remedy):
    with pytest.raises(UnitError, match="the decimal sign is a point") as found:
        quantity(text, "length")
    assert remedy in str(found.value)


@pytest.mark.parametrize("text", ["20 grad", "3 grad/s"])
def test_no_unit_is_suggested_beside_the_two_that_a_name_means(text):
    """Of 'grad' it went on with "did you mean 'rad'?"."""
    with pytest.raises(UnitError) as refused:
        quantity(text, "angle")
    assert "did you mean" not in str(refused.value)
