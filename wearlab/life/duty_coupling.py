"""One wear state in operating conditions that take turns: one rate, mixed per cycle."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.life.coupled import Account, Coupled, StartingPoint, Wear, WearState
from wearlab.life.coupling import Coupling

ROUNDED = 1e-12
"""What weights may lack of 1 by rounding."""


@dataclass(frozen=True)
class DutyCoupling(Coupled):
    """Contact, dynamics and wear of one gear set in conditions that take turns.

    The same flanks go through every block often enough for all of them to see the same
    wear, so that ``dh/dN = Σ w_b r_b(h)``.

    Parameters
    ----------
    kinds : the kinds of mesh, as the first block has them
    blocks : the gear set in each condition, on the same nodes
    weight : (n,) share of the cycles of each, of idle conditions the rest [1]
    """

    blocks: tuple[Coupling, ...]
    weight: Array

    def evaluate(self, wear: Wear, start: StartingPoint | None = None) -> WearState:
        """Evaluate one wear state in every block.

        Parameters
        ----------
        wear : of every kind of mesh, each (2, n), (driving, driven) [m]
        start : what a neighbouring state leaves to start from, block after block

        Returns
        -------
        WearState
            The first block's with the mixed rate; ``block`` holds them all.
        """
        starts = self.apart(start or StartingPoint())
        states = tuple(
            block.evaluate(wear, near)
            for block, near in zip(self.blocks, starts, strict=True)
        )
        return mixed(states, self.weight)

    @property
    def follows(self) -> bool:
        """Whether contacts follow the force in any block: an idle one has none."""
        return any(block.follows for block in self.blocks)

    @property
    def accounts(self) -> tuple[Account, ...]:
        """Where time and work are written down, block after block."""
        return tuple(block.account for block in self.blocks)

    @property
    def shared(self) -> tuple[Any, ...]:
        """What responses belong to, block after block."""
        return tuple(thing for block in self.blocks for thing in block.shared)

    def rate_only(self) -> "DutyCoupling":
        """Return what the wear rate needs: no response where static forces wear."""
        return replace(self, blocks=tuple(block.rate_only() for block in self.blocks))

    def static_only(self) -> "DutyCoupling | None":
        """Return what wears under static loads alone, None where it does already."""
        resting = tuple(block.static_only() or block for block in self.blocks)
        return (
            replace(self, blocks=resting)
            if any(block.load.moving for block in self.blocks)
            else None
        )

    def apart(self, start: StartingPoint) -> list[StartingPoint]:
        """Return what a neighbouring state leaves to each block.

        Parameters
        ----------
        start : of all blocks, in a row
        """
        responses = iter(start.responses)
        forces = iter(start.forces or ())
        starts = []
        for block in self.blocks:
            slow = None if block.vibration is None else block.vibration.slow
            angles = 1 if slow is None else len(slow)
            of_block = tuple(islice(responses, angles))
            of_kinds = tuple(islice(forces, len(block.kinds)))
            starts.append(StartingPoint(of_block, of_kinds or None))
        return starts


def mixed(states: tuple[WearState, ...], weight: Array) -> WearState:
    """Return the state of all blocks together: rates mixed, responses in a row.

    Parameters
    ----------
    states : of all blocks
    weight : share of the cycles of each block [1]
    """
    first = states[0]
    kinds = first.kind
    if first.wears:
        rates = [
            mixture(weight, [state.rate[k] for state in states])
            for k in range(len(kinds))
        ]
        kinds = tuple(
            kind._replace(rate=rate) for kind, rate in zip(kinds, rates, strict=True)
        )
    beyond = [state.rate_beyond for state in states]
    of_blocks = [rates for rates in beyond if rates is not None]
    if len(of_blocks) == len(states):
        kinds = tuple(
            kind._replace(rate_beyond=mixture(weight, list(rates)))
            for kind, rates in zip(kinds, zip(*of_blocks, strict=True), strict=True)
        )
    noise = float(
        np.hypot.reduce(
            [w * state.noise for w, state in zip(weight, states, strict=True)]
        )
    )
    responses = tuple(r for state in states for r in state.responses)
    return WearState(kinds, responses, noise, states, first.heat)


def mixture(weight: Array, values: Sequence[Array]) -> Array:
    """Return ``Σ w_b v_b`` of values ≥ 0, exactly their value where all are equal.

    Parameters
    ----------
    weight : w, (n_blocks,); what they lack of 1 is of value 0 [1]
    values : v, one for each block
    """
    first = values[0]
    difference = sum(
        w * (value - first) for w, value in zip(weight[1:], values[1:], strict=True)
    )
    idle = 1.0 - float(np.sum(weight))
    if idle > ROUNDED:
        difference = difference - idle * first
    return np.maximum(0.0, first + difference)
