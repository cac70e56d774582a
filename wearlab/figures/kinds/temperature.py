"""Figures of gears that warm up: temperature and wear over hours, and what ends it."""

from collections.abc import Iterator
from dataclasses import replace

from wearlab.figures.kind import FigureRequest, Run, kind, slices
from wearlab.figures.kinds.cycles import at_states, over_cycles, pointed
from wearlab.figures.plot import Series
from wearlab.figures.wording import Label

HOURS = "operating_hours"
"""What these are drawn over unless x names another."""


@kind(
    "temperature-wear",
    "Temperature and wear over hours",
    ("tooth_temperature", "max_wear_depth", HOURS),
    ("update",),
    roles=(
        ("rows", "part"),
        ("hue", "quantity"),
        ("hue", "*"),
        ("cols", "*"),
    ),
    shows="temperature of root and flank, and largest wear depth, of both gears over "
    "the operating hours",
)
def temperature_wear(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Yield temperatures and the largest wear depths over the operating hours.

    Parameters
    ----------
    run : that has the variables
    request : what the figure asks for
    """
    over_hours = replace(request, x=request.x or HOURS)
    for curve in over_cycles(run, "tooth_temperature", over_hours):
        key = dict(curve.key)
        member = key.pop("member")
        place = key.pop("place")
        name = f"{member.text}, {place.text}"
        yield replace(
            curve,
            key={
                **key,
                "part": Label(0.0, "temperature"),
                "quantity": Label(name, name),
            },
        )
    for curve in over_cycles(run, "max_wear_depth", over_hours):
        key = dict(curve.key)
        flank = key.pop("flank")
        name = f"{flank.text}, flank"
        yield replace(
            curve,
            key={**key, "part": Label(1.0, "wear"), "quantity": Label(name, name)},
        )


@kind(
    "what-ends-it",
    "Which limit is nearest",
    ("limit_share", HOURS),
    ("update",),
    roles=(("hue", "limit"), ("cols", "*"), ("rows", "*")),
    shows="shares of the limits of wear, temperature and backlash that are used up, "
    "over the operating hours: the first at 1 ends it",
)
def what_ends_it(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Yield the shares of the limits that are used up, over the operating hours.

    Parameters
    ----------
    run : that has the variables
    request : what the figure asks for
    """
    for piece in slices(run, "limit_share", request, "update"):
        x, x_scale = at_states(run, request, piece, HOURS)
        yield pointed(piece.over(x, x_scale).known)
