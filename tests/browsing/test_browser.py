"""A window as people use it, in a real browser: the system's Chromium, driven by
Playwright.

`pytest -m browser` runs these; without a browser each is skipped, and says so.
`WEARLAB_BROWSER` names one.
"""

import re
import subprocess
import sys
import time
from pathlib import Path

import many_runs
import pytest
from fake_campaign import filled, sweep

from wearlab.cli import app
from wearlab.figures import redraw
from wearlab.store import Store

pytestmark = pytest.mark.browser
PLANTED = (
    '"><img src=x '
    'onerror="window.planted=1"><script>window.planted=1</script>'
    "$$\\href{javascript:1}{x}$$"
)


def column(page, name):
    """Return the texts of a column of the table of runs."""
    heads = [
        text.split(" [")[0].strip("▲▼ ")
        for text in page.locator("table.runs thead th").all_inner_texts()
    ]
    place = heads.index(name) + 1
    return page.locator(f"table.runs tbody tr > :nth-child({place})").all_inner_texts()


def test_from_the_campaigns_to_a_run_and_its_slider(page, drawn):
    page.goto(drawn.window.address)
    page.get_by_role("link", name="Three speeds").first.click()
    page.locator("canvas").first.wait_for()
    page.locator("table.runs tbody a").nth(1).click()
    assert page.get_by_role("heading", level=1).inner_text().endswith("speed=1100 rpm")
    page.get_by_role("status").filter(has_text="State 2 of 2").wait_for()
    words = page.locator("summary", has_text="In words")
    words.click()
    before = page.locator("details[open] li").all_inner_texts()
    page.get_by_role("slider").focus()
    page.keyboard.press("ArrowLeft")
    page.get_by_role("status").filter(
        has_text="State 1 of 2: 3 million cycles"
    ).wait_for()
    page.get_by_role("button", name="Less worn").click()
    page.get_by_role("status").filter(has_text="State 0 of 2: 0 cycles").wait_for()
    page.locator("summary", has_text="In words").click()
    assert page.locator("details[open] li").all_inner_texts() != before


def test_filter_by_choosing_and_sort_by_clicking(page, drawn):
    page.goto(drawn.at("runs"))
    assert page.get_by_role("status").inner_text() == "runs 1 to 3 of 3"
    page.get_by_label("What", exact=True).fill("speed")
    page.get_by_label("How").select_option("at least")
    page.get_by_label("Value with unit").fill("1000 rpm")
    page.get_by_role("button", name="Add to the condition").click()
    assert page.get_by_label("Condition").input_value() == "speed >= 1000 rpm"
    assert page.get_by_role("status").inner_text() == "runs 1 to 2 of 2"
    page.locator("thead").get_by_role("link", name="speed").click()
    assert column(page, "speed") == ["3720", "1100"]
    assert page.locator("th[aria-sort=descending]").inner_text().startswith("speed")
    page.locator("thead").get_by_role("link", name="speed").click()
    assert column(page, "speed") == ["1100", "3720"]


def test_a_wrong_condition_is_answered_as_on_the_command_line(page, drawn):
    page.goto(drawn.at("runs"))
    page.get_by_label("Condition").fill("torqe > 5 N*m")
    page.get_by_role("button", name="Show", exact=True).click()
    said = page.get_by_role("alert").inner_text()
    assert "unknown name 'torqe'; did you mean" in said and "'torque'" in said
    assert page.get_by_label("Condition").input_value() == "torqe > 5 N*m"


def test_marked_runs_are_compared_and_taken_along(page, drawn, tmp_path):
    page.goto(drawn.at("runs"))
    for mark in page.get_by_role("checkbox").all()[:2]:
        mark.check()
    page.get_by_role("button", name="Compare the marked runs").first.click()
    page.locator("canvas").first.wait_for()
    assert page.get_by_label("Legend").inner_text().split() == [
        "speed:",
        "800",
        "rpm",
        "1100",
        "rpm",
    ]
    asked = page.get_by_role("region", name="Runs side by side")
    assert "operation.speed" in asked.inner_text()
    page.get_by_label("Kind", exact=True).select_option("tvms")
    page.get_by_role("button", name="Draw").click()
    page.get_by_role("heading", name="Time-varying mesh stiffness").wait_for()
    for ending in ("PNG", "CSV"):
        with page.expect_download() as taken:
            page.get_by_role("link", name=ending, exact=True).click()
        taken.value.save_as(tmp_path / taken.value.suggested_filename)
    (figure,) = tmp_path.glob("*.png")
    again = redraw(figure, drawn.store, tmp_path / "again")
    assert again.same and not again.missing
    (numbers,) = tmp_path.glob("*.csv")
    assert numbers.read_text().count(f"{2:020x}") > 10


def test_a_sweep_is_drawn_over_axes_of_choice_and_tells_what_is_pointed_at(page, drawn):
    key = re.search(r"key=([0-9a-f]+)", drawn.page(""))[1]
    page.goto(drawn.at("compare", campaign=key))
    page.get_by_label("Kind", exact=True).select_option("line")
    page.get_by_label("Result (y)").select_option("life")
    page.get_by_label("Over (x)").select_option("speed")
    page.get_by_role("button", name="Draw").click()
    canvas = page.locator("canvas").first
    canvas.wait_for()
    box = canvas.bounding_box()
    tip = page.locator(".bk-tooltip-content")
    for down in range(
        10, 260, 4
    ):  # across the line between the second and the third speed
        page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + down)
        if tip.count():
            break
    words = " ".join(tip.first.inner_text().split())
    assert re.fullmatch(
        r".*x: (1100|3720) y: [0-9.e+]+( ± [0-9.e+]+)? run: 0+[23]", words
    ), words


