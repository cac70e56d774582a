"""Tags and notes: kept in files of lines beside the runs, found again by reindex,
joined by merge.
"""

import json

import pytest
from fake_campaign import filled, sweep

from wearlab.query import QueryError
from wearlab.store import Store, StoreError
from wearlab.store.export import export_attributes
from wearlab.store.remarks import Remark, files_of, read_line


@pytest.fixture
def store(tmp_path):
    return filled(tmp_path / "store", sweep(3))


def ids(store):
    return [entry.id for entry in store.archive.entries().values()]


def found(store, where):
    return sorted(store.query(where)["id"])


def test_a_tag_is_found_and_taken_off_again(store):
    first, second, _ = ids(store)
    store.tag(first, "good", "for the paper")
    store.tag(second, "good")
    assert found(store, "tag = good") == sorted([first, second])
    assert found(store, "tag = 'for the paper'") == [first]
    assert len(found(store, "not tag = good")) == 1
    store.tag(first, remove=["good"])
    assert found(store, "tag = good") == [second]
    store.tag(first, "good")
    assert found(store, "tag = good") == sorted([first, second])
    assert store.query("", columns=["tag"])["tag"].count("for the paper,good") == 1


def test_a_note_is_kept_and_searched(store):
    first = ids(store)[0]
    store.note(first, "the peak at C is no error:\nsee the mesh force")
    assert found(store, "note contains 'mesh force'") == [first]
    (remark,) = store.remarks(first[:12])
    assert (remark.what, remark.subject) == ("note", first) and remark.when.startswith(
        "20"
    )


def test_a_tag_of_a_campaign_is_said_of_its_runs(store):
    store.tag("five speeds", "published", campaign=True)
    assert found(store, "tag = published") == sorted(ids(store))
    assert [r.text for r in store.remarks("five speeds", campaign=True)] == [
        "published"
    ]
    with pytest.raises(StoreError, match="did you mean 'five speeds'"):
        store.tag("five spedes", "x", campaign=True)


def test_nothing_of_it_is_part_of_a_run(store):
    before = {path: path.read_bytes() for path in store.archive.files}
    names = ids(store)
    store.tag(names[0], "good")
    assert (
        ids(store) == names
        and {path: path.read_bytes() for path in store.archive.files} == before
    )
    assert store.verify() == []


@pytest.mark.parametrize(
    ("what", "text", "said"),
    [
        ("tag", "  ", "write a word"),
        ("tag", "a" * 101, "101 characters"),
        ("tag", "two\nlines", "one line"),
    ],
)
def test_what_is_no_tag_is_refused_and_leaves_nothing(store, what, text, said):
    with pytest.raises(StoreError, match=said):
        store.tag(ids(store)[0], text)
    with pytest.raises(StoreError, match="no such run"):
        store.tag("../../etc", "x")
    assert not (store.path / "remarks").exists()


def test_signs_that_nobody_sees_are_left_out(store):
    first = ids(store)[0]
    store.tag(first, "\u202egood\x00\x1b[31m")
    assert [r.text for r in store.remarks(first)] == ["good[31m"]


def test_reindex_finds_them_again(store):
    first = ids(store)[0]
    store.tag(first, "good", "late")
    store.tag(first, remove=["late"])
    store.tag("five speeds", "all", campaign=True)
    with store.archive.catalogue._transaction() as connection:
        connection.execute("DROP TABLE remarks")
    assert found(store, "tag = good") == []
    assert [problem.kind for problem in store.verify()] == ["unknown", "unknown"]
    assert store.reindex() == [] and store.verify() == []
    assert found(store, "tag = good") == [first] and found(store, "tag = late") == []
    assert len(found(store, "tag = all")) == 3


def test_reindex_makes_a_table_anew_that_no_wearlab_made(store):
    first = ids(store)[0]
    store.tag(first, "good")
    with store.archive.catalogue._transaction() as connection:
        connection.execute("DROP TABLE remarks")
        connection.execute("CREATE TABLE remarks (subject, other)")
    with pytest.raises(StoreError, match="no such column"):
        store.verify()
    assert store.reindex() == [] and store.verify() == []
    assert found(store, "tag = good") == [first]


