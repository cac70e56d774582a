"""What the meshes exert at any instants: forces, moments about the gears' axes, their means and extremes.

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
from wearlab.dynamics.steady.response import Response, acceleration, forces_at, place_of
from wearlab.gears.gear import GearPair
from wearlab.mesh import excitation, force, gear_set, profile, stages

Forces = force.NormalForces
Flanks = excitation.MeshFlanks


def friction_force(
    forces: Forces, flanks: Flanks, where: profile.Lookup, coefficient: float
) -> Array:
    """Return ``Σ_j Λμ N_j`` on the driving flank, positive in recess, (n_periods, n) [N].

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
    """Return the moments on both gears over their base radii, (driving, driven) (2, n_periods, n) [N].

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
    """Return how much of its share of the load each mesh of a kind carries in the mean, (n_mesh,) [1].

    Parameters
    ----------
    kind : the kind of mesh
    means : (n_mesh, (driving, driven)) mean moments of its meshes over base radius [N]

    References
    ----------
    ISO 6336-1: the mesh load factor K_γ is the largest.
    """
    own = means[:, kind.loaded]
    return own / own.mean() if own.any() else np.full(len(own), np.nan)


def mean_force_residual(
    kinds: Sequence[gear_set.PairOfSet],
    loads: Sequence[float],
    means: Sequence[Array],
    rubs: bool,
) -> float:
    """Return the mean normal force over the static one, minus one: the largest of the kinds of mesh [1].

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
    of_kind = [each.mean(axis=0) for each in means]
    loaded = kinds[0].loaded
    compared = [
        (float(mean.mean()), load) for mean, load in zip(of_kind, loads, strict=True)
    ]
    if rubs:
        compared = [(of_kind[0][loaded], loads[0])]
        if len(kinds) > 1:
            compared.append((of_kind[1][1 - kinds[1].loaded], of_kind[0][1 - loaded]))
    return max(
        (mean / load - 1.0 if load > 0.0 else mean for mean, load in compared), key=abs
    )


NODES = 4
"""Nodes within a step, its ends among them."""

SAME_MEAN, MOST_HALVINGS = 1e-5, 14
"""Share of a mean modulus by which a step may differ from its halves; so many find a
jump to 1e-4 of one."""


