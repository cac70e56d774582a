"""What one more inspection would be worth, over its time and its error."""

from collections.abc import Iterator

from wearlab.figures.ask import Ask
from wearlab.figures.of_updates import CYCLES, update_kind
from wearlab.figures.plot import Scale, Series
from wearlab.figures.updated import Updated
from wearlab.figures.wording import Label


def _look_next(update: Updated, ask: Ask) -> Iterator[Series]:
    data = update["virtual_inspection"]
    up = Scale("expected width of the 90 % interval of the remaining life, over that now", "1")
    for k, sd in enumerate(data["instrument"].values):
        key = {**update.key, "instrument": Label(float(sd), f"{float(sd):g} × the error")}
        y = data["expected_width"].transpose("instrument", "look").values[k]
        yield Series(key, data["look"].values, y, CYCLES, up, "line-points")


LOOK_NEXT = update_kind(
    "look-next",
    "When to look next",
    "expected width of the remaining life's interval after one more inspection, over its time and error",
    ("virtual_inspection",),
    _look_next,
    ("hue", "instrument"),
)
