"""The phases at which an integrator asks for the mesh, and the tables that answer.

Steps never straddle a phase where a pair enters or leaves: each smooth segment of the
mesh period is cut into equal steps of its own, and every step holds its three stage
values (start, middle, end). Both sides of a jump are therefore present, and a
fourth-order method stays of fourth order.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index

NO_PAIRS = np.empty((0, 0, 0, 0))
NO_PARTS = np.empty((0, 0, 0, 0, 0))
NO_FACTORS = np.empty((0, 3))


class Springs(NamedTuple):
    """Flanks of meshes as one-sided springs at some instants (…).

    A series is one spring and one pair.

    Parameters
    ----------
    stiffness, gap : (…, n_pairs) of the springs, in their order of engagement where
        pairs share a gear body [N/m], [m]
    pair_rate : (…, n_pairs) rates of the gaps of the pairs [m], by phase; by time of
        `per`
    lead_rate : (…) rate of the least gap [m]
    part : (…, n_springs, n_pairs) what each spring hands to each pair [1]; None: each
        to its own
    """

    stiffness: Array
    gap: Array
    pair_rate: Array
    lead_rate: Array
    part: Array | None

    def each(self, change: Callable[[Array], Array]) -> "Springs":
        """Return them with every table changed alike."""
        stiffness, gap, pair_rate, lead_rate = map(change, self[:4])
        part = None if self.part is None else change(self.part)
        return Springs(stiffness, gap, pair_rate, lead_rate, part)

    def per(self, period: float) -> "Springs":
        """Return them with rates by time, of a mesh period [s]."""
        return self._replace(
            pair_rate=self.pair_rate / period, lead_rate=self.lead_rate / period
        )


class StageGrid(NamedTuple):
    """Steps of one mesh period.

    Parameters
    ----------
    start : (n_steps,) phase at which each step begins [1]
    width : (n_steps,) length of each step in phase [1]; the widths sum to 1
    segment : (n_steps,) index of the smooth segment each step lies in
    """

    start: Array
    width: Array
    segment: Index

    @property
    def phase(self) -> Array:
        """Stage phases, start, middle and end of every step, (n_steps, 3) [1]."""
        return self.start[:, None] + self.width[:, None] * np.array([0.0, 0.5, 1.0])

    def halved(self) -> "StageGrid":
        """Return both halves of every step, one after another."""
        start = np.stack([self.start, self.start + 0.5 * self.width], axis=1).ravel()
        return StageGrid(
            start, np.repeat(0.5 * self.width, 2), np.repeat(self.segment, 2)
        )


class StageTables(NamedTuple):
    """Everything periodic in the mesh, tabulated at the stages.

    The integrator evaluates nothing else.

    Per mesh: elastic force ``W = Σ_p k_p max(0, δ − g_p) − Σ_p k_p max(0, −j_bn − δ)``
    with ``δ = d·q − e``. A mesh-level law (Fourier series, constant mesh stiffness) is
    one "pair".

    Parameters
    ----------
    width : (n_steps,) step lengths in phase [1]
    stiffness : (n_steps, 3, n_mesh, n_pairs) pair stiffness, 0 where the pair is out of
        the path [N/m]
    gap : (n_steps, 3, n_mesh, n_pairs) gap of the drive flanks [m]
    error : (n_steps, 3, n_mesh) prescribed mesh error e [m]
    error_rate : (n_steps, 3, n_mesh) de/dphase [m]
    fluctuation : (n_steps, 3) factor on the system's fluctuating load [1], or None
    sliding : (n_steps, 3, n_mesh, n_pairs) Λμ of each pair's drive flank: coefficient
        of friction times the sign of sliding, 0 out of the path [1]; None: no friction.
        It jumps at the pitch point, a break
    moment : (n_steps, 3, n_mesh, n_pairs) Λμ times the path position s of each pair
        [m]; None: no friction
    pair_rate : (n_steps, 3, n_mesh, n_pairs) rate of each pair's gap by phase [m]
    lead_rate : (n_steps, 3, n_mesh) that of the pair of the least gap [m]
    part : (n_steps, 3, n_mesh, n_springs, n_pairs) what each spring hands to each pair
        [1]; None: springs are pairs

    Where pairs share a gear body, the springs are those of
    :func:`wearlab.mesh.springs.equivalent_springs`.
    """

    width: Array
    stiffness: Array
    gap: Array
    error: Array
    error_rate: Array
    fluctuation: Array | None
    sliding: Array | None = None
    moment: Array | None = None
    pair_rate: Array = NO_PAIRS
    lead_rate: Array = NO_FACTORS
    part: Array | None = None

    @property
    def mean_stiffness(self) -> Array:
        """Mean stiffness of each mesh with all pairs in contact, (n_mesh,) [N/m]."""
        weight = (self.width[:, None] * np.array([1.0, 4.0, 1.0]) / 6.0).ravel()
        total = weight @ self.stiffness.reshape(len(weight), -1)
        of_meshes = total.reshape(self.stiffness.shape[2:]).sum(axis=1)
        return np.asarray(of_meshes / self.width.sum())

    @property
    def filled(self) -> "StageTables":
        """The tables, with empty arrays for absent ones: one type for kernels."""
        rates = self.pair_rate, self.lead_rate
        if self.pair_rate.shape != self.stiffness.shape:
            rates = np.zeros_like(self.stiffness), np.zeros_like(self.error)
        fluctuation = NO_FACTORS if self.fluctuation is None else self.fluctuation
        sliding = NO_PAIRS if self.sliding is None else self.sliding
        moment = NO_PAIRS if self.moment is None else self.moment
        part = NO_PARTS if self.part is None else self.part
        # not by _replace, which takes as long as ten steps of a pair
        return StageTables(*self[:5], fluctuation, sliding, moment, *rates, part)

    @property
    def springs(self) -> Springs:
        """The springs at all stages."""
        full = self.filled
        part = self.part if self.part is not None and len(self.part) else None
        return Springs(full.stiffness, full.gap, full.pair_rate, full.lead_rate, part)

    def errors_at(
        self, step: Index, fraction: Array, meshes: slice = slice(None)
    ) -> tuple[Array, Array]:
        """Return errors and their rates by phase within steps, (n, n_mesh) [m].

        Parameters
        ----------
        step : (n,) numbers of steps
        fraction : (n,) of the step that has passed [1]
        meshes : which of the meshes
        """
        error = parabola(self.error[..., meshes], step, fraction)
        rate = parabola(self.error_rate[..., meshes], step, fraction)
        return error, rate

    def springs_at(self, step: Index, fraction: Array) -> Springs:
        """Return the springs at places within steps, by parabolas through three stages.

        Parameters
        ----------
        step : (n,) numbers of steps
        fraction : (n,) of the step that has passed [1]
        """
        return self.springs.each(lambda table: parabola(table, step, fraction))

    def springs_within(self, fractions: Array) -> Springs:
        """Return the springs in every step, (n_steps, k, n_mesh, n_pairs), likewise.

        Parameters
        ----------
        fractions : (k,) of a step [1]
        """
        weights = parabola_weights(fractions)
        return self.springs.each(
            lambda table: np.einsum("ik,ni...->nk...", weights, table)
        )


NO_TABLES = StageTables(
    width=np.empty(0),
    stiffness=np.empty((0, 3, 0, 0)),
    gap=np.empty((0, 3, 0, 0)),
    error=np.empty((0, 3, 0)),
    error_rate=np.empty((0, 3, 0)),
    fluctuation=None,
)
"""Tables of no step."""


def parabola(table: Array, step: Index, fraction: Array) -> Array:
    """Return values within steps, by the parabola through three stages, (n, …).

    Parameters
    ----------
    table : (n_steps, 3, …) values at the stages
    step : (n,) numbers of steps
    fraction : (n,) of the step that has passed [1]
    """
    return np.einsum("in,ni...->n...", parabola_weights(fraction), table[step])


def parabola_weights(fraction: Array) -> Array:
    """Return the weights of a step's three stages in values within it, (3, n) [1].

    Parameters
    ----------
    fraction : (n,) of the step that has passed [1]
    """
    x = fraction
    y = 1.0 - fraction
    return np.array([y * (y - x), 4.0 * x * y, x * (x - y)])


def stage_grid(breaks: Array, steps: int, multiple: int = 2) -> StageGrid:
    """Cut one mesh period into about ``steps`` steps that land on every break.

    Parameters
    ----------
    breaks : (n,) ascending phases in [0, 1) at which something jumps or kinks; 0 is
        added when missing [1]
    steps : the number of steps wanted; every segment gets its share, in proportion to
        its length
    multiple : the steps of a segment are a multiple of it

    Returns
    -------
    StageGrid with at least ``steps`` steps.
    """

    def even(length: float) -> Array:
        count = multiple * max(1, int(np.ceil(steps * length / multiple - 1e-9)))
        return np.full(count, length / count)

    return _cut(breaks, even)


def graded_grid(breaks: Array, first: float, alike: float) -> StageGrid:
    """Cut one mesh period into steps that grow after every break.

    What a jump excites dies out in short steps.

    Parameters
    ----------
    breaks : as for `stage_grid`
    first : longest step after a break, in phase [1]
    alike : steps of one length, made even; as many of twice the length follow, and so
        on

    Returns
    -------
    StageGrid with some ``alike log2(1/(alike first))`` steps a segment.
    """
    alike = 2 * max(1, int(np.ceil(0.5 * alike)))

    def growing(length: float) -> Array:
        width = first
        widths: list[float] = []
        while (rest := length - sum(widths)) > alike * width:
            widths += [width] * alike
            width *= 2.0
        widths += [width] * max(2 * int(np.ceil(0.5 * rest / width)), 2)
        return np.array(widths) * (length / sum(widths))

    return _cut(breaks, growing)


def _cut(breaks: Array, lengths: Callable[[float], Array]) -> StageGrid:
    """Return the steps of all segments; ``lengths`` cuts a segment by its length."""
    edges = np.unique(np.concatenate([[0.0], np.asarray(breaks, float), [1.0]]))
    widths = [lengths(length) for length in np.diff(edges).tolist()]
    starts = [
        low + np.cumsum(width) - width
        for low, width in zip(edges[:-1], widths, strict=True)
    ]
    segment = np.repeat(np.arange(len(widths)), [len(width) for width in widths])
    return StageGrid(np.concatenate(starts), np.concatenate(widths), segment)
