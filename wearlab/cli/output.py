"""What commands write: texts, tables, JSON, errors, progress.

Closed streams and Ctrl-C harm no store.
"""

import errno
import json
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar
from enum import IntEnum, StrEnum
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from wearlab.sources import SHORT_ID
from wearlab.store import Store, outcome

if TYPE_CHECKING:
    from wearlab.campaign import Campaign, Case
    from wearlab.figures.plot import Paper
    from wearlab.plugins import Plugin


FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EBADF)
"""What the system says of an output that takes no more."""

INTERRUPTED_TWICE = (
    b"wearlab: interrupted twice: stopped at once; finished runs are kept, run again "
    b"to continue\n"
)
LONG_TABLE = 500  # rows from which a table is written without layout

Content = TypeVar("Content")
Rows = Sequence[Sequence[str]]
STORE = Path("wearlab-store")
STORE_FOLDER: ContextVar[Path] = ContextVar("store folder", default=STORE)
"""The store of the command, in which runs of plug-ins have left what these declare."""
TRUST_PLUGINS: ContextVar[bool] = ContextVar("trusted", default=False)
"""Whether ``--plugins`` was written: plug-ins of campaign files may be run."""
AS_JSON: ContextVar[bool] = ContextVar("as JSON", default=False)
"""Whether ``--json`` was written: a program reads the output."""


