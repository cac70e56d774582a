"""Windows on small stores, asked over HTTP as a browser does, and by a real browser."""

import http.client
import os
import shutil
from contextlib import closing
from urllib.parse import urlencode

import made_up
import pytest
from fake_campaign import filled, sweep

import wearlab as wl
from wearlab.browsing.window import browse

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
BROWSER = os.environ.get("WEARLAB_BROWSER") or next(
    filter(None, map(shutil.which, NAMES)), None
)
SMALL = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-extensions",
    "--disable-background-networking",
)


class Asked:
    """A window and how it answers."""

    def __init__(self, store):
        self.window = browse(store)
        self.store = store

    def send(self, path, method="GET", host=None, token=None, body=None, **arguments):
        """Return status, headers and text of an answer."""
        own = self.window.token if token is None else token
        query = (
            urlencode({"token": own, **arguments}, doseq=True)
            if own
            else urlencode(arguments, doseq=True)
        )
        connection = http.client.HTTPConnection(
            "127.0.0.1", self.window.port, timeout=30
        )
        headers = {"Host": host or f"127.0.0.1:{self.window.port}"}
        content = None if body is None else urlencode(body)
        if content is not None:
            headers["Content-Type"] = "application/x-www-form-urlencoded"
        with closing(connection):
            connection.request(method, f"/{path}?{query}", content, headers)
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read()

    def at(self, path="", **arguments):
        """Return an address of the window."""
        query = urlencode({"token": self.window.token, **arguments}, doseq=True)
        return f"http://127.0.0.1:{self.window.port}/{path}?{query}"

    def page(self, path, **arguments):
        """Return the text of a page that is there."""
        status, _, content = self.send(path, **arguments)
        assert status == 200, content.decode()[:2000]
        return content.decode()


@pytest.fixture
def opened():
    """Return a function that opens a window on a store, closed at the end."""
    pytest.importorskip(
        "bokeh", reason="wearlab[browse] is not installed: no window can be opened"
    )
    windows = []

    def open_(store):
        asked = Asked(store)
        windows.append(asked.window)
        return asked

    yield open_
    for window in windows:
        window.stop()


@pytest.fixture
def small(tmp_path, opened):
    """Return a window on a store of three runs without physics."""
    return opened(filled(tmp_path / "store", sweep(3)))


@pytest.fixture(scope="session")
def drawn_store(tmp_path_factory):
    """Return the folder of a store whose runs have every variable that figures draw.

    Copies are used.
    """
    from wearlab.campaign.campaign import with_figures
    from wearlab.store import Store

    store = Store(tmp_path_factory.mktemp("browsing") / "drawn")
    store.archive.create()
    axis = made_up.Axis("speed", made_up.SPEEDS, "rpm", "operation.speed")
    cases = []
    for number, speed in enumerate(made_up.SPEEDS):
        run_id = f"{number + 1:020x}"
        scene = (
            f'{{"operation": {{"speed": {speed * 0.10471975511966}, "torque": 340.0}}}}'
        )
        made_up.put(store, run_id, made_up.run(speed), scene)
        cases.append(made_up.Case("base", run_id, {"speed": number}))
    campaign = made_up.Campaign(tuple(cases), (axis,))
    members = [
        (case.id, case.label, {"speed": f"{made_up.SPEEDS[i]:g} rpm"})
        for i, case in enumerate(cases)
    ]
    store.archive.catalogue.record_campaign(
        campaign.title, "doi:1", None, members, {}, with_figures(campaign)
    )
    return store.path


@pytest.fixture
def drawn(drawn_store, tmp_path, opened):
    """Return a window on a copy of that store."""
    return opened(wl.Store(shutil.copytree(drawn_store, tmp_path / "drawn")))


FLEET = """
title = "four boxes"
[gears]
kind = "external-pair"
module = "3 mm"
face_width = "30 mm"
pinion = { teeth = 24 }
gear = { teeth = 53 }
[operation]
torque = "180 N*m"
speed = "900 rpm"
[mesh]
stiffness = "potential-energy"
extended_contact = false
[wear]
coefficient = { model = "constant", value = "1e-18 m^2/N" }
contact_patch = "none"
until = { depth = "20 um", flank = "pinion" }
snapshots = { depth = ["10 um"], flank = "pinion" }
[update]
draws = 300
[update.decision]
planned = 6000
failure = 45000
[update.unknown]
"wear.coefficient.factor" = { lognormal = { median = 1.0, cov = 3.0 } }
[[update.data]]
file = "boxes.csv"
quantity = "worn_mass"
member = "pinion"
columns = { unit = "box", date = "date", hours = "hours", value = "loss" }
units = { hours = "h", loss = "mg" }
error = { sd = "12 mg" }
[[update.unit]]
name = "<b>new</b>"
calendar = { date = "2026-01-01", hours = 0, hours_per_year = 6000 }
"""
BOXES = """box,date,hours,loss
A,2025-01-01,280,140
A,2026-01-01,840,390
B,2025-01-01,280,180
B,2026-01-01,840,500
C,2025-01-01,280,110
C,2026-01-01,840,300
"""


@pytest.fixture(scope="session")
def measured_store(tmp_path_factory):
    """Return a store with an update of a fleet."""
    from wearlab.updating import update

    folder = tmp_path_factory.mktemp("measured")
    (folder / "boxes.csv").write_text(BOXES)
    (folder / "boxes.toml").write_text(FLEET)
    store = wl.Store(folder / "store")
    update(wl.load(folder / "boxes.toml"), store, progress=False)
    return store


@pytest.fixture
def measured(measured_store, opened):
    """Return a window on that store, which is only looked at."""
    return opened(measured_store)


@pytest.fixture(scope="session")
def browser():
    """Return the system's Chromium.

    Whoever asks for it is skipped where there is none.
    """
    if BROWSER is None:
        pytest.skip("no browser is installed: windows are not looked at")
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="Playwright is not installed"
    )
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(executable_path=BROWSER, args=list(SMALL))
        yield chromium
        chromium.close()


@pytest.fixture
def page(browser):
    """Return a page.

    The test fails where its scripts fail, a dialog opens, or another machine is asked.
    """
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    page = context.new_page()
    wrong = []
    page.on("pageerror", lambda error: wrong.append(f"script: {error}"))
    page.on(
        "dialog",
        lambda dialog: (wrong.append(f"dialog: {dialog.message}"), dialog.dismiss()),
    )
    page.on(
        "console",
        lambda said: (
            wrong.append(said.text) if "Security Policy" in said.text else None
        ),
    )

    def asked(request):
        if not request.url.startswith(("http://127.0.0.1:", "data:", "blob:", "file:")):
            wrong.append(f"asked {request.url}")

    page.on("request", asked)
    yield page
    assert wrong == []
    context.close()
