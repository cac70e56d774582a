"""The mesh between the stages of its tables, from what the tables were taken of.

Three stages of a step say as much as a parabola through them: enough for steps that are short beside every
ramp of a stiffness and every wave of an error, too little for the few long ones of a high-order method.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.mesh.clock import Sampling, look_within
from wearlab.mesh.excitation import MeshFlanks
from wearlab.mesh.stages import Springs
from wearlab.mesh.tabulation import of_meshes, share_a_body


@dataclass(frozen=True)
class Between:
    """The meshes of one wear state anywhere within the steps of an integration.

    Parameters
    ----------
    kinds : the flanks of each kind of mesh
    sampling : the steps, and where they look
    slow : (n_mesh,) errors held over the mesh period, beside the periodic ones [m]; None: none
    """

    kinds: Sequence[MeshFlanks]
    sampling: Sampling
    slow: Array | None = None

    def errors(self, step: Index, fraction: Array) -> tuple[Array, Array]:
        """Return prescribed errors and their rates by phase at fractions of steps, both (n, n_mesh) [m]."""
        phase, meshes = self._phase(step, fraction), self.sampling.meshes
        error, rate = np.zeros((2, len(phase), len(meshes)))
        for at, mesh in enumerate(meshes):
            own, series = phase - mesh.lag, self.kinds[mesh.kind].series
            for part in (mesh.error,) if series is None else (mesh.error, series.error):
                error[:, at] += part.value(own)
                rate[:, at] += part.rate(own)
        return (error if self.slow is None else error + self.slow), rate

    def springs(self, step: Index, fraction: Array) -> Springs:
        """Return the springs of all meshes at fractions of steps, (n, n_mesh, n_pairs).

        Pairs that share a gear body have the order of engagement of the step's middle, as in the tables.
        """
        grid, meshes = self.sampling.grid, self.sampling.meshes
        phase, middle = self._phase(step, fraction), grid.start[step] + 0.5 * grid.width[step]
        ordered = any(share_a_body(flanks) for flanks in self.kinds)
        looks = np.stack([phase, middle] if ordered else [phase], axis=1)
        where = [
            look_within(
                flanks.analysis.grid,
                [mesh.lag for mesh in meshes if mesh.kind == kind],
                looks,
                middle,
            )
            for kind, flanks in enumerate(self.kinds)
        ]
        return of_meshes(self.kinds, meshes, where, looks.shape).each(lambda table: table[:, 0])

    def _phase(self, step: Index, fraction: Array) -> Array:
        grid = self.sampling.grid
        return np.asarray(grid.start[step] + fraction * grid.width[step])
