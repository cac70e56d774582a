"""Planets that differ: each with its own flanks, share of the load and wear.

Every mesh of such a set is a kind of its own, so that each planet's flanks are among
the depths that a life integrates. The flanks of sun and ring meet all planets in turn
and wear by the mean over them; each of these kinds holds the same copy of them.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.life.coupled import KindState
from wearlab.mesh import contact
from wearlab.mesh.excitation import MeshFlanks

SETTLED = 1e-10
"""Change of the forces of the meshes, over their mean, at which they are in balance."""
MAX_ROUNDS = 60
"""Rounds of the tangents of the meshes after which the last forces stand."""

Place = tuple[int, int]
"""Kind of mesh and gear (0 driving, 1 driven) of a flank."""


class StaticBalance(NamedTuple):
    """The set at rest under its load: members on their supports, pushed by meshes.

    ``K q + Σ d_i W_i = F`` and ``d_i·q − e_i = δ_i(W_i)``, δ_i the deflection of mesh i
    under a constant force, averaged over a mesh period.

    Parameters
    ----------
    stiffness : (n, n) K of supports and bearings [N/m]
    direction : (n_mesh, n) d, by how much a coordinate deflects a mesh [1]
    load : (n,) F [N]
    held : (n,) a coordinate that an unknown load holds, None: none is [1]
    errors : (n_angles, n_mesh) errors of the meshes at the angles of the members, one
        row where none turns [m]
    """

    stiffness: Array
    direction: Array
    load: Array
    held: Array | None
    errors: Array

    def forces(self, flanks: Sequence[MeshFlanks]) -> Array:
        """Return the force of every mesh at every angle, (n_angles, n_mesh) [N].

        Parameters
        ----------
        flanks : of every mesh in this wear state
        """
        nominal = np.array([of_mesh.analysis.load for of_mesh in flanks])
        if not nominal.any():
            return np.zeros_like(self.errors)
        rows = []
        force = nominal
        for error in self.errors:
            force = self._balanced(flanks, error, force)
            rows.append(force)
        return np.array(rows)

    def _balanced(
        self, flanks: Sequence[MeshFlanks], error: Array, force: Array
    ) -> Array:
        """Return the forces (n_mesh,) in balance at one angle, by Newton's method.

        Parameters
        ----------
        flanks : of every mesh
        error : (n_mesh,) of the meshes [m]
        force : (n_mesh,) to begin with [N]
        """
        mean = float(np.abs(force).mean())
        for _ in range(MAX_ROUNDS):
            before = force
            springs = [
                _mean_spring(of_mesh, load)
                for of_mesh, load in zip(flanks, force, strict=True)
            ]
            compliance, unloaded = np.array(springs).T
            force = self._of_springs(compliance, unloaded + error)
            if np.abs(force - before).max() <= SETTLED * mean:
                break
        return force

    def _of_springs(self, compliance: Array, gap: Array) -> Array:
        """Return the forces of springs that push alone, ``c W = d·q − g``, (n_mesh,).

        Parameters
        ----------
        compliance : (n_mesh,) c [m/N]
        gap : (n_mesh,) g, at which they begin to push [m]
        """
        touching = np.ones(len(gap), bool)
        force = np.zeros(len(gap))
        for _ in range(2 * len(gap)):
            position, force = self._solved(compliance, gap, touching)
            approach = self.direction @ position - gap
            still_touching = np.where(touching, force > 0.0, approach > 0.0)
            if (still_touching == touching).all() or not still_touching.any():
                break
            touching = still_touching
        return np.maximum(0.0, force)

    def _solved(
        self, compliance: Array, gap: Array, touching: Array
    ) -> tuple[Array, Array]:
        """Return coordinates (n,) [m] and forces (n_mesh,) [N] of springs that touch.

        Forces are counted in a spring's own size, so that all equations are in metres.
        """
        size = 1.0 / compliance.mean()
        coordinates = len(self.load)
        direction = self.direction[touching]
        softness = np.diag(-size * compliance[touching])
        count = coordinates + len(direction)

        equations = np.zeros((count, count))
        equations[:coordinates, :coordinates] = self.stiffness / size
        equations[:coordinates, coordinates:] = direction.T
        equations[coordinates:, :coordinates] = direction
        equations[coordinates:, coordinates:] = softness
        known = np.concatenate([self.load / size, gap[touching]])
        if self.held is not None:
            border = np.concatenate([self.held, np.zeros(len(direction))])
            equations = np.block(
                [[equations, border[:, None]], [border[None], np.zeros((1, 1))]]
            )
            known = np.append(known, 0.0)

        solution, *_ = np.linalg.lstsq(equations, known, rcond=None)
        force = np.zeros(len(gap))
        force[touching] = size * solution[coordinates:count]
        return solution[:coordinates], force


def _mean_spring(flanks: MeshFlanks, load: float) -> tuple[float, float]:
    """Return compliance and gap of a mesh under a load: ``δ = g + c W`` on the average.

    Parameters
    ----------
    flanks : of the mesh
    load : W [N]
    """
    analysis = flanks.analysis
    where = analysis.at_nodes
    _, weight = analysis.grid.phase_nodes
    state = analysis.quasistatic(flanks.nodes, where, np.full(len(weight), load))
    compliance = float(weight @ (1.0 / state.tangent))
    deflection = float(weight @ state.deflection)
    return compliance, deflection - compliance * load


class PlanetsApart(NamedTuple):
    """What the kinds of mesh of planets that differ have to do with one another.

    Parameters
    ----------
    met_by_all : places of the flanks of sun and ring, each in all the kinds that it
        meets
    balance : by which the planets share a static load
    """

    met_by_all: tuple[tuple[Place, ...], ...]
    balance: StaticBalance

    def worn_together(self, states: Sequence[KindState]) -> list[KindState]:
        """Return the kinds of mesh, sun and ring worn by the mean over their mates.

        Parameters
        ----------
        states : of every kind of mesh, each with the rate of its own meshes
        """
        rates = [None if one.rate is None else one.rate.copy() for one in states]
        for places in self.met_by_all:
            of_mates = []
            for kind, gear in places:
                rate = rates[kind]
                if rate is None:
                    return list(states)
                of_mates.append(rate[gear])
            mean = np.mean(of_mates, axis=0)
            for kind, gear in places:
                rate = rates[kind]
                assert rate is not None
                rate[gear] = mean
        return [
            state._replace(rate=rate) for state, rate in zip(states, rates, strict=True)
        ]

    def static(
        self, flanks: Sequence[MeshFlanks], states: Sequence[contact.Quasistatic]
    ) -> list[contact.Quasistatic]:
        """Return the sharing of the static load, its forces those that planets share.

        They are averaged over the angles of the members.

        Parameters
        ----------
        flanks : of every mesh
        states : under the mean load of all
        """
        forces = self.balance.forces(flanks)
        shared = []
        for mesh, (of_mesh, state) in enumerate(zip(flanks, states, strict=True)):
            analysis = of_mesh.analysis
            at_angles = [
                analysis.quasistatic(
                    of_mesh.nodes,
                    analysis.at_nodes,
                    np.full(len(state.deflection), load),
                ).force
                for load in forces[:, mesh]
            ]
            shared.append(state._replace(force=np.mean(at_angles, axis=0)))
        return shared
