"""Loads of unknown size that keep a set free to turn at its mean speed.

A rigid rotation has no position of its own: one coordinate of it is held at the start of a period, and the
size of a load takes its place among the unknowns of the shooting. With friction the load torque is found
this way (zero mean rigid-body acceleration); without, balanced loads leave nothing to find.
"""

from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.compiled import jit_inner
from wearlab.dynamics.rigid import rigid_modes
from wearlab.dynamics.system import System, once


class Balance(NamedTuple):
    """What the kernels know of it.

    Parameters
    ----------
    held : (n_rigid,) the coordinate held for each free rotation
    push : (n_rigid, n) acceleration by a load of size one, M⁻¹ times it [m/s²]
    size : (n_rigid,) sizes of the loads, moved by the shooting [1]
    position : (n_rigid,) where the coordinates are held [m]
    shape, momentum : (n_rigid, n) free rotations φ, and φᵀ M
    gain : (n_rigid,) acceleration of a rotation by its load of size one
    """

    held: Index
    push: Array
    size: Array
    position: Array
    shape: Array
    momentum: Array
    gain: Array


def no_balance(n: int) -> Balance:
    """Return what the kernels take for a system of ``n`` coordinates that leaves no load to find."""
    none, rows = np.empty(0), np.empty((0, n))
    return Balance(np.empty(0, np.int64), rows, none, none, rows, rows, none)


def balance_of(system: System, period: float) -> Balance | None:
    """Return the loads to find, scaled to move the set by about a metre in a period; None: nothing is free.

    Parameters
    ----------
    system : the one form
    period : duration of a mesh period [s]

    Raises
    ------
    ValueError
        When several rotations are free and the system names one load to balance them.
    """
    shapes = _free(system)
    if not len(shapes):
        return None
    if system.balance is not None and len(shapes) > 1:
        raise ValueError(
            f"{len(shapes)} rotations are free and one load cannot balance them: ground a member, the ring "
            "or the carrier"
        )
    loads = shapes @ system.mass if system.balance is None else system.balance[None, :]
    accelerations = loads @ np.linalg.inv(system.mass).T
    scale = max(period, 1e-9) ** 2 * np.abs(accelerations).max(axis=1, keepdims=True)
    index = _pivots(shapes)
    count = len(shapes)
    momentum, pushed = shapes @ system.mass, accelerations / scale
    gain = np.einsum("ri,ri->r", momentum, pushed)
    return Balance(index, pushed, np.zeros(count), np.zeros(count), shapes, momentum, gain)


@jit_inner
def rebalance(balance: Any, before: Any, after: Any, period: float) -> None:
    """Take mean acceleration and drift of an integrated period (2n,) out of a set free to turn."""
    n = len(after) // 2
    for row in range(len(balance.held)):
        gained, drifted = 0.0, 0.0
        for x in range(n):
            gained += balance.momentum[row, x] * (after[n + x] - before[n + x])
            drifted += balance.momentum[row, x] * (after[x] - before[x])
        balance.size[row] -= gained / (period * balance.gain[row])
        for x in range(n):
            after[x] -= balance.shape[row, x] * drifted
            after[n + x] -= balance.shape[row, x] * drifted / period


@once
def _free(system: System) -> Array:
    """Return the free rotations; a system that grounds every coordinate is not looked into."""
    if system.balance is None and system.stiffness.diagonal().all():
        return np.empty((0, len(system.load)))
    return rigid_modes(system)


def _pivots(shapes: Array) -> Index:
    """Return one coordinate a shape, those by which the shapes are told apart best."""
    left, pivots = shapes.copy(), []
    for row in range(len(shapes)):
        at = int(np.abs(left[row]).argmax())
        pivots.append(at)
        left -= np.outer(left[:, at] / left[row, at], left[row])
    return np.array(pivots)


def solved_load(system: System, balance: Balance | None) -> System:
    """Return the system with the loads that the shooting found."""
    if balance is None or not len(balance.held):
        return system
    return system._replace(load=system.load + system.mass @ (balance.size @ balance.push))


def true_derivative(system: System, balance: Balance, derivative: Array) -> Array:
    """Return the derivative of the period map where the held coordinates' columns are those of the loads.

    A free rotation maps onto itself, ``P (φ, 0) = (φ, 0)``, which gives the columns back.
    """
    n, at = len(system.load), balance.held
    shapes = _free(system).T
    other = np.delete(np.arange(n), at)
    right = np.vstack([shapes, np.zeros_like(shapes)]) - derivative[:, other] @ shapes[other]
    true = derivative.copy()
    true[:, at] = np.linalg.solve(shapes[at].T, right.T).T
    return true
