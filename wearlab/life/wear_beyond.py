"""What of the wear pairs beyond A and E have taken off, along a life.

The wear itself is integrated whole. From one accepted state to the next the part of it
follows the share of the rate that these pairs make: second order over the steps.
"""

from dataclasses import dataclass, field

import numpy as np

from wearlab.arrays import Array
from wearlab.life.coupled import Coupled, WearState


def share_beyond(coupling: Coupled, state: WearState) -> Array | None:
    """Return what share of the wear rate pairs beyond A and E make, (n_entries,) [1].

    None: they wear nothing.

    Parameters
    ----------
    coupling : contact, dynamics and wear of the gear set
    state : a wear state
    """
    if state.rate_beyond is None:
        return None
    rate = coupling.flat(state.rate)
    beyond = coupling.flat(state.rate_beyond)
    return np.divide(beyond, rate, out=np.zeros_like(rate), where=rate > 0.0)


def unworn_beyond(state: WearState) -> WearState:
    """Return a state in which pairs beyond A and E have worn off nothing so far.

    Parameters
    ----------
    state : a wear state
    """
    kinds = tuple(
        kind
        if kind.rate_beyond is None
        else kind._replace(wear_beyond=np.zeros_like(kind.wear))
        for kind in state.kind
    )
    return state._replace(kind=kinds)


@dataclass
class WornBeyond:
    """The part of the wear at every accepted state of a life.

    Parameters
    ----------
    cycle : of the accepted states [1]
    depth : whole wear there, each (n_entries,) [m]
    share : of the rate that pairs beyond A and E make [1]
    worn : what they have worn off [m]
    """

    cycle: list[float]
    depth: list[Array]
    share: list[Array]
    worn: list[Array] = field(default_factory=list)

    def add(self, cycle: float, depth: Array, share: Array) -> None:
        """Count one more accepted state.

        Parameters
        ----------
        cycle : of the state [1]
        depth : (n_entries,) wear [m]
        share : (n_entries,) of the rate that pairs beyond A and E make [1]
        """
        mean_share = 0.5 * (self.share[-1] + share)
        added = mean_share * (depth - self.depth[-1])
        self.worn.append(self.worn[-1] + added)
        self.cycle.append(cycle)
        self.depth.append(depth)
        self.share.append(share)

    def at(self, cycle: float, depth: Array) -> Array:
        """Return what they have worn off in a state of the life, (n_entries,) [m].

        Parameters
        ----------
        cycle : of the state [1]
        depth : (n_entries,) wear [m]
        """
        before = max(int(np.searchsorted(self.cycle, cycle, side="right")) - 1, 0)
        if before == len(self.cycle) - 1 or cycle == self.cycle[before]:
            return self.worn[before]
        step = self.cycle[before + 1] - self.cycle[before]
        way = (cycle - self.cycle[before]) / step
        change = self.share[before + 1] - self.share[before]
        mean_share = self.share[before] + 0.5 * way * change
        return self.worn[before] + mean_share * (depth - self.depth[before])

    def joined_to(self, coupling: Coupled, cycle: float, state: WearState) -> WearState:
        """Return a state of the life with what pairs beyond A and E have worn off.

        Parameters
        ----------
        coupling : contact, dynamics and wear of the gear set
        cycle : of the state [1]
        state : a wear state
        """
        worn = coupling.split(self.at(cycle, coupling.flat(state.wear)))
        kinds = tuple(
            kind._replace(wear_beyond=of_kind)
            for kind, of_kind in zip(state.kind, worn, strict=True)
        )
        return state._replace(kind=kinds)


def begun(
    coupling: Coupled, first: WearState, depth: Array, worn: Array | None
) -> WornBeyond | None:
    """Return the part of the wear at the beginning of a life.

    None: pairs beyond A and E wear nothing.

    Parameters
    ----------
    coupling : contact, dynamics and wear of the gear set
    first : its first state
    depth : (n_entries,) wear there [m]
    worn : (n_entries,) what these pairs have worn off before [m], None: nothing
    """
    share = share_beyond(coupling, first)
    if share is None:
        return None
    before = np.zeros_like(depth) if worn is None else worn
    return WornBeyond(cycle=[0.0], depth=[depth], share=[share], worn=[before])
