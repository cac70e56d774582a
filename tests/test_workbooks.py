"""Workbooks are read as CSV is: spectra, inspections, profiles, points."""

import base64
import io
import sys
import zipfile
import zlib

import numpy as np
import pytest

import wearlab as wl
from wearlab.cli.app import status_of
from wearlab.tables import TableError, read_table, table_of
from wearlab.tables.ods import TAG
from wearlab.tables.workbook import PART_OF_ODS

openpyxl = pytest.importorskip("openpyxl")
pytest.importorskip("python_calamine")

PAIR = """
title = "x"
[gears]
kind = "external-pair"
module = "3 mm"
face_width = "20 mm"
pinion.teeth = 20
gear.teeth = 30
[operation]
duty = { file = "FILE" KEYS }
[wear]
load = "static"
coefficient = { model = "constant", value = "1e-18 m^2/N" }
until = { cycles = 1e6 }
"""
ROWS = [
    ["Drehmoment [Nm]", "Drehzahl [1/min]", "Dauer [h]"],
    ["345,5", 1200, "1.150,0"],
    [567, "1.150,5", 800],
    ["Summe", None, 1950],
]
ODS = """<?xml version="1.0" encoding="UTF-8"?>
<office:document-content
 xmlns:office="urn:oasis:names:tc:opendocument:xmlns:office:1.0"
 xmlns:table="urn:oasis:names:tc:opendocument:xmlns:table:1.0"
 xmlns:text="urn:oasis:names:tc:opendocument:xmlns:text:1.0" office:version="1.2">
<office:body><office:spreadsheet><table:table table:name="Lasten">
ROWS</table:table></office:spreadsheet></office:body></office:document-content>"""

MANIFEST = """<?xml version="1.0" encoding="UTF-8"?>
<manifest:manifest xmlns:manifest="urn:oasis:names:tc:opendocument:xmlns:manifest:1.0"
 manifest:version="1.2"><manifest:file-entry manifest:full-path="/"
 manifest:media-type="application/vnd.oasis.opendocument.spreadsheet"/>
</manifest:manifest>"""


def workbook(sheets, merged=(), hidden=()):
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
        if name in hidden:
            sheet.sheet_state = "hidden"
        for cells in merged:
            sheet.merge_cells(cells)
    content = io.BytesIO()
    book.save(content)
    return content.getvalue()


def ods(rows, more=""):
    def cell(value):
        if value is None:
            return "<table:table-cell/>"
        kind = "string" if isinstance(value, str) else "float"
        stated = "" if kind == "string" else f'office:value="{value}"'
        return (
            f'<table:table-cell office:value-type="{kind}" {stated}>'
            f"<text:p>{value}</text:p></table:table-cell>"
        )

    lines = (
        f"<table:table-row>{''.join(map(cell, row))}</table:table-row>" for row in rows
    )
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        archive.writestr("META-INF/manifest.xml", MANIFEST)
        archive.writestr("content.xml", ODS.replace("ROWS", "".join(lines) + more))
    return content.getvalue()


@pytest.mark.parametrize("kind", ["xlsx", "ods"])
def test_texts_and_numbers_of_a_german_sheet(kind):
    raw = workbook({"Lasten": ROWS}) if kind == "xlsx" else ods(ROWS)
    table = table_of(f"a.{kind}", raw)
    assert table.names == ("Drehmoment", "Drehzahl", "Dauer")
    np.testing.assert_array_equal(table.numbers("Drehmoment"), [345.5, 567.0])
    np.testing.assert_array_equal(table.numbers("Drehzahl"), [1200.0, 1150.5])
    np.testing.assert_array_equal(table.numbers("Dauer"), [1150.0, 800.0])
    assert "sheet 'Lasten', headers in row 1, 2 rows" in table.understood
    assert "'Summe' in line 4 left out" in table.understood and table.doubts == ()


def test_a_spectrum_is_the_same_scene_from_csv_and_workbooks(tmp_path):
    files = {
        "a.csv": (
            b"Drehmoment [Nm];Drehzahl [1/min];Dauer [h]\n345,5;1200;1150\n"
            b"567;1150,5;800\n"
        ),
        "a.xlsx": workbook({"Lasten": ROWS, "Notizen": [["nur", "Text"]]}),
        "b.xlsx": workbook({"x": ROWS, "y": [["T", "n", "t"], [1, 2, 3]]}),
        "a.ods": ods(ROWS),
    }
    identities = set()
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
        keys = ', sheet = "x"' if name == "b.xlsx" else ""
        file = tmp_path / "c.toml"
        file.write_text(PAIR.replace("FILE", name).replace("KEYS", keys))
        identities.add(wl.load(file).cases[0].scene.id)
    assert len(identities) == 1


