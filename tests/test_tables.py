"""The one reader of tables: what people and machines write, and what is refused with
one clear message.
"""

import time

import numpy as np
import pytest

import wearlab as wl
from wearlab.cli.app import status_of
from wearlab.scene.duty_file import load_table_of
from wearlab.tables import ReadTable, TableError, read_table, reading, table_of
from wearlab.tables.cells import kind_of, number_in, plain_numbers

PAIR = """
[gears]
kind = "external-pair"
module = "3 mm"
face_width = "20 mm"
pinion.teeth = 20
gear.teeth = 30
[operation]
duty = { file = "duty.csv" UNITS }
[wear]
load = "static"
coefficient = { model = "constant", value = "1e-18 m^2/N" }
until = { cycles = 1e6 }
"""


@pytest.fixture
def table(tmp_path):
    def read(text: str | bytes, encoding: str = "utf-8") -> ReadTable:
        (tmp_path / "t.csv").write_bytes(
            text if isinstance(text, bytes) else text.encode(encoding)
        )
        return read_table(tmp_path / "t.csv")

    return read


HEADERS = "torque [N*m],speed [rpm],hours\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            f"345,1200,9000\n{HEADERS}0,1500,900\n",
            "line 1 holds values like a row, abov",
        ),
        (
            f"{HEADERS}0,x,y\n{HEADERS}0,1500,900\n",
            "line 1 has the headers of line 3 a",
        ),
        (f"{HEADERS}0,1500,900\n1,2,3,4,x\n", "line 3: 5 columns instead of 3"),
    ],
    ids=["rows above the headers", "headers twice", "a last row that is too wide"],
)
def test_no_row_is_left_unread_in_silence(table, text, message):
    with pytest.raises(TableError, match=message):
        table(text)


GERMAN = (
    "Anlage;7\r\nBediener;Meier\r\n\r\nDatum;Masse [mg];Stunden / h;Notiz\r\n"
    "01.02.2026;1.234,5;10,5;nach Ölwechsel\r\n13.02.2026 14:30;2,5;20;\r\nSumme;;;\r\n"
)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_a_weighing_as_excel_in_germany_writes_it(table, encoding):
    """Lines above the headers, units in them, decimal commas, thousands, a column of
    notes, an end mark.
    """
    read = table(GERMAN, encoding)
    assert (
        read.names == ("Datum", "Masse", "Stunden", "Notiz") and read.header_line == 4
    )
    assert read.units == {"Datum": "", "Masse": "mg", "Stunden": "h", "Notiz": ""}
    assert (
        read.lines == (5, 6)
        and read.left_out == 1
        and read.preamble == ("Anlage;7", "Bediener;Meier")
    )
    np.testing.assert_array_equal(read.numbers("Masse"), [1234.5, 2.5])
    np.testing.assert_array_equal(read.numbers("Stunden"), [10.5, 20.0])
    days = np.array(["2026-02-01T00:00", "2026-02-13T14:30"], "datetime64[s]")
    np.testing.assert_array_equal(read.dates("Datum"), days)
    assert (
        read.find("Masse [mg]") == read.find("masse") == "Masse"
        and read.find("mass") is None
    )


@pytest.mark.parametrize(
    "text",
    [
        "t,F / kN\n0.5,1.5\n1.5,-2e3\n",
        "t\tF (kN)\n0,5\t1,5\n1,5\t-2e3\n",
        "t|F_x\ns|kN\n0.5|1.5\n1.5|-2e3\n".replace("F_x", "F"),
        "# a comment\nt F\ns kN\n0.5 1.5\n1.5 -2e3\n",
        '"t";"F in kN";\n"0,5";"1,5";\n"1,5";"-2.000,0";\n',
    ],
    ids=[
        "comma",
        "tab",
        "bar and a row of units",
        "blanks",
        "quotes, thousands, a separator at the end",
    ],
)
def test_one_table_in_five_dialects(table, text):
    read = table(text)
    assert read.names == ("t", "F") and read.units["F"] == "kN"
    np.testing.assert_array_equal(read.numbers("t"), [0.5, 1.5])
    np.testing.assert_array_equal(read.numbers("F"), [1.5, -2000.0])


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("2026-02-03", "2026-12-31T13:05"),
        ("2026-02-03 00:00:00", "2026-12-31T14:05+01:00"),
        ("03.02.2026", "31.12.26 13:05"),
        ("03/02/2026", "31/12/2026 13:05"),
        ("2/3/26", "12/31/26 1:05 PM"),
        ("2/3/2026 12:00:00 AM", "12/31/2026 1:05:00 PM"),
        ("03-02-2026", "31-12-2026 13:05"),
        ("3-Feb-26", "31-Dec-2026 13:05"),
    ],
)
def test_dates_as_they_are_written_in_europe_and_america(table, first, second):
    read = table(f"day;mass\n{first};1\n{second};2\n")
    days = np.array(["2026-02-03T00:00", "2026-12-31T13:05"], "datetime64[s]")
    np.testing.assert_array_equal(read.dates("day"), days)


