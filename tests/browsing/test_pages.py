"""What pages tell, asked over HTTP without a browser: campaigns, runs, figures in
words, trouble, copies.
"""

import csv
import io
import json
import re

import made_up
import numpy as np
import pytest
from fake_campaign import alter, filled, sweep

from wearlab.browsing import listing, recorded
from wearlab.campaign.campaign import FigureSpec, with_figures
from wearlab.query import QueryError
from wearlab.store import StoreError
from wearlab.store.locks import ReachedCycle
from wearlab.store.outcome import Outcome

copy = pytest.importorskip(
    "wearlab.browsing.pages", reason="wearlab[browse] is not installed"
)
question = copy.figures
words = copy.interactive
write_copy = copy.write_copy


def runs(asked):
    return list(asked.store.archive.entries())


def test_a_campaign_is_counted(tmp_path, opened):
    campaign = alter(alter(sweep(4), 1, act="fail"), 2, act="refuse")
    store = filled(tmp_path / "store", campaign)
    store.archive.catalogue.record_campaign(
        "absent", None, None, [("ab" * 10, "base", {})]
    )
    told = {each.title: dict(each.states) for each in recorded.campaigns(store)[0]}
    assert told == {
        "five speeds": {"done": 2, "failed": 1, "refused": 1},
        "absent": {"missing": 1},
    }
    page = opened(store).page("")
    for words_ in ("2 done", "1 failed", "1 refused", "1 missing"):
        assert words_ in page


def test_doubtful_runs_are_counted_as_figures_mark_them(tmp_path):
    store = filled(tmp_path / "store", sweep(3))
    some = (
        {"verdict": "aperiodic"},
        {"estimate_quality": "doubtful: steps"},
        {"separation_fraction": 0.2},
    )
    ids = [f"{number:020x}" for number in range(5)]
    summaries = [
        *some,
        {"verdict": "completed", "separation_fraction": 0.0},
        {"verdict": "stopped"},
    ]
    done = [
        Outcome(i, "done", "now", 1.0, "{}", summary=s)
        for i, s in zip(ids, summaries, strict=True)
    ]
    store.archive.catalogue.record(done)
    store.archive.catalogue.record_campaign(
        "doubts", None, None, [(i, "base", {}) for i in ids]
    )
    (told,) = [each for each in recorded.campaigns(store)[0] if each.title == "doubts"]
    assert told.counts["doubtful"] == 3


def test_a_file_that_was_run_again_is_one_campaign(tmp_path):
    store = filled(tmp_path / "store", sweep(2))
    ids = list(store.archive.entries())
    for count in (1, 2):
        store.archive.catalogue.record_campaign(
            "t", None, "a.toml", [(run, "base", {}) for run in ids[:count]]
        )
    told = [each for each in recorded.campaigns(store)[0] if each.title == "t"]
    assert [each.cases for each in told] == [2]


def test_axes_come_back_with_and_without_a_record(drawn):
    store = drawn.store
    (told,) = recorded.campaigns(store)[0]
    with_record = recorded.campaign_of(store, told.key)
    with store.archive.catalogue._transaction() as connection:
        connection.execute("DROP TABLE records")
    without = recorded.campaign_of(store, told.key)
    for campaign in (with_record, without):
        (axis,) = campaign.axes
        assert (axis.name, axis.values, axis.units) == ("speed", made_up.SPEEDS, "rpm")
        assert [case.position for case in campaign.cases] == [
            {"speed": 0},
            {"speed": 1},
            {"speed": 2},
        ]
    assert without.axes[0].key == "operation.speed"


def test_marked_runs_that_one_number_tells_apart_have_an_axis(drawn):
    ids = runs(drawn)
    campaign = recorded.together(drawn.store, [ids[2], ids[0]])
    (axis,) = campaign.axes
    assert (axis.name, axis.values, axis.units) == ("speed", (800.0, 3720.0), "rpm")
    assert [case.position["speed"] for case in campaign.cases] == [1, 0]
    with pytest.raises(StoreError, match="no such run"):
        recorded.together(drawn.store, [ids[0], "feed"])


def test_marked_runs_that_differ_in_more_are_told_in_words(drawn):
    made_up.put(
        drawn.store,
        "ab" * 10,
        made_up.run(900.0),
        '{"operation": {"speed": 94.2477796, "torque": 5.0}}',
    )
    campaign = recorded.together(drawn.store, [runs(drawn)[0], "ab" * 10])
    assert [case.label for case in campaign.cases] == [
        "speed 800 rpm, torque 340 N·m",
        "speed 900 rpm, torque 5 N·m",
    ]


