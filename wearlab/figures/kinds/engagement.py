"""While a tooth pair is in contact: along the path, over mesh cycles, and over the flank with its width."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.figures.kind import (
    ORBITS,
    STATES,
    FigureRequest,
    Run,
    Slice,
    companion,
    kind,
    over,
    slices,
)
from wearlab.figures.plot import Line, Mark, Scale, Series
from wearlab.figures.published import beside_map, measured_flank
from wearlab.figures.wording import Label
from wearlab.nearest import choices

POSITIONS = ("path_position", "diameter", "roll_angle", "distance_to_pitch_circle")
QUANTITIES = (
    "contact_pressure",
    "sliding_velocity",
    "lambda_ratio",
    "effective_wear_coefficient",
)


def along_path(
    run: Run,
    name: str,
    request: FigureRequest,
    extra: Mapping[str, Label] | None = None,
) -> Iterator[Series]:
    """Yield a variable along the flank, over the coordinate that ``x`` names."""
    for piece in slices(run, name, request, "profile"):
        x, x_scale = _positions(run, piece, request)
        named = piece._replace(key={**piece.key, **(extra or {})})
        yield named.over(x, x_scale, marks=_marks(run, x, piece.place)).at(
            np.isfinite(x)
        )


def _positions(run: Run, piece: Slice, request: FigureRequest) -> tuple[Array, Scale]:
    """Return the coordinate along the flank that ``x`` names."""
    name = request.x or POSITIONS[0]
    if "profile" not in run.data[name].dims:
        raise request.error(
            f"x = {name!r} does not run along the flank; {choices(name, POSITIONS)}"
        )
    return companion(run, name, piece.place, request)


def _marks(run: Run, x: np.ndarray, place: Mapping[str, int]) -> tuple[Mark, ...]:
    if "characteristic_point" not in run.data:
        return ()
    points = run.data["characteristic_point"]
    letters = points.isel(
        {dim: place[str(dim)] for dim in points.dims if dim in place}
    ).values
    at = {
        str(letter): float(where)
        for letter, where in zip(letters, x, strict=True)
        if letter
    }
    return tuple(Mark(where, letter) for letter, where in at.items())


@kind(
    "wear-profile",
    "Wear depth along the flank",
    ("wear_depth", "path_position"),
    ("profile",),
    roles=(
        ("hue", "update"),
        ("hue", "*"),
        ("cols", "*"),
        ("rows", "flank"),
        ("rows", "*"),
    ),
    titled="{} along the flank",
)
def wear_profile(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Wear depth over path_position, diameter, roll_angle or distance_to_pitch_circle, with A–E marked."""
    return along_path(run.thinned(), request.y[0], request)


