"""A campaign as one HTML page that needs nothing else: no server, no address, no script."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from wearlab.report.content import Content, content

if TYPE_CHECKING:
    from wearlab.campaign import Campaign
    from wearlab.store import Store

FOLDER = Path(__file__).parent
SUFFIXES = (".html", ".htm", ".pdf")


class ReportError(ValueError):
    """A page that cannot be written as asked for; the message says what can."""


def check_suffix(path: Path) -> None:
    """Refuse a file that no page is written to.

    Raises
    ------
    ReportError : its suffix is none of `SUFFIXES`, or nothing here writes it
    """
    if path.suffix.lower() not in SUFFIXES:
        raise ReportError(
            f"{path}: a report is written as .html or .pdf, not as {path.suffix or 'a file without'}"
        )
    if path.suffix.lower() == ".pdf":
        _printer()


def as_file(page: str, suffix: str) -> bytes:
    """Return the bytes of a page as HTML, or printed as a PDF.

    Parameters
    ----------
    page : HTML
    suffix : one of `SUFFIXES`

    Raises
    ------
    ReportError : WeasyPrint is not installed
    """
    if suffix.lower() != ".pdf":
        return page.encode()
    return bytes(_printer()(string=page).write_pdf())


def _printer() -> Any:
    """Return WeasyPrint's `HTML`."""
    try:
        from weasyprint import HTML
    except (ImportError, OSError) as error:  # OSError: Pango is not there
        raise ReportError(
            f"a PDF needs WeasyPrint ({str(error).splitlines()[0]}): pip install 'wearlab[pdf]'; or name the "
            "file .html and print it from a browser"
        ) from None
    return HTML


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