def test_a_date_of_two_meanings_is_refused_until_it_is_told(table):
    read = table("day,mass\n5/5/2026,1\n2/3/2026,2\n")
    with pytest.raises(
        TableError,
        match=r"t.csv: line 3, column 'day': '2/3/2026' has day and month .* "
        r"date_format",
    ):
        read.dates("day")
    assert read.dates("day", "%d/%m/%Y")[1] == np.datetime64("2026-03-02")
    assert read.dates("day", "%m/%d/%Y")[1] == np.datetime64("2026-02-03")
    assert table("day,mass\n5/5/2026,1\n").dates("day")[0] == np.datetime64(
        "2026-05-05"
    )


@pytest.mark.parametrize(
    ("days", "said"),
    [
        (
            "13/2/2026 2/13/2026",
            "line 3, column 'day': '2/13/2026' has the month first, '13/2/2026' in "
            "line 2",
        ),
        (
            "31.02.2026 01.03.2026",
            "line 2, column 'day': '31.02.2026' is no date that exists",
        ),
        (
            "2026-02-01 soon",
            "line 3, column 'day': 'soon' is no date; write 2026-12-31",
        ),
        (
            "2026-02-01 45321",
            "line 3, column 'day': '45321' is no date; write 2026-12-31",
        ),
    ],
)
def test_what_is_no_date_is_told_by_its_line(table, days, said):
    first, second = days.split()
    with pytest.raises(TableError, match=said):
        table(f"day;mass\n{first};1\n{second};2\n").dates("day")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "a,b\n1,2\na,b\n3,4\n",
            "t.csv: line 3: the headers of line 1 again; delete the line",
        ),
        ("a,a\n1,2\n", "t.csv: line 1: two columns are called 'a'; rename one of them"),
        (b"a,b\n1,\x002\n", "t.csv: line 2: holds a NUL byte"),
        ("a,b\n1," + "2" * 140_000, "t.csv: line 2: more than 100,000 characters"),
        (
            "a,b\n1,2\n3\n4,5\n",
            "t.csv: line 3: 1 columns instead of 2: '3'; every row must hold 2 cells",
        ),
        ("a,b\n1,2\n3,4,5\n", "t.csv: line 3: 3 columns instead of 2"),
        ("", "t.csv: no rows under a header"),
        ("1,2\n3,4\n", "t.csv: no table was found: no line of headers"),
        (
            b"PK\x03\x04 and so on",
            r"t.csv: cannot be read as a workbook .*: save it again in a spread",
        ),
        (b"\xff\xfe\x00\xd8", "t.csv: "),
    ],
)
def test_a_hostile_file_is_refused_in_one_sentence(table, text, said):
    with pytest.raises(TableError, match=said):
        table(text)


@pytest.mark.parametrize(
    ("cell", "said"),
    [
        ("1e308", "beyond anything that is measured; the largest is 1e"),
        ("1e999", "is not finite"),
        ("nan", "is not finite"),
        ("", "is empty"),
        ("1,5", "'1,5' is no number .decimal point"),
        ("0x10", "'0x10' is no number"),
        ("True", "'True' is no number"),
    ],
)
def test_what_is_no_number_is_told_by_line_and_column(table, cell, said):
    read = table(f't,F\n1.5,2\n2,"{cell}"\n3,4\n')
    with pytest.raises(TableError, match=f"t.csv: line 3, column 'F': .*{said}"):
        read.numbers("F")
    if not cell:
        assert np.isnan(read.numbers("F", empty=True)[1])