def test_check_tells_the_sheet_and_the_sum_that_is_left_out(tmp_path, capsys):
    (tmp_path / "a.xlsx").write_bytes(workbook({"Lasten": ROWS}))
    (tmp_path / "c.toml").write_text(PAIR.replace("FILE", "a.xlsx").replace("KEYS", ""))
    assert status_of(["check", str(tmp_path / "c.toml")]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "sheet 'Lasten'" in text and "'Summe' in line 4 left out" in text


def test_merged_heads_stand_over_their_columns():
    rows = [
        ["Lastkollektiv", None, None, None],
        [],
        ["Drehmoment [Nm]", None, "Drehzahl [1/min]", "Dauer [h]"],
        ["von", "bis", None, None],
        [300, 345.5, 1200, 9000],
    ]
    raw = workbook({"a": rows}, ("A1:D1", "A3:B3", "C3:C4", "D3:D4"))
    table = table_of("a.xlsx", raw)
    assert table.names == ("Drehmoment von", "Drehmoment bis", "Drehzahl", "Dauer")
    assert list(table.units.values()) == ["Nm", "Nm", "1/min", "h"]
    assert table.lines == (5,) and table.numbers("Drehmoment bis")[0] == 345.5


MERGED_XLS = (
    "c-rk)O-NKx6#njeZ}JBnXC@6)kU_}Ggpf9EbSf-2B^E@{BsJy(hnaa3<0RxJ%iI-2t%^2=n>"
    "O~d=!br&RxJXf7C{kc(yCQZ5TU-#Iq$tvn}q`<74Li8bI&{Xe)pbx@45H=yqFA6joqx9#uBt"
    "c$GlyJRSRs2Qki!X0+rh~t6pA8$@cM2p{$e^a#aBLE1#F}8uEHiL&FW@2}$5Rr9(J|uB>H7R"
    "}kC9hlFAu+DIx~AxjXo;#EZCQIV@fUYD8=L~a$!IgxEtcS;?^WUQ-siyOrUv_>flg4?|#oHt"
    "@=MGc;D6rVh=oVo#Q%Ow-(zq6phsK7XA-8xOn%q7xOsHO!R#}_*aeD-$g<EU?6S-S$+zb>|y"
    "6tG{^3}6`c5ee{73dnD|vk7-42J)sgi+!>oIZ?r2)*{)P9H@j;NM+M$GnG#cRskJ3vp<u~m{"
    "vX-@5=Oq9LrFmKOK#?ZptLB9y+-@635M4G~VA+&L_F-{LrGEUnx7Hf@B}6L=Vfp2+`R-d+pQ"
    "9-M!th!(thh)82U|tmR?A#wlhHIS8*kfJ>T%u~Fn{X|-PTI+4{B&6GEF*SN~g5vg-VN}H&k&"
    "4O34bqn<Mq>p~wbGKo1Cbog}iO%Vv>WSB}F*MRMs*m`5ji5!fsLPia_hMeI-1Fm|$l71dl2R"
    "?i(@nnH?t`xib0`;ESPae`&km3O5%sSVljq9Ob<%Zd$5_(NLo|pjj9UiFxAn|>8e#qFS-7k~"
    "0aid*7Zl6*41Ta8L63z3K0{cVcv&Iq6_(3kXayLWFm!iZnmbCTgnc#K@oO?l_UZ%8xgqzu%!"
    "4j9HEBt?!LFlSi{Lh!=zRW(a`^D!!-o$aK79CCN$~rb=6qhrn_a+tb1!lK>&#J__kWZ8x7dp"
    ";U3vO2-2sd898MG!KWh+BUR!FJ9PfW2V?XttLkhj(N2=)fr7t<Pa6HQ<hJN1`Dz^XmV*LEW{"
    "eK6Bf#%!"
)
"""An .xls of before 2007 with the merged heads below, packed: no writer is needed."""


def merged_ods():
    """Return an open document whose heads are merged."""

    def spanned(text, columns, rows):
        spans = (
            f'table:number-columns-spanned="{columns}" '
            f'table:number-rows-spanned="{rows}"'
        )
        return (
            f'<table:table-cell office:value-type="string" {spans}><text:p>{text}'
            "</text:p></table:table-cell>"
            + "<table:covered-table-cell/>"
            * (columns - 1)
        )

    covered = '<table:covered-table-cell table:number-columns-repeated="2"/>'
    words = "".join(
        f'<table:table-cell office:value-type="string"><text:p>{word}</text:p>'
        "</table:table-cell>"
        for word in ("von", "bis")
    )
    lines = (
        spanned("Lastkollektiv", 4, 1),
        "<table:table-cell/>",
        spanned("Drehmoment [Nm]", 2, 1)
        + spanned("Drehzahl [1/min]", 1, 2)
        + spanned("Dauer [h]", 1, 2),
        words + covered,
    )
    heads = "".join(f"<table:table-row>{line}</table:table-row>" for line in lines)
    rows = ods([[300, 345.5, 1200, 9000], [100, 145.5, 1200, 900]])
    content = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(rows)) as old, zipfile.ZipFile(content, "w") as new:
        for name in old.namelist():
            member = old.read(name).decode()
            new.writestr(name, member.replace('"Lasten">', f'"Lasten">{heads}'))
    return content.getvalue()


