"""What workshops write in their tables, and what is said where it is not understood."""

import pytest
from made import data

from wearlab.campaign.update_options import (
    Columns,
    ErrorModel,
    RecordBlock,
    RecordColumns,
)
from wearlab.updating import UpdateError
from wearlab.updating.measurements import read_observations, read_record

HEAD = "Datum;Verschleißtiefe Ritzel{unit}\n"


def read(folder, rows, unit=" [µm]"):
    path = folder / "m3.csv"
    path.write_text(HEAD.format(unit=unit) + rows, encoding="utf-8")
    columns = Columns(hours="Datum", value="Verschleißtiefe Ritzel")
    block = data(ErrorModel(2e-6), quantity="max_wear_depth", where="pinion")
    return read_observations(
        block.model_copy(update={"file": path, "columns": columns})
    )


def test_a_remedy_is_toml_as_it_stands(tmp_path):
    with pytest.raises(
        UpdateError, match=r'units = \{ "Verschleißtiefe Ritzel" = "…" \}'
    ):
        read(tmp_path, "100;12,5\n200;19,0\n", unit="")


@pytest.mark.parametrize("unit", ["1/min", "U/min", "min^-1", "min⁻¹", "r/min", "rpm"])
def test_revolutions_in_a_record_are_read_as_they_are_written(tmp_path, unit):
    path = tmp_path / "record.csv"
    path.write_text(
        f"h;Moment [Nm];Drehzahl [{unit}]\n0;420;980\n9;300;980\n20;;\n",
        encoding="utf-8",
    )
    columns = RecordColumns(hours="h", torque="Moment", speed="Drehzahl")
    record = read_record(RecordBlock(file=path, columns=columns), None, None)
    assert record.speed == pytest.approx([980 * 0.10471975511965977] * 2)


def test_a_unit_in_a_header_that_is_not_known_is_named(tmp_path):
    with pytest.raises(
        UpdateError,
        match=r"line 1: no column .*\[Tick\] in its header is no unit that is",
    ):
        read(tmp_path, "100;12,5\n200;19,0\n", unit=" [Tick]")


def test_less_than_a_limit_of_detection_is_read_as_it_is_written(tmp_path):
    seen = read(tmp_path, "100;<0,1\n200;19,0\n300;< 2,5\n")
    assert seen.censored.tolist() == [True, False, True]
    assert seen.below[[0, 2]] == pytest.approx([0.1e-6, 2.5e-6]) and seen.value[
        1
    ] == pytest.approx(19e-6)


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (
            "100;12,5\n200;\n",
            "write the value, name its limit of detection .* or delete the row",
        ),
        ("-5;12,5\n200;19,0\n", "line 2, column 'Datum': -5 is before the first"),
        ("100;<0,x\n200;1\n", "'0,x' is no number"),
    ],
)
def test_what_cannot_be_is_told_with_value_and_remedy(tmp_path, rows, said):
    with pytest.raises(UpdateError, match=said):
        read(tmp_path, rows)


def test_of_two_columns_that_say_when_the_one_that_is_read_is_told(tmp_path):
    from conftest import STATIC

    import wearlab as wl
    from wearlab.cli.commands import plan

    (tmp_path / "weighings.csv").write_text("cycles,hours,loss\n5e7,760,140\n")
    (tmp_path / "weighed.toml").write_text(STATIC)
    lines = list(plan._update(wl.load(tmp_path / "weighed.toml")))
    assert any(line.endswith("when, by cycle: not by hours") for line in lines), lines
