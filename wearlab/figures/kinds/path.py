"""What happens along the path of contact, with the points A–E marked."""

from collections.abc import Iterator, Mapping

import numpy as np

from wearlab.figures.kind import Ask, Kind
from wearlab.figures.plot import Mark, Series
from wearlab.figures.runs import Run
from wearlab.figures.slices import companion, slices, thinned
from wearlab.figures.wording import Label

POSITIONS = ("path_position", "diameter", "roll_angle", "distance_to_pitch_circle")
QUANTITIES = ("contact_pressure", "sliding_velocity", "lambda_ratio", "effective_wear_coefficient")


def along_path(run: Run, name: str, ask: Ask, extra: Mapping[str, Label] | None = None) -> Iterator[Series]:
    """Yield a variable along the flank, over the coordinate that ``x`` names."""
    for piece in slices(run, name, ask, "profile"):
        x, across = companion(run, ask.x or POSITIONS[0], piece.place, ask)
        held = np.isfinite(x)
        key, marks = {**piece.key, **(extra or {})}, _marks(run, x, piece.place)
        yield Series(key, x, piece.values, across, piece.scale, marks=marks, y_error=piece.error).at(held)


def _marks(run: Run, x: np.ndarray, place: Mapping[str, int]) -> tuple[Mark, ...]:
    if "characteristic_point" not in run.data:
        return ()
    points = run.data["characteristic_point"]
    letters = points.isel({dim: place[str(dim)] for dim in points.dims if dim in place}).values
    at = {str(letter): float(where) for letter, where in zip(letters, x, strict=True) if letter}
    return tuple(Mark(where, letter) for letter, where in at.items())


def _wear_profile(run: Run, ask: Ask) -> Iterator[Series]:
    return along_path(thinned(run), ask.y[0], ask)


def _along_path(run: Run, ask: Ask) -> Iterator[Series]:
    names = ask.y or QUANTITIES
    run = thinned(run, 2)  # the first and the last wear state
    for order, name in enumerate(names):
        if name in run.data:
            yield from along_path(run, name, ask, {"variable": Label(float(order), name)})


WEAR_PROFILE = Kind(
    name="wear-profile",
    title="Wear depth along the flank",
    shows="wear depth over path_position, diameter, roll_angle or distance_to_pitch_circle, with A–E marked",
    needs=("wear_depth", "path_position"),
    dims=("profile",),
    series=_wear_profile,
    roles=(("hue", "update"), ("hue", "*"), ("cols", "*"), ("rows", "flank"), ("rows", "*")),
    y="wear_depth",
    titled="{} along the flank",
)
ALONG_PATH = Kind(
    name="along-path",
    title="Contact along the path",
    shows="pressure, sliding, λ and wear coefficient along the path (or the variables in y), one row each, "
    "in the first and the last wear state; the first flank when none is selected",
    needs=("path_position",),
    dims=("profile",),
    series=_along_path,
    roles=(("rows", "variable"), ("hue", "*"), ("cols", "update"), ("cols", "*")),
    also=QUANTITIES,
    one_flank=True,
    titled="{} along the path",
)
