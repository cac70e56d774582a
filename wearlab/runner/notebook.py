"""The progress bar of notebooks: one line of HTML that is written again as cases finish."""

import time
from html import escape
from types import TracebackType
from typing import Any

from wearlab.runner.progress import CASES, Progress
from wearlab.store.outcome import Outcome

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

    def under_way(self, run_id: str, text: str) -> None:
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
