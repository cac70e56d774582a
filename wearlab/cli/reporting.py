"""``report``: a campaign as one page."""

from pathlib import Path
from typing import TYPE_CHECKING

from wearlab.cli.output import REFUSALS, Status, load_campaign, refusing, say, show_json

if TYPE_CHECKING:
    from wearlab.store import Store


def write_report(file: str, store: "Store", out: Path | None, as_json: bool) -> Status:
    """Write the page of a campaign; an unfinished campaign is told as far as it is.

    Parameters
    ----------
    file : the campaign
    store : where its runs are
    out : the page [the campaign's name with .html, here]
    as_json : print for machines
    """
    from wearlab.report.page import report
    from wearlab.store.files import write_whole

    campaign = load_campaign(file)
    path = out or Path(f"{Path(file).stem}.html")
    with refusing(*REFUSALS, OSError):
        write_whole(path, report(campaign, store).encode())
    if as_json:
        show_json({"file": str(path)})
    else:
        say(str(path))
    return Status.WELL
