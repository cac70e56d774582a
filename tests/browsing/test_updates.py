"""Pages of updates: the answer, the table of a fleet, its figures,
and what is taken along.
"""

import re
from html import escape, unescape
from urllib.parse import parse_qs, urlsplit

from wearlab.store.updates import kept_updates, read_update
from wearlab.updating import report_text
from wearlab.updating.report_text import answers, fleet_tables


def test_a_fleet_is_told_as_by_command(measured):
    (update,) = kept_updates(measured.store).values()
    tree = read_update(measured.store, update.id)
    listed = unescape(measured.page("updates"))
    page = measured.page("update", id=update.id)
    for line in answers(tree):
        assert line in listed and escape(line) in page.replace(
            "&#39;", "&#x27;"
        ).replace("&#34;", "&quot;")
    ((_, head, rows),) = fleet_tables(tree)
    assert len(rows) == 4 and "<b>new</b>" in [row[0] for row in rows]
    found = re.findall(r'<th scope="row">(.*?)</th>', page)
    assert [unescape(name) for name in found] == [
        row[0] for row in rows
    ] and "<b>new</b>" not in page
    for cell in (*head, *(cell for row in rows for cell in row)):
        assert cell in unescape(page)


def test_a_planted_update_ends_in_one_message(measured, monkeypatch):
    """Tables of what no update holds ended in a traceback."""
    (update,) = kept_updates(measured.store)

    def absent(tree):
        raise KeyError("pace")

    monkeypatch.setattr(report_text, "fleet_tables", absent)
    status, _, content = measured.send("update", id=update)
    assert status == 400 and b"its file holds what no update does" in content


def test_figures_of_an_update_are_taken_along(measured):
    (update,) = kept_updates(measured.store)
    page = unescape(measured.page("update", id=update))
    kinds = set(re.findall(r"/update\.png\?[^\"]*kind=([a-z-]+)", page))
    assert "fleet" in kinds
    for ending, start in (("png", b"\x89PNG"), ("csv", b"panel,")):
        (address,) = re.findall(rf'"(/update\.{ending}\?[^"]*kind=fleet)"', page)
        asked = {
            key: value[0]
            for key, value in parse_qs(urlsplit(address).query).items()
            if key != "token"
        }
        status, _, content = measured.send(f"update.{ending}", **asked)
        assert status == 200 and content.startswith(start)
    assert measured.send("update.png", id=update, kind="nothing")[0] in (400, 404)
    assert measured.send("update", id="feed")[0] == 404
