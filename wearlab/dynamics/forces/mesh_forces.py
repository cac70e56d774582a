"""Forces of the meshes, moments about the gears' axes, their means and extremes.

Forces come from the contact itself, by the deflections that a response has there, and
not from the tables that its solver used: their means against the load that was given
tell how well it closes.

Extremes are read from the steps, not from samples. A force that pairs enter and leave
is largest at a jump as often as not. Jumps of every mesh, lagging ones too, lie between
two steps, and both sides of each are among what is looked at. Within a step the force
is smooth; the few steps that come nearest to an extreme are looked into closely about
where they do.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.polynomial import Legendre

from wearlab.arrays import Array, Index
from wearlab.dynamics.steady.response import (
    Response,
    acceleration,
    dashpot_of,
    forces_at,
    motion_at,
    place_of,
)
from wearlab.gears.gear import GearPair
from wearlab.mesh import excitation, force, gear_set, profile, stages

NODES = 4
"""Nodes within a step, its ends among them."""
HALVES_AGREE = 1e-5
"""Share of a mean modulus by which a step may differ from its halves."""
MAX_HALVINGS = 14
"""So many find a jump to 1e-4 of a step."""
FRACTIONS = np.linspace(0.0, 1.0, 9)
"""Where within each step is looked first."""
CLOSELY = np.linspace(-FRACTIONS[1], FRACTIONS[1], 33)
"""Where about the look that comes nearest to an extreme in a step."""
NEAREST = 6
"""Steps of every mesh, of all periods, that are looked into closely for its largest and
smallest force."""
AT_ONCE = 200_000
"""Values of a force that are held at once."""

Forces = force.NormalForces
Flanks = excitation.MeshFlanks


def friction_force(
    forces: Forces, flanks: Flanks, where: profile.Lookup, coefficient: float
) -> Array:
    """Return ``Σ_j Λμ N_j`` on the driving flank, (n_periods, n) [N].

    It is positive in recess.

    Parameters
    ----------
    forces, flanks, where : the mesh's forces, its flanks, the instants
    coefficient : μ [1]

    References
    ----------
    B23, rederived: friction with the sign of the sliding, at the arms ``ρ``.
    """
    sense = flanks.analysis.grid.sliding_sense[where.segment]
    return np.asarray(coefficient * (sense * forces.pair_normal).sum(axis=-1))


def moments(
    forces: Forces,
    flanks: Flanks,
    pair: GearPair,
    where: profile.Lookup,
    coefficient: float | None,
) -> Array:
    """Return the moments on both gears over their base radii, (2, n_periods, n) [N].

    The driving gear comes first.
    ``Σ_j N_j (1 + Λμ ρ_j/r_b)``, with the back flank: friction adds to the moment of a
    driving gear in recess, where its arm is ρ = r_b tan α_w + s.

    Parameters
    ----------
    forces, flanks, where : the mesh's forces, its flanks, the instants
    pair : the gears
    coefficient : μ, None without friction [1]

    References
    ----------
    B23, rederived: friction with the sign of the sliding, at the arms ``ρ``.
    """
    plain = forces.normal
    if coefficient is None:
        return np.stack([plain, plain])
    grid = flanks.analysis.grid
    s = profile.interpolate(grid, where, grid.contact_position, 0.0)
    rubs = coefficient * grid.sliding_sense[where.segment]
    arms = zip(pair.curvature(s.ravel()), pair.gears, strict=True)
    shares = [rubs * arm.reshape(s.shape) / gear.base_radius for arm, gear in arms]
    return np.stack(
        [plain + (forces.pair_normal * share).sum(axis=-1) for share in shares]
    )


def load_factors(kind: gear_set.PairOfSet, means: Array) -> Array:
    """Return the mean moment of each mesh over that of its kind, (n_mesh,) [1].

    Parameters
    ----------
    kind : the kind of mesh
    means : (n_mesh, (driving, driven)) mean moments of its meshes over base radius [N]

    References
    ----------
    ISO 6336-1: the mesh load factor K_γ is the largest.
    """
    loaded = means[:, kind.loaded]
    if not loaded.any():
        return np.full(len(loaded), np.nan)
    return loaded / loaded.mean()


def mean_force_residual(
    kinds: Sequence[gear_set.PairOfSet],
    loads: Sequence[float],
    means: Sequence[Array],
    rubs: bool,
) -> float:
    """Return the mean normal force over the static one, minus one [1].

    It is the largest of the kinds of mesh.
    Meshes of one kind share the load among them, so their mean is what the load
    decides. With friction the moments on the gear whose torque is given count, and on a
    planet those of its two meshes.

    Parameters
    ----------
    kinds : the kinds of mesh
    loads : static force of one mesh of each [N]
    means : of each, (n_mesh, (driving, driven)) mean moments over base radius [N]
    rubs : whether there is friction
    """
    of_kind = [moments.mean(axis=0) for moments in means]
    loaded = kinds[0].loaded
    mean_forces = [float(moments.mean()) for moments in of_kind]
    compared = list(zip(mean_forces, loads, strict=True))
    if rubs:
        compared = [(of_kind[0][loaded], loads[0])]
        if len(kinds) > 1:
            compared.append((of_kind[1][1 - kinds[1].loaded], of_kind[0][1 - loaded]))
    residuals = []
    for mean, load in compared:
        residuals.append(mean / load - 1.0 if load > 0.0 else mean)
    return max(residuals, key=abs)


def mesh_acceleration_at(
    response: Response,
    grid: stages.StageGrid,
    phase: Array,
    segment: Index | None = None,
) -> Array:
    """Return the relative acceleration of both bodies along each line of action.

    ``d·q̈`` with ``q̈ = M⁻¹(F − Σ d W − friction − C q̇ − K q)``: all forces at that
    instant, nothing is differentiated. It is the acceleration of the mesh deflection δ,
    less that of a prescribed error.

    Parameters
    ----------
    response : the response
    grid : the steps it was computed on
    phase : (n,) [1]
    segment : (n,) the smooth segment each phase belongs to, which decides at breaks

    Returns
    -------
    (n_kept, n_mesh, n) [m/s²]
    """
    place = place_of(grid, phase, segment)
    forces = forces_at(response, *place)
    motion = response.motion.at(*place)
    a = acceleration(
        response, *motion, forces, lambda table: stages.parabola(table, *place)
    )
    return np.ascontiguousarray((a @ response.system.direction.T).transpose(0, 2, 1))


def within_steps(
    grid: stages.StageGrid, nodes: int = NODES
) -> tuple[Array, Index, Array]:
    """Return phases in all steps, their segments, and weights of a mean over them.

    Lobatto's rule, of order ``2 nodes − 2`` on each smooth segment: (nodes · n_steps,)
    each. A wave that turns by θ within a step takes some θ/2 nodes beside the first
    few.

    Parameters
    ----------
    grid : the steps
    nodes : phases of a step, both ends among them
    """
    place, share = lobatto(nodes)
    phase = grid.start[:, None] + grid.width[:, None] * place
    weight = grid.width[:, None] * share
    segment = np.repeat(grid.segment, nodes)
    return phase.ravel(), segment, weight.ravel() / weight.sum()


def mean_over_period(
    grid: stages.StageGrid, values: Callable[[stages.StageGrid], Array]
) -> Array:
    """Return the mean over a mesh period of values that may jump within steps, (...,).

    Steps whose halves, by Lobatto's rule, do not add up to them are halved again.

    Parameters
    ----------
    grid : the steps of the period
    values : of the (n,) phases that :func:`within_steps` finds in given steps, (..., n)

    References
    ----------
    Davis & Rabinowitz, Methods of Numerical Integration, 2nd ed. 1984, 6.2, adaptive by
    halves.
    """

    def integrals(steps: stages.StageGrid) -> Array:
        samples = values(steps)
        by_step = samples.reshape(*samples.shape[:-1], -1, NODES)
        weights = lobatto(NODES)[1]
        return np.asarray(by_step @ weights * steps.width)

    whole = integrals(grid)
    mean = whole.sum(axis=-1)
    bound = HALVES_AGREE * np.abs(whole).sum(axis=-1)[..., None]
    for _ in range(MAX_HALVINGS):
        halves = grid.halved()
        parts = integrals(halves)
        change = parts[..., ::2] + parts[..., 1::2] - whole
        mean = mean + change.sum(axis=-1)
        differs = np.abs(change) > bound
        differing_steps = differs.reshape(-1, len(grid.start)).any(axis=0)
        rough = np.repeat(differing_steps, 2)
        if not rough.any():
            break
        grid = stages.StageGrid(*(column[rough] for column in halves))
        whole = parts[..., rough]
    return mean


@cache
def lobatto(nodes: int) -> tuple[Array, Array]:
    """Return the nodes of Lobatto's rule on [0, 1] and their weights, (nodes,) each.

    Ends, and between them the extremes of the Legendre polynomial P of degree ``n −
    1``; weights ``1/(n (n − 1) P²)``.

    References
    ----------
    Abramowitz & Stegun, Handbook of Mathematical Functions, 1964, 25.4.32.
    """
    polynomial = Legendre.basis(nodes - 1)
    place = np.concatenate([[-1.0], np.sort(polynomial.deriv().roots().real), [1.0]])
    return 0.5 + 0.5 * place, 1.0 / (nodes * (nodes - 1) * polynomial(place) ** 2)


class Extremes(NamedTuple):
    """What is read off the mesh forces of a response, (n_mesh,) each.

    Parameters
    ----------
    least, largest : elastic mesh force [N]
    largest_normal : largest normal mesh force [N]
    separated : fraction of time in which no drive flank pushes [1]
    """

    least: Array
    largest: Array
    largest_normal: Array
    separated: Array


_extremes: WeakKeyDictionary[Response, Extremes] = WeakKeyDictionary()
"""Extremes of responses that still are: estimates, doubts and the dataset ask for the
same."""


def extremes(response: Response) -> Extremes:
    """Return the extreme forces of every mesh over all periods of a response."""
    if response in _extremes:
        return _extremes[response]
    steps = len(response.tables.width)
    meshes = len(response.system.direction)
    block = max(1, AT_ONCE // (len(FRACTIONS) * steps * meshes))
    count = len(response.state)
    starts = range(0, count, block)
    periods = [slice(first, min(first + block, count)) for first in starts]
    share = [(part.stop - part.start) / count for part in periods]
    blocks = [_of_periods(response, part) for part in periods]
    whole = Extremes(
        least=np.min([part.least for part in blocks], axis=0),
        largest=np.max([part.largest for part in blocks], axis=0),
        largest_normal=np.max([part.largest_normal for part in blocks], axis=0),
        separated=share @ np.array([part.separated for part in blocks]),
    )
    return _extremes.setdefault(response, whole)


def _of_periods(response: Response, periods: slice) -> Extremes:
    """Return the extreme forces of every mesh over some periods of a response."""
    forces = forces_within(response, FRACTIONS, periods)
    width = response.tables.width
    elastic = _with_close_looks(response, forces, "elastic", periods)
    normal = _with_close_looks(response, forces, "normal", periods)
    separated_in_steps = _positive_share(-forces.reserve).mean(axis=0)
    return Extremes(
        least=elastic.min(axis=0),
        largest=elastic.max(axis=0),
        largest_normal=normal.max(axis=0),
        separated=width @ separated_in_steps / width.sum(),
    )


def _with_close_looks(
    response: Response, forces: Forces, name: str, periods: slice
) -> Array:
    """Return a force at its samples and closely about its extremes, (…, n_mesh) [N]."""
    signal = getattr(forces, name)
    looks = [signal]
    for period, step, fraction in nearest(signal):
        first = periods.start + period
        part = slice(first, first + 1)
        closer = forces_at(response, step, fraction, part)
        looks.append(getattr(closer, name))
    meshes = signal.shape[-1]
    return np.concatenate([look.reshape(-1, meshes) for look in looks])


def forces_within(response: Response, x: Array, periods: slice = slice(None)) -> Forces:
    """Return the forces of all meshes within every step, (n_periods, n, n_steps, …).

    Parameters
    ----------
    response : the response
    x : (n,) fractions of a step, their middle one 0.5 [1]
    periods : which of them
    """
    steps = len(response.tables.width)
    step = np.repeat(np.arange(steps), len(x))
    motion = motion_at(response, step, np.tile(x, steps), periods)

    def by_step(values: Array) -> Array:
        return values.reshape(len(values), steps, len(x), -1)

    springs = response.within.springs_within(x).per(response.mesh_period)
    motion_by_step = force.Deflections(*map(by_step, motion))
    dashpot = dashpot_of(response.system)
    forces = force.normal_forces(springs, motion_by_step, dashpot)
    return Forces(*(values.swapaxes(1, 2) for values in forces))


def nearest(elastic: Array) -> Iterator[tuple[int, Index, Array]]:
    """Yield periods, and steps and fractions about where an extreme comes nearest.

    Parameters
    ----------
    elastic : (n_periods, n_fractions, n_steps, n_mesh) forces [N]
    """
    periods, _, steps, meshes = elastic.shape
    count = min(NEAREST, periods * steps)
    places = []
    for signed in (elastic, -elastic):
        look = signed.argmin(axis=1).reshape(-1, meshes)
        least = signed.min(axis=1).reshape(-1, meshes)
        near = np.argpartition(least, count - 1, axis=0)[:count]
        look_of_near = np.take_along_axis(look, near, axis=0)
        places.append(near * len(FRACTIONS) + look_of_near)

    period_of, place = np.divmod(np.unique(places), steps * len(FRACTIONS))
    for period in np.unique(period_of):
        step, look = np.divmod(place[period_of == period], len(FRACTIONS))
        about = np.clip(FRACTIONS[look, None] + CLOSELY, 0.0, 1.0)
        yield int(period), np.repeat(step, len(CLOSELY)), about.ravel()


def _positive_share(values: Array) -> Array:
    """Return the share of each step in which a signal is positive.

    The signal is straight between its values.
    """
    low = values[:, :-1]
    high = values[:, 1:]
    lesser = np.minimum(low, high)
    larger = np.maximum(low, high)
    with np.errstate(invalid="ignore", divide="ignore"):
        crossed = larger / (larger - lesser)
    share = np.where(larger <= 0.0, 0.0, crossed)
    return np.asarray(np.where(lesser >= 0.0, 1.0, share).mean(axis=1))
