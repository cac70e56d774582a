"""What commands write: texts, tables, JSON, errors, progress.

Closed streams and Ctrl-C harm no store.
"""

import errno
import json
import os
import re
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from enum import IntEnum, StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from wearlab.sources import SHORT_ID
from wearlab.store import Store, outcome

if TYPE_CHECKING:
    from wearlab.campaign import Campaign, Case
    from wearlab.plugins import Plugin


FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EBADF)
"""What the system says of an output that takes no more."""


def fill_closed() -> None:
    """Let streams that this process was begun without (``>&-``) lead nowhere.

    A number that stays free is given to the next file that is opened: what a library
    prints would go into it.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free
        if getattr(sys, name) is None:
            setattr(
                sys,
                name,
                open(os.devnull, "r" if number == 0 else "w", encoding="utf-8"),
            )


def nowhere(stream: object) -> None:
    """Drop what a stream holds back and whatever comes, so that Python does not complain when it leaves."""
    with suppress(OSError, ValueError, AttributeError):
        sink = os.open(os.devnull, os.O_WRONLY)
        os.dup2(sink, stream.fileno())  # type: ignore[attr-defined]
        os.close(sink)


SECOND = b"wearlab: interrupted twice: stopped at once; finished runs are kept, run again to continue\n"


def at_once_when_twice() -> None:
    """Let a second Ctrl-C end this process without any farewell.

    Whatever is written at that moment appears whole or not at all, and workers go when
    their parent does.
    """
    here = threading.current_thread() is threading.main_thread()
    if (
        here and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    ):  # else somebody else decides
        signal.signal(signal.SIGINT, _first)


def _first(*told: object) -> None:
    signal.signal(signal.SIGINT, _second)
    raise KeyboardInterrupt


def _second(*told: object) -> None:
    os.write(2, SECOND)
    os._exit(Status.INTERRUPTED)


Content = TypeVar("Content")
Rows = Sequence[Sequence[str]]
STORE = Path("wearlab-store")
ASKED: ContextVar[Path] = ContextVar("asked", default=STORE)
"""The store of the command, in which runs of plug-ins have left what these declare."""
TRUSTED: ContextVar[bool] = ContextVar("trusted", default=False)
"""Whether the command was told ``--plugins``: that plug-ins of campaign files may be
run."""
AS_JSON: ContextVar[bool] = ContextVar("as JSON", default=False)
"""Whether the command was told ``--json``: that a program reads what it found."""


class Status(IntEnum):
    """Exit statuses."""

    WELL = 0
    TROUBLE = 1
    REFUSED = 2
    INTERRUPTED = 130


Format = StrEnum("Format", ("TABLE", "JSON", "CSV"))
"""How a table is written."""


class ShownTable(NamedTuple):
    """A table that people see, as `show_table` writes it."""

    heads: Sequence[str]
    rows: Rows
    title: str | None = None
    empty: str = ""


Text = Iterable[str | ShownTable]
"""Lines and tables for people; asked for only when they are to be shown."""


class Findings(NamedTuple):
    """What a command found.

    Parameters
    ----------
    content : for programs, what ``--json`` writes; or a function that returns it
    text : for people
    well : whether nothing is wrong; else the exit status tells of trouble
    remarks : what is said on standard error besides, of either
    """

    content: Any
    text: Text
    well: bool = True
    remarks: Sequence[str] = ()


class Stop(Exception):
    """A command cannot go on: a message for the user, and the exit status."""

    def __init__(self, message: str, status: Status = Status.REFUSED) -> None:
        super().__init__(message)
        self.status = status


@contextmanager
def refusing(*kinds: type[Exception]) -> Iterator[None]:
    """Turn errors of these kinds into one message and exit status 2."""
    try:
        yield
    except kinds as error:
        message = str(error)
        if isinstance(error, OSError) and error.filename:
            message = f"{error.filename}: {error.strerror}"

        raise Stop(message) from error


def read_campaign(file: str) -> "Campaign":
    """Read a campaign file.

    Raises
    ------
    Stop : it is absent, unreadable or wrong
    """
    from wearlab.campaign import load

    return _loaded(load, file)


def read_plugins(file: str) -> "tuple[Plugin, ...]":
    """Make the variants of a file's plug-ins known.

    Raises
    ------
    Stop : the file cannot be read, or a plug-in may not be run
    """
    from wearlab.campaign import read_plugins

    return _loaded(read_plugins, file)


def _loaded(read: Callable[[str], Content], file: str) -> Content:
    from wearlab.plugins import FOLDER, Trust, trusting

    trust = Trust(TRUSTED.get(), ASKED.get() / FOLDER)
    with (
        refusing(OSError, ValueError),
        trusting(trust),
        reporting(f"reading the cases of {file}"),
    ):
        return read(file)


def sound_campaign(file: str) -> "Campaign":
    """Read a campaign file whose figures name kinds, variables, dimensions and cases that exist."""
    campaign = read_campaign(file)
    refuse_wrong_figures(campaign, file)
    return campaign


def refuse_wrong_figures(campaign: "Campaign", file: str) -> None:
    """Stop where a figure names what does not exist."""
    if campaign.figures:
        from wearlab.figures import question

        if problems := question.figure_problems(campaign):
            raise Stop("\n".join(f"{file}: {problem}" for problem in problems))


def drawn(
    campaign: "Campaign", store: Store, out: Path, ending: str = "png"
) -> tuple[list[Path], bool]:
    """Draw a campaign's figures.

    Say which cannot be, and return the others and whether that went well.
    """
    from wearlab.figures import FigureError, draw

    try:
        return list(draw(campaign, store, out, ending)), True
    except FigureError as error:
        complain(str(error))
        return list(error.drawn), False


@contextmanager
def reporting(what: str) -> Iterator[None]:
    """Say on a terminal what is being done, once it has taken a second."""
    timer = threading.Timer(
        1.0, print, [f"{what} …"], {"file": sys.stderr, "flush": True}
    )
    timer.daemon = True
    if sys.stderr is not None and sys.stderr.isatty():
        timer.start()
    try:
        yield
    finally:
        timer.cancel()


def say(text: str = "") -> None:
    """Write a line on standard output."""
    print(text)


def complain(text: str) -> None:
    """Write a message on standard error, if anybody is there to read it."""
    try:
        print(text, file=sys.stderr, flush=True)
    except OSError:
        nowhere(sys.stderr)


def split_columns(text: str | None) -> tuple[str, ...] | None:
    """Return the columns of a list.

    A comma within parentheses or quotes does not part them.
    """
    if text is None:
        return None
    parts: list[str] = []
    held = ""
    for piece in text.split(","):
        held = f"{held},{piece}" if held else piece
        bare = re.sub(r"'[^']*'|\"[^\"]*\"", "", held)
        if not set("'\"") & set(bare) and all(
            bare.count(a) <= bare.count(b) for a, b in ("()", "[]")
        ):
            parts.append(held.strip())
            held = ""
    return tuple(part for part in [*parts, held.strip()] if part)


def place(position: Mapping[str, object]) -> str:
    """Return a place on the axes of a campaign in words."""
    return ", ".join(f"{name}={value}" for name, value in position.items())


def case_name(campaign: "Campaign", case: "Case") -> str:
    """Return what a person calls a case: its label and its place on the axes."""
    return in_words(case.label, outcome.place(campaign, case))


def in_words(label: str, position: Mapping[str, object]) -> str:
    """Return a label, and its place on the axes in brackets where it has one."""
    return f"{label} ({place(position)})" if position else label


def short(run_id: str) -> str:
    """Return the beginning of a run's id by which people know it."""
    return run_id[:SHORT_ID]