@kind(
    "along-path",
    "Contact along the path",
    ("path_position",),
    ("profile",),
    roles=(("rows", "variable"), ("hue", "*"), ("cols", "update"), ("cols", "*")),
    also=QUANTITIES,
    one_flank=True,
    y="",
    titled="{} along the path",
    shows="pressure, sliding, λ and wear coefficient along the path (or the variables "
    "in y), one row each, "
    "in the first and the last wear state; the first flank when none is selected",
)
def along_whole_path(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Quantities along the path, one row each."""
    run = run.thinned(2)  # the first and the last wear state
    for order, name in enumerate(request.y or QUANTITIES):
        if name in run.data:
            yield from along_path(
                run, name, request, {"variable": Label(float(order), name)}
            )


ENGAGED = ("phase", "contact_ratio", "mesh_phase_offset")


def _engagement_marks(
    run: Run, index: Mapping[str, int], ratio: float
) -> tuple[Mark, ...]:
    """Return the points A–E on the scale of mesh cycles since A, on the path of the flank that leads.

    That is "sun" in "sun-planet-1".
    """
    if "path_position" not in run.data:
        return ()
    leads = 0
    position = run.data["path_position"].values
    if "mesh" in run.data.coords and "flank" in run.data.dims:
        mesh = str(np.atleast_1d(run.data["mesh"].values)[index.get("mesh", 0)])
        flanks = run.data["flank"].values
        leads = next(
            (i for i, name in enumerate(flanks) if mesh.startswith(str(name))), 0
        )
    marks = _marks(
        run, position[leads] if position.ndim > 1 else position, {"flank": leads}
    )
    at = {mark.text: mark.x for mark in marks}
    if not {"A", "E"} <= set(at):
        return ()
    period = (at["E"] - at["A"]) / ratio
    return tuple(Mark((s - at["A"]) / period, letter) for letter, s in at.items())


def _engagements(
    run: Run, request: FigureRequest, name: str, *along: str
) -> Iterator[Series]:
    """Yield what one tooth pair goes through from A to E.

    Parameters
    ----------
    run, request : of the figure
    name : a variable of the mesh period, repeated until the pair that entered at phase
        0 leaves, or of pairs
    along : its dimensions, of ``pair``, ``mesh_period`` and ``phase``; a curve for each
        mesh period
    """
    run = run.thinned()
    for piece in slices(run, name, request, *along):
        phase, ratio, lag = (
            companion(run, of, piece.place, request)[0] for of in ENGAGED
        )
        end = float(ratio)
        marks = _engagement_marks(run, piece.place, float(ratio))
        values = piece.values
        if "pair" not in along:
            values = np.broadcast_to(values, (int(np.ceil(end)), 1, len(phase)))
        elif "mesh_period" not in along:
            values = values[:, None]
        values = values[:, ~np.isnan(values).all(axis=(0, 2))]
        for period in range(values.shape[1]):
            x, y = through_engagement(values, phase, end, float(lag), period)
            if "pair" not in along:  # to the end
                x, y = np.append(x[x < end], end), np.append(y[x < end], y[x < end][-1])
            x_scale = Scale("mesh cycles since the pair enters at A", "1")
            yield Series(piece.key, x, y, x_scale, piece.scale, marks=marks)


def _of_mesh(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Yield a variable of the mesh period, over an engagement or over the phase."""
    if request.x == "phase":
        return over(run.thinned(), request.y[0], request, "phase", "phase")
    return _engagements(run, request, request.y[0], "phase")


TVMS = kind(
    "tvms",
    "Time-varying mesh stiffness",
    ("mesh_stiffness", *ENGAGED),
    ("phase",),
    roles=STATES,
    titled="{} through an engagement",
    shows="mesh stiffness from the entry of a tooth pair at A to its exit at E, or "
    "one period (x = phase)",
)(_of_mesh)
STE = kind(
    "ste",
    "Static transmission error under load",
    ("static_transmission_error", *ENGAGED),
    ("phase",),
    roles=STATES,
    titled="{} through an engagement",
    shows="static transmission error from the entry of a tooth pair at A to its exit "
    "at E",
)(_of_mesh)


def through_engagement(
    values: Array, phase: Array, ratio: float, lag: float = 0.0, period: int = 0
) -> Line:
    """Join the pieces of one pair: slot p holds the pair that entered ceil(ε) − 1 − p periods ago.

    Parameters
    ----------
    values : (pair, n_periods, n_phases)
    phase : (n_phases,) on the clock of all meshes [1]
    ratio : contact ratio [1]
    lag : phase at which a pair of this mesh enters at A [1]
    period : the mesh period in which the pair enters
    """
    slots = int(np.ceil(ratio))
    periods = values.shape[1]
    since = np.round(np.arange(periods)[:, None] + phase - lag, 12)
    entered = np.floor(since).astype(int)
    own = since % 1.0
    x = []
    y = []
    for age in range(slots):
        then = (entered - period - age) % periods == 0
        order = np.argsort(own[then])
        x.append(own[then][order] + age)
        y.append(values[slots - 1 - age][then][order])
    at = np.concatenate(x)
    history = np.concatenate(y)
    return at[at <= ratio], history[at <= ratio]


@kind(
    "load-share",
    "Load share of one tooth pair",
    ("load_share", *ENGAGED),
    ("pair", "phase"),
    roles=STATES,
)
def load_share(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Share of the static mesh force that one tooth pair carries, from A to E."""
    return _engagements(run, request, "load_share", "pair", "phase")


@kind(
    "pair-force",
    "Dynamic force on one tooth pair",
    ("pair_force", *ENGAGED),
    ("pair", "mesh_period", "phase"),
    roles=ORBITS,
)
def pair_force(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Elastic force on the drive flanks of one tooth pair, from A to E, one curve per mesh period."""
    return _engagements(run, request, "pair_force", "pair", "mesh_period", "phase")


MAPS = (("cols", "update"), ("cols", "*"), ("rows", "flank"), ("rows", "*"))


def over_flank(run: Run, name: str, request: FigureRequest) -> Iterator[Series]:
    """Yield a variable as maps over profile and face.

    What has no face is even across it.
    """
    for piece in slices(run, name, request, "face", "profile"):
        x, x_scale = _positions(run, piece, request)
        y, y_scale = companion(run, "face_position", piece.place, request)
        held = np.isfinite(x)
        wide, high = np.meshgrid(x[held], y)
        level: Any = {
            "level": np.broadcast_to(piece.values[..., held], wide.shape).ravel()
        }
        yield Series(
            piece.key,
            wide.ravel(),
            high.ravel(),
            x_scale,
            y_scale,
            "map",
            colours=piece.scale,
            **level,
        )


@kind(
    "contact-pattern",
    "Contact pattern",
    ("contact_pressure", "path_position", "face_position"),
    ("face", "profile"),
    roles=MAPS,
    one_flank=True,
    titled="{} over the flank",
    shape="square",
)
def contact_pattern(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Pressure over profile and face as it is painted in a test, in the first and the last wear state."""
    return over_flank(run.thinned(2), request.y[0], request)


@kind(
    "wear-map",
    "Wear over face and profile",
    ("wear_depth", "path_position", "face_position"),
    ("face", "profile"),
    roles=(("cols", "source"), *MAPS),
    titled="{} over the flank",
    shape="square",
)
def wear_map(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Wear depth over profile and face in the last wear state or those selected, a measured one beside."""
    if run.data.sizes.get("update", 1) > 2:
        run = run.at_states([-1])
    if request.published is None:
        yield from over_flank(run, request.y[0], request)
        return
    if request.y[0] != "wear_depth":
        raise request.error(
            f"published tells wear depths, and y = {request.y[0]!r}: leave one out"
        )
    if run.data.sizes["flank"] > 1:
        flanks = ", ".join(map(str, run.data["flank"].values))
        raise request.error(
            f"published is of one flank: name it in select.flank, of {flanks}"
        )
    flank = measured_flank(request)
    for curve in over_flank(run, request.y[0], replace(request, x=flank.along)):
        for source in ("computed", "measured"):
            told = replace(curve, key={**curve.key, "source": Label(source, source)})
            yield beside_map(told, flank) if source == "measured" else told


@kind(
    "face-load",
    "Load over the face",
    ("mean_line_load", "face_position"),
    ("face",),
    roles=STATES,
    titled="{} over the face",
)
def face_load(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Line load over the face, mean over the mesh period, as wear goes on."""
    return over(run.thinned(), request.y[0], request, "face_position", "face")


@kind(
    "contact-lines",
    "Lines of contact",
    ("base_helix_angle", "contact_ratio", "path_position", "face_position"),
    roles=(("hue", "phase"), ("cols", "*"), ("rows", "*")),
    one_flank=True,
    shape="square",
)
def contact_lines(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Lines of contact in the field of action, at four phases of the mesh."""
    place = {"flank": 0, "mesh": 0}
    x, x_scale = companion(run, "path_position", place, request)
    y, y_scale = companion(run, "face_position", place, request)
    begin = float(np.nanmin(x))
    end = float(np.nanmax(x))
    pitch = (end - begin) / float(companion(run, "contact_ratio", place, request)[0])
    slope = float(np.tan(run.data["base_helix_angle"].values[0]))
    frame = (
        np.array([begin, end, end, begin, begin]),
        np.array([y[0], y[0], y[-1], y[-1], y[0]]),
    )
    yield Series(run.place, *frame, x_scale, y_scale, "level", text="field of action")
    reach = int(np.ceil((end - begin + abs(slope) * np.ptp(y)) / pitch)) + 1
    along = np.append(np.linspace(y[0], y[-1], 201), np.nan)
    for phase in (0.0, 0.25, 0.5, 0.75):
        s = np.concatenate(
            [
                begin + pitch * (phase + n) - slope * along
                for n in range(-reach, reach + 1)
            ]
        )
        s[~((s >= begin) & (s <= end))] = np.nan
        height = np.where(np.isnan(s), np.nan, np.tile(along, 2 * reach + 1))
        yield Series(
            {**run.place, "phase": Label(phase, f"phase {phase:g}")},
            s,
            height,
            x_scale,
            y_scale,
        )
