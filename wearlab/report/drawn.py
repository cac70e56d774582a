"""The figures of a report, each inside the page itself."""

import base64
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from wearlab.figures.drawing import both_widths, fault
from wearlab.figures.errors import FigureError
from wearlab.figures.question import question
from wearlab.store.errors import StoreError

if TYPE_CHECKING:
    from wearlab.campaign import Campaign
    from wearlab.store import Store

BROAD = 1000  # pixels: several columns of panels take a whole row


@dataclass(frozen=True)
class Drawn:
    """A figure as a data URI, with one for small screens if that is another; or why there is none."""

    title: str
    uri: str
    note: str
    problem: str
    broad: bool = False
    small: str = ""


def _uri(image: bytes) -> str:
    return f"data:image/png;base64,{base64.b64encode(image).decode('ascii')}"


def drawn(campaign: "Campaign", store: "Store") -> Iterator[Drawn]:
    """Yield each figure of a campaign, or why it cannot be drawn."""
    if not campaign.figures:
        return
    grid = store.open(campaign)
    for number, spec in enumerate(campaign.figures, 1):
        title = str(getattr(spec, "title", None) or spec.kind)
        note = str(getattr(spec, "note", None) or "")
        try:
            image, small = both_widths(question(campaign, spec, number), grid, store)
            broad = int.from_bytes(image[16:20], "big") > BROAD
            yield Drawn(title, _uri(image), note, "", broad, _uri(small) if small else "")
        except (FigureError, StoreError) as error:
            yield Drawn(title, "", note, str(error))
        except Exception as error:  # a fault of ours in one figure stops no page
            yield Drawn(title, "", note, fault(f"figure {number} ({spec.kind})", error))
