"""Natural frequencies against the mesh frequency and its harmonics: a Campbell diagram."""

from collections.abc import Iterator

import numpy as np

from wearlab.figures.ask import Ask
from wearlab.figures.kind import Kind
from wearlab.figures.plot import Scale, Series
from wearlab.figures.runs import Run
from wearlab.figures.slices import companion, shown
from wearlab.figures.wording import Label, ordinal

ORDERS = 4
MARGIN = 1.12


def _campbell(run: Run, ask: Ask) -> Iterator[Series]:
    """Yield mesh harmonics over speed, natural frequencies, and the point at which the run works."""
    natural, up = shown(run.data["natural_frequency"], "natural_frequency", ask)
    critical, across = shown(run.data["critical_speed"], "critical_speed", ask, "x")
    mesh = float(companion(run, "mesh_frequency", {}, ask)[0].ravel()[0])
    per_speed = float(natural[0] / critical[0])  # mesh frequency over speed: mesh periods per turn
    top = MARGIN * max(float(critical.max()), mesh / per_speed)
    speed = np.array([0.0, top])
    up = Scale("frequency", up.units)
    across = Scale("speed of the input member", across.units)
    for order in range(1, ORDERS + 1):
        name = Label(float(order), "mesh frequency" if order == 1 else f"{ordinal(order)} harmonic")
        reach = min(top, MARGIN * float(natural.max()) / (order * per_speed))
        x = np.minimum(speed, reach)
        yield Series({"order": name}, x, order * per_speed * x, across, up)
    for frequency in natural:
        yield Series({}, speed, np.full(2, frequency), across, up, "reference", "natural frequency")
    meets = mesh * np.arange(1.0, ORDERS + 1)
    meets = meets[meets <= MARGIN * float(natural.max())]
    at = np.full(len(meets), mesh / per_speed)
    yield Series({}, at, meets, across, up, "points", "speeds of the runs")


NATURAL_MODES = Kind(
    name="natural-modes",
    title="Natural frequencies and mesh harmonics",
    shows="natural frequencies, and the mesh frequency with its harmonics over speed",
    needs=("natural_frequency", "critical_speed", "mesh_frequency"),
    dims=("mode",),
    series=_campbell,
    roles=(("hue", "order"),),
)
