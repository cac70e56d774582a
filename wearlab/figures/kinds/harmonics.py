"""RMS and the first three harmonics of a quantity, over wear."""

from collections.abc import Callable, Iterator

import numpy as np

from wearlab.figures.ask import Ask
from wearlab.figures.kind import Kind, Role
from wearlab.figures.plot import Scale, Series
from wearlab.figures.runs import Run
from wearlab.figures.slices import Slice, companion, slices
from wearlab.figures.wording import Label, ordinal

SHOWN = 3
MEAN = Label("mean", "mean")
FLUCTUATION = Label("fluctuation", "fluctuation")
RMS = Label("RMS", "RMS of the fluctuation")


def _of(prefix: str, subject: str, by: str) -> Callable[[Run, Ask], Iterator[Series]]:
    def series(run: Run, ask: Ask) -> Iterator[Series]:
        amplitude = f"{subject} fluctuation"
        if f"{prefix}_mean" in run.data:
            yield from _states(run, ask, f"{prefix}_mean", by, {"part": MEAN}, f"mean {subject}")
        yield from _states(run, ask, f"{prefix}_rms", by, {"part": FLUCTUATION, "quantity": RMS}, amplitude)
        for piece in slices(run, f"{prefix}_harmonics", ask, "update"):
            order = int(piece.key["harmonic"].value)
            if order <= SHOWN or "harmonic" in ask.select:
                key = {k: v for k, v in piece.key.items() if k != "harmonic"}
                name = Label(f"harmonic {order}", f"{ordinal(order)} harmonic")
                yield _line(
                    run,
                    ask,
                    piece._replace(key={**key, "part": FLUCTUATION, "quantity": name}),
                    by,
                    amplitude,
                )

    return series


def _states(run: Run, ask: Ask, name: str, by: str, labels: dict[str, Label], words: str) -> Iterator[Series]:
    for piece in slices(run, name, ask, "update"):
        yield _line(run, ask, piece._replace(key={**piece.key, **labels}), by, words)


def _line(run: Run, ask: Ask, piece: Slice, by: str, words: str) -> Series:
    x, across = companion(run, ask.x or by, dict(piece.place), ask)
    if x.ndim > 1:  # the flank that is worn most
        x = x.max(axis=1)
    held = np.isfinite(x) & np.isfinite(piece.values)
    up = Scale(words, piece.scale.units)
    return Series(piece.key, x[held], piece.values[held], across, up, "line-points")


ROLES: tuple[tuple[Role, str], ...] = (("hue", "quantity"), ("cols", "part"), ("rows", "*"), ("cols", "*"))
STIFFNESS_HARMONICS = Kind(
    name="stiffness-harmonics",
    title="Mesh stiffness and its harmonics over wear",
    shows="mean, RMS and first three harmonics of the mesh stiffness over the largest wear depth",
    needs=("stiffness_rms", "stiffness_harmonics", "max_wear_depth"),
    dims=("update",),
    series=_of("stiffness", "stiffness", "max_wear_depth"),
    roles=ROLES,
    also=("stiffness_mean",),
)
STE_HARMONICS = Kind(
    name="ste-harmonics",
    title="Static transmission error and its harmonics over wear",
    shows="mean, RMS and first three harmonics of the static transmission error over the largest wear depth",
    needs=("ste_rms", "ste_harmonics", "max_wear_depth"),
    dims=("update",),
    series=_of("ste", "STE", "max_wear_depth"),
    roles=ROLES,
    also=("ste_mean",),
)
DTE_HARMONICS = Kind(
    name="dte-harmonics",
    title="Harmonics of the dynamic transmission error",
    shows="RMS and first three harmonics of the dynamic transmission error over the cycles",
    needs=("dte_rms", "dte_harmonics", "cycle"),
    dims=("update",),
    series=_of("dte", "DTE", "cycle"),
    roles=(("hue", "quantity"), ("cols", "*"), ("rows", "*")),
)