def fill_closed() -> None:
    """Open the null device for standard streams that were closed (``>&-``).

    A number that stays free is given to the next file that is opened: what a library
    prints would go into it.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free

        if getattr(sys, name) is None:
            mode = "r" if number == 0 else "w"
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))


def discard(stream: object) -> None:
    """Send what a stream still holds, and what follows, to the null device.

    Python then does not complain when it flushes the stream on leaving.

    Parameters
    ----------
    stream : standard output or standard error
    """
    with suppress(OSError, ValueError, AttributeError):
        sink = os.open(os.devnull, os.O_WRONLY)
        os.dup2(sink, stream.fileno())  # type: ignore[attr-defined]
        os.close(sink)


def stop_on_second_interrupt() -> None:
    """Let a second Ctrl-C end this process at once.

    Whatever is written at that moment appears whole or not at all, and workers go when
    their parent does.
    """
    in_main_thread = threading.current_thread() is threading.main_thread()
    handler = signal.getsignal(signal.SIGINT)
    if in_main_thread and handler is signal.default_int_handler:
        signal.signal(signal.SIGINT, _interrupt)


def _interrupt(*signal_arguments: object) -> None:
    """Raise KeyboardInterrupt, and stop at once from the next signal on."""
    signal.signal(signal.SIGINT, _exit_at_once)
    raise KeyboardInterrupt


def _exit_at_once(*signal_arguments: object) -> None:
    """End the process without clean-up."""
    os.write(2, INTERRUPTED_TWICE)
    os._exit(Status.INTERRUPTED)


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
    """The result of a command.

    Parameters
    ----------
    content : for programs, what ``--json`` writes; or a function that returns it
    text : for people
    ok : whether nothing is wrong; else the exit status is that of trouble
    remarks : lines for standard error
    """

    content: Any
    text: Text
    ok: bool = True
    remarks: Sequence[str] = ()


class Stop(Exception):
    """A command cannot go on: a message for the user, and the exit status.

    Parameters
    ----------
    message : for the user
    status : exit status
    """

    def __init__(self, message: str, status: Status = Status.REFUSED) -> None:
        super().__init__(message)
        self.status = status


@contextmanager
def refusing(*kinds: type[Exception]) -> Iterator[None]:
    """Turn errors of these kinds into one message and exit status 2.

    Parameters
    ----------
    kinds : classes of errors
    """
    try:
        yield
    except kinds as error:
        message = str(error)
        if isinstance(error, OSError) and error.filename:
            message = f"{error.filename}: {error.strerror}"

        raise Stop(message) from error


def read_campaign(file: str) -> "Campaign":
    """Read a campaign file.

    Parameters
    ----------
    file : path of the file

    Raises
    ------
    Stop : it is absent, unreadable or wrong
    """
    from wearlab.campaign import load

    return _read_with_plugins(load, file)


def read_plugins(file: str) -> "tuple[Plugin, ...]":
    """Make the variants of a file's plug-ins known.

    Parameters
    ----------
    file : path of a campaign file

    Raises
    ------
    Stop : the file cannot be read, or a plug-in may not be run
    """
    from wearlab.campaign import read_plugins

    return _read_with_plugins(read_plugins, file)


def _read_with_plugins(read: Callable[[str], Content], file: str) -> Content:
    """Read a file by a function, with the trust in plug-ins that the user gave."""
    from wearlab.plugins import FOLDER, Trust, trusting

    trust = Trust(TRUST_PLUGINS.get(), STORE_FOLDER.get() / FOLDER)
    with (
        refusing(OSError, ValueError),
        trusting(trust),
        reporting(f"reading the cases of {file}"),
    ):
        return read(file)


def read_drawable_campaign(file: str) -> "Campaign":
    """Read a campaign file, and check that its figures can be drawn.

    Parameters
    ----------
    file : path of the file

    Raises
    ------
    Stop : the file is wrong, or a figure names a kind, variable, dimension or case that
        does not exist
    """
    campaign = read_campaign(file)
    refuse_wrong_figures(campaign, file)
    return campaign


def refuse_wrong_figures(campaign: "Campaign", file: str) -> None:
    """Stop where a figure names what does not exist.

    Parameters
    ----------
    campaign : with its figures
    file : its path, for messages

    Raises
    ------
    Stop : with one line for each problem
    """
    if campaign.figures:
        from wearlab.figures import question

        if problems := question.figure_problems(campaign):
            raise Stop("\n".join(f"{file}: {problem}" for problem in problems))


class DrawnFigures(NamedTuple):
    """The files of the figures that were drawn, and whether all of them were."""

    files: list[Path]
    ok: bool


def draw_figures(
    campaign: "Campaign",
    store: Store,
    out: Path,
    ending: str = "png",
    paper: "Paper | None" = None,
) -> DrawnFigures:
    """Draw a campaign's figures, and write to standard error why some cannot be.

    Parameters
    ----------
    campaign : with its figures
    store : the folder of its runs
    out : folder of the figures
    ending : png, svg or pdf
    paper : width and style, where they are not wearlab's
    """
    from wearlab.figures import FigureError, draw

    try:
        return DrawnFigures(list(draw(campaign, store, out, ending, paper)), True)
    except FigureError as error:
        complain(str(error))
        return DrawnFigures(list(error.drawn), False)


@contextmanager
def reporting(what: str) -> Iterator[None]:
    """Write to a terminal what is being done, once it has taken a second.

    Parameters
    ----------
    what : the work, such as "reading the cases of a.toml"
    """
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
    """Write a line on standard output.

    Parameters
    ----------
    text : of one or more lines
    """
    print(outcome.printable(text))


def complain(text: str) -> None:
    """Write a message on standard error, if anybody is there to read it.

    Parameters
    ----------
    text : of the message, of one or more lines
    """
    try:
        print(outcome.printable(text), file=sys.stderr, flush=True)
    except OSError:
        discard(sys.stderr)


def place(position: Mapping[str, object]) -> str:
    """Return a place on the axes of a campaign in words.

    Parameters
    ----------
    position : value by axis
    """
    return ", ".join(f"{name}={value}" for name, value in position.items())


def case_name(campaign: "Campaign", case: "Case") -> str:
    """Return what a person calls a case: its label and its place on the axes.

    Parameters
    ----------
    campaign, case : the campaign, and one of its cases
    """
    return in_words(case.label, outcome.place(campaign, case))


def in_words(label: str, position: Mapping[str, object]) -> str:
    """Return a label, and its place on the axes in brackets where it has one.

    Parameters
    ----------
    label : of a case
    position : value by axis
    """
    return f"{label} ({place(position)})" if position else label


def short(run_id: str) -> str:
    """Return the beginning of a run's id by which people know it.

    Parameters
    ----------
    run_id : the identity in full
    """
    return run_id[:SHORT_ID]


def show_json(content: Any) -> None:
    """Write content as JSON.

    Parameters
    ----------
    content : what JSON can hold; numbers are finite
    """
    text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False)
    print(outcome.printable(text))


def write(findings: Findings) -> Status:
    """Write the result of a command as text or JSON, and return its exit status.

    Parameters
    ----------
    findings : the result
    """
    if AS_JSON.get():
        content = findings.content
        show_json(content() if callable(content) else content)
    else:
        for part in findings.text:
            say(part) if isinstance(part, str) else show_table(*part)

    for remark in findings.remarks:
        complain(remark)
    return Status.WELL if findings.ok else Status.TROUBLE


def show_table(
    heads: Sequence[str], rows: Rows, title: str | None = None, empty: str = ""
) -> None:
    """Write a table, as wide as the terminal; columns without any entry are left out.

    A file or a pipe gets one line a row, and so does a table of many rows.

    Parameters
    ----------
    heads : of the columns
    rows : a cell for each head
    title : above the table
    empty : what to write to standard error where there are no rows
    """
    if empty and not rows:
        return complain(empty)

    used = [i for i, _ in enumerate(heads) if any(row[i] for row in rows)]
    lines = [[outcome.printable(row[i]) for i in used] for row in (heads, *rows)]
    if not sys.stdout.isatty() or len(rows) > LONG_TABLE:
        _show_plain(lines, title)
        return
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(
        title=Text(outcome.printable(title)) if title else None,
        title_justify="left",
        box=None,
        pad_edge=False,
        header_style="bold",
    )
    for i, head in zip(used, lines[0], strict=True):
        table.add_column(head, overflow="fold", no_wrap=i == 0)
    for line in lines[1:]:
        table.add_row(*map(Text, line))
    Console(highlight=False).print(table)


def _show_plain(lines: Rows, title: str | None) -> None:
    """Write a table in columns as wide as their longest cells."""
    lines = [[cell.replace("\n", " ") for cell in line] for line in lines]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    if title:
        say(f"{title:<{widths[0]}}".rstrip() if widths else title)
    for line in lines:
        cells = zip(line, widths, strict=True)
        say("  ".join(f"{cell:<{width}}" for cell, width in cells).rstrip())


@contextmanager
def counted(what: str) -> Iterator[Callable[[int, int], None]]:
    """Show how many of something are done, as `bar` does.

    Parameters
    ----------
    what : plural of what is counted; what is yielded is called with how many are done,
        and how many there are
    """
    from wearlab.runner.progress import watched

    with watched(not AS_JSON.get()) as progress:

        def report(done: int, total: int) -> None:
            if total != progress.total:
                progress.start(total, what)
            progress.done = done
            progress.show()

        yield report


@contextmanager
def watched(what: str) -> Iterator[None]:
    """Show how far the work of the block is, from when it tells that.

    Parameters
    ----------
    what : plural of its parts
    """
    from wearlab.store import watching

    with ExitStack() as shown:

        @cache
        def shown_count() -> Callable[[int, int], None]:
            return shown.enter_context(counted(what))

        def tell(done: int, total: int) -> None:
            shown_count()(done, total)

        shown.enter_context(watching.watched_by(tell))
        yield


@contextmanager
def bar(total: int, what: str = "") -> Iterator[Callable[[str], None]]:
    """Show progress of long work on standard error.

    As a bar on a terminal, else as a line now and then; not beside JSON.

    Parameters
    ----------
    total : how many steps it has; what is yielded is called after each, with its name
    what : what the steps are, shown in place of their names
    """
    from wearlab.runner.progress import watched

    with watched(not AS_JSON.get()) as progress:
        progress.start(total, what)

        def advance(step: str) -> None:
            progress.done += 1
            progress.step(what or step)

        yield advance