def test_a_figure_is_told_in_words_and_as_a_table(drawn):
    wanted = question.WantedFigure((runs(drawn)[0],), kind="max-wear")
    source = question.source_of(drawn.store, wanted)
    plot = source.plot(source.ask_for(wanted))
    lines = words.summary(plot)
    assert lines[0].startswith("Largest wear depth")
    curve = plot.panels[0].curves[0]
    assert any(
        f"largest {curve.y.max():.4g} at {curve.x[curve.y.argmax()]:.4g}" in line
        for line in lines
    )
    rows = list(csv.DictReader(io.StringIO(words.table(plot))))
    assert [float(row["y"]) for row in rows if row["run"]][
        : len(curve.y)
    ] == pytest.approx(list(curve.y))
    assert {row["run"] for row in rows} - {""} == {runs(drawn)[0]}


def test_ranks_of_units_have_their_names():
    """A second answer, a little below its rank, had the name of another unit."""
    from types import SimpleNamespace

    from wearlab.browsing import interactive

    panel = SimpleNamespace(names=("G1", "G2"))
    names = [interactive._name_of_rank(panel, rank) for rank in (1, 0.7, 1.7, 2, 3)]
    assert names == ["G1", "G1", "G2", "G2", ""]
    assert interactive._name_of_rank(SimpleNamespace(names=()), 1.0) == ""


def test_labels_that_a_typesetter_would_take_for_formulas_are_plain():
    assert words.plain("Depth ($10^{-3}$ µm)") == "Depth (10⁻³ µm)"
    for planted in ("$$x$$", "\\(x\\)", "\\[x\\]"):
        assert not re.search(r"\$\$|\\\(|\\\[", words.plain(planted))


def test_what_is_drawn_follows_values_of_the_same_form_alone(drawn):
    from wearlab.browsing import interactive

    def plot(kind, *states):
        options = {"select": {"update": [*states]}}
        wanted = question.WantedFigure((runs(drawn)[0],), kind=kind, options=options)
        source = question.source_of(drawn.store, wanted)
        return source.plot(source.ask_for(wanted))

    shown = interactive.drawn(plot("tvms", 0, 1, 2))
    other = plot("tvms", 0, 0, 2)
    before = [handle.source.data["y"] for handle in shown.curves[0]]
    assert shown.follow(other)
    after = [handle.source.data["y"] for handle in shown.curves[0]]
    for values, curve in zip(after, other.panels[0].curves, strict=True):
        assert values.tolist() == curve.y.tolist()
    assert after[0] is before[0] and after[1] is not before[1]
    assert not shown.follow(plot("tvms", 0)) and not shown.follow(
        plot("wear-profile", 0, 1, 2)
    )


def test_a_wear_state_is_worked_out_once(drawn):
    from bokeh.document import Document

    from wearlab.browsing.figures import Follower

    follower = Follower(drawn.store, runs(drawn)[0], Document())
    assert list(follower.made) == [2]
    follower.ahead(1)
    follower.ahead(0)
    made = dict(follower.made)
    follower.follow(1)
    assert set(made) == {0, 1, 2} and all(
        follower.made[state] is made[state] for state in made
    )
    assert "State 1 of 2: 3 million cycles" in follower.said.text


def test_a_table_of_runs_has_pages(tmp_path, opened):
    count = 2 * listing.ROWS + 1
    store = filled(tmp_path / "store", sweep(count))
    told = listing.listed(store, {"page": "3", "sort": "-life"})
    reach = f"runs {count} to {count} of {count}"
    assert (told.pages, told.reach, len(told.rows)) == (3, reach, 1)
    assert listing.listed(store, {"page": "99"}).rows == ()
    for page in ("-1", "0", "x", "1e9", "9" * 40, "٣"):
        assert listing.listed(store, {"page": page}).number == 1


@pytest.mark.parametrize(
    ("word", "sign", "value", "where"),
    [
        ("torque", ">=", "340 N*m", "torque >= 340 N*m"),
        ("tag", "=", "it's", 'tag = "it\'s"'),
        ("verdict", "contains", "ok", "verdict contains 'ok'"),
        ("torque", "; drop", "5 Nm", "torque = 5 Nm"),
        ("torque", "<", "", ""),
        ("", "<", "5", ""),
    ],
)
def test_a_condition_is_put_together(small, word, sign, value, where):
    told = listing.listed(small.store, {"word": word, "sign": sign, "value": value})
    assert told.where == where
    both = listing.listed(
        small.store, {"where": "life > 1", "word": word, "sign": sign, "value": value}
    )
    assert both.where == (f"life > 1 and {where}" if where else "life > 1")


