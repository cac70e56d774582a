"""The phases at which an integrator asks for the mesh, and the tables that answer.

Steps never straddle a phase where a pair enters or leaves: each smooth segment of the mesh period is cut
into equal steps of its own, and every step holds its three stage values (start, middle, end). Both sides of
a jump are therefore present, and a fourth-order method stays of fourth order.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index

NO_PAIRS, NO_FACTORS = np.empty((0, 0, 0, 0)), np.empty((0, 3))


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


class StageTables(NamedTuple):
    """Everything periodic in the mesh, tabulated at the stages; the integrator evaluates nothing else.

    Per mesh: elastic force ``W = Σ_p k_p max(0, δ − g_p) − Σ_p k_p max(0, −j_bn − δ)`` with
    ``δ = d·q − e``. A mesh-level law (Fourier series, constant mesh stiffness) is one "pair".

    Parameters
    ----------
    width : (n_steps,) step lengths in phase [1]
    stiffness : (n_steps, 3, n_mesh, n_pairs) pair stiffness, 0 where the pair is out of the path [N/m]
    gap : (n_steps, 3, n_mesh, n_pairs) gap of the drive flanks [m]
    error : (n_steps, 3, n_mesh) prescribed mesh error e [m]
    error_rate : (n_steps, 3, n_mesh) de/dphase [m]
    fluctuation : (n_steps, 3) factor on the system's fluctuating load [1], or None
    sliding : (n_steps, 3, n_mesh, n_pairs) Λμ of each pair's drive flank: coefficient of friction times the
        sign of sliding, 0 out of the path [1]; None: no friction. It jumps at the pitch point, a break
    moment : (n_steps, 3, n_mesh, n_pairs) Λμ times the path position s of each pair [m]; None: no friction

    Where pairs share a gear body, the springs are those of :func:`wearlab.mesh.sharing.equivalent_springs`:
    Λμ and Λμ s are then what the spring hands to the pairs, weighted by their parts of its stiffness.
    """

    width: Array
    stiffness: Array
    gap: Array
    error: Array
    error_rate: Array
    fluctuation: Array | None
    sliding: Array | None = None
    moment: Array | None = None

    @property
    def mean_stiffness(self) -> Array:
        """Mean stiffness of every mesh with all its pairs in contact, (n_mesh,) [N/m]."""
        weight = (self.width[:, None] * np.array([1.0, 4.0, 1.0]) / 6.0).ravel()
        total = weight @ self.stiffness.reshape(len(weight), -1)
        return np.asarray(total.reshape(self.stiffness.shape[2:]).sum(axis=1) / self.width.sum())

    def section(self, sections: int) -> "StageTables":
        """Return the tables of the first of so many equal sections of the mesh period."""
        steps = len(self.width) // sections
        if sections == 1:
            return self
        given = {name: table[:steps] for name, table in self._asdict().items() if table is not None}
        return self._replace(**given)

    @property
    def filled(self) -> "StageTables":
        """The tables with empty ones for those that are absent: kernels compile once for both."""
        width, stiffness, gap, error, error_rate, factor, sliding, moment = self
        return StageTables(  # not by _replace, which takes as long as ten steps of a pair
            width,
            stiffness,
            gap,
            error,
            error_rate,
            NO_FACTORS if factor is None else factor,
            NO_PAIRS if sliding is None else sliding,
            NO_PAIRS if moment is None else moment,
        )

    @property
    def with_factors(self) -> "StageTables":
        """The tables with an empty one for factors that are absent, and none for friction that is."""
        width, stiffness, gap, error, error_rate, factor, sliding, moment = self
        factor = NO_FACTORS if factor is None else factor
        return StageTables(width, stiffness, gap, error, error_rate, factor, sliding, moment)


def stage_grid(breaks: Array, steps: int, multiple: int = 2) -> StageGrid:
    """Cut one mesh period into about ``steps`` steps that land on every break.

    Parameters
    ----------
    breaks : (n,) ascending phases in [0, 1) at which something jumps or kinks; 0 is added when missing [1]
    steps : the number of steps wanted; every segment gets its share, in proportion to its length
    multiple : the steps of a segment are a multiple of it

    Returns
    -------
    StageGrid with at least ``steps`` steps.
    """
    edges = np.unique(np.concatenate([[0.0], np.asarray(breaks, float), [1.0]]))
    starts, widths, segments = [], [], []
    for index, (low, high) in enumerate(pairwise(edges)):
        count = multiple * max(1, int(np.ceil(steps * (high - low) / multiple - 1e-9)))
        width = (high - low) / count
        starts.append(low + width * np.arange(count))
        widths.append(np.full(count, width))
        segments.append(np.full(count, index))
    return StageGrid(np.concatenate(starts), np.concatenate(widths), np.concatenate(segments))


def halved(tables: StageTables) -> StageTables:
    """Return the tables on steps half as long, from the parabola through the three stages of each."""
    to = np.array(
        [[1.0, 0.0, 0.0], [0.375, 0.75, -0.125], [0.0, 1.0, 0.0], [-0.125, 0.75, 0.375], [0.0, 0.0, 1.0]]
    )

    def finer(table: Array) -> Array:
        five = to @ table.reshape(len(table), 3, -1)
        both = np.stack([five[:, :3], five[:, 2:]], axis=1)
        return both.reshape(2 * len(table), 3, *table.shape[2:])

    values = {
        name: finer(table)
        for name, table in tables._asdict().items()
        if table is not None and name != "width"
    }
    return tables._replace(width=np.repeat(0.5 * tables.width, 2), **values)
