"""A file that cannot be right ends the command with one message and status 2, and
nothing is written.
"""

import pytest
from scenes import CAMPAIGNS

from wearlab.cli.app import status_of

CAMPAIGN = CAMPAIGNS / "update_gearbox.toml"
GOOD = "hours,loss_mg,below_mg\n2000,,40\n6200,300,\n"
HOSTILE = {
    "endless value": (
        "hours,loss_mg,below_mg\n2000,1e308,\n",
        "beyond anything that is measured",
    ),
    "endless time": (
        "hours,loss_mg,below_mg\n1e308,1,\n",
        "beyond anything that is measured",
    ),
    "endless field": (
        f"hours,loss_mg,below_mg\n2000,{'4' * 140_000},\n",
        "more than 100,000 characters",
    ),
    "endless header": (
        f"hours,loss_mg,{'x' * 140_000}\n1,2,3\n",
        "more than 100,000 characters",
    ),
    "doubled header": (
        "hours,loss_mg,loss_mg\n1,2,3\n",
        "two columns are called 'loss'",
    ),
    "no number": ("hours,loss_mg,below_mg\n2000,nan,\n", "line 2, column 'loss'"),
    "negative time": ("hours,loss_mg,below_mg\n-5,1,\n", "before the first cycle"),
    "mixed commas": (
        "hours;loss_mg;below_mg\n2000;1,5;\n4000;1.5;\n",
        "'1,5' is no number",
    ),
    "thousands": (
        "hours;loss_mg;below_mg\n2.000;1,5;\n4000,5;2;\n",
        "'2.000' is no number (decimal comma)",
    ),
    "thousands or decimals": (
        "hours\tloss_mg\tbelow_mg\n2,000\t200\t\n4,000\t410\t\n",
        "column 'hours' is like 2,000, read as 2, in a file of tabs",
    ),
    "error of a spreadsheet": (
        "hours,loss_mg,below_mg\n2000,200,\n#DIV/0!,410,\n",
        "line 3, column 'hours': '#DIV/0!' is an error of the spreadsheet",
    ),
    "a point among commas": (
        "hours;loss_mg;below_mg\n2000;1,5;\n4000;2,5;\n5000;3.5;\n",
        "line 4, column 'loss': '3.5' is no number (decimal comma)",
    ),
    "zeros of a binary file": ("hours,loss_mg,below_mg\n20\x0000,1,\n", "line 2"),
    "no rows": ("hours,loss_mg,below_mg\n", "no rows"),
}


@pytest.fixture
def told(tmp_path, capsys):
    def run(command, text, change=("", ""), encoding="utf-8"):
        file = tmp_path / "study.toml"
        store = tmp_path / "store"
        (tmp_path / "measured").mkdir()
        (tmp_path / "measured" / "gearbox_weighings.csv").write_text(
            text, encoding=encoding
        )
        file.write_text(CAMPAIGN.read_text().replace(*change))
        place = [] if command == "check" else ["--store", str(store)]
        status = status_of([command, str(file), *place])
        assert command == "check" or not store.exists()
        return status, capsys.readouterr().err.strip()

    return run


@pytest.mark.parametrize("case", HOSTILE)
def test_a_hostile_file_is_one_message(told, case):
    text, expected = HOSTILE[case]
    status, said = told("update", text)
    assert status == 2 and expected in said and len(said) < 1000
    assert (
        len(said.splitlines()) == 1
        and "gearbox_weighings.csv" in said
        and "Traceback" not in said
    )


@pytest.mark.parametrize("date", ["03/04/2026", "31.02.2026", "yesterday"])
def test_a_date_that_cannot_be_read_is_one_message(told, date):
    columns = """columns  = { hours = "hours", value = "loss_mg", below = "below_mg" }
units    = { hours = "h", loss_mg"""
    text = f"day,loss_mg,below_mg\n{date},300,\n"
    dated = columns.replace('hours = "hours"', 'date = "day"').replace(
        'hours = "h", ', ""
    )
    status, said = told("update", text, (columns, dated))
    assert status == 2 and len(said.splitlines()) == 1 and date in said


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_what_excel_writes_before_the_header_is_no_part_of_it(told, encoding):
    assert told("check", GOOD, encoding=encoding)[0] == 0


@pytest.mark.parametrize("command", ["check", "update"])
def test_wear_deeper_than_a_tooth_is_thick_is_in_another_unit(told, command):
    block = CAMPAIGN.read_text().partition("[[update.data]]")[2].partition("\n[")[0]
    measured = """
file     = "measured/gearbox_weighings.csv"
quantity = "max_wear_depth"
flank    = "pinion"
columns  = { hours = "hours", value = "depth" }
units    = { hours = "h", depth = "mm" }
error    = { sd = "2 um" }
"""
    status, said = told(
        command, "hours,depth\n2000,0.004\n6200,12\n", (block, measured)
    )
    assert (
        status == 2
        and "line 3: max_wear_depth of 12 mm is deeper than a tooth is thick" in said
    )
    assert "update.data[0].units" in said and len(said.splitlines()) == 1
