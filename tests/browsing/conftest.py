"""Windows on small stores, asked over HTTP as a browser does."""

import http.client
from contextlib import closing
from urllib.parse import urlencode

import made_up
import pytest
from fake_campaign import filled, sweep

from wearlab.browsing.window import browse


class Asked:
    """A window and how it answers."""

    def __init__(self, store):
        self.window = browse(store)
        self.store = store

    def send(self, path, method="GET", host=None, token=None, body=None, **arguments):
        """Return status, headers and text of an answer."""
        own = self.window.token if token is None else token
        query = (
            urlencode({"token": own, **arguments}, doseq=True) if own else urlencode(arguments, doseq=True)
        )
        connection = http.client.HTTPConnection("127.0.0.1", self.window.port, timeout=30)
        headers = {"Host": host or f"127.0.0.1:{self.window.port}"}
        content = None if body is None else urlencode(body)
        if content is not None:
            headers["Content-Type"] = "application/x-www-form-urlencoded"
        with closing(connection):
            connection.request(method, f"/{path}?{query}", content, headers)
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read()

    def page(self, path, **arguments):
        """Return the text of a page that is there."""
        status, _, content = self.send(path, **arguments)
        assert status == 200, content.decode()[:2000]
        return content.decode()


@pytest.fixture
def opened():
    """Return a function that opens a window on a store, closed at the end."""
    pytest.importorskip("bokeh", reason="wearlab[browse] is not installed: no window can be opened")
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


@pytest.fixture
def drawn(tmp_path, opened):
    """Return a window on a store whose runs have every variable that figures draw."""
    from wearlab.store import Store

    store = Store(tmp_path / "drawn")
    store.create()
    axis = made_up.Axis("speed", made_up.SPEEDS, "rpm", "operation.speed")
    cases = []
    for number, speed in enumerate(made_up.SPEEDS):
        run_id = f"{number + 1:020x}"
        scene = f'{{"operation": {{"speed": {speed * 0.10471975511966}, "torque": 340.0}}}}'
        made_up.put(store, run_id, made_up.run(speed), scene)
        cases.append(made_up.Case("base", run_id, {"speed": number}))
    campaign = made_up.Campaign(tuple(cases), (axis,))
    from wearlab.campaign.campaign import with_figures

    members = [(case.id, case.label, {"speed": f"{made_up.SPEEDS[i]:g} rpm"}) for i, case in enumerate(cases)]
    store.catalogue.record_campaign(campaign.title, "doi:1", None, members, {}, with_figures(campaign))
    return opened(store)
