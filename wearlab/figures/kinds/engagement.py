"""Figures of a pair in contact: along the path, over mesh cycles, over the flank."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

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
ENGAGED = ("phase", "contact_ratio", "mesh_phase_offset")
"""What a figure of an engagement needs of a run."""
POINTS = "ABCDE"
"""Of the path of contact: begin, one pair alone from B to D around C, end."""
MAPS = (("cols", "update"), ("cols", "*"), ("rows", "flank"), ("rows", "*"))


def along_path(
    run: Run,
    name: str,
    request: FigureRequest,
    extra: Mapping[str, Label] | None = None,
) -> Iterator[Series]:
    """Yield a variable along the flank, over the coordinate that ``x`` names.

    Parameters
    ----------
    run : that has the variable
    name : of the variable
    request : what the figure asks for
    extra : further labels of the curves
    """
    for piece in slices(run, name, request, "profile"):
        x, x_scale = _positions(run, piece, request)
        labelled = piece._replace(key={**piece.key, **(extra or {})})
        curve = labelled.over(x, x_scale, marks=_marks(run, x, piece.place))
        yield curve.at(np.isfinite(x))


def _positions(run: Run, piece: Slice, request: FigureRequest) -> tuple[Array, Scale]:
    """Return the coordinate along the flank that ``x`` names."""
    name = request.x or POSITIONS[0]
    if "profile" not in run.data[name].dims:
        raise request.error(
            f"x = {name!r} does not run along the flank; {choices(name, POSITIONS)}"
        )
    return companion(run, name, piece.place, request)


def _marks(run: Run, x: np.ndarray, place: Mapping[str, int]) -> tuple[Mark, ...]:
    """Return the characteristic points A–E of a flank at their abscissae."""
    places = _points_at_nodes(run, x, place)
    if {"A", "D"} <= places.keys() and len(places) < len(POINTS):
        places = _points_between_nodes(run, x, place) or places
    return tuple(Mark(abscissa, letter) for letter, abscissa in places.items())


def _points_at_nodes(
    run: Run, x: np.ndarray, place: Mapping[str, int]
) -> dict[str, float]:
    """Return the abscissae of those points A–E that are nodes."""
    if "characteristic_point" not in run.data:
        return {}
    points = run.data["characteristic_point"]
    index = {dim: place[str(dim)] for dim in points.dims if dim in place}
    letters = points.isel(index).values
    return {
        str(letter): float(abscissa)
        for letter, abscissa in zip(letters, x, strict=True)
        if letter
    }


def _points_between_nodes(
    run: Run, x: np.ndarray, place: Mapping[str, int]
) -> dict[str, float]:
    """Return the abscissae of A–E where nodes are as even as flanks with a face need.

    A is a node there, and D, a base pitch from it; E is a contact ratio of pitches
    away, B a pitch before E, C the pitch point at 0. None where meshes have several
    contact ratios.
    """
    ratios = set(run.data["contact_ratio"].values.ravel().tolist())
    if len(ratios) != 1 or "path_position" not in run.data:
        return {}
    path = run.data["path_position"].variable
    index = {dim: place[str(dim)] for dim in path.dims if dim in place}
    position = path.isel(index).values
    if position.shape != np.shape(x):
        return {}

    at_nodes = _points_at_nodes(run, position, place)
    begin = at_nodes["A"]
    pitch = at_nodes["D"] - begin
    end = begin + ratios.pop() * pitch
    positions = (begin, end - pitch, 0.0, begin + pitch, end)
    order = np.argsort(position)
    abscissae = np.interp(positions, position[order], np.asarray(x)[order])
    return dict(zip(POINTS, abscissae.tolist(), strict=True))


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
    shows="wear depth over path_position, diameter, roll_angle or "
    "distance_to_pitch_circle, with A–E marked",
)
def wear_profile(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Yield the wear depth along the flank, with A–E marked.

    Parameters
    ----------
    run : that has the variable
    request : what the figure asks for
    """
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