DUTIES = {
    "header": (
        "Md [kNm];n [1/min];Zeit [h]\n0,05;1000;6\n0,10;500;2\n",
        ', columns = { torque = "Md", speed = "n", share = "Zeit" }',
    ),
    "usual names": (
        "Nr;Drehmoment [Nm];Drehzahl [1/min];Zeitanteil "
        "[%]\n1;50;1000;75\n2;100;500;25\n",
        "",
    ),
    "its name before others": (
        "time,torque,speed,share\n9,50,1000,0.75\n8,100,500,0.25\n",
        ', units = { torque = "N*m", speed = "rpm" }',
    ),
    "file": (
        "torque,speed,share\n50,1000,0.75\n100,500,0.25\n",
        ', units = { torque = "N*m", speed = "rpm" }',
    ),
}


def test_a_duty_takes_its_units_from_its_headers(tmp_path):
    scenes = []
    for name, (text, keys) in DUTIES.items():
        folder = tmp_path / name
        folder.mkdir()
        (folder / "duty.csv").write_text(text)
        (folder / "c.toml").write_text(PAIR.replace(" UNITS", keys))
        scenes.append(wl.load(folder / "c.toml").cases[0].scene)
    assert len({scene.id for scene in scenes}) == 1
    assert [block.share for block in scenes[0].operation.duty] == [0.75, 0.25]


@pytest.mark.parametrize("torque", ["1e308", "9" * 140_000, "\0", "abc"])
def test_a_campaign_with_a_hostile_table_is_refused_whole(
    tmp_path, monkeypatch, capsys, torque
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "duty.csv").write_text(f"torque,speed,share\n{torque},1000,1\n")
    (tmp_path / "c.toml").write_text(
        PAIR.replace(" UNITS", ', units = { torque = "N*m", speed = "rpm" }')
    )
    assert status_of(["check", "c.toml"]) == 2
    said = capsys.readouterr().err
    assert "operation.duty: duty.csv: line 2" in said and len(said) < 400


SPECTRUM = "T [Nm];n [1/min];t [h]\n312;1.200;100\n250;1.400;900\n"


def test_thousands_with_a_point_are_told_and_mixed_signs_refused(
    table, tmp_path, capsys
):
    (doubt,) = table(SPECTRUM).doubts
    assert (
        "column 'n' is like 1.200, read as 1.2" in doubt
        and "where the point parts thousands" in doubt
    )
    assert table(SPECTRUM.replace("1.400", "1.4")).doubts == ()
    mixed = table(SPECTRUM.replace("312", "312,5"))
    with pytest.raises(
        TableError,
        match=r"'1\.200' .*file mixes ',' and '.': remove the thousands separators",
    ):
        mixed.numbers("n")
    (tmp_path / "duty.csv").write_text(SPECTRUM)
    columns = ', columns = { torque = "T", speed = "n", share = "t" }'
    (tmp_path / "c.toml").write_text('title = "x"' + PAIR.replace(" UNITS", columns))
    assert status_of(["check", str(tmp_path / "c.toml")]) == 0
    said = capsys.readouterr()
    assert doubt.removeprefix("t.csv") in said.err and "decimal point" in said.out
    mean = (0.1 * 312 * 1.2 + 0.9 * 250 * 1.4) * np.pi / 30e3
    assert f"{mean:.6g}" in said.out.split("mean")[1]


@pytest.mark.parametrize(
    "text",
    [
        "T (Nm),n (rpm),t (h)\n60,1450,400\n45,900,1200\n",
        "Load case,M [kNm],n [min-1],h [%]\n1,0.060,1450,25\n2,0.045,900,75\n",
        "torque_Nm,speed_rpm,hours\n60,1450,400\n45,900,1200\n",
        "Drehmoment in Nm;Drehzahl in U/min;Stunden\n60,0;1450;400\n45,0;900;1200\n",
    ],
)
def test_columns_of_a_spectrum_are_known_by_their_units_where_their_names_are_symbols(
    tmp_path, text
):
    """Were three tries: one column was asked for at a time."""
    (tmp_path / "k.csv").write_text(text)
    torque, speed, share = load_table_of(read_table(tmp_path / "k.csv"), {}, {})
    assert torque == pytest.approx((60.0, 45.0)) and speed == pytest.approx(
        (151.8436, 94.24778)
    )
    assert share[1] / share[0] == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "a,b,c\n1,2,3\n",
            r'none is called torque, speed, share: columns = \{ torque = "…", speed = '
            r'"…", sh',
        ),
        ("T [Nm],M [Nm],n [rpm],share\n1,1,2,3\n", "none is called torque: columns"),
        (
            "Torque,Speed,Share\n1,2,3\n",
            r'units.torque and units.speed required: units = \{ torque = "N\*m", sp',
        ),
    ],
)
def test_all_that_a_spectrum_lacks_is_told_at_once(tmp_path, text, said):
    (tmp_path / "k.csv").write_text(text)
    with pytest.raises(TableError, match=said):
        load_table_of(read_table(tmp_path / "k.csv"), {}, {})


