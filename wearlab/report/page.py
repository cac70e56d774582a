"""A campaign as one HTML page that needs nothing else: no server, no address, no script."""

from pathlib import Path
from typing import TYPE_CHECKING

from wearlab.report.content import Content, content

if TYPE_CHECKING:
    from wearlab.campaign import Campaign
    from wearlab.store import Store

FOLDER = Path(__file__).parent


def report(campaign: "Campaign", store: "Store") -> str:
    """Return the page of a campaign: equal stores give equal pages.

    Parameters
    ----------
    campaign : its cases and figures
    store : where the runs are; nothing is computed

    Raises
    ------
    StoreError : there is no store
    """
    return page(content(campaign, store))


def page(told: Content) -> str:
    """Return the HTML of a report; every text in it is escaped."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(FOLDER),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    style = (FOLDER / "page.css").read_text(encoding="utf-8")
    return environment.get_template("page.html").render(told=told, style=style)
