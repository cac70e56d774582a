import numpy as np
import pytest

from wearlab.figures import FigureError


@pytest.fixture
def table(tmp_path):
    def written(text):
        path = tmp_path / "points.csv"
        path.write_text(text, encoding="utf-8")
        return path

    return written


def test_points_in_their_units_and_the_colour_of_their_hue(plot, table):
    path = table(
        "# Fig. 13, read by eye\nx [million cycles], y [mm], hue\n3, 0.002, 800\n100, "
        "0.01, 1100 rpm\n"
    )
    one = plot(kind="max-wear", published=path)
    assert one.legend[-1].text == "published"
    points = [c for c in one.panels[0].curves if c.style == "published"]
    np.testing.assert_allclose(
        [(*c.x, *c.y) for c in points], [(3.0, 2.0), (100.0, 10.0)]
    )
    pens = {entry.text: entry.pen for entry in one.legend}
    assert [c.pen for c in points] == [pens["800 rpm"], pens["1100 rpm"]]


@pytest.mark.parametrize(
    "text",
    [
        "x [million cycles];y [mm]\n3,0;0,002\n100;0,01\n",
        "x [million cycles]\ty (um)\n3\t2\n100\t10\n",
        "x,y [mm]\n3.0e+06,2.0e-03\n1.0e+08,1.0e-02\n",
        "% made by MATLAB\n3.0000000e+06   2.0e+00\n1.0000000e+08   1.0e+01\n",
        "3000000,2\n100000000,10\n",
    ],
    ids=["German", "tabs", "MATLAB", "MATLAB without names", "numbers alone"],
)
def test_points_as_spreadsheets_and_programs_write_them(plot, table, text):
    panel = plot(kind="max-wear", published=table(text)).panels[0]
    points = [c for c in panel.curves if c.style == "published"]
    found = [point for c in points for point in zip(c.x, c.y, strict=True)]
    np.testing.assert_allclose(found, [(3.0, 2.0), (100.0, 10.0)])


def test_points_of_a_workbook(plot, tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    pytest.importorskip("python_calamine")
    book = openpyxl.Workbook()
    for row in (["x [million cycles]", "y [mm]"], [3, "0,002"], [100, 0.01]):
        book.active.append(row)
    other = book.create_sheet("other")
    other.append(["x", "y"])
    other.append([1, 2])
    path = tmp_path / "points.xlsx"
    book.save(path)
    panel = plot(kind="max-wear", published=path, sheet="Sheet").panels[0]
    points = next(c for c in panel.curves if c.style == "published")
    np.testing.assert_allclose([points.x, points.y], [(3.0, 100.0), (2.0, 10.0)])
    with pytest.raises(FigureError, match="sheets 'Sheet', 'other' hold tables"):
        plot(kind="max-wear", published=path)


def test_one_curve_beside_points_has_its_name_too(plot, table):
    alone = {
        "kind": "max-wear",
        "select": {"case": "base", "speed": 800, "flank": "pinion"},
    }
    assert "computed" not in [entry.text for entry in plot(**alone).legend]
    one = plot(**alone, published=table("x [million cycles],y [um]\n3,2\n"))
    assert [entry.text for entry in one.legend] == ["computed", "published"]
    assert one.legend[0].pen == next(
        c.pen for c in one.panels[0].curves if c.style != "published"
    )


def test_points_find_their_panel(plot, table):
    path = table("x,y [N],speed\n0.5,100,1100\n")
    panels = plot(kind="mesh-force", published=path).panels
    assert [sum(c.style == "published" for c in panel.curves) for panel in panels] == [
        0,
        1,
        0,
    ]


def test_places_without_a_height_are_marked_in_their_panel(plot, table):
    path = table("x, text, speed\n0.25, low, 1100\n0.75, high, 1100\n0.5, alone, 800\n")
    one = plot(kind="mesh-force", published=path)
    told = [[(mark.x, mark.text) for mark in panel.marks] for panel in one.panels]
    assert told == [[(0.5, "alone")], [(0.25, "low"), (0.75, "high")], []]
    assert "published" not in [entry.text for entry in one.legend]


def test_orders_are_drawn_as_frequencies(plot, store, campaign):
    asked = {
        "kind": "line",
        "y": "mesh_deflection_orders",
        "x": "order",
        "select": {"speed": 800, "case": "base"},
    }
    order, hertz = (
        plot(**asked, **more).panels[0] for more in ({}, {"units": {"order": "kHz"}})
    )
    frequency = float(
        store.open(campaign).mesh_frequency.sel(speed=800, case="base").values[0]
    )
    np.testing.assert_allclose(hertz.curves[0].x, 1e-3 * frequency * order.curves[0].x)
    assert hertz.x_label == "Frequency (kHz)"
    with pytest.raises(FigureError, match="units of order"):
        plot(**asked, units={"order": "mm"})


@pytest.mark.parametrize(
    "text, message",
    [
        ("x,y\n", "points.csv: no rows under a header"),
        ("x\ty\n1,200\t2\n", "parts thousands"),
        ("a,b\n1,2\n", "a column x is required, found a, b"),
        ("x,y [rpm]\n1,2\n", "column 2"),
        ("x,y\n1,b\n", "column 2"),
    ],
)
def test_what_is_wrong_with_a_table(plot, table, text, message):
    with pytest.raises(FigureError, match=message):
        plot(kind="max-wear", published=table(text))


def test_no_such_table(plot, tmp_path):
    with pytest.raises(FigureError, match="No such file"):
        plot(kind="max-wear", published=tmp_path / "none.csv")