def test_a_tag_is_put_on_and_found_by_command(page, small, capsys):
    run = next(iter(small.store.archive.entries()))
    page.goto(small.at("run", id=run))
    page.get_by_role("textbox", name="Tag").fill("for the paper")
    page.get_by_role("button", name="Put on").click()
    page.get_by_role("button", name="Take off “for the paper”").wait_for()
    page.get_by_role("textbox", name="Note").fill("seen by <b>two</b> of us")
    page.get_by_role("button", name="Write").click()
    page.get_by_text("seen by <b>two</b> of us").wait_for()
    found = small.store.query("tag = 'for the paper'")["id"]
    assert found == [run]
    where = ["--store", str(small.store.path), "--where", "tag = 'for the paper'"]
    assert app.status_of(["ls", *where]) == 0 and run[:10] in capsys.readouterr().out
    page.get_by_role("button", name="Take off “for the paper”").click()
    page.get_by_text("seen by").wait_for()
    assert small.store.query("tag = 'for the paper'")["id"] == []


def test_a_wrong_token_shows_nothing(page, small):
    page.goto(f"http://127.0.0.1:{small.window.port}/?token=wrong")
    assert (
        page.locator("body")
        .inner_text()
        .startswith("The token of this window is missing or wrong")
    )


def test_text_of_strangers_stays_text(page, drawn):
    store = drawn.store
    run = next(iter(store.archive.entries()))
    store.tag(run, "".join(PLANTED[:99]))
    store.note(run, PLANTED)
    second = list(store.archive.entries())[1]
    axis = {
        "name": "speed",
        "values": [PLANTED, "b"],
        "units": None,
        "key": PLANTED,
        "beside": {},
    }
    record = {
        "format": 1,
        "title": PLANTED,
        "reference": PLANTED,
        "axes": [axis],
        "cases": [[run, PLANTED, [0]], [second, PLANTED, [1]]],
        "figures": [
            {
                "kind": "tvms",
                "title": PLANTED,
                "note": PLANTED,
                "select": {"update": -1},
            }
        ],
    }
    members = [(run, PLANTED, {"speed": PLANTED}), (second, PLANTED, {"speed": "b"})]
    key = store.archive.catalogue.record_campaign(
        PLANTED, PLANTED, PLANTED, members, {}, record
    )
    for path, more in (
        ("", {}),
        ("campaign", {"key": key}),
        ("runs", {"columns": "tag,note,case", "where": PLANTED}),
        ("runs", {"columns": "tag,note,campaign,case"}),
        ("run", {"id": run}),
        ("compare", {"run": [run, second]}),
        ("compare", {"campaign": key, "x": PLANTED}),
        ("compare", {"campaign": key, "kind": "tvms"}),
        ("run", {"id": PLANTED}),
        ("progress", {}),
        ("updates", {}),
    ):
        page.goto(drawn.at(path, **more))
        if path in ("campaign", "run", "compare") and PLANTED not in more.values():
            page.locator("canvas").first.wait_for()
        assert page.evaluate("window.planted") is None, path
        assert page.locator("img[src=x]").count() == 0, path


def test_a_hundred_thousand_runs_are_paged(page, tmp_path, opened):
    asked = opened(many_runs.filled(tmp_path / "many", 100_000))
    page.goto(asked.window.address)
    assert "100000 failed" in page.locator("main").inner_text()
    page.goto(asked.at("runs"))
    assert page.get_by_role("status").inner_text() == "runs 1 to 50 of 100,000"
    page.get_by_role("link", name="next page").click()
    assert page.get_by_role("status").inner_text() == "runs 51 to 100 of 100,000"
    page.locator("thead").get_by_role("link", name="life [cycles]", exact=True).click()
    longest = max(many_runs.values(n)["life"] for n in range(1, 100_001))
    assert float(column(page, "life")[0].replace(",", "")) == pytest.approx(
        longest, rel=1e-5
    )


def test_a_campaign_under_way_is_watched(page, tmp_path, opened):
    store = filled(tmp_path / "store", sweep(2))
    gate = tmp_path / "gate"
    here = Path(__file__).parents[1] / "support"
    words = [
        sys.executable,
        here / "run_fake.py",
        store.path,
        "4",
        "-",
        gate,
        "alone=1",
    ]
    process = subprocess.Popen(
        words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        asked = opened(store)
        page.goto(asked.at("progress"))
        for _ in range(120):
            if page.get_by_role("progressbar").count():
                break
            time.sleep(0.25)
            page.reload()
        assert "0 of 4 finished" in page.locator("main").inner_text()
        assert page.get_by_role("rowheader").count() >= 1
        gate.touch()
        assert process.wait(timeout=60) == 0
        page.reload()
        assert page.get_by_role("status").inner_text() == "No run is under way."
    finally:
        process.kill()
        process.wait()
    assert len(Store(store.path).archive.entries()) == 6 and store.verify() == []


def test_a_copy_needs_no_window(page, drawn, tmp_path):
    from wearlab.browsing.pages import write_copy

    first = write_copy(drawn.store, tmp_path / "copy")
    page.goto(first.as_uri())
    page.locator("canvas").first.wait_for()
    page.locator("table.runs tbody a").first.click()
    page.locator("canvas").first.wait_for()
    assert "How to cite it" in page.locator("main").inner_text()
    assert "token" not in page.content()
