"""Every control has a role, a name and a place in the order of the Tab key.

Pages fit the screen.
"""

import re

import pytest

pytestmark = pytest.mark.browser
IDLE = ("generic", "none", "presentation", "InlineTextBox", "StaticText", "RootWebArea")
"""Roles of what tells nobody what it is for; the page itself can be focused, too."""
EVERY = """const every = root => [...root.querySelectorAll('*')].flatMap(
  e => e.shadowRoot ? [e, ...every(e.shadowRoot)] : [e]);"""
REACHABLE = f"""() => {{ {EVERY}
  window.reachable = every(document).filter(
    e => e.tabIndex >= 0 && e.checkVisibility({{visibilityProperty: true}}));
  return window.reachable.map(e => e.outerHTML.slice(0, 90)) }}"""
DEEPEST = (
    "let e = document.activeElement; while (e?.shadowRoot?.activeElement) e = "
    "e.shadowRoot.activeElement;"
)
FOCUSED = f"() => {{ {DEEPEST} return window.reachable.indexOf(e) }}"
ROLE = f"() => {{ {DEEPEST} return e?.getAttribute('role') }}"
READY = f"""() => {{ {EVERY} return Bokeh.documents.length > 0
  && Bokeh.documents.every(d => d.is_idle)
  && every(document).filter(e => e.matches('.bk-events'))
    .every(e => !e.hasAttribute('tabindex')) }}"""


def pages(drawn, measured):
    """Return what each page is called, its address and what is waited for."""
    (first, second, _) = drawn.store.archive.entries()
    (update,) = kept(measured)
    key = re.search(r"key=([0-9a-f]+)", drawn.page(""))[1]
    drawn.store.tag(first, "good")
    return {
        "campaigns": (drawn.at(), "main table"),
        "campaign": (drawn.at("campaign", key=key), "canvas"),
        "runs": (drawn.at("runs"), "table.runs"),
        "run": (drawn.at("run", id=first), "canvas"),
        "compare": (drawn.at("compare", run=[first, second]), "canvas"),
        "updates": (measured.at("updates"), "article"),
        "update": (measured.at("update", id=update), "canvas"),
        "progress": (drawn.at("progress"), "main"),
        "message": (drawn.at("run", id="feed"), "[role=alert]"),
    }


def kept(measured):
    from wearlab.store.updates import kept_updates

    return list(kept_updates(measured.store))


def nameless(page):
    """Return what can be focused and has no role or no name for those
    who hear the page.
    """
    session = page.context.new_cdp_session(page)
    nodes = session.send("Accessibility.getFullAXTree")["nodes"]
    found = []
    for node in nodes:
        focusable = any(
            p["name"] == "focusable" and p["value"]["value"]
            for p in node.get("properties", ())
        )
        role = node.get("role", {}).get("value", "")
        name = node.get("name", {}).get("value", "")
        if (
            focusable
            and not node.get("ignored")
            and role != "RootWebArea"
            and (role in IDLE or not name.strip())
        ):
            told = session.send(
                "DOM.describeNode", {"backendNodeId": node["backendDOMNodeId"]}
            )["node"]
            found.append((role, told["nodeName"], told.get("attributes")))
    session.detach()
    return found


def unreached(page):
    """Return what the Tab key does not come to, from the top of the page to its end."""
    expected = page.evaluate(REACHABLE)
    reached = set()
    for _ in range(len(expected) + 5):
        page.keyboard.press("Tab")
        reached.add(page.evaluate(FOCUSED))
        if len(reached - {-1}) == len(expected):
            break
    return [html for number, html in enumerate(expected) if number not in reached]


def test_every_control_of_every_page_has_a_name_and_is_reached_by_keys(
    page, drawn, measured
):
    axe = pytest.importorskip(
        "axe_playwright_python.sync_playwright", reason="axe is not installed"
    ).Axe()
    wrong = []
    for name, (address, awaited) in pages(drawn, measured).items():
        page.goto(address)
        page.locator(awaited).first.wait_for()
        while awaited == "canvas" and not page.evaluate(READY):
            page.wait_for_timeout(100)
        assert (
            page.get_by_role("heading", level=1).count() == 1
            and page.locator("html[lang=en]").count() == 1
        )
        wrong += [(name, "nameless", told) for told in nameless(page)]
        wrong += [(name, "unreached", told) for told in unreached(page)]
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)
            broken = axe.run(page, options={"resultTypes": ["violations"]}).response[
                "violations"
            ]
            for rule in broken:
                wrong += [
                    (name, scheme, rule["id"], node["html"][:160])
                    for node in rule["nodes"]
                ]
    assert wrong == [], "\n".join(map(str, wrong))


def test_the_slider_is_named_and_moved_by_keys_alone(page, drawn):
    page.goto(drawn.at("run", id=next(iter(drawn.store.archive.entries()))))
    handle = page.get_by_role("slider", name="Wear state")
    handle.wait_for()
    for _ in range(60):
        page.keyboard.press("Tab")
        if page.evaluate(ROLE) == "slider":
            break
    page.keyboard.press("ArrowLeft")
    page.get_by_role("status").filter(
        has_text="State 1 of 2: 3 million cycles"
    ).wait_for()


@pytest.mark.parametrize("width", [390, 1280])
def test_no_page_is_wider_than_the_screen(page, drawn, measured, width):
    page.set_viewport_size({"width": width, "height": 844})
    for name, (address, awaited) in pages(drawn, measured).items():
        page.goto(address)
        page.locator(awaited).first.wait_for()
        assert page.evaluate("document.documentElement.scrollWidth") <= width, name
