"""Files: bytes, text chunks, missing runs, errors."""

import json
import subprocess
import sys

import numpy as np
import pytest
from PIL import Image

from wearlab.figures import KINDS, FigureError
from wearlab.figures.kind import no_kind
from wearlab.figures.plot import Curve, Mark, Panel, Pen
from wearlab.figures.render import _sides
from wearlab.schema import VARIABLES


def texts(path):
    with Image.open(path) as image:
        image.load()
        return dict(image.text)


def size(path):
    with Image.open(path) as image:
        return image.size


def test_every_kind_draws(drawn):
    kinds = [name for name, kind in KINDS.items() if set(kind.needs) <= set(VARIABLES)]
    paths = drawn(
        *(
            {"kind": kind, **({"y": "worn_mass"} if kind == "line" else {})}
            for kind in kinds
        )
    )
    assert [path.name for path in paths] == [
        f"{i:02d}-{kind}.png" for i, kind in enumerate(kinds, 1)
    ]
    for path in paths:
        with Image.open(path) as image:
            assert image.size[0] > 700
            assert len(image.convert("L").getcolors()) > 10


def test_the_same_store_gives_the_same_bytes(drawn, monkeypatch):
    wishes = [
        {"kind": "mesh-force"},
        {"kind": "wear-profile", "note": "a note"},
        {"kind": "max-wear"},
    ]
    first = [path.read_bytes() for path in drawn(*wishes, to="one")]
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1")
    import matplotlib

    monkeypatch.setitem(matplotlib.rcParams, "axes.titleweight", "bold")
    assert [path.read_bytes() for path in drawn(*wishes, to="two")] == first


def test_a_note_changes_the_picture(drawn):
    without, withal = drawn(
        {"kind": "max-wear"}, {"kind": "max-wear", "note": "Costs $5 and $6: not math."}
    )
    assert size(withal)[1] > size(without)[1]


def test_text_chunks(drawn):
    (path,) = drawn(
        {"kind": "max-wear", "select": {"flank": "gear", "speed": [800, 1100]}}
    )
    found = texts(path)
    assert found["campaign"] == "Three speeds · µ"
    assert found["figure"] == "max-wear"
    assert json.loads(found["select"]) == {"flank": "gear", "speed": [800, 1100]}
    assert found["runs"].split() == ["0" * 32, "3" * 32, "1" * 32]
    assert found["wearlab"] == "9.9"
    assert found["source_hash"] == "feed"
    assert not {"Software", "Creation Time", "date"} & set(found)


def test_missing_runs_are_named(drawn, holed):
    (path,) = drawn({"kind": "dynamic-factor"}, of=holed)
    assert texts(path)["missing"] == "1100 rpm: failed; 3720 rpm: missing"
    assert texts(path)["runs"] == "0" * 32


def test_nothing_there_is_an_error(drawn, holed):
    with pytest.raises(
        FigureError, match=r"figure 1 \(tvms\): none of its runs.*1100 rpm: failed"
    ):
        drawn({"kind": "tvms", "select": {"speed": 1100}}, of=holed)


def test_the_others_are_drawn_all_the_same(drawn):
    with pytest.raises(FigureError) as caught:
        drawn(
            {"kind": "tvmz"},
            {"kind": "tvms"},
            {"kind": "wear-profile", "select": {"flank": "pinon"}},
        )
    message = str(caught.value)
    assert "figure 1 (tvmz): no such kind; did you mean 'tvms'?" in message
    assert "spectrum is drawn by orders, shaft-orders, waterfall; " in no_kind(
        "spectrum"
    )
    assert (
        "figure 3 (wear-profile): select.flank = 'pinon' is not there; did you mean "
        "'pinion'?" in message
    )
    assert [path.name for path in caught.value.drawn] == ["02-tvms.png"]
    assert caught.value.drawn[0].exists()


def test_the_table_of_kinds_needs_no_matplotlib():
    code = (
        "import sys; from wearlab.figures import KINDS; assert KINDS and 'matplotlib' "
        "not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_letters_of_close_marks_turn_away_from_each_other():
    curve = Curve(np.array([0.0, 1.0]), np.zeros(2), Pen("k"), "line")
    marks = tuple(
        Mark(x, letter)
        for x, letter in ((0.0, "A"), (0.5, "C"), (0.51, "D"), (1.0, "E"))
    )
    panel = Panel(0, 0, "", "", "", (curve,), marks)
    assert _sides(panel, 0.02) == ["center", "right", "left", "center"]
    apart = (*marks[:2], Mark(0.55, "D"), *marks[3:])
    assert _sides(panel._replace(marks=apart), 0.02) == ["center"] * 4
    assert _sides(panel._replace(marks=apart), 0.06) == [
        "center",
        "right",
        "left",
        "center",
    ]