def test_merged_heads_of_open_documents_and_of_old_workbooks():
    old = zlib.decompress(base64.b85decode(MERGED_XLS))
    for name, raw in (("a.xls", old), ("a.ods", merged_ods())):
        table = table_of(name, raw)
        assert table.names == ("Drehmoment von", "Drehmoment bis", "Drehzahl", "Dauer")
        assert list(table.units.values()) == ["Nm", "Nm", "1/min", "h"]
        assert table.lines == (5, 6)
        np.testing.assert_array_equal(table.numbers("Drehmoment bis"), [345.5, 145.5])


SPECTRA = {
    "hours": [
        ["torque [N*m]", "speed [rpm]", "hours"],
        [0, 0, 4000],
        [345, 1200, 9000],
        [567, 1150, 800],
        [-210, 1180, 300],
        [0, 1500, 900],
    ],
    "hours without rest": [
        ["torque [N*m]", "speed [rpm]", "hours"],
        [345, 1200, 9000],
        [567, 1150, 800],
        [-210, 1180, 300],
        [0, 1500, 900],
    ],
    "cycles": [
        ["torque [N*m]", "speed [rpm]", "cycles"],
        [345, 1200, 6.48e8],
        [567, 1150, 5.52e7],
        [-210, 1180, 2.124e7],
        [0, 1500, 8.1e7],
    ],
    "ranges": [
        ["torque from [N*m]", "torque to [N*m]", "speed [rpm]", "hours"],
        [340, 350, 1200, 9000],
        [567, 567, 1150, 800],
        [-220, -200, 1180, 300],
        [0, 0, 1500, 900],
    ],
}


def test_every_spectrum_is_the_same_scene_as_csv_and_as_workbook(tmp_path):
    """Idle, at rest, reversed; by hours, cycles and ranges: two scenes in all."""
    identities = {}
    for kind, rows in SPECTRA.items():
        text = "\n".join(",".join(map(str, row)) for row in rows)
        files = {"csv": text.encode(), "xlsx": workbook({"a": rows}), "ods": ods(rows)}
        for suffix, content in files.items():
            name = f"{kind}.{suffix}".replace(" ", "_")
            (tmp_path / name).write_bytes(content)
            file = tmp_path / "c.toml"
            file.write_text(PAIR.replace("FILE", name).replace("KEYS", ""))
            scene = wl.load(file).cases[0].scene
            identities.setdefault(kind, set()).add(scene.id)
    assert identities["hours without rest"] == identities["cycles"]
    assert identities["ranges"] == identities["cycles"]
    assert all(len(found) == 1 for found in identities.values())
    assert identities["hours"] != identities["cycles"]


def test_dates_and_an_english_sheet_that_begins_elsewhere(tmp_path):
    from datetime import date, datetime

    rows = [
        [],
        [None, "Date", "Mass loss [mg]", "note"],
        [None, date(2026, 2, 28), "<0,1", "new oil"],
        [None, datetime(2026, 12, 31, 6), "1,234.5", None],
    ]
    table = table_of("a.xlsx", workbook({"a": rows}))
    assert table.lines == (3, 4) and table.cells["Mass loss"] == ("<0.1", "1234.5")
    days = np.array(["2026-02-28T00", "2026-12-31T06"], "datetime64[s]")
    np.testing.assert_array_equal(table.dates("Date"), days)


