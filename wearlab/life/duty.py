"""Several operating conditions in turn: one wear rate, mixed per cycle."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.life.coupled import Account, Coupled
from wearlab.life.coupling import Coupling
from wearlab.life.state import Wear, WearState
from wearlab.life.vibration import Responses


class DutyShares(NamedTuple):
    """How often the blocks of a duty come.

    Parameters
    ----------
    weight : (n,) share of the cycles [1]
    mean_speed : cycles over time, as an angular speed [rad/s]
    """

    weight: Array
    mean_speed: float


def duty_shares(share: Sequence[float], speed: Sequence[float]) -> DutyShares:
    """Return the shares of the cycles, ``w_b = u_b ω_b / Σ u_b ω_b``, from those of the time u_b.

    Parameters
    ----------
    share : (n,) of the time; only their proportions count [1]
    speed : (n,) of the reference gear relative to the carrier [rad/s]
    """
    time, turning = np.asarray(share, float) / np.sum(share), np.asarray(speed, float)
    weight = time * turning / (time @ turning)
    return DutyShares(weight, float(mixture(time, list(turning))))


@dataclass(frozen=True)
class DutyCoupling(Coupled):
    """Contact, dynamics and wear of one gear set in several operating conditions that take turns.

    The same flanks go through every block often enough for all of them to see the same wear, so that
    ``dh/dN = Σ w_b r_b(h)``.

    Parameters
    ----------
    kinds : the kinds of mesh, as the first block has them
    blocks : the gear set in each condition, on the same nodes
    weight : (n,) share of the cycles of each [1]
    """

    blocks: tuple[Coupling, ...]
    weight: Array

    def evaluate(self, wear: Wear, start: Responses | None = None) -> WearState:
        """Evaluate one wear state in every block.

        Parameters
        ----------
        wear : of every kind of mesh, each (2, n), (driving, driven) [m]
        start : responses of a neighbouring state to start from, block after block

        Returns
        -------
        WearState
            The first block's with the mixed rate; ``block`` holds them all.
        """
        starts = self.apart(start) if start else [None] * len(self.blocks)
        states = tuple(block.evaluate(wear, near) for block, near in zip(self.blocks, starts, strict=True))
        return mixed(states, self.weight)

    @property
    def work(self) -> int:
        """Right-hand sides evaluated so far, in all blocks."""
        return sum(block.work for block in self.blocks)

    @property
    def accounts(self) -> tuple[Account, ...]:
        """Where time and work are written down, block after block."""
        return tuple(account for block in self.blocks for account in block.accounts)

    @property
    def shared(self) -> tuple[Any, ...]:
        """What responses belong to, block after block."""
        return tuple(thing for block in self.blocks for thing in block.shared)

    def wearing(self) -> "DutyCoupling":
        """Return what the wear rate needs of it: no responses where the static force wears."""
        return replace(self, blocks=tuple(block.wearing() for block in self.blocks))

    def resting(self) -> "DutyCoupling | None":
        """Return what wears under the static loads alone, None where it does so already."""
        static = [block.resting() for block in self.blocks]
        resting = tuple(still_block or block for still_block, block in zip(static, self.blocks, strict=True))
        return replace(self, blocks=resting) if any(force is not None for force in static) else None

    def apart(self, responses: Responses) -> list[Responses]:
        """Return the responses of each block."""
        counts = [len(block.vibration.slow) if block.vibration and block.vibration.slow is not None else 1
                  for block in self.blocks]  # fmt: skip
        ends = np.cumsum(counts)
        return [responses[end - count : end] for end, count in zip(ends, counts, strict=True)]


def mixed(states: tuple[WearState, ...], weight: Array) -> WearState:
    """Return the state of all blocks together: rates mixed, responses in a row."""
    first = states[0]
    kinds = first.kind
    if first.wears:
        rates = [mixture(weight, [state.rate[k] for state in states]) for k in range(len(kinds))]
        kinds = tuple(kind._replace(rate=rate) for kind, rate in zip(kinds, rates, strict=True))
    noise = float(np.hypot.reduce([w * state.noise for w, state in zip(weight, states, strict=True)]))
    return WearState(kinds, tuple(r for state in states for r in state.responses), noise, states)


def mixture(weight: Array, values: Sequence[Array]) -> Array:
    """Return ``Σ w_b v_b`` of values ≥ 0, exactly their own value where all are equal."""
    first = values[0]
    apart = sum(w * (value - first) for w, value in zip(weight[1:], values[1:], strict=True))
    return np.maximum(0.0, first + apart)
