"""A figure's own file is the question: drawn again it gives the same
bytes, or says why not.
"""

import json
import shutil
from dataclasses import replace
from types import SimpleNamespace

import pytest
from made_up import put, run

from wearlab.figures import FigureError, draw, redraw
from wearlab.figures.question import embedded
from wearlab.store import Store

WISH = {
    "kind": "max-wear",
    "select": {"flank": "gear", "speed": [800, 1100]},
    "note": 'µ (a) \\ <b> & "c"',
}
CAMPAIGN = 'title = "Three speeds"  # as written\n'


@pytest.fixture
def asked(campaign, tmp_path):
    """The campaign with one figure, points of a paper, and a file."""
    (tmp_path / "points.csv").write_text("x [million cycles], y [um]\n50, 3\n")
    (tmp_path / "speeds.toml").write_text(CAMPAIGN)
    return replace(
        campaign,
        figures=(SimpleNamespace(**WISH, published="points.csv"),),
        path=tmp_path / "speeds.toml",
    )


@pytest.fixture
def own(store, tmp_path):
    """A store that a test may spoil."""
    return Store(shutil.copytree(store.path, tmp_path / "own"))


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_the_file_alone_is_enough(ending, asked, store, tmp_path):
    (first,) = draw(asked, store, tmp_path / "one", ending)
    (tmp_path / "points.csv").unlink()
    (tmp_path / "speeds.toml").unlink()
    one = redraw(first, store, tmp_path / "two")
    assert one.same and one.path.read_bytes() == first.read_bytes()
    assert one.path != first and not one.missing and not one.changed
    again = redraw(one.path, store, tmp_path / "three")
    assert again.path.read_bytes() == first.read_bytes()


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_what_a_file_tells(ending, asked, store, tmp_path):
    (first,) = draw(asked, store, tmp_path / "one", ending)
    found = embedded(first)
    assert found["campaign"] == asked.title
    assert (
        found["campaign_text"] == f"# ---- speeds.toml\n{CAMPAIGN}"
        and len(found["campaign_hash"]) == 16
    )
    assert json.loads(found["table"]) == WISH
    assert json.loads(found["select"]) == WISH["select"]
    assert found["runs"].split() == ["0" * 32, "3" * 32, "1" * 32]
    assert found["source_hash"] == "feed"
    assert str(tmp_path).encode() not in first.read_bytes()


def test_runs_made_by_other_code_are_stale(asked, store, tmp_path, monkeypatch):
    (first,) = draw(asked, store, tmp_path)
    assert redraw(first, store, tmp_path / "two").stale == (
        "0" * 10,
        "1" * 10,
        "3" * 10,
    )
    monkeypatch.setattr("wearlab.sources.present_hashes", lambda: ("feed",))
    assert redraw(first, store, tmp_path / "two").stale == ()


def test_a_run_that_went_is_missing(asked, own, tmp_path):
    (first,) = draw(asked, own, tmp_path)
    with own.archive.catalogue._transaction() as connection:
        connection.execute("DELETE FROM runs WHERE id = ?", ("1" * 32,))
    one = redraw(first, own, tmp_path / "two")
    assert one.missing == ("1100 rpm: missing",) and not one.same


def test_a_run_computed_again_has_changed(asked, own, tmp_path):
    (first,) = draw(asked, own, tmp_path)
    with own.archive.catalogue._transaction() as connection:
        connection.execute("DELETE FROM runs WHERE id = ?", ("1" * 32,))
    put(own, "1" * 32, run(1200.0))
    one = redraw(first, own, tmp_path / "two")
    assert one.changed == ("1" * 10,) and not one.same and not one.missing


def test_what_is_no_figure_of_ours(store, tmp_path):
    from PIL import Image

    Image.new("L", (2, 2)).save(tmp_path / "other.png")
    (tmp_path / "text.png").write_text("no picture")
    (tmp_path / "cut.png").write_bytes((tmp_path / "other.png").read_bytes()[:40])
    (tmp_path / "cut.svg").write_text("<svg><a>")
    (tmp_path / "other.pdf").write_bytes(b"%PDF-1.4 nothing")
    for name, message in (
        ("other.png", "no question"),
        ("text.png", "no PNG, SVG or PDF"),
        ("cut.png", "damaged"),
        ("cut.svg", "damaged"),
        ("other.pdf", "no question"),
        ("none.png", "No such file"),
    ):
        with pytest.raises(FigureError, match=message):
            redraw(tmp_path / name, store, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_what_is_larger_than_any_figure(store, tmp_path, monkeypatch):
    from PIL import Image

    monkeypatch.setattr("wearlab.figures.question.LARGEST", 1000)
    Image.new("L", (100, 100)).save(tmp_path / "wide.png")
    (tmp_path / "long.png").write_bytes(b"\x89PNG" + bytes(1000))
    for name, message in (
        ("wide.png", "100 by 100 pixels are more"),
        ("long.png", "1004 bytes are more"),
        (".", "is no file"),
    ):
        with pytest.raises(FigureError, match=message):
            redraw(tmp_path / name, store, tmp_path / "out")


@pytest.mark.parametrize(
    "spoilt",
    [
        {"table": {"kind": "../../evil"}},
        {"campaign": []},
        {"runs": 1},
        {"format": 9},
        {"points": 3},
    ],
)
def test_a_hostile_question_is_refused(spoilt, asked, store, tmp_path):
    (first,) = draw(asked, store, tmp_path, "svg")
    texts = embedded(first)
    texts["question"] = json.dumps(json.loads(texts["question"]) | spoilt)
    escaped = json.dumps(texts).replace("&", "&amp;").replace("<", "&lt;")
    uri = "http://purl.org/dc/elements/1.1/"
    first.write_text(
        f'<svg><d:description xmlns:d="{uri}">{escaped}</d:description></svg>'
    )
    with pytest.raises(FigureError, match="question cannot be read"):
        redraw(first, store, tmp_path / "out")


def test_an_unknown_format(asked, store, tmp_path):
    with pytest.raises(FigureError, match="did you mean 'svg'"):
        draw(asked, store, tmp_path, "svgg")