def _engagement_marks(
    run: Run, index: Mapping[str, int], ratio: float
) -> tuple[Mark, ...]:
    """Return the points A–E in mesh cycles since A, on the path of the leading flank.

    That is "sun" in "sun-planet-1".
    """
    if "path_position" not in run.data:
        return ()
    position = run.data["path_position"].values
    flank = _leading_flank(run, index.get("mesh", 0))
    path = position[flank] if position.ndim > 1 else position
    places = _points_at_nodes(run, path, {"flank": flank})
    if not {"A", "E"} <= set(places):
        return ()
    begin = places["A"]
    period = (places["E"] - begin) / ratio
    return tuple(Mark((s - begin) / period, letter) for letter, s in places.items())


def _leading_flank(run: Run, mesh: int) -> int:
    """Return the flank after which a mesh is called first, 0 without one."""
    if "mesh" not in run.data.coords or "flank" not in run.data.dims:
        return 0
    name = str(np.atleast_1d(run.data["mesh"].values)[mesh])
    flanks = [str(flank) for flank in run.data["flank"].values]
    leading = [i for i, flank in enumerate(flanks) if name.startswith(flank)]
    return leading[0] if leading else 0


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
    x_scale = Scale("mesh cycles since the pair enters at A", "1")
    for piece in slices(run, name, request, *along):
        phase, _ = companion(run, "phase", piece.place, request)
        ratios, _ = companion(run, "contact_ratio", piece.place, request)
        lags, _ = companion(run, "mesh_phase_offset", piece.place, request)
        ratio = float(ratios)
        lag = float(lags)

        marks = _engagement_marks(run, piece.place, ratio)
        values = _of_pairs(piece.values, along, int(np.ceil(ratio)))
        for period in range(values.shape[1]):
            x, y = through_engagement(values, phase, ratio, lag, period)
            if "pair" not in along:  # to the end
                inside = x < ratio
                x = np.append(x[inside], ratio)
                y = np.append(y[inside], y[inside][-1])
            yield Series(piece.key, x, y, x_scale, piece.scale, marks=marks)


def _of_pairs(values: Array, along: Sequence[str], pairs: int) -> Array:
    """Return values as (pair, n_periods, n_phases), without periods that have none."""
    if "pair" not in along:
        values = np.broadcast_to(values, (pairs, 1, values.shape[-1]))
    elif "mesh_period" not in along:
        values = values[:, None]
    return values[:, ~np.isnan(values).all(axis=(0, 2))]


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
    """Return mesh cycles since A, and the values of one pair at them, until E.

    Slot p holds the pair that entered ceil(ε) − 1 − p periods ago.

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
    phase_of_pair = since % 1.0

    cycles = []
    history = []
    for age in range(slots):
        inside = (entered - period - age) % periods == 0
        order = np.argsort(phase_of_pair[inside])
        cycles.append(phase_of_pair[inside][order] + age)
        history.append(values[slots - 1 - age][inside][order])
    x = np.concatenate(cycles)
    y = np.concatenate(history)
    return x[x <= ratio], y[x <= ratio]


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
    shows="elastic force on the drive flanks of one tooth pair, from A to E, one "
    "curve per mesh period",
)
def pair_force(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Yield the elastic force on one tooth pair, a curve for each mesh period.

    Parameters
    ----------
    run : that has the variable
    request : what the figure asks for
    """
    return _engagements(run, request, "pair_force", "pair", "mesh_period", "phase")


