"""What goes with the wear states: one number over the cycles, mean and harmonics over wear."""

from collections.abc import Callable, Iterator

import numpy as np

from wearlab.figures.kind import Ask, Kind, Role, kind
from wearlab.figures.plot import Look, Scale, Series
from wearlab.figures.runs import Run
from wearlab.figures.slices import Slice, companion, slices
from wearlab.figures.wording import Label, converted, ordinal

MOST_POINTS = 30


def over_cycles(run: Run, name: str, ask: Ask) -> Iterator[Series]:
    """Yield a variable over the wear states, by cycle or by the coordinate that ``x`` names."""
    for piece in slices(run, name, ask, "update"):
        x, across = companion(run, ask.x or "cycle", piece.place, ask)
        y = np.atleast_1d(piece.values)
        held = np.isfinite(x) & np.isfinite(y)
        look: Look = "line-points" if held.sum() <= MOST_POINTS else "line"
        hours = hours_a_cycle(run) if (ask.x or "cycle") == "cycle" else None
        whole = Series(piece.key, x, y, across, piece.scale, look, hours=hours, y_error=piece.error)
        yield whole.at(held)


def hours_a_cycle(run: Run) -> float | None:
    """Return the operating hours of a wear cycle, None where it takes now more, now less."""
    if "operating_hours" not in run.data or "cycle" not in run.data:
        return None
    units = str(run.data["operating_hours"].attrs.get("units", "h"))
    hours = converted(run.data["operating_hours"].values, units, "h")
    cycle = np.asarray(run.data["cycle"].values, float)
    if hours.shape != cycle.shape:
        return None
    held = np.isfinite(hours) & np.isfinite(cycle) & (cycle > 0.0)
    if not held.any():
        return None
    rate = hours[held] / cycle[held]
    return float(rate[0]) if np.allclose(rate, rate[0], rtol=1e-6) else None


def _number(run: Run, ask: Ask) -> Iterator[Series]:
    return over_cycles(run, ask.y[0], ask)


EQUIVALENT_LOAD = kind(
    "equivalent-load", "Equivalent load", ("equivalent_load", "cycle"), ("update",), y="equivalent_load",
    titled="{}", shows="equivalent torque by Miner's rule over the cycles",
)(_number)  # fmt: skip
DYNAMIC_FACTOR = kind(
    "dynamic-factor", "Dynamic factor", ("dynamic_factor", "cycle"), ("update",), y="dynamic_factor",
    titled="{}", shows="largest dynamic over static mesh force, over the cycles",
)(_number)  # fmt: skip
MAX_WEAR = kind(
    "max-wear", "Largest wear depth", ("max_wear_depth", "cycle"), ("update",),
    roles=(("hue", "*"), ("cols", "flank"), ("rows", "*")), all_cases=True, one_flank=True,
    y="max_wear_depth", titled="{}",
    shows="largest wear depth over the cycles, of every case; the first flank when none is selected",
)(_number)  # fmt: skip


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


def _states(run: Run, ask: Ask, name: str, by: str, labels: dict[str, Label], label: str) -> Iterator[Series]:
    for piece in slices(run, name, ask, "update"):
        yield _line(run, ask, piece._replace(key={**piece.key, **labels}), by, label)


def _line(run: Run, ask: Ask, piece: Slice, by: str, label: str) -> Series:
    x, across = companion(run, ask.x or by, dict(piece.place), ask)
    if x.ndim > 1:  # the flank that is worn most
        x = x.max(axis=1)
    held = np.isfinite(x) & np.isfinite(piece.values)
    up = Scale(label, piece.scale.units)
    return Series(piece.key, x[held], piece.values[held], across, up, "line-points")


ROLES: tuple[tuple[Role, str], ...] = (("hue", "quantity"), ("cols", "part"), ("rows", "*"), ("cols", "*"))


def _over_wear(prefix: str, subject: str, title: str, label: str) -> Kind:
    return kind(
        f"{prefix}-harmonics", f"{title} and its harmonics over wear",
        (f"{prefix}_rms", f"{prefix}_harmonics", "max_wear_depth"), ("update",), roles=ROLES,
        also=(f"{prefix}_mean",),
        shows=f"mean, RMS and first three harmonics of the {label} over the largest wear depth",
    )(_of(prefix, subject, "max_wear_depth"))  # fmt: skip


STIFFNESS_HARMONICS = _over_wear("stiffness", "stiffness", "Mesh stiffness", "mesh stiffness")
STE_HARMONICS = _over_wear("ste", "STE", "Static transmission error", "static transmission error")
DTE_HARMONICS = kind(
    "dte-harmonics", "Harmonics of the dynamic transmission error", ("dte_rms", "dte_harmonics", "cycle"),
    ("update",), roles=(("hue", "quantity"), ("cols", "*"), ("rows", "*")),
    shows="RMS and first three harmonics of the dynamic transmission error over the cycles",
)(_of("dte", "DTE", "cycle"))  # fmt: skip