def test_lines_are_added_and_never_written_over(store):
    first = ids(store)[0]
    store.tag(first, "one")
    before = files_of(store.archive.catalogue).path(first).read_bytes()
    store.tag(first, "two", remove=["one"])
    assert files_of(store.archive.catalogue).path(first).read_bytes().startswith(before)


def test_a_torn_and_a_changed_line_are_told_and_the_rest_stays(store):
    first = ids(store)[0]
    store.tag(first, "one")
    path = files_of(store.archive.catalogue).path(first)
    with path.open("ab") as file:
        file.write(b'{"subject": "half')
    store.tag(first, "two")
    lines = path.read_text().splitlines()
    path.write_text("\n".join([lines[0].replace("one", "won"), *lines[1:]]) + "\n")
    problems = store.reindex()
    assert [problem.kind for problem in problems] == ["altered", "altered"]
    assert found(store, "tag = two") == [first] and found(store, "tag = won") == []
    assert {problem.kind for problem in store.verify()} == {"altered"}


def test_a_line_about_another_run_is_none():
    line = Remark("ab12", "tag", "good", "me", "2026-11-24").line
    assert read_line(line, "ab12").text == "good"
    with pytest.raises(ValueError, match="another run"):
        read_line(line, "cd34")
    told = json.loads(line) | {"text": "bad"}
    with pytest.raises(ValueError, match="its hash"):
        read_line(json.dumps(told), "ab12")


def test_merge_joins_the_lines_of_two_stores(store, tmp_path):
    other = filled(tmp_path / "other", sweep(3))
    first, second, _ = ids(store)
    store.tag(first, "ours")
    other.tag(first, "theirs")
    other.tag(second, "gone", remove=["gone"])
    other.tag("five speeds", "all", campaign=True)
    other.note(first, "a note")
    from wearlab.store.merging import merge

    made = merge(store, other)
    assert made.remarks == 5 and not made.damaged
    assert {r.text for r in store.remarks(first)} == {"ours", "theirs", "a note"}
    assert found(store, "tag = gone") == [] and len(found(store, "tag = all")) == 3
    assert merge(store, other).remarks == 0 and store.verify() == []


def test_a_damaged_line_of_another_store_stays_there(store, tmp_path):
    other = filled(tmp_path / "other", sweep(3))
    first = ids(store)[0]
    other.tag(first, "theirs")
    with other.archive.catalogue._transaction() as connection:
        connection.execute(
            "UPDATE remarks SET line = replace(line, 'theirs', 'planted')"
        )
    from wearlab.store.merging import merge

    made = merge(store, other)
    assert made.remarks == 0 and "its hash" in made.damaged[first]
    assert store.remarks(first) == []


def test_a_pull_over_the_network_brings_them(store, tmp_path):
    first = ids(store)[0]
    store.tag(first, "good")
    here = Store(tmp_path / "here")
    from wearlab.store.merging import merge

    made = merge(here, Store(f"file://{store.path}"))
    assert made.remarks == 1 and found(here, "tag = good") == [first]
    with pytest.raises(StoreError, match="only read from here"):
        Store(f"file://{store.path}").tag(first, "x")


def test_exports_tell_them(store):
    first = ids(store)[0]
    store.tag(first, "good")
    store.tag("five speeds", "all", campaign=True)
    told = json.loads(export_attributes(sweep(3), store)["tags"])
    assert [(one["of"], one["tag"]) for one in told] == [
        (first, "good"),
        ("five speeds", "all"),
    ]
    assert "notes" not in export_attributes(sweep(3), store)


def test_an_older_store_without_any_is_asked_all_the_same(store):
    assert found(store, "tag = good") == [] and store.remarks(ids(store)[0]) == []
    with pytest.raises(QueryError, match="tag"):
        store.query("tga = good")


def test_a_link_is_not_followed(store, tmp_path):
    first = ids(store)[0]
    path = files_of(store.archive.catalogue).path(first)
    path.parent.mkdir(parents=True)
    (tmp_path / "elsewhere").write_text("kept")
    path.symlink_to(tmp_path / "elsewhere")
    with pytest.raises(StoreError, match="is a link"):
        store.tag(first, "good")
    assert (tmp_path / "elsewhere").read_text() == "kept"
