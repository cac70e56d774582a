"""Tables that a script writes into a page, between their marks."""

from collections.abc import Sequence
from pathlib import Path


def write_between(file: Path, begin: str, end: str, lines: Sequence[str]) -> None:
    """Write lines into a page in place of what stands between two marks.

    Parameters
    ----------
    file : the page, which has both marks
    begin, end : the marks
    lines : of the table
    """
    head, _, rest = file.read_text(encoding="utf-8").partition(begin)
    _, _, tail = rest.partition(end)
    page = "\n".join([head + begin, "", *lines, "", end + tail])
    file.write_text(page, encoding="utf-8")
