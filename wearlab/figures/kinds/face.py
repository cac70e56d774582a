"""Flanks with a width: contact pattern, wear over face and profile, load over the face, K_Hβ over cycles."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from wearlab.figures.kind import Ask, FigureError, kind
from wearlab.figures.kinds.cycles import over_cycles
from wearlab.figures.kinds.engagement import POSITIONS
from wearlab.figures.plot import Series
from wearlab.figures.published import beside_map, measured_flank
from wearlab.figures.runs import Run
from wearlab.figures.slices import companion, slices, thinned
from wearlab.figures.wording import Label

COMPUTED, MEASURED = (Label(text, text) for text in ("computed", "measured"))
ROLES = (("cols", "update"), ("cols", "*"), ("rows", "flank"), ("rows", "*"))


def over_flank(run: Run, name: str, ask: Ask) -> Iterator[Series]:
    """Yield a variable as maps over profile and face; what has no face is even across it."""
    for piece in slices(run, name, ask, "face", "profile"):
        x, across = companion(run, ask.x or POSITIONS[0], piece.place, ask)
        y, up = companion(run, "face_position", piece.place, ask)
        held = np.isfinite(x)
        wide, high = np.meshgrid(x[held], y)
        values = np.broadcast_to(piece.values[..., held], wide.shape)
        yield Series(
            piece.key, wide.ravel(), high.ravel(), across, up, "map",
            level=values.ravel(), colours=piece.scale,
        )  # fmt: skip


@kind(
    "contact-pattern", "Contact pattern", ("contact_pressure", "path_position", "face_position"),
    ("face", "profile"), roles=ROLES, one_flank=True, y="contact_pressure", titled="{} over the flank",
    shape="square",
)  # fmt: skip
def contact_pattern(run: Run, ask: Ask) -> Iterator[Series]:
    """Pressure over profile and face as it is painted in a test, in the first and the last wear state."""
    return over_flank(thinned(run, 2), ask.y[0], ask)


@kind(
    "wear-map", "Wear over face and profile", ("wear_depth", "path_position", "face_position"),
    ("face", "profile"), roles=(("cols", "source"), *ROLES), y="wear_depth", titled="{} over the flank",
    shape="square",
)  # fmt: skip
def wear_map(run: Run, ask: Ask) -> Iterator[Series]:
    """Wear depth over profile and face in the last wear state or those selected, a measured one beside."""
    if run.data.sizes.get("update", 1) > 2:
        run = replace(run, data=run.data.isel(update=[-1]), states=run.states[-1:])
    if ask.published is None:
        yield from over_flank(run, ask.y[0], ask)
        return
    if ask.y[0] != "wear_depth":
        raise FigureError(f"{ask.name}: published tells wear depths, and y = {ask.y[0]!r}: leave one out")
    if run.data.sizes["flank"] > 1:
        flanks = ", ".join(map(str, run.data["flank"].values))
        raise FigureError(f"{ask.name}: published is of one flank: name it in select.flank, of {flanks}")
    flank = measured_flank(ask)
    for curve in over_flank(run, ask.y[0], replace(ask, x=flank.along)):
        yield replace(curve, key={**curve.key, "source": COMPUTED})
        yield beside_map(replace(curve, key={**curve.key, "source": MEASURED}), flank)


@kind(
    "face-load", "Load over the face", ("mean_line_load", "face_position"), ("face",),
    roles=(("hue", "update"), ("hue", "*"), ("cols", "*"), ("rows", "*")), y="mean_line_load",
    titled="{} over the face",
)  # fmt: skip
def face_load(run: Run, ask: Ask) -> Iterator[Series]:
    """Line load over the face, mean over the mesh period, as wear goes on."""
    run = thinned(run)
    for piece in slices(run, ask.y[0], ask, "face"):
        x, across = companion(run, "face_position", piece.place, ask)
        yield Series(piece.key, x, piece.values, across, piece.scale, y_error=piece.error)


@kind(
    "face-load-factor", "Face load factor", ("face_load_factor", "cycle"), ("update",),
    roles=(("hue", "*"), ("cols", "*"), ("rows", "*")), all_cases=True, y="face_load_factor", titled="{}",
)  # fmt: skip
def face_load_factor(run: Run, ask: Ask) -> Iterator[Series]:
    """Face load factor K_Hβ over the cycles, of every case."""
    return over_cycles(run, ask.y[0], ask)


PHASES = (0.0, 0.25, 0.5, 0.75)


@kind(
    "contact-lines", "Lines of contact",
    ("base_helix_angle", "contact_ratio", "path_position", "face_position"),
    roles=(("hue", "phase"), ("cols", "*"), ("rows", "*")), one_flank=True, shape="square",
)  # fmt: skip
def contact_lines(run: Run, ask: Ask) -> Iterator[Series]:
    """Lines of contact in the field of action, at four phases of the mesh."""
    place = {"flank": 0, "mesh": 0}
    x, across = companion(run, "path_position", place, ask)
    y, up = companion(run, "face_position", place, ask)
    ends = float(np.nanmin(x)), float(np.nanmax(x))
    pitch = (ends[1] - ends[0]) / float(companion(run, "contact_ratio", place, ask)[0])
    slope = float(np.tan(run.data["base_helix_angle"].values[0]))
    frame = np.array([ends[0], ends[1], ends[1], ends[0], ends[0]])
    side = np.array([y[0], y[0], y[-1], y[-1], y[0]])
    yield Series(run.place, frame, side, across, up, "level", text="field of action")
    reach = int(np.ceil((np.ptp(x[np.isfinite(x)]) + abs(slope) * np.ptp(y)) / pitch)) + 1
    along = np.linspace(y[0], y[-1], 201)
    for phase in PHASES:
        lines = [ends[0] + pitch * (phase + n) - slope * along for n in range(-reach, reach + 1)]
        s = np.concatenate([np.append(line, np.nan) for line in lines])
        inside = (s >= ends[0]) & (s <= ends[1])
        height = np.where(inside, np.tile(np.append(along, np.nan), len(lines)), np.nan)
        label = Label(phase, f"phase {phase:g}")
        yield Series({**run.place, "phase": label}, np.where(inside, s, np.nan), height, across, up)
