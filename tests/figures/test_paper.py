"""A figure for a paper: width, style file, PDF, labels that do not overlap."""

import re
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from wearlab.figures import FigureError
from wearlab.figures.drawing import draw, redraw
from wearlab.figures.paper import paper_of
from wearlab.figures.plot import Curve, Panel, Paper, Pen, Plot
from wearlab.figures.question import embedded
from wearlab.figures.render import draw as draw_plot

SPEC = SimpleNamespace(kind="max-wear", note="as drawn for a paper")


@pytest.fixture
def style(tmp_path):
    def written(text):
        path = tmp_path / "journal.mplstyle"
        path.write_text(text, encoding="utf-8")
        return path

    return written


def drawn(campaign, store, out, paper, ending="png"):
    (path,) = draw(replace(campaign, figures=(SPEC,)), store, out, ending, paper)
    return path


def test_a_pdf_is_as_wide_as_the_column_and_embeds_its_fonts(store, campaign, tmp_path):
    paper = paper_of("84mm", None)
    pdf = drawn(campaign, store, tmp_path, paper, "pdf").read_bytes()
    width = float(re.search(rb"/MediaBox \[ 0 0 ([\d.]+)", pdf)[1])
    assert width == pytest.approx(72.0 * 84.0 / 25.4, abs=0.01)
    assert b"/FontFile2" in pdf and b"/Type3" not in pdf


def test_a_figure_keeps_its_look_and_is_drawn_again_with_it(
    store, campaign, tmp_path, style
):
    paper = paper_of("84 mm", style("font.size: 8\nsavefig.dpi: 300  # print\n"))
    path = drawn(campaign, store, tmp_path / "first", paper)
    with Image.open(path) as image:
        assert image.width == int(300.0 * 84.0 / 25.4)
    again = redraw(path, store, tmp_path / "again")
    assert again.same and again.path.read_bytes() == path.read_bytes()

    wide = redraw(path, store, tmp_path / "wide", "svg", Paper(6.0))
    assert b'width="432pt"' in wide.path.read_bytes()


def test_no_file_of_a_figure_has_latex_run(store, campaign, tmp_path):
    settings = {"text.latex.preamble": r"\input{secret}", "font.size": 7.0}
    path = drawn(campaign, store, tmp_path, Paper(4.0, settings))
    assert "secret" not in str(embedded(path))


@pytest.mark.parametrize(
    "width, text, message",
    [
        ("84", "", "width '84': .* such as 84mm"),
        ("84 rpm", "", "width '84 rpm'"),
        ("2 m", "", "a figure is 38 to 1016 mm wide"),
        (None, "font.sise: 8", r"line 1: font.sise: did you mean 'font.size'"),
        (None, "font.size: large and wide", "line 1: "),
        (None, "font.size 8", "write key: value"),
        (None, "font.family: Helvetika Nova", "Helvetika Nova is not installed"),
    ],
)
def test_what_no_paper_can_have_is_refused(style, width, text, message):
    with pytest.raises(FigureError, match=message):
        paper_of(width, style(text) if text else None)
    assert paper_of("84 mm", style("font.size: 8")).settings == {"font.size": 8.0}


def test_labels_do_not_overlap_in_a_column_of_3_5_inches():
    """Was: titles over each other, numbers of narrow axes run together."""
    pen = Pen("#000000")
    curves = [Curve(1e3 * np.arange(9.0), np.arange(9.0), pen, "line")]
    title = "tip relief of the pinion of twenty micrometres · last state, pinion"
    panels = [
        Panel(0, column, title, "Position on the path", "Depth (µm)", tuple(curves))
        for column in range(3)
    ]
    plot = Plot("", tuple(panels), 1, 3)
    for width in (3.5, 7.2):
        figure = draw_plot(plot, width)
        figure.draw_without_rendering()
        boxes = [ax.title.get_window_extent() for ax in figure.axes]
        boxes = [ax._left_title.get_window_extent() for ax in figure.axes] or boxes
        assert not any(one.overlaps(two) for one, two in pairwise(boxes))
        for ax in figure.axes:
            texts = [text for text in ax.get_xticklabels() if text.get_text()]
            spans = [text.get_window_extent() for text in texts if text.get_visible()]
            low, high = ax.bbox.x0 - 1.0, ax.bbox.x1 + 1.0
            inside = [box for box in spans if low <= (box.x0 + box.x1) / 2 <= high]
            assert all(one.x1 <= two.x0 for one, two in pairwise(inside))
