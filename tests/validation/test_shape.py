"""What the shape of the package promises: a class name has one meaning."""

from shape import blocks, by_room, of_one_name, sources


def test_no_class_name_stands_twice():
    assert of_one_name(sources()) == {"classes of one name": []}


def test_files_that_share_blocks_are_seen():
    """A detector that sees nothing proves nothing."""
    files = sources()
    one = next(file for file in files if len(file.lines) > 100)
    assert len(*blocks([one, one._replace(name="again.py")]).values()) == 1


def test_every_file_stands_in_a_room():
    files = sources()
    assert sum(count for count, _ in by_room(files).values()) == len(files)
