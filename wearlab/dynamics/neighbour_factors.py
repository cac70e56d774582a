"""What is kept of a solved case of touching meshes, for neighbours to be found from."""

from typing import NamedTuple

import numpy as np
from scipy.linalg import eig

from wearlab.arrays import Array, Complex, Index
from wearlab.dynamics.balance import Balance
from wearlab.dynamics.collocation import SIZES, Cut, basis_of, cut_of, joined_steps
from wearlab.dynamics.collocation_inputs import Inputs, inputs_of
from wearlab.dynamics.multipliers import over_sections
from wearlab.dynamics.neighbour_kernel import answers_of_groups, over_period
from wearlab.dynamics.propagator import mean_stiffness
from wearlab.dynamics.symmetry import turned_back
from wearlab.dynamics.system import System
from wearlab.mesh.stages import StageTables

LEADING = 0.5
"""Multipliers that follow the change of the mesh, as a share of the largest."""
MOST_STAGES = 2 * SIZES[0] + 1


class Factors(NamedTuple):
    """The answers of all groups of steps to their start and to additional inputs, and the solution.

    Parameters
    ----------
    mean, shares : (n_mesh,) stiffness held by the linear part [N/m], (n_in, n_vectors) see `basis_of`
    direction : (n_mesh, n) d
    inputs, cut : the mesh at the stages, and the groups
    stages : (n_groups,) number of stages
    by_state, by_input : see `wearlab.dynamics.neighbour_kernel.answers_of_groups`
    starts : (n_groups + 1, 2n) states at the groups' starts
    felt : (n_groups, most stages, n_mesh) d·q at all stages
    """

    mean: Array
    shares: Array
    direction: Array
    inputs: Inputs
    cut: Cut
    stages: Index
    by_state: Array
    by_input: Array
    starts: Array
    felt: Array


def factors_of(
    system: System, balance: Balance | None, tables: StageTables, period: float, given: Array, sections: int
) -> Factors:
    """Return the factors of a case.

    Parameters
    ----------
    system, balance, tables, period : the case
    given : (2n + 1 + n_balance,) its start, 1, and sizes of loads
    sections : of the period, the first of which is looked at
    """
    mean, direction = mean_stiffness(tables), np.ascontiguousarray(system.direction)
    tables = tables.section(sections)
    basis, shares = basis_of(system, balance)
    cut = cut_of(system, tables.width, period, mean, basis, joined_steps(tables))
    assert cut is not None
    inputs = inputs_of(system, balance, tables, period, mean, shares)
    moving = inputs.law.shape[2] if len(shares) == len(shares.T) else len(basis)
    (meshes, n), groups = direction.shape, len(cut.groups)
    by_state = np.empty((groups, 2 * n + (MOST_STAGES - 1) * meshes, len(given)))
    by_input = np.empty((*by_state.shape[:2], MOST_STAGES * moving))
    answers_of_groups(*cut, direction, inputs, moving, by_state, by_input)
    starts, felt = np.empty((groups + 1, 2 * n)), np.empty((groups, MOST_STAGES, meshes))
    over_period(by_state, direction, given.copy(), np.zeros(by_state.shape[:2]), starts, felt)
    stages = 2 * cut.groups[:, 1] + 1
    return Factors(mean, shares, direction, inputs, cut, stages, by_state, by_input, starts, felt)


class Drifts(NamedTuple):
    """How leading multipliers change with the mesh law, ``Δμ = Σ by_law Δlaw``.

    Parameters
    ----------
    which : (n,) indices of the multipliers, of each pair the one above the real axis
    by_law : (n, n_groups · most stages · n_channel)
    """

    which: Index
    by_law: Complex


def drifts_of(known: Factors, system: System, whole: Array, multipliers: Complex, sections: int) -> Drifts:
    """Return the first-order changes ``lᴴ ΔP r`` of multipliers, with ``lᴴ r = 1``.

    Over m sections ``P = Rᵐ Qᵐ`` and ``Q = R⁻¹ P_section`` have their eigenvectors in common, the latter's
    values being ν: ``Δμ = m (μ/ν) (R l)ᴴ ΔP_section r``.

    Parameters
    ----------
    known : the answers of the groups
    system : what moves
    whole : (2n, 2n) derivative of the period map, or Q
    multipliers : of the period map, largest first
    sections : m

    References
    ----------
    Wilkinson, The Algebraic Eigenvalue Problem, 1965, ch. 2.
    """
    own, left, right = eig(whole, left=True)
    period = over_sections(system, whole, sections)
    drift = (left.conj() * (period @ right)).sum(axis=0) / (left.conj() * right).sum(axis=0)
    large = (np.abs(multipliers) >= LEADING * abs(multipliers[0])) & (multipliers.imag >= 0.0)
    which = np.flatnonzero(large)
    nearest = np.abs(drift[:, None] - multipliers[which]).argmin(axis=0)
    backward, forward = left.T[nearest].conj(), right.T[nearest]
    backward /= (backward * forward).sum(axis=1)[:, None]
    by_input, felt = _carried(known, backward @ turned_back(system.symmetry, sections, len(whole)), forward)
    inputs, moving = known.inputs, known.by_input.shape[2] // MOST_STAGES
    channels, meshes = inputs.law.shape[2], felt.shape[3]
    shares = np.zeros((moving, channels))
    shares[inputs.to, inputs.of] = inputs.share
    by_law = -(by_input.reshape(*felt.shape[:3], moving) @ shares) * np.tile(felt, channels // meshes)
    by_section = sections * (drift / own)[nearest]
    return Drifts(which, by_section[:, None] * by_law.reshape(len(which), -1))


def _carried(known: Factors, backward: Complex, forward: Complex) -> tuple[Complex, Complex]:
    """Carry vectors (k, 2n) over a period, from its end by inputs and from its start to d·q at all stages.

    Returns (k, n_groups, most stages · moving) and (k, n_groups, most stages, n_mesh).
    """
    (meshes, n), groups, count = known.direction.shape, len(known.by_state), 2 * len(forward)
    back, on = np.vstack([backward.real, backward.imag]), np.vstack([forward.real, forward.imag])
    by_input = np.empty((count, groups, known.by_input.shape[2]))
    felt = np.empty((count, groups, MOST_STAGES, meshes))
    for group in range(groups - 1, -1, -1):
        by_input[:, group] = back @ known.by_input[group, : 2 * n]
        back = back @ known.by_state[group, : 2 * n, : 2 * n]
    for group in range(groups):
        answer = on @ known.by_state[group, :, : 2 * n].T
        felt[:, group, 0] = on[:, :n] @ known.direction.T
        felt[:, group, 1:] = answer[:, 2 * n :].reshape(count, -1, meshes)
        on = answer[:, : 2 * n]
    half = count // 2
    return by_input[:half] + 1j * by_input[half:], felt[:half] + 1j * felt[half:]