@pytest.mark.parametrize(
    ("cell", "message"),
    [
        (
            "=B2*2",
            "row 3, column 'b': holds a formula that nobody computed: open .*sav",
        ),
        ("1.150", "row 3, column 'b': '1.150' is text, and may have decimals or thous"),
        ("1,150", "row 3, column 'b': '1,150' is text, and may"),
        ("#DIV/0!", "row 3, column 'b': '#DIV/0!' is an error of the spreadsheet"),
        (None, "row 3, column 'b': is empty"),
        (True, "row 3, column 'b': 'True' is no number"),
    ],
)
def test_a_cell_that_is_no_number_is_told_by_row_and_column(cell, message):
    table = table_of("x.xlsx", workbook({"a": [["a", "b"], [1, 2], [3, cell]]}))
    with pytest.raises(TableError, match=f"x.xlsx: sheet 'a': {message}"):
        table.numbers("b")


def test_the_sheet_is_found_or_asked_for(tmp_path):
    good = [["a", "b"], [1, 2]]
    words = [["only", "text"], ["and", "more"]]
    raw = workbook({"w": words, "g": good, "h": good}, hidden=["h"])
    assert table_of("x.xlsx", raw).sheet == "g"
    assert table_of("x.xlsx", raw, sheet="h").sheet == "h"
    two = workbook({"g": good, "h": good})
    with pytest.raises(TableError, match=r"x.xlsx: sheets 'g', 'h' hold tables: say"):
        table_of("x.xlsx", two)
    with pytest.raises(TableError, match="sheet = 'k': its sheets are 'g', 'h'"):
        table_of("x.xlsx", two, sheet="k")
    with pytest.raises(TableError, match=r"x.xlsx: sheet 'w': no table was found"):
        table_of("x.xlsx", workbook({"w": words}))
    (tmp_path / "x.csv").write_text("a,b\n1,2\n")
    with pytest.raises(TableError, match="is no workbook: leave sheet = 'g' out"):
        read_table(tmp_path / "x.csv", sheet="g")


def test_without_the_package_one_line_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "python_calamine", None)
    with pytest.raises(TableError, match=r"pip install 'wearlab\[xlsx\]'"):
        table_of("x.xlsx", workbook({"a": [["a", "b"], [1, 2]]}))


def test_a_formula_without_value_in_an_open_document_is_told():
    formula = (
        '<table:table-row><table:table-cell table:formula="of:=1+1"/></table:table-row>'
    )
    with pytest.raises(TableError, match="formulas that nobody computed"):
        table_of("x.ods", ods(ROWS, formula))


def test_tags_that_never_end_are_read_past_once():
    """Each was searched to the end of the file: a minute for a few hundred kB."""
    content = b"<table:table-cell " * 20_000
    for pattern in (TAG, PART_OF_ODS):
        looked = [found.span() for found in pattern.finditer(content + b">")]
        assert len(looked) == 1 and looked[0][1] - looked[0][0] < 30


def test_a_sheet_or_an_archive_beyond_bounds_is_refused(monkeypatch):
    raw = workbook({"a": [["a", "b"], [1, 2]]})
    far = raw_with(
        raw,
        b"</row></sheetData>",
        b'</row><row r="1048576"><c r="XFD1048576"'
        b' t="n"><v>1</v></c></row></sheetData>',
    )
    with pytest.raises(TableError, match="reaches to row 1,048,576 and column 16,384"):
        table_of("x.xlsx", far)
    bomb = io.BytesIO()
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("xl/worksheets/sheet1.xml", b" " * 210_000_000)
    with pytest.raises(TableError, match="unpacks to 210 MB"):
        table_of("x.xlsx", bomb.getvalue())


def raw_with(raw, old, new):
    content = io.BytesIO()
    with (
        zipfile.ZipFile(io.BytesIO(raw)) as source,
        zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as target,
    ):
        for name in source.namelist():
            target.writestr(name, source.read(name).replace(old, new))
    return content.getvalue()


def test_damaged_workbooks_cost_one_line():
    """Bytes of the archive, and of the sheet within it."""
    random = np.random.default_rng(1)
    raw = workbook({"Lasten": ROWS})
    with zipfile.ZipFile(io.BytesIO(raw)) as archive:
        sheet = archive.read("xl/worksheets/sheet1.xml")
    for number in range(300):
        damaged = bytearray(sheet if number % 2 else raw)
        for _ in range(1 + number % 5):
            damaged[random.integers(len(damaged))] = random.integers(256)
        content = bytes(damaged)
        try:
            table = table_of(
                "x.xlsx", raw_with(raw, sheet, content) if number % 2 else content
            )
            assert len(table)
        except TableError as error:
            assert "\n" not in str(error) and str(error).startswith("x.xlsx")
