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


@pytest.mark.parametrize(
    "text, asked, message",
    [
        (
            "x,y,flank\n3,2,pinoin\n",
            {"kind": "max-wear"},
            "line 2, column 'flank': flank 'pinoin' is not here; did you mean 'pinion'",
        ),
        (
            "x,y,flnak\n3,2,pinion\n",
            {"kind": "max-wear"},
            "column 'flnak' is no dimension of this figure; did you mean 'flank'",
        ),
        (
            "x,y,hue\n3,2,900 rpm\n",
            {"kind": "max-wear"},
            "speed '900 rpm' is not here; did you mean '800 rpm'",
        ),
        (
            "x,y\n0.5,100\n",
            {"kind": "mesh-force"},
            "a panel for each speed stands here, .* add a column speed "
            r"\(800 rpm, 1100 rpm, 3720 rpm\), or choose one in select.speed",
        ),
        (
            "x,y,hue\n3,2,brass\n",
            {"kind": "max-wear", "select": {"speed": 800, "case": "base"}},
            "column 'hue' names brass, and nothing varies by colour here",
        ),
        (
            "x,y,flank\n3,2,gear\n",
            {"kind": "max-wear", "select": {"flank": "pinion"}},
            "none of its points belongs here: gear is not drawn",
        ),
    ],
    ids=["label", "column", "hue", "panel", "no hue", "select"],
)
def test_points_without_a_place_are_refused_by_name(plot, table, text, asked, message):
    with pytest.raises(FigureError, match=message):
        plot(**asked, published=table(text))


@pytest.mark.parametrize(
    "asked",
    [
        {"kind": "max-wear", "select": {"flank": "pinion"}},
        {"kind": "max-wear", "select": {"flank": "pinion", "speed": 800}},
    ],
    ids=["several colours", "one colour"],
)
def test_points_of_curves_that_are_not_drawn_are_left_out_and_told(plot, table, asked):
    path = table("x [million cycles],y [um],flank,hue\n3,2,pinion,800\n9,8,gear,800\n")
    one = plot(**asked, published=path)
    points = [c for c in one.panels[0].curves if c.style == "published"]
    assert [(*c.x, *c.y) for c in points] == [(3.0, 2.0)]
    assert "Points without a curve here are left out: 1 of gear." in one.notes


def test_no_point_brings_a_panel_of_its_own(plot, table):
    asked = {"kind": "wear-profile", "select": {"update": -1, "case": "base"}}
    path = table("x [mm],y [um],flank,speed\n1,2,gear,1100\n")
    panels = plot(**asked).panels
    with_points = plot(**asked, published=path).panels
    assert [panel.title for panel in with_points] == [panel.title for panel in panels]
    counts = [sum(c.style == "published" for c in p.curves) for p in with_points]
    assert sum(counts) == 1 and "gear" in with_points[counts.index(1)].title


@pytest.mark.parametrize(
    "head, text",
    [
        ("# measured on the rig, 3 March\n", "measured"),
        ("Gemessen am Prüfstand;;\n", "measured"),
        ("# Fig. 3, read by eye\n", "published"),
    ],
)
def test_measured_points_are_called_measured(plot, table, head, text):
    one = plot(kind="max-wear", published=table(f"{head}x;y\n3000000;2\n4000000;3\n"))
    assert one.legend[-1].text == text


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
