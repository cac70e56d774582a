"""What the shape of the package promises: a class name has one meaning."""

import pytest
from shape import blocks, by_room, of_one_name, sources


@pytest.fixture(scope="module")
def files():
    return sources()


def test_no_class_name_stands_twice(files):
    assert of_one_name(files) == {"classes of one name": []}


def test_files_that_share_blocks_are_seen(files):
    """A detector that sees nothing proves nothing."""
    one = next(file for file in files if len(file.lines) > 100)
    assert len(*blocks([one, one._replace(name="again.py")]).values()) == 1


def test_every_file_stands_in_a_room(files):
    assert sum(count for count, _ in by_room(files).values()) == len(files)
