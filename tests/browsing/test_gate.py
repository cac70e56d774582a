"""Who may look: this machine under its own name, with the token.

And what a window never does.
"""

import json
import re

import pytest

PLANTED = "<script>alert(1)</script><img src=x onerror=alert(2)>"


def test_the_first_page_tells_the_campaign(small):
    page = small.page("")
    assert "five speeds" in page and "3 done" in page


@pytest.mark.parametrize("token", ["", "wrong", "a" * 10_000, "\u00e9"])
@pytest.mark.parametrize(
    "path", ["", "runs", "figure/autoload.js", "remark", "style.css", "nothing"]
)
def test_without_the_token_nothing_is_told(small, path, token):
    status, headers, content = small.send(path, token=token)
    assert status == 403 and b"five speeds" not in content
    assert headers["Referrer-Policy"] == "no-referrer"


def test_two_tokens_are_none(small):
    assert small.send("", token=[small.window.token, "x"])[0] == 403


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:80", "127.0.0.1", "127.0.0.1:1", "localhost"]
)
def test_another_host_is_refused(small, host):
    """A page of a stranger whose name leads to this machine asks under that name."""
    assert small.send("", host=host)[0] == 403
    assert small.send("static/js/bokeh.min.js", host=host)[0] == 403


def test_localhost_is_this_machine(small):
    assert small.send("", host=f"localhost:{small.window.port}")[0] == 200


@pytest.mark.parametrize("method", ["PUT", "DELETE", "PATCH", "TRACE"])
def test_a_window_is_looked_at(small, method):
    assert small.send("runs", method)[0] == 405


@pytest.mark.parametrize(
    "run", ["../../etc/passwd", "..%2f..%2fetc", "/etc/passwd", "a" * 500, "", "*", "'"]
)
def test_what_is_no_run_of_the_store_is_not_given(small, run):
    for path in ("data", "citation", "run"):
        status, _, content = small.send(path, id=run)
        assert status in (400, 404) and b"root:" not in content
    status, _, content = small.send("figure.png", run=run)
    assert status in (400, 404)


PATHS = (
    "static/../../../etc/passwd",
    "static/%2e%2e/%2e%2e/x.py",
    "../catalogue.sqlite",
)


@pytest.mark.parametrize("path", PATHS)
def test_a_path_leads_nowhere_else(small, path):
    status, _, content = small.send(path)
    assert (
        status in (400, 403, 404)
        and b"SQLite" not in content
        and b"root:" not in content
    )


def test_a_linked_run_is_not_followed(small, tmp_path):
    entry = next(iter(small.store.archive.entries().values()))
    path = small.store.archive.files.path(entry.id)
    path.rename(tmp_path / "elsewhere.nc")
    path.symlink_to(tmp_path / "elsewhere.nc")
    status, _, content = small.send("data", id=entry.id)
    assert status == 400 and "is a link" in content.decode()


def test_pages_load_nothing_from_elsewhere(drawn):
    for path, more in (
        ("", {}),
        ("runs", {}),
        ("compare", {"run": [f"{n:020x}" for n in (1, 2)]}),
    ):
        _, headers, content = drawn.send(path, **more)
        assert "default-src 'none'" in headers["Content-Security-Policy"]
        assert (
            headers["X-Content-Type-Options"] == "nosniff"
            and headers["Cache-Control"] == "no-store"
        )
        loaded = re.findall(r'(?:src|href|action)="([^"]*)"', content.decode())
        assert loaded and all(
            one.startswith(("/", "#", "data:,")) and one[:2] != "//" for one in loaded
        )