def over_flank(run: Run, name: str, request: FigureRequest) -> Iterator[Series]:
    """Yield a variable as maps over profile and face.

    What has no face is even across it.

    Parameters
    ----------
    run : that has the variable
    name : of the variable
    request : what the figure asks for
    """
    for piece in slices(run, name, request, "face", "profile"):
        x, x_scale = _positions(run, piece, request)
        y, y_scale = companion(run, "face_position", piece.place, request)
        finite = np.isfinite(x)
        map_x, map_y = np.meshgrid(x[finite], y)
        level = np.broadcast_to(piece.values[..., finite], map_x.shape)
        yield Series(
            key=piece.key,
            x=map_x.ravel(),
            y=map_y.ravel(),
            x_scale=x_scale,
            y_scale=y_scale,
            style="map",
            colours=piece.scale,
            level=level.ravel(),
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
    shows="pressure over profile and face as it is painted in a test, in the "
    "first and the last wear state",
)
def contact_pattern(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Yield the pressure over profile and face, as it is painted in a test.

    Parameters
    ----------
    run : that has the variable
    request : what the figure asks for
    """
    return over_flank(run.thinned(2), request.y[0], request)


@kind(
    "wear-map",
    "Wear over face and profile",
    ("wear_depth", "path_position", "face_position"),
    ("face", "profile"),
    roles=(("cols", "source"), *MAPS),
    titled="{} over the flank",
    shape="square",
    shows="wear depth over profile and face in the last wear state or those "
    "selected, a measured one beside",
)
def wear_map(run: Run, request: FigureRequest) -> Iterator[Series]:
    """Yield maps of the wear depth, and a measured flank beside them.

    Parameters
    ----------
    run : with its wear states, of which the last is shown
    request : what the figure asks for

    Raises
    ------
    FigureError : the measured flank cannot stand beside the maps
    """
    name = request.y[0]
    if run.data.sizes.get("update", 1) > 2:
        run = run.at_states([-1])
    if request.published is None:
        yield from over_flank(run, name, request)
        return

    if name != "wear_depth":
        raise request.error(
            f"published tells wear depths, and y = {name!r}: leave one out"
        )
    if run.data.sizes["flank"] > 1:
        flanks = ", ".join(map(str, run.data["flank"].values))
        raise request.error(
            f"published is of one flank: name it in select.flank, of {flanks}"
        )
    flank = measured_flank(request)
    for curve in over_flank(run, name, replace(request, x=flank.along)):
        yield _with_source(curve, "computed")
        yield beside_map(_with_source(curve, "measured"), flank)


def _with_source(curve: Series, source: str) -> Series:
    """Return a map with the label of its source."""
    return replace(curve, key={**curve.key, "source": Label(source, source)})


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
    """Lines of contact in the field of action, at four phases of the mesh.

    Parameters
    ----------
    run : with its helix and its nodes
    request : what the figure asks for
    """
    place = {"flank": 0, "mesh": 0}
    x, x_scale = companion(run, "path_position", place, request)
    y, y_scale = companion(run, "face_position", place, request)
    contact_ratio, _ = companion(run, "contact_ratio", place, request)
    begin = float(np.nanmin(x))
    end = float(np.nanmax(x))
    field = Series(
        key=run.place,
        x=np.array([begin, end, end, begin, begin]),
        y=np.array([y[0], y[0], y[-1], y[-1], y[0]]),
        x_scale=x_scale,
        y_scale=y_scale,
        style="level",
        text="field of action",
    )
    yield field

    pitch = (end - begin) / float(contact_ratio)
    slope = float(np.tan(run.data["base_helix_angle"].values[0]))
    reach = int(np.ceil((end - begin + abs(slope) * np.ptp(y)) / pitch)) + 1
    numbers = range(-reach, reach + 1)
    face = np.append(np.linspace(y[0], y[-1], 201), np.nan)
    for phase in (0.0, 0.25, 0.5, 0.75):
        lines = [begin + pitch * (phase + n) - slope * face for n in numbers]
        s = np.concatenate(lines)
        s[~((s >= begin) & (s <= end))] = np.nan
        height = np.where(np.isnan(s), np.nan, np.tile(face, len(numbers)))
        key = {**run.place, "phase": Label(phase, f"phase {phase:g}")}
        yield Series(key, s, height, x_scale, y_scale)