@pytest.mark.parametrize(
    ("text", "separator"),
    [
        ("cycles\tloss (mg)\n10 000\t200\n20 000\t410\n", "\t"),
        ("cycles\tloss (mg)\n10\u202f000\t200\n20\u202f000\t410\n", "\t"),
        ("cycles;loss (mg)\n10\u2009000;200\n20'000;410\n", ";"),
        ("cycles, loss (mg)\n10 000, 200\n20 000, 410\n", ","),
        ("cycles loss (mg)\n10\u00a0000 200\n20\u202f000 410\n", ""),
        ("cycles\tloss (mg)\n10,000.0\t200\n20,000\t410\n", "\t"),
    ],
)
def test_a_blank_in_a_header_or_between_thousands_separates_nothing(
    table, text, separator
):
    read = table(text)
    assert read.separator == separator and read.doubts == ()
    assert read.names == ("cycles", "loss") and read.units["loss"] == "mg"
    np.testing.assert_array_equal(read.numbers("cycles"), [1e4, 2e4])
    np.testing.assert_array_equal(read.numbers("loss"), [200.0, 410.0])


def test_thousands_are_known_by_their_column(table):
    read = table("cycles\tloss\n900,000\t200\n1,100,000\t410\n")
    np.testing.assert_array_equal(read.numbers("cycles"), [9e5, 1.1e6])
    read = table("cycles;loss\n900.000;0,2\n1.100.000;0,4\n")
    np.testing.assert_array_equal(read.numbers("cycles"), [9e5, 1.1e6])
    assert read.doubts == ()


@pytest.mark.parametrize(
    "text",
    [
        "cycles\tloss\n100,000\t200\n200,000\t410\n",
        "cycles\tloss\n100\t1.200\n200\t2.410\n",
        "cycles;loss\n100,000;200\n200,000;410\n",
        "cycles loss\n100,000 200\n200,000 410\n",
        "cycles|loss\n-100,000|200\n200,000|410\n",
    ],
)
def test_a_number_of_two_meanings_asks_and_the_answer_is_taken(table, tmp_path, text):
    read = table(text)
    (doubt,) = read.doubts
    name = "loss" if "1.200" in text else "cycles"
    with pytest.raises(TableError, match=r"parts thousands.*decimal = \"") as refused:
        read.numbers(name)
    assert str(refused.value) == doubt
    path = tmp_path / "t.csv"
    decided = read_table(path, decimal=read.decimal)
    assert decided.doubts == ()
    assert abs(decided.numbers(name)[0]) == (1.2 if "1.200" in text else 100.0)
    sign = read.decimal
    path.write_text(text.replace(sign, ""))
    assert read_table(path).numbers(name)[1] == (2410.0 if name == "loss" else 2e5)


OF_OTHER_LANGUAGES = (
    "#VALEUR!", "#NOM?", "#¡VALOR!", "#¿NOMBRE?", "#N/D", "#RIF!", "#WAARDE!", "#I/T",
    "#ДЕЛ/0!", "#Н/Д", "#SAYI/0!", "#HIÁNYZIK", "Errore:502",
)  # fmt: skip


