"""The scores of the error estimates as a figure: estimate against true error, one point
for each scene.
"""

import io
from collections.abc import Sequence
from typing import NamedTuple

import matplotlib
import numpy as np
from estimate_score import Score
from matplotlib.figure import Figure
from numpy.typing import NDArray

DEFAULTS = {
    key: value
    for key, value in matplotlib.rcParamsDefault.items()
    if "backend" not in key
}
TENFOLD = 10.0
HONEST, EXCEEDED, DOUBTED = "#0072B2", "#D55E00", "0.75"


class ScorePanel(NamedTuple):
    """What a panel shows: quantity, unit in which it is drawn, and how many of that
    make one of ours.
    """

    quantity: str
    title: str
    unit: str
    scale: float


PANELS = (
    ScorePanel("wear_depth", "wear depth", "µm", 1e6),
    ScorePanel("life", "life", "cycles", 1.0),
    ScorePanel("mesh_force", "mesh force", "N", 1.0),
    ScorePanel("mesh_force_max", "largest mesh force", "N", 1.0),
)


def scores_png(scores: Sequence[Score]) -> bytes:
    """Return the PNG of a figure of estimates against true errors, log–log.

    Runs that say that their estimates are doubtful stand behind, and count in no title.
    """
    stream = io.BytesIO()
    with matplotlib.rc_context(DEFAULTS):
        figure = Figure((9.4, 2.9), layout="constrained")
        for axes, panel in zip(figure.subplots(1, len(PANELS)), PANELS, strict=True):
            doubted = panel.scale * _known(scores, panel.quantity, False)
            (true, told) = panel.scale * _known(scores, panel.quantity, True)
            axes.loglog(
                *doubted,
                "x",
                ms=2.5,
                mew=0.6,
                color=DOUBTED,
                label="run says it is doubtful",
            )
            _points(axes, true, told)
            below = f", {np.mean(true <= told):.1%} below" if len(true) else ""
            axes.set_title(f"{panel.title}\n{len(true)} scenes{below}", size=8)
            axes.set_xlabel(f"true error in {panel.unit}", size=8)
            axes.set_ylabel(f"estimated error in {panel.unit}", size=8)
            axes.tick_params(labelsize=7)
        handles, labels = figure.axes[0].get_legend_handles_labels()
        figure.legend(
            handles,
            labels,
            loc="outside lower center",
            ncols=5,
            fontsize=7,
            frameon=False,
        )
        figure.savefig(stream, format="png", dpi=200, metadata={"Software": None})
    return stream.getvalue()


def _known(
    scores: Sequence[Score], quantity: str, trusted: bool
) -> NDArray[np.float64]:
    """Return true and estimated errors of the runs that trust theirs,
    or of the others, (2, n).
    """
    pairs = [getattr(one, quantity) for one in scores if one.trusted == trusted]
    known = [pair for pair in pairs if pair is not None and np.isfinite(pair).all()]
    return np.reshape(np.array(known), (-1, 2)).T


def _points(axes, true, told) -> None:  # type: ignore[no-untyped-def]
    below = true <= told
    axes.loglog(
        true[below],
        told[below],
        "o",
        ms=2.5,
        color=HONEST,
        label="error below its estimate",
    )
    axes.loglog(
        true[~below], told[~below], "s", ms=3.0, color=EXCEEDED, label="error above it"
    )
    ends = np.array([true.min(), true.max()]) if len(true) else np.ones(2)
    axes.loglog(ends, ends, "-", lw=0.8, color="black", label="equal")
    axes.loglog(
        ends, TENFOLD * ends, "--", lw=0.8, color="black", label="ten times the error"
    )
