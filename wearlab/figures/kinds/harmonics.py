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


def _over_wear(prefix: str, subject: str, title: str, words: str) -> Kind:
    return Kind(
        name=f"{prefix}-harmonics",
        title=f"{title} and its harmonics over wear",
        shows=f"mean, RMS and first three harmonics of the {words} over the largest wear depth",
        needs=(f"{prefix}_rms", f"{prefix}_harmonics", "max_wear_depth"),
        dims=("update",),
        series=_of(prefix, subject, "max_wear_depth"),
        roles=ROLES,
        also=(f"{prefix}_mean",),
    )


STIFFNESS_HARMONICS = _over_wear("stiffness", "stiffness", "Mesh stiffness", "mesh stiffness")
STE_HARMONICS = _over_wear("ste", "STE", "Static transmission error", "static transmission error")
DTE_HARMONICS = Kind(
    name="dte-harmonics",
    title="Harmonics of the dynamic transmission error",
    shows="RMS and first three harmonics of the dynamic transmission error over the cycles",
    needs=("dte_rms", "dte_harmonics", "cycle"),
    dims=("update",),
    series=_of("dte", "DTE", "cycle"),
    roles=(("hue", "quantity"), ("cols", "*"), ("rows", "*")),
)