@pytest.mark.parametrize(
    "error",
    ["#DIV/0!", "#N/A", "#NV", "#WERT!", "####", "#REF!", "#n/a", *OF_OTHER_LANGUAGES],
)
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_an_error_of_a_spreadsheet_is_refused_by_its_row(table, error, separator):
    rows = ["cycles,loss", "100,200", f"{error},410", "300,600", f"400,{error}"]
    text = "\n".join(rows).replace(",", separator) + "\n"
    read = table("# a comment, with a comma\n" + text)
    assert read.lines == (3, 4, 5, 6)
    for name, line in (("cycles", 4), ("loss", 6)):
        with pytest.raises(TableError, match=f"line {line}, column '{name}': .*mend"):
            read.numbers(name)
    first = table(f"cycles;loss\n{error};{error}\n100;200\n")
    assert first.names == ("cycles", "loss") and len(first) == 2


def test_an_error_among_dates_is_told(table):
    with pytest.raises(TableError, match="line 3, column 'day': '#NV' is an error"):
        table("day;loss\n2026-02-03;1\n#NV;2\n").dates("day")


@pytest.mark.parametrize(
    "cells",
    [
        ("2026/02/28", "2026/12/31"),
        ("2026.2.28", "2026.12.31"),
        ("20260228", "20261231"),
        ("46081", "46387"),
        ("46081.5", "46387.25"),
        ("46081,5", "46387,25"),
        ("2026/2/28 12:00", "2026/12/31 6:00 AM"),
    ],
)
def test_dates_of_programs_and_serial_numbers_of_spreadsheets(table, cells):
    read = table(f"day;loss\n{cells[0]};1\n{cells[1]};2\n")
    days = read.dates("day").astype("datetime64[D]")
    np.testing.assert_array_equal(days, np.array(["2026-02-28", "2026-12-31"], "M8[D]"))


def test_rows_of_sums_are_left_out_and_told(table):
    read = table("Nr;T [Nm];t [h]\n1;50;10\nZwischensumme;50;10\n2;60;20\nSumme;;30\n")
    np.testing.assert_array_equal(read.numbers("t"), [10.0, 20.0])
    assert read.lines == (2, 4)
    assert "'Zwischensumme' in line 3 and 'Summe' in line 5 left out" in read.understood


@pytest.mark.parametrize(
    "text",
    [
        "% made by MATLAB\n% t F\n0.5 1.5\n1.5 -2e3\n",
        "# numpy\n# t,F\n5.0e-01,1.5e+00\n1.5e+00,-2e3\n",
        "%t\tF\n0.5\t1.5\n1.5\t-2000\n",
    ],
)
def test_headers_in_a_comment_above_the_numbers(table, text):
    read = table(text)
    assert read.names == ("t", "F")
    np.testing.assert_array_equal(read.numbers("F"), [1.5, -2000.0])


def test_idle_standing_and_reversed_rows_of_a_spectrum_are_read(
    tmp_path, monkeypatch, capsys
):
    """They were refused, so that people deleted their idle hours."""
    monkeypatch.chdir(tmp_path)
    rows = "0;0;4000\n345;1200;9000\n567;1150;800\n-210;-1180;300\n0;1500;900\n"
    (tmp_path / "duty.csv").write_text(f"T [Nm];n [1/min];t [h]\n{rows}")
    text = 'title = "x"' + PAIR.replace(" UNITS", "")
    (tmp_path / "c.toml").write_text(text)
    blocks = wl.load(tmp_path / "c.toml").cases[0].scene.operation.blocks
    assert [block.torque for block in blocks] == [0.0, 345.0, 567.0, -210.0, 0.0]
    speeds = [block.speed * 30.0 / np.pi for block in blocks]
    assert speeds == pytest.approx([0.0, 1200.0, 1150.0, 1180.0, 1500.0])
    assert [block.share * 15_000 for block in blocks] == pytest.approx(
        [4000, 9000, 800, 300, 900]
    )
    assert status_of(["check", "c.toml"]) == 0
    shown = capsys.readouterr().out.split("load spectrum of")[1]
    assert "front   87.72" in shown and "back    100" in shown
    assert "turns in 1000 h" in shown


def test_percent_in_a_row_of_units_is_no_comment(table):
    read = table("share;torque\n%;Nm\n25;100\n75;200\n")
    assert read.units == {"share": "%", "torque": "Nm"} and len(read) == 2