def test_text_of_strangers_is_never_markup(small):
    store = small.store
    run = next(iter(store.archive.entries()))
    store.tag(run, PLANTED)
    store.note(run, PLANTED)
    store.tag("five speeds", PLANTED, campaign=True)
    members = [(run, PLANTED, {PLANTED: PLANTED})]
    key = store.archive.catalogue.record_campaign(
        PLANTED, PLANTED, PLANTED, members, {"author": PLANTED}
    )
    shown = [
        small.page(""),
        small.page("campaign", key=key),
        small.page("runs", columns="tag,note,campaign,case"),
        small.page("runs", where=PLANTED),
        small.page("run", id=run),
        small.page("compare", run=[run]),
        small.send("run", id=PLANTED)[2].decode(),
        small.page("runs", columns=PLANTED, sort=PLANTED),
        small.send("figure.png", run=[run], kind=PLANTED)[2].decode(),
        small.page("compare", run=[run], kind=PLANTED),
    ]
    for page in shown:
        assert "<script>alert" not in page and "<img src=x" not in page
        assert (
            "alert(1)" not in page
            or "&lt;script&gt;" in page
            or "\\u003c" in page
            or "%3Cscript" in page
        )


def test_a_failed_trace_is_not_told(small, monkeypatch):
    from wearlab.browsing import contents

    monkeypatch.setattr(contents, "updates", lambda *asked: 1 / 0)
    status, _, content = small.send("updates")
    assert (
        status == 500
        and "ZeroDivisionError" in content.decode()
        and "Traceback" not in content.decode()
    )


def test_a_window_writes_tags_and_notes_alone(small):
    run = next(iter(small.store.archive.entries()))
    before = sorted(path for path in small.store.path.rglob("*") if path.is_file())
    status, headers, _ = small.send(
        "remark", "POST", body={"subject": run, "what": "tag", "text": "good"}
    )
    assert status == 303 and headers["Location"].startswith("/run?token=")
    assert [r.text for r in small.store.remarks(run)] == ["good"]
    new = sorted(path for path in small.store.path.rglob("*") if path.is_file())
    assert [
        path.suffix for path in new if path not in before and "sqlite" not in path.name
    ] == [".jsonl"]
    for subject, what in (("nobody", "tag"), (run, "erase"), ("../x", "note")):
        body = {"subject": subject, "what": what, "text": "x"}
        assert small.send("remark", "POST", body=body)[0] in (400, 404)
    assert (
        small.send(
            "remark",
            "POST",
            token="wrong",
            body={"subject": run, "what": "tag", "text": "b"},
        )[0]
        == 403
    )
    assert small.send("remark")[0] == 405


def test_no_code_of_a_store_is_run(drawn, tmp_path):
    """Neither the file of a campaign nor the plug-ins that a scene or
    a file names are read.
    """
    planted = tmp_path / "<script>plug.py"
    marker = tmp_path / "ran"
    planted.write_text(f"open({str(marker)!r}, 'w').close()\n")
    file = tmp_path / "campaign.toml"
    file.write_text(f"plugins = [{str(planted)!r}]\n")
    store = drawn.store
    run = next(iter(store.archive.entries()))
    scene = {
        "plugins": {str(planted): "ab"},
        "wear": {"law": {"model": PLANTED}},
        "operation": {"speed": 1.0},
    }
    with store.archive.catalogue._transaction() as connection:
        named = (json.dumps(scene), run)
        connection.execute(
            "UPDATE documents SET scene = ? WHERE number = (SELECT number FROM runs "
            "WHERE id = ?)",
            named,
        )
    record = {
        "format": 1,
        "title": "t",
        "reference": None,
        "axes": [],
        "cases": [[run, "base", []]],
        "figures": [],
    }
    record["written"] = {"operation.speed": [PLANTED, "1 rpm", 5], "operation": PLANTED}
    key = store.archive.catalogue.record_campaign(
        "t", None, str(file), [(run, "base", {})], {}, record
    )
    pages = [
        drawn.page(""),
        drawn.page("campaign", key=key),
        drawn.page("run", id=run),
        drawn.page("runs"),
    ]
    pages.append(drawn.page("compare", run=list(store.archive.entries())[:2]))
    assert not marker.exists() and "plug.py" in pages[2]
    assert all(
        "<script>plug" not in page and "<script>alert" not in page for page in pages
    )
