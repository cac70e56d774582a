"""The progress bar: done, failed, refused, time left.

In a notebook, a terminal, or as lines now and then.
"""

import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from html import escape
from typing import Any

from wearlab.store.outcome import Outcome, printable

CASES = "cases"


@contextmanager
def repeated(act: Callable[[], object], every: float, name: str) -> Iterator[None]:
    """Do something again and again in a thread, until the block ends.

    Every so many seconds, in a thread of that name.

    Parameters
    ----------
    act : what is done
    every : time between [s]
    name : of the thread
    """
    ended = threading.Event()

    def work() -> None:
        while not ended.wait(every):
            act()

    thread = threading.Thread(target=work, name=name, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


class Progress(ExitStack):
    """What ``run`` tells about its progress, and what it has told.

    This one shows it to nobody.

    It begins when it is made; what it has begun ends with the block that it stands for.
    """

    def __init__(self) -> None:
        super().__init__()
        self.text, self.what, self.total, self.done = "starting", CASES, 0, 0
        self.counts: Counter[str] = Counter()
        self.at: dict[str, str] = {}
        self.compiled: dict[int, tuple[int, int]] = {}

    def step(self, text: str) -> None:
        """Say what is being done before cases run."""
        self.text = printable(text)
        self.show()

    def compiling(self, worker: int, done: int, total: int, text: str) -> None:
        """Say what is being compiled, and how much of it all is done.

        Parameters
        ----------
        worker : which of those that share the work
        done, total : its parts
        text : what it compiles next, empty: it is at the end
        """
        if self.total:
            return  # heard late: cases run by now
        self.compiled[worker] = (done, total)
        counts = self.compiled.values()
        all_done = sum(one_done for one_done, _ in counts)
        all_parts = sum(one_total for _, one_total in counts)
        now = f" {text}" if text else ""
        self.step(f"compiling{now} ({all_done} of {all_parts} parts done)")

    def note(self, text: str) -> None:
        """Say something that stays to be read."""

    def start(self, total: int, noun: str = CASES) -> None:
        """Say how many cases there are, or what else is computed."""
        self.text, self.what, self.total, self.done = "", noun, total, 0
        self.show()

    def advance(self, outcome: Outcome) -> None:
        """Count a finished case, and trouble."""
        self.text, self.done = "", self.done + 1
        self.at.pop(outcome.id, None)
        if outcome.state in ("failed", "refused"):
            self.counts[outcome.state] += 1
        self.show()

    def in_progress(self, run_id: str, text: str) -> None:
        """Say how far an unfinished case is."""
        self.at[run_id] = text
        self.show()

    def show(self) -> None:
        """Show what is known now."""

    @property
    def description(self) -> str:
        """What is being done, and how far the case is that was heard of last."""
        last = f" ({list(self.at.values())[-1]})" if self.at else ""
        return self.text or f"{self.what}{last}"

    @property
    def trouble(self) -> list[str]:
        """How many cases gave no data."""
        return [f"{count} {state}" for state, count in self.counts.items()]


class Lines(Progress):
    """Progress where nobody watches a terminal: lines on standard error.

    Parameters
    ----------
    every : between two lines [s]
    stream : where to; standard error when absent
    """

    def __init__(self, every: float = 30.0, stream: Any = None) -> None:
        super().__init__()
        self._stream = stream or sys.stderr
        self.enter_context(repeated(self._tell, every, "wearlab-progress"))

    def _tell(self) -> None:
        summary = f"{self.done} of {self.total} {self.what} done".replace("  ", " ")
        texts = [self.text] if self.text else []
        if self.total or not texts:
            texts.append(summary)
        print(
            "; ".join([*texts, *list(self.at.values())[-4:]]),
            file=self._stream,
            flush=True,
        )


class ProgressBar(Progress):
    """Progress on the terminal, by rich, on standard error.

    Parameters
    ----------
    console : of rich; standard error when absent
    """

    def __init__(self, console: Any = None) -> None:
        from rich import progress
        from rich.console import Console

        super().__init__()
        self._console = console or Console(stderr=True)
        bar = (progress.SpinnerColumn(), "{task.description}", progress.BarColumn())
        counts = (progress.MofNCompleteColumn(), "{task.fields[trouble]}")
        times = (progress.TimeElapsedColumn(), "left", progress.TimeRemainingColumn())
        shown = progress.Progress(
            *bar, *counts, *times, console=self._console, transient=True
        )
        self._task = shown.add_task("", total=None, trouble="")
        self._bar = self.enter_context(shown)

    def note(self, text: str) -> None:
        """Write a line above the bar."""
        self._console.print(printable(text), markup=False, highlight=False)

    def start(self, total: int, what: str = CASES) -> None:
        """Show the bar of the cases."""
        self._bar.reset(self._task, total=total, trouble="")
        super().start(total, what)

    def show(self) -> None:
        """Move the bar."""
        trouble = ", ".join(self.trouble)
        self._bar.update(
            self._task,
            completed=self.done,
            description=self.description,
            trouble=trouble,
        )


class NotebookBar(Progress):
    """Progress in a notebook, through IPython's display.

    Parameters
    ----------
    display : called with an object to show, returns a handle with ``update``
        [IPython's]
    """

    def __init__(self, display: Any = None) -> None:
        super().__init__()
        self._display, self._handle = display, None
        self._begun = self._drawn = time.monotonic()
        self.push(self._end)

    def _end(self, kind: type[BaseException] | None, *told: Any) -> None:
        self.text = (
            "interrupted" if kind is KeyboardInterrupt else "" if kind else self.text
        )
        if self._handle is not None:
            self._draw()

    def note(self, text: str) -> None:
        """Write a line that stays."""
        print(printable(text))

    def start(self, total: int, what: str = CASES) -> None:
        """Show the bar of the cases."""
        self._begun = time.monotonic()
        super().start(total, what)

    def show(self) -> None:
        """Draw the bar, unless that was just done."""
        if self.done in (0, self.total) or time.monotonic() - self._drawn > 0.2:
            self._draw()

    def _repr_html_(self) -> str:
        if not self.total:
            return f"<span>{escape(self.description)}</span>"
        bar = f'<progress value="{self.done}" max="{self.total}"></progress>'
        passed = time.monotonic() - self._begun
        times = f"{passed:.0f} s"
        if 0 < self.done != self.total:
            times += f", {passed / self.done * (self.total - self.done):.0f} s left"
        return f"<span>{' · '.join([bar, repr(self), *self.trouble, times])}</span>"

    def __repr__(self) -> str:
        return (
            f"{self.done} of {self.total} {self.what}"
            if self.total
            else self.description
        )

    def _draw(self) -> None:
        self._drawn = time.monotonic()
        if self._handle is not None:
            self._handle.update(self)
            return
        if self._display is None:
            from IPython.display import display

            self._display = lambda shown: display(shown, display_id=True)
        self._handle = self._display(self)


def watched(progress: bool) -> Progress:
    """Return a bar when it is wanted and somebody watches.

    In a notebook, or on a terminal.

    Parameters
    ----------
    progress : whether a bar is wanted
    """
    if not progress:
        return Progress()
    ipython = sys.modules.get("IPython")
    if "IPKernelApp" in getattr(
        ipython and ipython.get_ipython(), "config", {}
    ):  # the kernel of a notebook
        return NotebookBar()
    from rich.console import Console

    console = Console(stderr=True)
    return ProgressBar(console) if console.is_terminal else Lines()