def test_a_header_may_be_a_number_sign(table):
    assert table("#;T\n1;50\n2;60\n").names == ("#", "T")


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("210;1180;-300", "line 3, column 't': -300 is negative: .* delete the row"),
    ],
)
def test_a_row_of_a_spectrum_is_refused_by_row_column_and_value(tmp_path, row, message):
    text = f"T [Nm];n [1/min];t [h]\n345;1200;9000\n{row}\n567;1150,5;800\n"
    (tmp_path / "k.csv").write_text(text)
    with pytest.raises(TableError, match=f"k.csv: {message}"):
        load_table_of(read_table(tmp_path / "k.csv"), {}, {})
    (tmp_path / "k.csv").write_text(text.replace(f"{row}\n", ""))  # the remedy
    assert len(load_table_of(read_table(tmp_path / "k.csv"), {}, {}).torque) == 2


def test_a_spectrum_without_time_is_refused(tmp_path):
    (tmp_path / "k.csv").write_text("T [Nm];n [1/min];t [h]\n345;1200;0\n")
    with pytest.raises(TableError, match="column 't': every row is 0: give each"):
        load_table_of(read_table(tmp_path / "k.csv"), {}, {})


BINS = """T [Nm];n [1/min];t [h];cycles
0;0;4000;0
345;1200;9000;6.48e8
567;1150;800;5.52e7
-210;1180;300;2.124e7
0;1500;900;8.1e7
"""
"""15 000 hours of a gearbox: at rest, loaded, reversed and idle."""


def scene_of(folder, text: str, keys: str = "") -> wl.Scene:
    (folder / "duty.csv").write_text(text)
    (folder / "c.toml").write_text(PAIR.replace(" UNITS", keys))
    return wl.load(folder / "c.toml").cases[0].scene


def test_hours_and_cycles_of_a_spectrum_are_one_time(tmp_path):
    """Cycles were no column, and shares alone stood in blocks."""
    both = scene_of(tmp_path, BINS)
    assert [15_000 * block.share for block in both.operation.blocks] == pytest.approx(
        [4000, 9000, 800, 300, 900]
    )
    turning = BINS.replace("0;0;4000;0\n", "")
    by_hours = scene_of(tmp_path, turning, ', columns = { hours = "t" }')
    by_cycles = scene_of(tmp_path, turning, ', columns = { cycles = "cycles" }')
    assert by_hours.id == by_cycles.id == scene_of(tmp_path, turning).id != both.id
    heads = "T [Nm];n [1/min];cycles\n"
    without = "\n".join(
        ";".join(cell for at, cell in enumerate(line.split(";")) if at != 2)
        for line in turning.splitlines()[1:]
    )
    assert scene_of(tmp_path, heads + without).id == by_hours.id


@pytest.mark.parametrize("key", ["hours", "cycles"])
def test_blocks_have_their_time_by_hours_or_cycles(key):
    loads = ((345, 1200, 9000), (567, 1150, 800), (-210, 1180, 300), (0, 1500, 900))
    scenes = []
    for name in ("share", key):
        blocks = [
            {
                "torque": f"{torque} N*m",
                "speed": f"{speed} rpm",
                name: {
                    "share": hours / 11_000,
                    "hours": hours,
                    "cycles": 60.0 * speed * hours,
                }[name],
            }
            for torque, speed, hours in loads
        ]
        gears = {"kind": "external-pair", "module": "3 mm", "face_width": "20 mm"}
        teeth = {"pinion": {"teeth": 20}, "gear": {"teeth": 30}}
        scenes.append(
            wl.Scene.from_mapping(
                {"gears": gears | teeth, "operation": {"duty": blocks}}
            )
        )
    assert scenes[0].id == scenes[1].id
    assert wl.Scene.from_canonical(scenes[1].canonical()).id == scenes[0].id


