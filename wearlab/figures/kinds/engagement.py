"""While a tooth pair is in contact: along the path, over mesh cycles, and over the flank with its width."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from wearlab.arrays import Array
from wearlab.figures.kind import ORBITS, STATES, Ask, Run, Slice, companion, kind, last_state, slices, thinned
from wearlab.figures.plot import Mark, Scale, Series
from wearlab.figures.published import beside_map, measured_flank
from wearlab.figures.wording import Label

POSITIONS = ("path_position", "diameter", "roll_angle", "distance_to_pitch_circle")
QUANTITIES = ("contact_pressure", "sliding_velocity", "lambda_ratio", "effective_wear_coefficient")


def along_path(run: Run, name: str, ask: Ask, extra: Mapping[str, Label] | None = None) -> Iterator[Series]:
    """Yield a variable along the flank, over the coordinate that ``x`` names."""
    for piece in slices(run, name, ask, "profile"):
        x, across = companion(run, ask.x or POSITIONS[0], piece.place, ask)
        named = piece._replace(key={**piece.key, **(extra or {})})
        yield named.over(x, across, marks=_marks(run, x, piece.place)).at(np.isfinite(x))


def _marks(run: Run, x: np.ndarray, place: Mapping[str, int]) -> tuple[Mark, ...]:
    if "characteristic_point" not in run.data:
        return ()
    points = run.data["characteristic_point"]
    letters = points.isel({dim: place[str(dim)] for dim in points.dims if dim in place}).values
    at = {str(letter): float(where) for letter, where in zip(letters, x, strict=True) if letter}
    return tuple(Mark(where, letter) for letter, where in at.items())


@kind(
    "wear-profile", "Wear depth along the flank", ("wear_depth", "path_position"), ("profile",),
    roles=(("hue", "update"), ("hue", "*"), ("cols", "*"), ("rows", "flank"), ("rows", "*")),
    titled="{} along the flank",
)  # fmt: skip
def wear_profile(run: Run, ask: Ask) -> Iterator[Series]:
    """Wear depth over path_position, diameter, roll_angle or distance_to_pitch_circle, with A–E marked."""
    return along_path(thinned(run), ask.y[0], ask)


@kind(
    "along-path", "Contact along the path", ("path_position",), ("profile",),
    roles=(("rows", "variable"), ("hue", "*"), ("cols", "update"), ("cols", "*")), also=QUANTITIES,
    one_flank=True, y="", titled="{} along the path",
    shows="pressure, sliding, λ and wear coefficient along the path (or the variables in y), one row each, "
    "in the first and the last wear state; the first flank when none is selected",
)  # fmt: skip
def along_whole_path(run: Run, ask: Ask) -> Iterator[Series]:
    """Quantities along the path, one row each."""
    names = ask.y or QUANTITIES
    run = thinned(run, 2)  # the first and the last wear state
    for order, name in enumerate(names):
        if name in run.data:
            yield from along_path(run, name, ask, {"variable": Label(float(order), name)})


ENGAGED = ("phase", "contact_ratio", "mesh_phase_offset")
ENGAGEMENT = Scale("mesh cycles since the pair enters at A", "1")


def path_marks(run: Run, index: Mapping[str, int], ratio: float) -> tuple[Mark, ...]:
    """Return the points A–E on the scale of mesh cycles since A."""
    if "path_position" not in run.data:
        return ()
    position, leads = run.data["path_position"].values, _flank(run, index)
    marks = _marks(run, position[leads] if position.ndim > 1 else position, {"flank": leads})
    at = {mark.text: mark.x for mark in marks}
    if not {"A", "E"} <= set(at):
        return ()
    period = (at["E"] - at["A"]) / ratio
    return tuple(Mark((s - at["A"]) / period, letter) for letter, s in at.items())


def _flank(run: Run, index: Mapping[str, int]) -> int:
    """Return the place of the flank that leads in a mesh, such as "sun" in "sun-planet-1"."""
    if "mesh" not in run.data.coords or "flank" not in run.data.dims:
        return 0
    mesh = str(np.atleast_1d(run.data["mesh"].values)[index.get("mesh", 0)])
    return next((i for i, name in enumerate(run.data["flank"].values) if mesh.startswith(str(name))), 0)


def _engaged(run: Run, ask: Ask, piece: Slice) -> tuple[Array, float, float, tuple[Mark, ...]]:
    """Return phases, contact ratio, the phase at which a pair of the mesh enters at A, and the points A–E."""
    phase, ratio, lag = (companion(run, name, piece.place, ask)[0] for name in ENGAGED)
    return phase, float(ratio), float(lag), path_marks(run, piece.place, float(ratio))


def _curves(run: Run, ask: Ask) -> Iterator[Series]:
    """Yield a variable of the mesh period, repeated until the pair that entered at phase 0 leaves."""
    run = thinned(run)
    for piece in slices(run, ask.y[0], ask, "phase"):
        if ask.x == "phase":
            phase, scale = companion(run, "phase", piece.place, ask)
            yield Series(piece.key, phase, piece.values, scale, piece.scale)
            continue
        phase, ratio, lag, marks = _engaged(run, ask, piece)
        periods = np.broadcast_to(piece.values, (int(np.ceil(ratio)), 1, len(phase)))
        x, y = through_engagement(periods, phase, ratio, lag)
        inside = x < ratio
        x, y = np.append(x[inside], ratio), np.append(y[inside], y[inside][-1])
        yield Series(piece.key, x, y, ENGAGEMENT, piece.scale, marks=marks)


TVMS = kind(
    "tvms", "Time-varying mesh stiffness", ("mesh_stiffness", *ENGAGED), ("phase",), roles=STATES,
    titled="{} through an engagement",
    shows="mesh stiffness from the entry of a tooth pair at A to its exit at E, or one period (x = phase)",
)(_curves)  # fmt: skip
STE = kind(
    "ste", "Static transmission error under load", ("static_transmission_error", *ENGAGED), ("phase",),
    roles=STATES, titled="{} through an engagement",
    shows="static transmission error from the entry of a tooth pair at A to its exit at E",
)(_curves)  # fmt: skip


def through_engagement(
    values: Array, phase: Array, ratio: float, lag: float = 0.0, period: int = 0
) -> tuple[Array, Array]:
    """Join the pieces of one pair: slot p holds the pair that entered ceil(ε) − 1 − p periods ago.

    Parameters
    ----------
    values : (pair, n_periods, n_phases)
    phase : (n_phases,) on the clock of all meshes [1]
    ratio : contact ratio [1]
    lag : phase at which a pair of this mesh enters at A [1]
    period : the mesh period in which the pair enters
    """
    slots, periods = int(np.ceil(ratio)), values.shape[1]
    since = np.round(np.arange(periods)[:, None] + phase - lag, 12)
    entered, own = np.floor(since).astype(int), since % 1.0
    x, y = [], []
    for age in range(slots):
        then = (entered - period - age) % periods == 0
        order = np.argsort(own[then])
        x.append(own[then][order] + age)
        y.append(values[slots - 1 - age][then][order])
    at, history = np.concatenate(x), np.concatenate(y)
    return at[at <= ratio], history[at <= ratio]


@kind("load-share", "Load share of one tooth pair", ("load_share", *ENGAGED), ("pair", "phase"), roles=STATES)
def load_share(run: Run, ask: Ask) -> Iterator[Series]:
    """Share of the static mesh force that one tooth pair carries, from A to E."""
    run = thinned(run)
    for piece in slices(run, "load_share", ask, "pair", "phase"):
        yield from _histories(run, ask, piece, piece.values[:, None, :])


@kind(
    "pair-force", "Dynamic force on one tooth pair", ("pair_force", *ENGAGED),
    ("pair", "mesh_period", "phase"), roles=ORBITS,
)  # fmt: skip
def pair_force(run: Run, ask: Ask) -> Iterator[Series]:
    """Elastic force on the drive flanks of one tooth pair, from A to E, one curve per mesh period."""
    run = thinned(run)
    for piece in slices(run, "pair_force", ask, "pair", "mesh_period", "phase"):
        kept = ~np.isnan(piece.values).all(axis=(0, 2))
        yield from _histories(run, ask, piece, piece.values[:, kept])


def _histories(run: Run, ask: Ask, piece: Slice, values: Array) -> Iterator[Series]:
    phase, ratio, lag, marks = _engaged(run, ask, piece)
    for period in range(values.shape[1]):
        x, y = through_engagement(values, phase, ratio, lag, period)
        yield Series(piece.key, x, y, ENGAGEMENT, piece.scale, marks=marks)


COMPUTED, MEASURED = (Label(text, text) for text in ("computed", "measured"))
MAPS = (("cols", "update"), ("cols", "*"), ("rows", "flank"), ("rows", "*"))


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
    ("face", "profile"), roles=MAPS, one_flank=True, titled="{} over the flank",
    shape="square",
)  # fmt: skip
def contact_pattern(run: Run, ask: Ask) -> Iterator[Series]:
    """Pressure over profile and face as it is painted in a test, in the first and the last wear state."""
    return over_flank(thinned(run, 2), ask.y[0], ask)


@kind(
    "wear-map", "Wear over face and profile", ("wear_depth", "path_position", "face_position"),
    ("face", "profile"), roles=(("cols", "source"), *MAPS), titled="{} over the flank",
    shape="square",
)  # fmt: skip
def wear_map(run: Run, ask: Ask) -> Iterator[Series]:
    """Wear depth over profile and face in the last wear state or those selected, a measured one beside."""
    if run.data.sizes.get("update", 1) > 2:
        run = last_state(run)
    if ask.published is None:
        yield from over_flank(run, ask.y[0], ask)
        return
    if ask.y[0] != "wear_depth":
        raise ask.wrong(f"published tells wear depths, and y = {ask.y[0]!r}: leave one out")
    if run.data.sizes["flank"] > 1:
        flanks = ", ".join(map(str, run.data["flank"].values))
        raise ask.wrong(f"published is of one flank: name it in select.flank, of {flanks}")
    flank = measured_flank(ask)
    for curve in over_flank(run, ask.y[0], replace(ask, x=flank.along)):
        yield replace(curve, key={**curve.key, "source": COMPUTED})
        yield beside_map(replace(curve, key={**curve.key, "source": MEASURED}), flank)


@kind(
    "face-load", "Load over the face", ("mean_line_load", "face_position"), ("face",),
    roles=STATES, titled="{} over the face",
)  # fmt: skip
def face_load(run: Run, ask: Ask) -> Iterator[Series]:
    """Line load over the face, mean over the mesh period, as wear goes on."""
    run = thinned(run)
    for piece in slices(run, ask.y[0], ask, "face"):
        yield piece.over(*companion(run, "face_position", piece.place, ask))


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
