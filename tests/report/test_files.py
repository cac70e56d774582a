"""A page and a workbook are written as their suffix says, or refused."""

import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from wearlab.report.page import ReportError, as_file, check_suffix
from wearlab.report.workbook import workbook
from wearlab.store.files import StoreError

PAGE = (
    "<!doctype html><html><head><title>Wear</title></head><body><p>20 "
    "µm</p></body></html>"
)


def grid():
    """Return a grid of two torques, one of two wear states, one of one."""
    return xr.Dataset(
        {
            "run_id": ("torque", ["a", "b"]),
            "n_updates": ("torque", [2, 1]),
            "verdict": ("torque", np.array(["completed", "aperiodic"], object)),
            "life": ("torque", [2e7, np.nan], {"units": "1"}),
            "max_wear_depth": (
                ("torque", "update", "flank"),
                [[[0.0, 0.0], [1e-6, 2e-6]], [[3e-6, 4e-6], [np.nan, np.nan]]],
                {"units": "m", "display_units": "um"},
            ),
            "wear_depth": (
                ("torque", "update", "flank", "profile"),
                np.zeros((2, 2, 2, 3)),
                {"units": "m"},
            ),
        },
        {
            "torque": ("torque", [30.0, 60.0], {"units": "N*m"}),
            "flank": ["pinion", "gear"],
        },
    )


def test_a_workbook_has_a_row_for_each_run_and_each_wear_state(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    (tmp_path / "a.xlsx").write_bytes(workbook(grid(), {"title": "Two torques"}))
    book = openpyxl.load_workbook(tmp_path / "a.xlsx")
    runs, states, about = (list(sheet.iter_rows(values_only=True)) for sheet in book)
    assert runs[0] == ("torque [N*m]", "life", "verdict", "run_id", "n_updates")
    assert runs[1:] == [(30, 2e7, "completed", "a", 2), (60, None, "aperiodic", "b", 1)]
    assert states[0] == (
        "torque [N*m]",
        "wear state",
        "max_wear_depth pinion [um]",
        "max_wear_depth gear [um]",
    )
    assert [row[:2] for row in states[1:]] == [(30, 0), (30, 1), (60, 0)]
    assert states[2][2:] == pytest.approx((1.0, 2.0)) and about == [
        ("title", "Two torques")
    ]


def test_wear_states_of_a_lone_run_are_rows_and_no_columns(tmp_path):
    """Were twelve columns each beside the life."""
    openpyxl = pytest.importorskip("openpyxl")
    lone = (
        grid().isel(torque=0).assign_coords(cycle=("update", [0.0, 2e7]), update=[0, 1])
    )
    worn = lone.max_wear_depth.isel(flank=0, drop=True)
    (tmp_path / "a.xlsx").write_bytes(workbook(lone.assign(deepest=worn), {}))
    runs, states, _ = openpyxl.load_workbook(tmp_path / "a.xlsx")
    assert [cell.value for cell in runs[1]] == [
        "torque [N*m]",
        "life",
        "verdict",
        "run_id",
        "n_updates",
    ]
    assert [cell.value for cell in states[1]][2:4] == [
        "cycle",
        "max_wear_depth pinion [um]",
    ]
    assert [row[2] for row in states.iter_rows(values_only=True, min_row=2)] == [0, 2e7]
    assert runs.freeze_panes == states.freeze_panes == "A2"


def test_without_its_library_a_workbook_says_what_to_do(monkeypatch):
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    with pytest.raises(StoreError, match=r"pip install 'wearlab\[xlsx\]'"):
        workbook(grid(), {})


def test_a_page_is_printed_as_a_pdf():
    pytest.importorskip("weasyprint")
    assert (
        as_file(PAGE, ".pdf")[:5] == b"%PDF-"
        and as_file(PAGE, ".html") == PAGE.encode()
    )


def test_other_suffixes_are_refused_and_a_missing_library_is_named(monkeypatch):
    """Was HTML under the name pair.pdf."""
    with pytest.raises(
        ReportError, match=r"pair.docx: a report is written as .html or .pdf"
    ):
        check_suffix(Path("pair.docx"))
    monkeypatch.setitem(sys.modules, "weasyprint", None)
    with pytest.raises(ReportError, match=r"pip install 'wearlab\[pdf\]'"):
        check_suffix(Path("pair.pdf"))
    check_suffix(Path("pair.HTML"))
