"""A notebook's cell: a real kernel runs it, and a real browser shows what it gave."""

import asyncio
import warnings
from concurrent.futures import ThreadPoolExecutor

import pytest

pytestmark = pytest.mark.browser
CELL = "import wearlab as wl\nwindow = wl.browse({!r})\nwindow"


class Kernel:
    """A kernel in a thread of its own: both it and the browser have an event loop."""

    def __init__(self):
        jupyter = pytest.importorskip(
            "jupyter_client.manager", reason="ipykernel is not installed"
        )
        self.thread = ThreadPoolExecutor(1)
        self.manager, self.client = self.thread.submit(jupyter.start_new_kernel).result(
            60
        )

    def outputs(self, code):
        """Return what a cell gave."""
        found = []
        run = self.client.execute_interactive
        answer = self.thread.submit(
            run, code, output_hook=found.append, timeout=100
        ).result(120)
        assert answer["content"]["status"] == "ok", answer["content"]
        return [
            message["content"]["data"]
            for message in found
            if message["msg_type"] == "execute_result"
        ]

    def end(self):
        self.thread.submit(self.client.stop_channels).result(30)
        self.thread.submit(self.manager.shutdown_kernel, now=True).result(30)
        self.thread.submit(close_loop).result(30)
        self.thread.shutdown()


def close_loop():
    """Close the event loop that the client made in this thread."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # where none was made
        asyncio.get_event_loop_policy().get_event_loop().close()


def test_a_cell_shows_the_window(page, drawn_store):
    kernel = Kernel()
    try:
        (data,) = kernel.outputs(CELL.format(str(drawn_store)))
        assert data["text/plain"].startswith("<Window on")
        page.set_content(f"<h1>A notebook</h1>{data['text/html']}")
        frame = page.frame_locator("iframe[title='wearlab browse']")
        frame.get_by_role("link", name="Three speeds").first.click()
        frame.locator("table.runs tbody a").first.click()
        frame.get_by_role("slider", name="Wear state").press("ArrowLeft")
        frame.get_by_role("status").filter(has_text="State 1 of 2").wait_for()
        kernel.outputs("window.stop()")
    finally:
        kernel.end()