def test_an_error_is_that_of_the_command_line(small):
    with pytest.raises(QueryError) as error:
        small.store.query("lief > 5")
    assert listing.listed(small.store, {"where": "lief > 5"}).problem == str(
        error.value
    )
    assert "did you mean" in small.page("runs", where="lief > 5")


def test_worth_is_told_before_any_number(drawn):
    page = drawn.page("run", id=runs(drawn)[0])
    places = [
        page.index(words_)
        for words_ in (
            "What it is worth",
            "What it came to",
            "Over its wear",
            "How to cite it",
        )
    ]
    assert places == sorted(places)
    name = drawn.store.path.name
    assert f"wl.open({name!r})".replace("'", "&#39;") in page


def test_no_page_of_a_window_tells_the_folders_of_this_machine(
    tmp_path, opened, monkeypatch
):
    scenes = alter(alter(sweep(3), 0, act="fail"), 1, act="warn")
    store = filled(tmp_path / "lab" / "store", scenes)
    entries = store.archive.entries()
    members = [(run, "base", {}) for run in entries]
    for path in (tmp_path / "lab" / "a.toml", tmp_path / "other" / "b.toml"):
        store.archive.catalogue.record_campaign(path.stem, None, str(path), members)
    first = next(run for run, entry in entries.items() if entry.state == "done")
    file = store.archive.files.path(first)
    image = bytearray(file.read_bytes())
    image[len(image) // 2] ^= 0xFF
    file.write_bytes(bytes(image))

    asked = opened(store)
    listed = recorded.campaigns(store)[0]
    pages = [asked.page(""), asked.page("runs"), asked.page("progress")]
    pages += [asked.page("campaign", key=campaign.key) for campaign in listed]
    pages += [asked.page("run", id=run) for run in entries]
    pages.append(asked.page("compare", run=[first], kind="tvms"))
    pages.append(asked.send("data", id=first)[2].decode())
    for page in pages:
        assert str(tmp_path) not in page and "Traceback" not in page
    assert ">a.toml<" in pages[0] and ">…/other/b.toml<" in pages[0]
    assert any("is not what was written" in page for page in pages)

    monkeypatch.chdir(tmp_path)  # a store below the working directory: from there on
    page = opened(store).page("run", id=first)
    assert "# in the folder that holds lab:\nwearlab show" in page
    assert f"wearlab show {first} --store lab/store" in page


def test_what_failed_says_why(tmp_path, opened):
    store = filled(
        tmp_path / "store", alter(alter(sweep(3), 0, act="fail"), 1, act="warn")
    )
    asked = opened(store)
    states = {
        entry.state: run
        for run, entry in store.archive.entries().items()
        if entry.state != "done"
    }
    assert "the shooting did not converge" in asked.page("run", id=states["failed"])
    warned = next(
        run for run, entry in store.archive.entries().items() if entry.warnings
    )
    assert "the film is thin" in asked.page("run", id=warned)
    assert asked.send("data", id=states["failed"])[0] == 400


def test_a_damaged_run_is_told_and_the_rest_goes_on(drawn):
    first, second, _ = runs(drawn)
    path = drawn.store.archive.files.path(first)
    image = bytearray(path.read_bytes())
    image[len(image) // 2] ^= 0xFF
    path.write_bytes(bytes(image))
    for address, more in (
        ("campaign", {"key": recorded.campaigns(drawn.store)[0][0].key}),
        ("run", {"id": first}),
    ):
        page = drawn.page(address, **more)
        assert "is not what was written" in page
    assert "is not what was written" in drawn.page(
        "compare", run=[first, second], kind="tvms"
    )
    assert drawn.send("data", id=first)[0] == 400
    assert "In words" in drawn.page("compare", run=[second], kind="tvms")
    path.unlink()
    assert "lost" in drawn.page("runs") and drawn.send("data", id=second)[0] == 200


def test_what_is_taken_along_is_what_is_stored(drawn):
    run = runs(drawn)[0]
    _, headers, content = drawn.send("data", id=run)
    assert content == drawn.store.archive.files.path(run).read_bytes()
    assert headers["Content-Disposition"] == f'attachment; filename="{run}.nc"'
    assert run in drawn.send("citation", id=run)[2].decode()
    for ending, start in (
        ("png", b"\x89PNG"),
        ("svg", b"<?xml"),
        ("pdf", b"%PDF"),
        ("csv", b"panel,"),
    ):
        assert drawn.send(f"figure.{ending}", run=run, kind="tvms")[2].startswith(start)
    assert drawn.send("figure.exe", run=run)[0] == 404


def test_runs_under_way_say_how_far_they_are(tmp_path, opened):
    store = filled(tmp_path / "store", sweep(2))
    with store.archive.presence() as presence:
        store.archive.claim(["ab" * 10, "cd" * 10], presence.token, lambda entry: False)
        store.archive.checkpoints.write(
            "ab" * 10, b"image", "code", ReachedCycle(2.5e6, 7.5e-6)
        )
        assert store.archive.checkpoints.read("ab" * 10, "code") == b"image"
        page = opened(store).page("progress")
    assert "2.5e+06" in page and "7.5 µm" in page and "not told yet" in page


def test_a_window_touches_nothing(drawn):
    def there():
        files = (path for path in drawn.store.path.rglob("*") if path.is_file())
        return {path: path.read_bytes() for path in files if "sqlite" not in path.name}

    before = there()
    run = runs(drawn)[0]
    for path, more in (
        ("", {}),
        ("runs", {}),
        ("run", {"id": run}),
        ("progress", {}),
        ("updates", {}),
    ):
        drawn.page(path, **more)
    assert there() == before


def test_a_copy_is_whole_and_asks_for_nothing(drawn, tmp_path):
    first = write_copy(drawn.store, tmp_path / "copy")
    pages = {path.name: path.read_text() for path in first.parent.glob("*.html")}
    assert pages.keys() == {"index.html", *(f"run-{run}.html" for run in runs(drawn))}
    there = {path.name for path in first.parent.iterdir()}
    for page in pages.values():
        for link in re.findall(r'(?:src|href)="([^"]*)"', page):
            assert link.startswith(("#", "data:,")) or link in there, link
        assert "<form" not in page and str(tmp_path) not in page
        assert str(drawn.store.path.absolute().parent) not in page
    with pytest.raises(StoreError, match="empty folder"):
        write_copy(drawn.store, tmp_path / "copy")
    with pytest.raises(StoreError, match="did you mean 'Three speeds"):
        write_copy(drawn.store, tmp_path / "other", "Three sped")
    assert not (tmp_path / "other").exists()


def test_a_copy_names_files_without_the_folders_of_this_machine(small, tmp_path):
    run = runs(small)[0]
    small.store.archive.catalogue.record_campaign(
        "of a file", None, "/home/somebody/study.toml", [(run, "base", {})]
    )
    first = write_copy(small.store, tmp_path / "copy", "of a file")
    pages = {path.name: path.read_text() for path in first.parent.glob("*.html")}
    assert ">study.toml<" in pages["index.html"]
    name = small.store.path.name
    assert f"wearlab show {run} --store {name}" in pages[f"run-{run}.html"]
    assert f"# in the folder that holds {name}:\n" in pages[f"run-{run}.html"]
    for page in pages.values():
        assert "somebody" not in page
        assert str(small.store.path.absolute().parent) not in page


def test_a_copy_of_a_failed_run_has_no_traceback_of_this_machine(tmp_path):
    store = filled(tmp_path / "store", alter(sweep(2), 1, act="fail"))
    first = write_copy(store, tmp_path / "copy")
    pages = [path.read_text() for path in first.parent.glob("run-*.html")]
    assert any("It failed: " in page for page in pages)
    assert not any("Traceback" in page or "File &#34;" in page for page in pages)


def test_a_copy_has_two_hundred_runs_at_most(small, tmp_path):
    run = runs(small)[0]
    small.store.archive.catalogue.record_campaign(
        "large", None, None, [(run, f"c{n}", {}) for n in range(201)]
    )
    with pytest.raises(StoreError, match="201 cases are more than the 200"):
        write_copy(small.store, tmp_path / "copy", "large")
    with pytest.raises(StoreError, match="2 campaigns: choose one"):
        write_copy(small.store, tmp_path / "copy")


@pytest.mark.parametrize(
    ("rows", "drawn_there"), [(2, True), (100_000, False)], ids=["kept", "too long"]
)
def test_a_copy_draws_published_points_or_says_that_they_are_not_there(
    drawn, tmp_path, rows, drawn_there
):
    """Was a note on hollow marks that the copy did not draw."""
    points = tmp_path / "paper.csv"
    points.write_text("x [million cycles],y [um]\n" + "3,2\n" * rows)
    figure = FigureSpec(
        kind="max-wear", published=points, note="Hollow marks: the paper."
    )
    cases = tuple(
        made_up.Case("base", f"{number + 1:020x}", {"speed": number})
        for number in range(3)
    )
    axis = made_up.Axis("speed", made_up.SPEEDS, "rpm", "operation.speed")
    campaign = made_up.Campaign(cases, (axis,), "with points", figures=(figure,))
    key = drawn.store.archive.catalogue.record_campaign(
        campaign.title,
        None,
        None,
        [(case.id, case.label, {}) for case in cases],
        {},
        with_figures(campaign),
    )
    points.unlink()

    source = question.Source(drawn.store, recorded.campaign_of(drawn.store, key))
    (asked,) = source.of_campaign()
    plot = source.plot(asked)
    styles = {curve.style for panel in plot.panels for curve in panel.curves}
    assert ("published" in styles) == drawn_there
    absent = "The points of paper.csv are not in this store, and not drawn."
    assert any(absent in note for note in plot.notes) != drawn_there

    first = write_copy(drawn.store, tmp_path / "copy", "with points")
    assert (absent in first.read_text()) != drawn_there


@pytest.mark.parametrize(
    ("page", "named"), [("run", "id"), ("campaign", "key"), ("update", "id")]
)
def test_a_page_of_nothing_says_what_to_give(small, page, named):
    """Was "run '': no such run"."""
    status, _, content = small.send(page)
    assert status == 400
    assert (
        f"which {page}? Open one from the pages, or give {named}=… in the address"
        in content.decode()
    )


def test_a_figure_of_too_many_runs_is_refused(small):
    assert small.send("compare", run=[f"{n:020x}" for n in range(201)])[0] == 400


def test_a_damaged_catalogue_is_told(small):
    with small.store.archive.catalogue._transaction() as connection:
        connection.execute("UPDATE members SET position = '[1'")
    key = recorded.campaigns(small.store)[0][0].key
    for path, more in (("campaign", {"key": key}), ("runs", {})):
        status, _, content = small.send(path, **more)
        assert status == 400 and "wearlab reindex" in content.decode()
    assert "five speeds" in small.page("")


def test_a_notebook_shows_the_window(small):
    shown = small.window._repr_html_()
    assert f'src="{small.window.address}"' in shown and "<iframe" in shown


def test_commands_and_python_agree(small, capsys):
    from wearlab.cli import app

    run = runs(small)[0]
    where = ["--store", str(small.store.path)]
    assert app.status_of(["tag", run, "good", "late", *where]) == 0
    assert app.status_of(["tag", run, "--remove", "late", *where]) == 0
    assert app.status_of(["note", run, "seen", *where, "--json"]) == 0
    assert [
        note["note"]
        for note in json.loads(
            capsys.readouterr().out.rpartition("\n[")[2].join(["[", ""])
        )
    ] == ["seen"]
    assert [r.text for r in small.store.remarks(run)] == ["good", "seen"]
    assert app.status_of(["show", run, *where]) == 0
    assert re.search(r"tags\s+good\n", capsys.readouterr().out)
    assert app.status_of(["tag", "feed", "x", *where]) == 2
    assert app.status_of(["browse", str(small.store.path / "none")]) == 2


def test_a_map_is_drawn_as_cells_that_tell_their_level():
    """Was an empty pair of axes."""
    from types import SimpleNamespace

    from bokeh.models import ColumnDataSource
    from bokeh.plotting import figure

    from wearlab.browsing import interactive

    x, y = np.meshgrid([0.0, 1.0, 3.0], [-10.0, 10.0])
    level = np.arange(6.0)
    pen = SimpleNamespace(colour="#000000", dash="-", width=1.0, marker="")
    curve = SimpleNamespace(
        x=x.ravel(),
        y=y.ravel(),
        level=level,
        reach=(0.0, 5.0),
        style="map",
        pen=pen,
        y_error=None,
        x_error=None,
        doubtful=None,
        runs=None,
    )
    data = interactive._data(curve, {"x": 0.0, "y": 0.0})
    assert (
        data["width"].tolist() == [1.0, 1.5, 2.0] * 2
        and data["height"].tolist() == [20.0] * 6
    )
    (cells,), asked = interactive._curve(figure(), curve, ColumnDataSource(data))
    assert asked == [cells] and cells.glyph.fill_color.field == "level"
    assert (
        cells.glyph.fill_color.transform.low,
        cells.glyph.fill_color.transform.high,
    ) == (0.0, 5.0)