def mesh_acceleration_at(
    response: Response,
    grid: stages.StageGrid,
    phase: Array,
    segment: Index | None = None,
) -> Array:
    """Return the relative acceleration of both bodies along each line of action, (n_kept, n_mesh, n) [m/s²].

    ``d·q̈`` with ``q̈ = M⁻¹(F − Σ d W − friction − C q̇ − K q)``: all forces at that
    instant, nothing is differentiated. It is the acceleration of the mesh deflection δ,
    less that of a prescribed error.

    Parameters
    ----------
    response : the response
    grid : the steps it was computed on
    phase : (n,) [1]
    segment : (n,) the smooth segment each phase belongs to, which decides at breaks
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
    """Return phases within and at both ends of all steps, their segments, and weights of a mean over them.

    Lobatto's rule, of order ``2 nodes − 2`` on each smooth segment: (nodes · n_steps,)
    each. A wave that turns by θ within a step takes some θ/2 nodes beside the first
    few.
    """
    place, share = lobatto(nodes)
    phase = grid.start[:, None] + grid.width[:, None] * place
    weight = grid.width[:, None] * share
    return phase.ravel(), np.repeat(grid.segment, nodes), weight.ravel() / weight.sum()


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
        each = values(steps)
        return np.asarray(
            each.reshape(*each.shape[:-1], -1, NODES) @ lobatto(NODES)[1] * steps.width
        )

    whole = integrals(grid)
    mean = whole.sum(axis=-1)
    bound = SAME_MEAN * np.abs(whole).sum(axis=-1)[..., None]
    for _ in range(MOST_HALVINGS):
        halves = grid.halved()
        parts = integrals(halves)
        change = parts[..., ::2] + parts[..., 1::2] - whole
        mean = mean + change.sum(axis=-1)
        again = np.repeat(
            (np.abs(change) > bound).reshape(-1, len(grid.start)).any(axis=0), 2
        )
        if not again.any():
            break
        grid = stages.StageGrid(*(column[again] for column in halves))
        whole = parts[..., again]
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


FRACTIONS = np.linspace(0.0, 1.0, 9)
"""Where within each step is looked first."""
CLOSELY = np.linspace(-FRACTIONS[1], FRACTIONS[1], 33)
"""Where about the look that comes nearest to an extreme in a step."""
NEAREST = 6
"""Steps of every mesh, of all periods, that are looked into closely for its largest and
smallest force."""
AT_ONCE = 200_000
"""Values of a force that are held at once."""


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


_read: WeakKeyDictionary[Response, Extremes] = WeakKeyDictionary()
"""What was read off responses that still are: estimates, doubts and the dataset ask for
the same."""


def extremes(response: Response) -> Extremes:
    """Return the extreme forces of every mesh over the period, or over the kept periods, of a response."""
    if response in _read:
        return _read[response]
    meshes = len(response.system.direction)
    steps = len(response.tables.width)
    block = max(1, AT_ONCE // (len(FRACTIONS) * steps * meshes))
    kept = len(response.state)
    blocks = [
        _of_periods(response, slice(at, min(at + block, kept)))
        for at in range(0, kept, block)
    ]
    share = [min(block, kept - at) / kept for at in range(0, kept, block)]
    least, largest, normal, separated = (
        np.array(values) for values in zip(*blocks, strict=True)
    )
    whole = Extremes(
        least.min(axis=0), largest.max(axis=0), normal.max(axis=0), share @ separated
    )
    return _read.setdefault(response, whole)


def _of_periods(response: Response, kept: slice) -> Extremes:
    forces = forces_within(response, FRACTIONS, kept)
    width = response.tables.width
    ends = []
    for name in ("elastic", "normal"):
        signal = getattr(forces, name)
        looks = [signal]
        for turn, step, fraction in nearest(signal):
            own = slice(kept.start + turn, kept.start + turn + 1)
            looks.append(getattr(forces_at(response, step, fraction, own), name))
        every = np.concatenate([look.reshape(-1, signal.shape[-1]) for look in looks])
        ends.append((every.min(axis=0), every.max(axis=0)))
    return Extremes(
        *ends[0],
        ends[1][1],
        width @ _positive_share(-forces.reserve).mean(axis=0) / width.sum(),
    )


def forces_within(response: Response, x: Array, kept: slice = slice(None)) -> Forces:
    """Return the forces of all meshes at fractions x (n_fractions,) of every step, (…, n_steps, …)."""
    steps = len(response.tables.width)
    forces = forces_at(
        response, np.tile(np.arange(steps), len(x)), np.repeat(x, steps), kept
    )
    return Forces(*(f.reshape(len(f), len(x), steps, *f.shape[2:]) for f in forces))


def nearest(elastic: Array) -> Iterator[tuple[int, Index, Array]]:
    """Yield periods, and steps and fractions in them about where an extreme of any mesh comes nearest.

    Parameters
    ----------
    elastic : (n_periods, n_fractions, n_steps, n_mesh) forces [N]
    """
    periods, _, steps, meshes = elastic.shape
    nearest = min(NEAREST, periods * steps)
    places = []
    for signed in (elastic, -elastic):
        look = signed.argmin(axis=1).reshape(-1, meshes)
        near = np.argpartition(
            signed.min(axis=1).reshape(-1, meshes), nearest - 1, axis=0
        )[:nearest]
        places.append(near * len(FRACTIONS) + np.take_along_axis(look, near, axis=0))
    turn, place = np.divmod(np.unique(places), steps * len(FRACTIONS))
    for own in np.unique(turn):
        step, look = np.divmod(place[turn == own], len(FRACTIONS))
        about = np.clip(FRACTIONS[look, None] + CLOSELY, 0.0, 1.0)
        yield int(own), np.repeat(step, len(CLOSELY)), about.ravel()


def _positive_share(values: Array) -> Array:
    """Return the share of each step in which a signal is positive, straight between its values."""
    low = values[:, :-1]
    high = values[:, 1:]
    lesser = np.minimum(low, high)
    larger = np.maximum(low, high)
    with np.errstate(invalid="ignore", divide="ignore"):
        crossed = larger / (larger - lesser)
    return np.asarray(
        np.where(lesser >= 0.0, 1.0, np.where(larger <= 0.0, 0.0, crossed)).mean(axis=1)
    )