def show_json(content: Any) -> None:
    """Write content as JSON."""
    print(json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False))


def tell(found: Findings) -> Status:
    """Write what a command found, as it was asked for, and return its exit status."""
    if AS_JSON.get():
        show_json(found.content() if callable(found.content) else found.content)
    else:
        for part in found.text:
            say(part) if isinstance(part, str) else show_table(*part)
    for remark in found.remarks:
        complain(remark)
    return Status.WELL if found.well else Status.TROUBLE


def show_table(
    heads: Sequence[str], rows: Rows, title: str | None = None, empty: str = ""
) -> None:
    """Write a table, as wide as the terminal; columns without any entry are left out.

    A file or a pipe gets one line a row, and so does what fills many screens. ``empty``
    is said where there are no rows.
    """
    if empty and not rows:
        return complain(empty)
    used = [i for i, _ in enumerate(heads) if any(row[i] for row in rows)]
    lines = [[row[i] for i in used] for row in (heads, *rows)]
    if not sys.stdout.isatty() or len(rows) > 500:
        _show_plain(lines, title)
        return
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(
        title=title, title_justify="left", box=None, pad_edge=False, header_style="bold"
    )
    for i, head in zip(used, lines[0], strict=True):
        table.add_column(head, overflow="fold", no_wrap=i == 0)
    for line in lines[1:]:
        table.add_row(*map(Text, line))
    Console(highlight=False).print(table)


def _show_plain(lines: Rows, title: str | None) -> None:
    lines = [[cell.replace("\n", " ") for cell in line] for line in lines]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    for line in [[title]] * bool(title) + lines:
        say(
            "  ".join(
                f"{text:<{width}}" for text, width in zip(line, widths, strict=False)
            ).rstrip()
        )


@contextmanager
def bar(total: int, what: str = "") -> Iterator[Callable[[str], None]]:
    """Show on standard error how far a long work is; silent where nobody watches.

    Parameters
    ----------
    total : how many steps it has; what is yielded is called after each, with its name
    what : what the steps are, shown in place of their names
    """
    from wearlab.runner.progress import Progress, ProgressBar

    with (
        Progress()
        if AS_JSON.get() or not sys.stderr.isatty()
        else ProgressBar() as shown
    ):
        shown.start(total, what)

        def tell(text: str) -> None:
            shown.done += 1
            shown.step(what or text)

        yield tell