def test_the_middle_of_a_range_counts_and_check_tells_it(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    middles = scene_of(tmp_path, "T [Nm];n [rpm];t [h]\n50;1100;6\n90;1100;2\n")
    rows = "40;60;1100;6\n80;100;1100;2\n"
    by_name = scene_of(
        tmp_path, f"Drehmoment von [Nm];Drehmoment bis [Nm];n [rpm];t [h]\n{rows}"
    )
    written = ', columns = { torque = ["T1", "T2"] }'
    by_key = scene_of(tmp_path, f"T1 [Nm];T2 [Nm];n [rpm];t [h]\n{rows}", written)
    assert middles.id == by_name.id == by_key.id
    assert status_of(["check", "c.toml"]) == 0
    assert "torque is the middle of columns 'T1' and 'T2'" in capsys.readouterr().err

    block = '{ torque = "50 N*m", speed = ["1000 rpm", "1200 rpm"], hours = 6 }'
    other = '{ torque = ["80 N*m", "100 N*m"], speed = "1100 rpm", hours = 2 }'
    text = PAIR.replace('{ file = "duty.csv" UNITS }', f"[{block}, {other}]")
    (tmp_path / "c.toml").write_text(text)
    assert wl.load("c.toml").cases[0].scene.id == middles.id
    assert status_of(["check", "c.toml"]) == 0
    said = capsys.readouterr().err
    assert "speed of condition 1 is the middle of 1000 rpm and 1200 rpm" in said


@pytest.mark.parametrize(
    ("text", "message", "remedy"),
    [
        (
            BINS.replace("5.52e7", "6.52e7"),
            "line 4, column 'cycles': 6.52e7 is not the 5.52e[+]07 of its speed and "
            'time: mend .* columns = { share = "…" } or { cycles',
            ("6.52e7", "5.52e7"),
        ),
        (
            "T [Nm];n [rpm];cycles\n50;1100;1e6\n90;0;2e6\n",
            "line 3, column 'cycles': 2e6 cycles at speed 0 take no time: give its ",
            ("90;0", "90;1000"),
        ),
        (
            "T [Nm];n [rpm];share\n50;1100;0.6\n90;1000;0.2\n",
            "column 'share' sums to 0.8, not to 1 or 100, within 1 %: mend a share, or",
            ("0.2", "0.4"),
        ),
        (
            "T [Nm];n [rpm];share [%]\n50;1100;60\n90;1000;20\n",
            "column 'share' sums to 80, not to 100, within 1 %: mend a share, or say",
            ("20", "40"),
        ),
        (
            "T from [Nm];T to [Nm];n [rpm];t [h]\n50;60;1100;6\n",
            "none is called torque: columns",
            ("T ", "torque "),
        ),
        (
            "torque from [Nm];torque to [Nm];n [rpm];t [h]\n-50;60;1100;6\n",
            "line 2, column 'torque from': -50 to 60: a range on both sides of 0 loads",
            ("-50", "0"),
        ),
    ],
)
def test_a_spectrum_of_odd_times_is_refused_with_a_remedy_that_helps(
    table, text, message, remedy
):
    with pytest.raises(TableError, match=message):
        load_table_of(table(text), {}, {})
    wrong, right = remedy
    load_table_of(table(text.replace(wrong, right)), {}, {})


def test_shares_that_are_hours_are_told_how_to_say_so(table):
    text = "T [Nm];n [rpm];Zeit\n50;1100;600\n90;1000;200\n"
    with pytest.raises(TableError, match=r'sums to 800, .*units = \{ share = "h" \}'):
        load_table_of(table(text), {}, {})
    assert sum(load_table_of(table(text), {}, {"share": "h"}).share) == 800 * 3600


@pytest.mark.parametrize(
    ("times", "message"),
    [
        (("share = 0.5", "share = 0.4"), "sum to 0.9, not to 1: mend them, or give"),
        (("share = 0.5", "hours = 4"), "1 has 'share' and 2 has 'hours': give one of"),
        (("share = 0.5, hours = 3", "hours = 4"), "one of 'share' and 'hours', not"),
        (("hours = 3", ""), "its time is missing: give 'share', 'hours' or 'cycles'"),
        (("cycles = 3", "cycles = 4"), "condition 2: 4 cycles at speed 0 take no time"),
    ],
)
def test_blocks_of_odd_times_are_refused(tmp_path, times, message):
    loads = (
        'torque = "50 N*m", speed = "1000 rpm"',
        'torque = "0 N*m", speed = "0 rpm"',
    )
    blocks = [f"{{ {load}, {time} }}" for load, time in zip(loads, times, strict=True)]
    text = PAIR.replace('{ file = "duty.csv" UNITS }', f"[{', '.join(blocks)}]")
    (tmp_path / "c.toml").write_text(text.replace(",  }", " }"))
    with pytest.raises(wl.CampaignError, match=message):
        wl.load(tmp_path / "c.toml")


@pytest.mark.parametrize(
    ("ends", "message"),
    [
        ('["-1000 rpm", "1000 rpm"]', "-1000 rpm to 1000 rpm: a range on both sides"),
        ('["1000 rpm"]', r"\['1000 rpm'\] is no range: give two values, or one"),
    ],
)
def test_ranges_without_a_middle_are_refused(tmp_path, ends, message):
    block = f'[{{ torque = "50 N*m", speed = {ends}, hours = 6 }}]'
    text = PAIR.replace('{ file = "duty.csv" UNITS }', block)
    (tmp_path / "c.toml").write_text(text)
    with pytest.raises(wl.CampaignError, match=message):
        wl.load(tmp_path / "c.toml")


@pytest.mark.parametrize(
    "comment",
    ["# Achtung, Mittelwerte!", "#100,200", "#!/bin/sh", "#Note!", "# N/D, 3"],
)
def test_a_comment_is_no_error_of_a_spreadsheet(table, comment):
    read = table(f"{comment}\ncycles,loss\n100,200\n{comment}\n300,600\n")
    assert read.names == ("cycles", "loss") and read.lines == (3, 5)


def test_a_long_cell_of_capitals_is_a_text_at_once():
    """Ten thousand letters after # took seconds: each end was tried from each begin."""
    begin = time.process_time()
    assert kind_of("#" + "A" * 1_000_000, ".") == "text"
    assert time.process_time() - begin < 1.0


PARTS_OF_CELLS = [
    *("1", "-2.5", "1,5", "3e6", "1.234,5", "1,234", "12 000", "", " 7", "nan", "<0.1"),
    *(
        "Summe",
        "Total:",
        "U1",
        "a",
        '"1;2"',
        '"x"',
        "#N/A",
        "31.12.2026",
        "--1",
        "1e99",
    ),
]


def random_table(rng: np.random.Generator) -> str:
    """Return a table whose rows are mostly plain and now and then are not."""
    separator = str(rng.choice([";", ",", "\t", "|"]))
    width = int(rng.integers(2, 5))
    rows = [separator.join("abcd"[:width])]
    for _ in range(int(rng.integers(1, 12))):
        many = width + int(rng.choice([0, 0, 0, 0, 0, 0, 0, 0, 1, -1]))
        usual = PARTS_OF_CELLS[:3] if rng.random() < 0.8 else PARTS_OF_CELLS
        rows.append(separator.join(rng.choice(usual, many)))
    return "\n".join(rows) + "\n"


def outcome_of(read) -> object:
    """Return what a reading makes, or its refusal in words."""
    try:
        return read()
    except TableError as error:
        return str(error)


def test_plain_rows_are_read_as_each_by_itself(monkeypatch):
    rng = np.random.default_rng(20261130)
    texts = [random_table(rng).encode() for _ in range(1500)]
    counted: list[bool] = []
    plain_rows = reading._plain_rows

    def counting(rows, way):
        found = plain_rows(rows, way)
        counted.append(found is not None)
        return found

    monkeypatch.setattr(reading, "_plain_rows", counting)
    by_columns = [outcome_of(lambda t=text: table_of("t.csv", t)) for text in texts]
    monkeypatch.setattr(reading, "_plain_rows", lambda rows, way: None)
    by_rows = [outcome_of(lambda t=text: table_of("t.csv", t)) for text in texts]

    assert by_columns == by_rows
    assert 300 < sum(counted) < len(counted) - 300


@pytest.mark.parametrize("decimal", [".", ","])
def test_plain_numbers_are_those_of_each_cell(decimal):
    cells = ["1", "-2.5", "+3", ".5", "7.", "1e5", "2E-3", ",5", "1,25", "-3,", "4e+2"]
    odd = ["", "1_000", " 1", "nan", "inf", "1.2.3", "1,2,3", "--1", "e5", "1 000", "٣"]
    for cell in [*cells, *odd]:
        number = number_in(cell, decimal)
        found = plain_numbers(["12", cell], decimal)
        assert found is None or found == [12.0, number]
        is_other = "," in cell if decimal == "." else "." in cell
        if cell in cells and not is_other:
            assert found == [12.0, number]


def test_a_number_beyond_all_that_is_measured_is_refused_in_a_plain_column(table):
    read = table("a,b\n1,2\n3,1e99\n")
    with pytest.raises(TableError, match=r"line 3, column 'b': '1e99' is beyond"):
        read.numbers("b")
