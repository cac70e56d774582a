"""Figures of flanks with a width, of made-up runs."""

import numpy as np
import pytest
from made_up import RATIO, S

import wearlab as wl
from wearlab.figures import FigureError


def test_a_map_has_levels_over_profile_and_face(plot):
    figure = plot(kind="contact-pattern", select={"case": "static"})
    assert len(figure.panels) == 2 and figure.bar is not None
    (curve,) = figure.panels[0].curves
    assert curve.level.shape == curve.x.shape == curve.y.shape == (4 * len(S),)
    assert np.unique(curve.y).tolist() == pytest.approx([-7.5, -2.5, 2.5, 7.5])
    assert curve.reach == (0.0, figure.bar.high)


def test_slices_are_told_by_their_place_on_the_face(store, campaign):
    grid = store.open(campaign).load()
    grid["wear_depth"] = grid.wear_depth.expand_dims(face=4, axis=-2)
    asked = {"y": "wear_depth", "select": {"case": "static", "flank": "pinion"}}
    asked["select"]["update"] = -1
    figure = wl.figure(grid, "line", hue="face", **asked)
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    places = (-7.5, -2.5, 2.5, 7.5)
    assert set(legend) == {f"face position {at} mm" for at in places}

    for chosen in ("-2 mm", -2, "-0.2 cm"):
        asked["select"]["face_position"] = chosen
        title = wl.figure(grid, "line", **asked).legends[0].get_title().get_text()
        assert "face position -2.5 mm" in title.replace("\n", " ")
    asked["select"]["face_position"] = "2 rpm"
    with pytest.raises(FigureError, match=r"select\.face_position = '2 rpm'"):
        wl.figure(grid, "line", **asked)


def test_points_of_a_path_whose_nodes_miss_them(store, campaign):
    """Was: A and D alone, on flanks with a face."""
    grid = store.open(campaign).load()
    letters = grid.characteristic_point
    letters = np.where(np.isin(letters, ["A", "D"]), letters, "")
    grid = grid.assign_coords(characteristic_point=("profile", letters))
    ratio = (S[-1] - S[0]) / (S[6] - S[0])
    grid["contact_ratio"] = grid.contact_ratio * 0.0 + ratio
    select = {"case": "static", "update": -1, "face": 0}
    figure = wl.figure(grid, "wear-profile", select=select)
    marks = figure.axes[0].texts
    assert [text.get_text() for text in marks] == list("ABCDE")
    places = [text.xy[0] for text in marks]
    assert places == pytest.approx([-7.0, -1.0, 0.0, 1.0, 7.0])


def test_the_last_wear_is_mapped_on_both_flanks(plot):
    figure = plot(kind="wear-map", select={"case": "static"})
    assert [panel.title for panel in figure.panels] == ["(a) pinion", "(b) gear"]


def test_maps_do_not_hide_each_other(plot):
    with pytest.raises(FigureError, match="one map hides another"):
        plot(kind="wear-map", hue="speed", select={"case": "base"})


def test_load_over_the_face_and_its_factor(plot):
    (panel,) = plot(kind="face-load", select={"case": "static"}).panels
    assert all(len(curve.x) == 4 for curve in panel.curves)
    (panel,) = plot(kind="face-load-factor", select={"case": "static"}).panels
    assert panel.x_label.startswith("Wear cycles")


def test_lines_of_contact_keep_within_the_field_and_a_pitch_apart(plot):
    (panel,) = plot(kind="contact-lines", select={"case": "static"}).panels
    frame, *lines = panel.curves
    pitch = 14.0 / RATIO
    assert frame.x.min() == pytest.approx(-7.0) and frame.y.max() == pytest.approx(7.5)
    for line in lines:
        held = np.isfinite(line.x)
        assert line.x[held].min() >= -7.0 - 1e-9 and line.x[held].max() <= 7.0 + 1e-9
        offset = (line.x[held] + np.tan(0.2) * line.y[held]) / pitch
        assert np.ptp((offset - offset[0] + 0.5) % 1.0) == pytest.approx(0.0, abs=1e-9)
