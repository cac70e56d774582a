"""Extended contact of a campaign's static cases against finite elements: load,
deflection, wear at A.

``python tests/benchmarks/tip_corners.py FILE [FIGURE]`` prints the table, and draws it
when FIGURE is named. The finite elements are those of :mod:`.corner_elements`: gaps
from drawn outlines, corners loaded on the mate's normal, every pair in reach coupled to
every other. How wide the loaded patch is decides how soft a corner is: two widths are
given.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from corner_elements import OPTIONS, PAIRS, Loaded, load_corners
from estimate_figure import DEFAULTS
from matplotlib.figure import Figure
from numpy.typing import NDArray

from wearlab.assembly.mesh import build_analyses
from wearlab.assembly.sets import build_set
from wearlab.campaign import load
from wearlab.mesh.finite_element.elements import Options
from wearlab.mesh.gear_set import PairOfSet
from wearlab.mesh.profile import lookup
from wearlab.scene import Scene

Array = NDArray[np.float64]

PHASES = 121
BEFORE = (-0.3, -0.25, -0.2, -0.15, -0.1, -0.05, -0.01, 0.0, 0.05, 0.1)
"""Base pitches from A at which the table shows the entering pair; after E the leaving
one, mirrored."""
LOADED = 1e-6
COLOURS = ("#222222", "#888888", "#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00")


@dataclass(frozen=True)
class Way:
    """A pair of teeth on its way through the mesh, and the mesh it belongs to.

    Parameters
    ----------
    label : of the model
    position : (n,) path position from A, in base pitches, ascending [1]
    share : (n,) force of the pair over the load [1]
    phase : (m,) [1]
    deflection : (m,) static transmission error [m]
    """

    label: str
    position: Array
    share: Array
    phase: Array
    deflection: Array

    @property
    def swing(self) -> float:
        """Peak to peak of the static transmission error [m]."""
        return float(np.ptp(self.deflection))

    @property
    def loaded(self) -> tuple[float, float]:
        """Where the pair begins and ends to carry load, from A, in base pitches [1]."""
        where = self.position[self.share > LOADED]
        return float(where[0]), float(where[-1])

    def at(self, position: float) -> float:
        """Return the share at a position from A, in base pitches [1]."""
        return float(np.interp(position, self.position, self.share))


def by_elements(
    label: str, one: PairOfSet, phase: Array, options: Options = OPTIONS
) -> tuple[Way, Loaded]:
    """Return the way of a pair by finite elements alone, and what was loaded."""
    found = load_corners(one.pair, one.load, phase, options)
    return _way(label, phase, found.force / one.load, found.deflection), found


def by_model(label: str, scene: Scene, one: PairOfSet, phase: Array) -> Way:
    """Return the way of a pair by the contact analysis of a scene, unworn."""
    analysis = build_analyses(scene, [one])[0]
    grid = analysis.grid
    segment = np.searchsorted(grid.breaks, phase, side="right") - 1
    where = lookup(grid, phase, np.clip(segment, 0, len(grid.intervals) - 1))
    state = analysis.quasistatic(
        analysis.nodes(np.zeros((2, len(grid.position)))), where
    )
    share = np.zeros((len(phase), len(PAIRS)))
    for slot, number in enumerate(grid.pair_numbers):
        share[:, PAIRS.index(int(number))] = state.force[:, slot] / analysis.load
    return _way(label, phase, share, state.deflection)


def _way(label: str, phase: Array, share: Array, deflection: Array) -> Way:
    """String the pairs of one period together: one pair's way.

    At phase 1 the next pair's phase 0 counts.
    """
    position = (phase[:-1, None] + np.array(PAIRS)).T.ravel()
    return Way(label, position, share[:-1].T.ravel(), phase, deflection)


def ways(
    cases: Sequence[tuple[str, Scene]], phases: int = PHASES, options: Options = OPTIONS
) -> tuple[PairOfSet, list[Way], Loaded]:
    """Return the gears, the ways by elements (two patches) and by every static case,
    and what was loaded.
    """
    static = [(label, scene) for label, scene in cases if scene.dynamics is None]
    one = build_set(static[0][1]).kinds[0]
    end = one.pair.contact_ratio
    phase = np.unique(
        np.concatenate(
            [np.linspace(0.0, 1.0, phases), [end % 1.0, (end - 1e-6) % 1.0, 1.0 - 1e-6]]
        )
    )
    reference, loaded = by_elements("elements alone", one, phase, options)
    wide = options._replace(patch=2.0 * options.patch)
    wider, _ = by_elements("elements alone, patch twice as wide", one, phase, wide)
    return (
        one,
        [
            reference,
            wider,
            *(by_model(label, scene, one, phase) for label, scene in static),
        ],
        loaded,
    )


def wear_rate_at_a(scene: Scene, one: PairOfSet, way: Way) -> tuple[float, float]:
    """Return Archard's ``k F/B |1 − v_other/v_i|`` at A of both flanks, film left out
    [m per pass].

    Parameters
    ----------
    scene : of the wear coefficient
    one : the gears
    way : of the pair
    """
    given: Any = scene.wear.coefficient if scene.wear else None
    pressure = way.at(0.0) * one.load / one.pair.face_width
    first, second = (
        given.value
        * pressure
        * np.abs(one.pair.specific_sliding(np.array([one.pair.path.A])))[:, 0]
    )
    return float(first), float(second)


def report(
    title: str, scene: Scene, one: PairOfSet, found: Sequence[Way], loaded: Loaded
) -> str:
    """Return the tables as text."""
    pitch = one.pair.base_pitch
    ratio = one.pair.contact_ratio
    x = (loaded.position - one.pair.path.A).T.ravel() / pitch
    order = np.argsort(x)
    names = [f"({n + 1}) {way.label}" for n, way in enumerate(found)]
    heads = "".join(f"{f'({n + 1})':>9}" for n in range(len(found)))
    lines = [
        title,
        *names,
        "",
        "share of the load of one pair",
        f"{'base pitches':>18}{'gap um':>9}{heads}",
    ]
    for name, spots in (("A", BEFORE), ("E", tuple(-d for d in reversed(BEFORE)))):
        for d in spots:
            s = d + (ratio if name == "E" else 0.0)
            gap = 1e6 * float(np.interp(s, x[order], loaded.gap.T.ravel()[order]))
            shares = "".join(f"{way.at(s):9.4f}" for way in found)
            lines.append(f"{f'{name} {d:+.2f}':>18}{gap:9.3f}{shares}")
    lines += [
        "",
        f"{'model':40}{'loaded from A':>14}{'to E':>8}{'STE um':>9}{'p-p um':>8}"
        f"{'wear at A':>22}",
    ]
    for n, way in enumerate(found):
        begin, end = way.loaded
        rates = "".join(
            f"{1e15 * rate:11.4f}" for rate in wear_rate_at_a(scene, one, way)
        )
        mean = 1e6 * float(np.trapezoid(way.deflection, way.phase))
        lines.append(
            f"{names[n]:40}{begin:+14.3f}{end - ratio:+8.3f}"
            f"{mean:9.3f}{1e6 * way.swing:8.3f}{rates}"
        )
    lines.append("wear at A: fm per pass, driving and driven flank, film left out")
    return "\n".join(lines)


def draw(title: str, one: PairOfSet, found: Sequence[Way], file: Path) -> None:
    """Draw the way of a pair and the static transmission error."""
    ratio = one.pair.contact_ratio
    with matplotlib.rc_context(DEFAULTS):
        figure = Figure((7.2, 5.4), layout="constrained")
        top, bottom = figure.subplots(2, 1)
        for n, way in enumerate(found):
            style = {
                "color": COLOURS[n % len(COLOURS)],
                "lw": 1.8 if n == 0 else 1.0,
                "zorder": 3 - (n == 0),
            }
            line = "--" if "jump" in way.label else "-"
            seen = (way.position > -0.5) & (way.position < ratio + 0.5)
            top.plot(
                way.position[seen], way.share[seen], line, label=way.label, **style
            )
            bottom.plot(way.phase, 1e6 * way.deflection, line, **style)
        for place, name in ((0.0, "A"), (ratio, "E")):
            top.axvline(place, color="black", lw=0.5)
            top.annotate(
                name,
                (place, 1.0),
                (2, -8),
                xycoords=("data", "axes fraction"),
                textcoords="offset points",
                size=8,
            )
        top.set_title(
            f"{title}: load of a pair on its way through the mesh, unworn, static",
            size=9,
        )
        top.set_xlabel("path position from A in base pitches", size=8)
        top.set_ylabel("share of the load", size=8)
        bottom.set_xlabel("phase", size=8)
        bottom.set_ylabel("static transmission error in µm", size=8)
        for axes in (top, bottom):
            axes.tick_params(labelsize=7)
        figure.legend(
            *top.get_legend_handles_labels(),
            loc="outside lower center",
            ncols=3,
            fontsize=7,
            frameon=False,
        )
        figure.savefig(file, dpi=200)


def main(words: Sequence[str]) -> None:
    """Print the tables of a campaign file, and draw them when a picture is named."""
    campaign = load(words[0])
    cases = [(case.label, case.scene) for case in campaign.cases]
    one, found, loaded = ways(cases)
    print(report(str(campaign.title), cases[0][1], one, found, loaded))
    if len(words) > 1:
        draw(str(campaign.title), one, found, Path(words[1]))


if __name__ == "__main__":
    main(sys.argv[1:])
