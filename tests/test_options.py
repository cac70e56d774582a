"""What an option means is the text under it, as ``wearlab schema``
and messages tell it.
"""

import pydantic
import pytest

from wearlab import options
from wearlab.options import Number, Part, option


class Sample(Part):
    """Options with texts under them."""

    size: Number | None = None
    """how large, over
    two lines [as its mate]. Source: ISO 21771"""
    bare: Number | None = None
    """nothing more"""
    told: Number = option(2.0, "told in place", source="ISO 53")
    """not this"""
    needed: Number
    """[first, last], where brackets begin"""


class Narrower(Sample):
    """Options with another text, or that of the base."""

    bare: Number | None = None
    """another meaning"""
    size: Number | None = 1.0


@pytest.mark.parametrize(
    ("part", "key", "description", "derived", "source"),
    [
        (Sample, "size", "how large, over two lines", "as its mate", "ISO 21771"),
        (Sample, "bare", "nothing more", "none", None),
        (Sample, "told", "told in place", None, "ISO 53"),
        (Sample, "needed", "[first, last], where brackets begin", None, None),
        (Narrower, "bare", "another meaning", "none", None),
        (Narrower, "told", "told in place", None, "ISO 53"),
        (Narrower, "size", "how large, over two lines", "as its mate", "ISO 21771"),
    ],
)
def test_the_schema_tells_the_text_under_an_option(
    part, key, description, derived, source
):
    told = part.model_json_schema()["properties"][key]
    assert (told["description"], told.get("derived"), told.get("source")) == (
        description,
        derived,
        source,
    )
    assert part.texts()[key]["description"] == description


@pytest.mark.parametrize("value", [1e9, "1e9 h"])
def test_hours_beyond_any_time_are_refused_with_and_without_a_unit(value):
    hours = pydantic.TypeAdapter(options.Hours)
    with pytest.raises(pydantic.ValidationError, match="outside the plausible range"):
        hours.validate_python(value)
    assert hours.validate_python(20_000) == hours.validate_python("20000 h") == 20_000
    assert hours.validate_python(options.Stored(1e9)) == 1e9  # of a run on disk


def test_options_have_kinds_for_velocities_and_temperature_differences():
    velocity = pydantic.TypeAdapter(options.Velocity).validate_python
    assert velocity("2 m/s") == 2.0 == velocity("2000 mm/s")
    difference = pydantic.TypeAdapter(options.TemperatureDifference).validate_python
    assert difference("20 K") == 20.0 and difference("-5 K") == -5.0
    message = r"'degC' counts from a zero; expected a temperature difference such as"
    with pytest.raises(pydantic.ValidationError, match=message):
        difference("20 degC")
    with pytest.raises(pydantic.ValidationError, match="expected a velocity"):
        velocity("20 rpm")
