"""The progress bar: done, failed, refused, time left; in a notebook, a terminal, or as lines now and then."""

import sys
import threading
import time
from html import escape
from types import TracebackType
from typing import Any, Self

from wearlab.store.outcome import Outcome

CASES = "cases"


class Progress:
    """What ``run`` tells about its progress; this one tells nobody."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...

    def step(self, text: str) -> None:
        """Say what is being done before cases run."""

    def note(self, text: str) -> None:
        """Say something that stays to be read."""

    def start(self, total: int, what: str = CASES) -> None:
        """Say how many cases there are, or what else is computed."""

    def advance(self, outcome: Outcome) -> None:
        """Count a finished case."""

    def in_progress(self, run_id: str, text: str) -> None:
        """Say how far an unfinished case is."""


class Lines(Progress):
    """Progress where nobody watches a terminal: a line on standard error every half minute.

    Parameters
    ----------
    every : between two lines [s]
    stream : where to; standard error when absent
    """

    def __init__(self, every: float = 30.0, stream: Any = None) -> None:
        self._every, self._stream = every, stream or sys.stderr
        self._step, self._what, self._total, self._done = "starting", CASES, 0, 0
        self._at: dict[str, str] = {}
        self._ended = threading.Event()
        self._clock = threading.Thread(target=self._tell, name="wearlab-progress", daemon=True)

    def __enter__(self) -> Self:
        self._clock.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._clock.join()

    def step(self, text: str) -> None:
        """Take note of what is being done."""
        self._step = text

    def start(self, total: int, what: str = CASES) -> None:
        """Take note of how many cases there are."""
        self._total, self._done, self._what, self._step = total, 0, what, ""

    def advance(self, outcome: Outcome) -> None:
        """Count a finished case."""
        self._done += 1
        self._at.pop(outcome.id, None)

    def in_progress(self, run_id: str, text: str) -> None:
        """Take note of how far an unfinished case is."""
        self._at[run_id] = text

    def _tell(self) -> None:
        while not self._ended.wait(self._every):
            done = f"{self._done} of {self._total} {self._what} done"
            parts = [self._step or done, *list(self._at.values())[-4:]]
            print("; ".join(parts), file=self._stream, flush=True)


class ProgressBar(Progress):
    """Progress on the terminal, by rich, on standard error.

    Parameters
    ----------
    console : of rich; standard error when absent
    """

    def __init__(self, console: Any = None) -> None:
        from rich import progress
        from rich.console import Console

        self._console = console or Console(stderr=True)
        self._bar = progress.Progress(
            progress.SpinnerColumn(),
            progress.TextColumn("{task.description}"),
            progress.BarColumn(),
            progress.MofNCompleteColumn(),
            progress.TextColumn("{task.fields[trouble]}"),
            progress.TimeElapsedColumn(),
            progress.TextColumn("left"),
            progress.TimeRemainingColumn(),
            console=self._console,
            transient=True,
        )
        self._task = self._bar.add_task("", total=None, trouble="")
        self._counts, self._what = {"failed": 0, "refused": 0}, CASES

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()

    def step(self, text: str) -> None:
        """Show a step of unknown length."""
        self._bar.update(self._task, description=text)

    def note(self, text: str) -> None:
        """Write a line above the bar."""
        self._console.print(text, markup=False, highlight=False)

    def start(self, total: int, what: str = CASES) -> None:
        """Show the bar of the cases."""
        self._what = what
        self._bar.reset(self._task, description=what, total=total, trouble="")

    def advance(self, outcome: Outcome) -> None:
        """Move the bar, and count trouble."""
        if outcome.state in self._counts:
            self._counts[outcome.state] += 1
        trouble = ", ".join(f"{count} {state}" for state, count in self._counts.items() if count)
        self._bar.update(self._task, advance=1, trouble=trouble, description=self._what)

    def in_progress(self, run_id: str, text: str) -> None:
        """Show how far an unfinished case is."""
        self._bar.update(self._task, description=f"{self._what} ({text})")


LEAST = 0.2  # s between two drawings


class NotebookBar(Progress):
    """Progress in a notebook, through IPython's display.

    Parameters
    ----------
    display : called with an object to show, returns a handle with ``update`` [IPython's]
    """

    def __init__(self, display: Any = None) -> None:
        self._display, self._handle = display, None
        self._text, self._what, self._total, self._done = "", "cases", 0, 0
        self._counts: dict[str, int] = {}
        self._begun = self._drawn = time.monotonic()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._text = "interrupted" if kind is KeyboardInterrupt else "" if kind else self._text
        if self._handle is not None:
            self._draw()

    def step(self, text: str) -> None:
        """Show a step of unknown length."""
        self._text = text
        self._draw()

    def note(self, text: str) -> None:
        """Write a line that stays."""
        print(text)

    def start(self, total: int, what: str = CASES) -> None:
        """Show the bar of the cases."""
        self._text, self._what, self._total, self._begun = what, what, total, time.monotonic()
        self._done = 0
        self._draw()

    def advance(self, outcome: Outcome) -> None:
        """Move the bar, and count trouble."""
        self._done += 1
        if outcome.state in ("failed", "refused"):
            self._counts[outcome.state] = self._counts.get(outcome.state, 0) + 1
        if self._done == self._total or time.monotonic() - self._drawn > LEAST:
            self._draw()

    def in_progress(self, run_id: str, text: str) -> None:
        """Show how far an unfinished case is."""
        self._text = f"{self._what} ({text})"
        self._draw()

    def _repr_html_(self) -> str:
        told = [escape(self._text)]
        if self._total:
            told = [
                f'<progress value="{self._done}" max="{self._total}"></progress>',
                f"{self._done} of {self._total} {self._what}",
                *(f"{count} {state}" for state, count in self._counts.items()),
                self._times(),
            ]
        return f"<span>{' · '.join(told)}</span>"

    def __repr__(self) -> str:
        return f"{self._done} of {self._total} {self._what}" if self._total else self._text

    def _times(self) -> str:
        passed = time.monotonic() - self._begun
        if not self._done or self._done == self._total:
            return f"{passed:.0f} s"
        return f"{passed:.0f} s, {passed / self._done * (self._total - self._done):.0f} s left"

    def _draw(self) -> None:
        self._drawn = time.monotonic()
        if self._handle is not None:
            self._handle.update(self)
            return
        if self._display is None:
            from IPython.display import display

            self._display = lambda shown: display(shown, display_id=True)
        self._handle = self._display(self)


def in_notebook() -> bool:
    """Say whether this process is the kernel of a notebook."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return shell is not None and "IPKernelApp" in getattr(shell, "config", {})


def watched(progress: bool) -> Progress:
    """Return a bar when it is wanted and somebody watches: in a notebook, or on a terminal."""
    if progress and in_notebook():
        return NotebookBar()
    if progress:
        from rich.console import Console

        console = Console(stderr=True)
        return ProgressBar(console) if console.is_terminal else Lines()
    return Progress()
