"""The figure of a measured flank, as its file was understood."""

from collections.abc import Sequence

import numpy as np

from wearlab.figures.plot import Curve, Panel, Pen, Plot
from wearlab.figures.render import rendered
from wearlab.figures.wording import axis_label, converted, power_of_ten

SHOWN = {
    "diameter": ("diameter", "m", "mm"),
    "roll_angle": ("roll angle", "rad", "deg"),
    "roll_length": ("length of roll", "m", "mm"),
    "path_position": ("position on the path of contact", "m", "mm"),
    "depth": ("wear depth", "m", "um"),
    "deviation": ("deviation, material missing downwards", "m", "um"),
}
MARKED = 60


Column = tuple[str, Sequence[float]]


def profile_figure(name: str, across: Column, up: Column, note: str, ending: str) -> bytes:
    """Return the figure of a measured flank.

    Parameters
    ----------
    name : of the file
    across, up : abscissa and ordinate: what they are, and (n,) values [m] or [rad]
    note : how the file was read
    ending : png, svg or pdf
    """
    values, labels = [], []
    for quantity, given in (across, up):
        words, stored, wanted = SHOWN[quantity]
        shown = converted(np.asarray(given, float), stored, wanted)
        power = power_of_ten([shown], wanted)
        values.append(shown / 10.0**power)
        labels.append(axis_label(words, wanted, power))
    look = "line-points" if len(across[1]) <= MARKED else "line"
    curve = Curve(values[0], values[1], Pen("#0072B2", "-", "o"), look)  # type: ignore[arg-type]
    zero = Curve(values[0][[0, -1]], np.zeros(2), Pen("#7a7a7a", ":"), "reference")
    panel = Panel(0, 0, "", labels[0], labels[1], (zero, curve))
    plot = Plot(f"{name} as it was understood", (panel,), 1, 1, notes=(f"Read as {note}.",))
    return rendered(plot, {"Title": plot.title}, ending)
