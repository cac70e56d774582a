"""At which phases an integration asks for the meshes, and what wear does not change there."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.mesh.clock import Mesh, look_within, of_kind
from wearlab.mesh.profile import Lookup, ProfileGrid, interpolate
from wearlab.mesh.stages import StageGrid
from wearlab.mesh.stiffness import PairStiffness


class Friction(NamedTuple):
    """Sliding friction of the flanks.

    Parameters
    ----------
    coefficient : μ [1]
    sense : for each kind of mesh, +1 where the model's path position is s, −1 where it is −s [1]
    """

    coefficient: float
    sense: tuple[float, ...]


class Rubbing(NamedTuple):
    """What friction needs at the stages; wear does not change it.

    Parameters
    ----------
    sliding : (n_steps, 3, n_mesh, n_pairs) Λμ, 0 out of the path [1]
    moment : (n_steps, 3, n_mesh, n_pairs) Λμ times the path position as the model counts it [m]
    """

    sliding: Array
    moment: Array


@dataclass(frozen=True)
class Sampling:
    """The stages of one integration, and the look-ups that serve them.

    Parameters
    ----------
    grid : the steps, on the clock
    edges : (n_segments + 1,) breaks of the clock between which every mesh is smooth [1]
    meshes : the meshes
    where : for each kind of mesh, look-up of the (n_steps · 3) stages, one mesh of the kind after another
    rubbing : Λμ and Λμ s of every pair at the stages, None without friction
    """

    grid: StageGrid
    edges: Array
    meshes: tuple[Mesh, ...]
    where: tuple[Lookup, ...]
    rubbing: Rubbing | None = None
    _given: dict[int, tuple[PairStiffness, Array]] = field(default_factory=dict, repr=False, compare=False)

    def given(self, kind: int, stiffness: PairStiffness) -> Array:
        """Return the pair stiffnesses of a kind that wear does not change, (n_looked, n_pairs), or (0, 0)."""
        known = self._given.get(kind)
        if known is None or known[0] is not stiffness:
            springs = stiffness.at_phases(self.where[kind])
            known = stiffness, np.empty((0, 0)) if springs is None else springs
            self._given[kind] = known
        return known[1]

    @cached_property
    def errors(self) -> tuple[Array, Array]:
        """Prescribed errors of all meshes and their rates at the stages, (n_steps, 3, n_mesh) each [m]."""
        phases = [self.grid.phase - mesh.lag for mesh in self.meshes]
        values = [mesh.error.value(phase) for mesh, phase in zip(self.meshes, phases, strict=True)]
        rates = [mesh.error.rate(phase) for mesh, phase in zip(self.meshes, phases, strict=True)]
        return np.stack(values, axis=-1), np.stack(rates, axis=-1)


def sampling(
    grids: Sequence[ProfileGrid],
    meshes: tuple[Mesh, ...],
    edges: Array,
    grid: StageGrid,
    friction: Friction | None = None,
) -> Sampling:
    """Prepare the look-ups of an integrator's stages among the profile nodes of every kind of mesh."""
    middle = grid.start + 0.5 * grid.width
    where = tuple(
        look_within(nodes, [mesh.lag for mesh in meshes if mesh.kind == kind], grid.phase, middle)
        for kind, nodes in enumerate(grids)
    )
    rubbing = None if friction is None else _rubbing(grids, meshes, where, len(grid.width), friction)
    return Sampling(grid, edges, meshes, where, rubbing)


def _rubbing(
    grids: Sequence[ProfileGrid],
    meshes: tuple[Mesh, ...],
    where: tuple[Lookup, ...],
    steps: int,
    friction: Friction,
) -> Rubbing:
    """Return Λμ and Λμ s of every pair; sliding turns at the pitch point, where steps end."""
    pairs = max(nodes.n_pairs for nodes in grids)
    sliding, moment = np.zeros((2, steps, 3, len(meshes), pairs))
    for kind, (nodes, at) in enumerate(zip(grids, where, strict=True)):
        position = np.empty((len(at.phase), nodes.n_pairs))
        interpolate(nodes.first, at, nodes.touching, np.nan, position)
        s = position.reshape(-1, steps, 3, nodes.n_pairs).transpose(1, 2, 0, 3)
        own = of_kind(meshes, kind)
        sign = np.broadcast_to(np.sign(s[:, 1:2]), s.shape)
        rubs = friction.coefficient * np.nan_to_num(sign)
        sliding[:, :, own, : nodes.n_pairs] = rubs
        moment[:, :, own, : nodes.n_pairs] = rubs * friction.sense[kind] * np.nan_to_num(s)
    return Rubbing(sliding, moment)
