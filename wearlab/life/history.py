"""A life of a gear set: integrate the wear, then evaluate every kept state."""

import math
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array
from wearlab.life import coupled, integrate, limits, step, wear_beyond
from wearlab.life.coupling import Coupling
from wearlab.life.duty_coupling import DutyCoupling

MAX_SAMPLES = 5
"""Accepted states on which the estimates of a life's errors rest."""

FOLLOWED_WITHIN = 10e-6
"""Mean wear over which the width at which contacts are felt follows their load [m]."""
LEAST_FOLLOWED = 0.1e-6
"""Mean wear over which it does so on new flanks; in between it is the wear so far."""
LEAST_FORCE = 1e-3
"""Force over the largest below which contacts are not felt narrower [1]."""

KEPT_SHARES = 64
"""States whose share of wear beyond A and E a rate remembers: those of some steps."""

LAST_STATES = 4
"""States that a rate remembers whole where nothing moves: a step is accepted after two
more looks inside it at most."""

ACCEPTED_STATES = 200
"""Accepted states that are kept whole until the end of a life in which nothing moves, a
twentieth of a megabyte each; those beyond it are evaluated again where they are asked
for."""


class Widths(NamedTuple):
    """How wide contacts are felt from one accepted state to the next.

    ``ln F = ln F_loaded + (ln F_felt − ln F_loaded) exp(−s/L)``: from the width at
    which the accepted state felt them towards that under which it loaded them, over the
    mean wear s since. So the rate depends on the depth alone within a step, and
    does not jump between two.

    Parameters
    ----------
    felt : forces that made the patches at the accepted state, None: there was none
    loaded : forces that wore it
    wear : its mean depth [m]
    """

    felt: coupled.PatchForces | None = None
    loaded: coupled.PatchForces | None = None
    wear: float = 0.0

    def at(self, depth: Array) -> coupled.PatchForces | None:
        """Return the forces that make the patches at flat depths [m], None: unknown.

        Parameters
        ----------
        depth : (n_entries,) of a state of the step
        """
        if self.felt is None or self.loaded is None:
            return self.felt
        length = min(FOLLOWED_WITHIN, self.wear + LEAST_FOLLOWED)
        worn = max(0.0, float(depth.mean()) - self.wear)
        share = math.exp(-worn / length)
        return tuple(
            _between(felt, loaded, share)
            for felt, loaded in zip(self.felt, self.loaded, strict=True)
        )

    def accepted(self, depth: Array, state: coupled.StartingPoint) -> "Widths":
        """Return how wide contacts are felt after a state that was accepted.

        Parameters
        ----------
        depth : (n_entries,) its depths, flat [m]
        state : what it leaves
        """
        felt = self.at(depth)
        if felt is None:
            felt = state.forces
        return Widths(felt, state.forces, float(depth.mean()))


def _between(felt: Array, loaded: Array, share: float) -> Array:
    """Return forces between two, a share of the first in their logarithm [N]."""
    least = LEAST_FORCE * max(float(felt.max()), float(loaded.max()))
    if least <= 0.0:
        return loaded
    first = np.log(np.maximum(felt, least))
    second = np.log(np.maximum(loaded, least))
    return np.asarray(np.exp(second + share * (first - second)))


class Memory(NamedTuple):
    """What a rate remembers of the states in which it was evaluated.

    Parameters
    ----------
    last : what the last one leaves
    widths : how wide contacts are felt since the last accepted one
    noise : of the rate of the last one [m per cycle]
    """

    last: coupled.StartingPoint
    widths: Widths
    noise: float

    def start_at(self, depth: Array) -> coupled.StartingPoint:
        """Return what a state at flat depths (n_entries,) [m] starts from."""
        return coupled.StartingPoint(self.last.responses, self.widths.at(depth))


class History(NamedTuple):
    """Wear states of a life, each in full: what estimates and datasets are made of.

    Parameters
    ----------
    cycle : (m,) cycles of the states [1]
    state : the states
    life : the integration that led through them, None when nothing wears on
    sampled : accepted states, on which estimates of errors rest; None: on some of these
    stages : what a life of several conditions in order was joined from, each from its
        own first state
    seconds : (m,) operating time of the states [s], NaN where nothing turns; None: not
        asked for
    worn_beyond : what pairs beyond A and E have worn off in the end, flat [m], None:
        they wear nothing
    """

    cycle: Array
    state: tuple[coupled.WearState, ...]
    life: integrate.Life | None = None
    sampled: "History | None" = None
    stages: "tuple[History, ...]" = ()
    seconds: Array | None = None
    worn_beyond: Array | None = None

    @property
    def samples(self) -> "History":
        """The states on which errors are estimated, whatever snapshots there are."""
        if self.sampled is not None:
            return self.sampled
        chosen = spread_over(len(self.state))
        return History(self.cycle[chosen], tuple(self.state[k] for k in chosen))

    def kept(self, stage: int) -> "History":
        """Return the kept states of one stage.

        A later one begins with the last of the one before.

        Parameters
        ----------
        stage : number of the stage
        """
        part = self.stages[stage]
        return (
            part._replace(cycle=part.cycle[1:], state=part.state[1:]) if stage else part
        )

    def in_block(self, block: int) -> "History":
        """Return the states as one of the conditions that take turns saw them.

        Parameters
        ----------
        block : number of the condition
        """
        sampled = self.sampled and self.sampled.in_block(block)
        states = tuple(state.conditions[block] for state in self.state)
        return self._replace(state=states, sampled=sampled)


def spread_over(count: int, max_count: int = MAX_SAMPLES) -> list[int]:
    """Return which of so many states are sampled: first, last and some between.

    Where another number is given than that of the samples of estimates, so many of
    them.

    Parameters
    ----------
    count : number of states
    max_count : largest number of them to sample
    """
    sampled = (
        min(count, 2 + count // 3, MAX_SAMPLES)
        if max_count == MAX_SAMPLES
        else min(count, max_count)
    )
    return sorted({round(at) for at in np.linspace(0, count - 1, sampled)})


def halving(count: int) -> list[int]:
    """Return the numbers below a count, the middle one first, then by halving.

    Parameters
    ----------
    count : numbers below it are ordered
    """
    order = []
    spans = [(0, count)]
    for low, high in spans:  # grows as it is gone through
        if low < high:
            middle = (low + high) // 2
            order.append(middle)
            spans += [(low, middle), (middle + 1, high)]
    return order


def is_at_rest(coupling: coupled.Coupled) -> bool:
    """Return whether nothing moves: a state starts from nothing but widths of contact.

    Motions, and loads over a face, start from near ones.

    Parameters
    ----------
    coupling : contact, dynamics and wear of the gear set
    """
    if isinstance(coupling, DutyCoupling):
        return all(map(is_at_rest, coupling.blocks))
    return isinstance(coupling, Coupling) and coupling.vibration is None


class SetRate:
    """The wear rate of all flanks, flat, with the last orbits as its memory.

    How wide contacts are felt follows their load from one accepted state to the next,
    see `Widths`.

    Parameters
    ----------
    coupling : contact, dynamics and wear of the gear set
    """

    def __init__(self, coupling: coupled.Coupled) -> None:
        self.coupling = coupling.rate_only()
        self.last = coupled.StartingPoint()
        self.widths = Widths()
        self.noise = 0.0
        self.beyond: dict[bytes, Array] = {}
        self.follows = self.coupling.follows
        self.is_at_rest = is_at_rest(self.coupling)
        self.last_states: dict[bytes, coupled.WearState] = {}
        resting = self.coupling.static_only()
        self.still = None if resting is None else SetRate(resting)

    def __call__(self, depth: Array) -> Array:
        """Return the wear per cycle at depths (n_entries,), both flat [m]."""
        state = self.evaluate(depth)
        if not state.wears:
            raise ValueError("a scene without a wear law has no wear rate")
        self.note(depth, state)
        self._note_beyond(depth, state)
        return self.coupling.flat(state.rate)

    def note(self, depth: Array, state: coupled.WearState) -> None:
        """Keep what a state leaves to those after it.

        Parameters
        ----------
        depth : (n_entries,) its depths, flat [m]
        state : the state
        """
        left = state.start
        if self.follows and self.widths.felt is None:
            self.widths = self.widths.accepted(depth, left)
        self.last = left._replace(responses=left.responses or self.last.responses)
        self.noise = state.noise

    def accept(self, depth: Array) -> None:
        """Follow the load of the last state, which was accepted at depths, flat [m].

        Parameters
        ----------
        depth : (n_entries,)
        """
        if not self.follows:
            return
        self.widths = self.widths.accepted(depth, self.last)
        accepted = self.last_state(depth)
        self.last_states.clear()  # others were felt by the widths before
        if accepted is not None:
            self.note_state(depth, accepted)
        if self.still is not None and self.still.widths.felt is not None:
            self.still.accept(depth)

    def _note_beyond(self, depth: Array, state: coupled.WearState) -> None:
        """Keep what pairs beyond A and E do in the last few states."""
        share = wear_beyond.share_beyond(self.coupling, state)
        if share is None:
            return
        self.beyond[depth.tobytes()] = share
        while len(self.beyond) > KEPT_SHARES:
            del self.beyond[next(iter(self.beyond))]

    def share_beyond(self, depth: Array) -> Array:
        """Return what share of the rate pairs beyond A and E make, (n_entries,) [1].

        Parameters
        ----------
        depth : (n_entries,) of an accepted state [m]
        """
        share = self.beyond.get(depth.tobytes())
        if share is None:  # of a state that another process had reached
            found = wear_beyond.share_beyond(self.coupling, self.evaluate(depth))
            share = np.zeros_like(depth) if found is None else found
        return share

    def evaluate(self, depth: Array) -> coupled.WearState:
        """Return the state at depths (n_entries,), from the last orbits."""
        state = self.last_state(depth)
        if state is None:
            start = self.remember().start_at(depth)
            state = self.coupling.evaluate(self.coupling.split(depth), start)
            self.note_state(depth, state)
        return state

    def note_state(self, depth: Array, state: coupled.WearState) -> None:
        """Keep a state in which nothing moves, for the next few.

        Parameters
        ----------
        depth : (n_entries,) [m]
        state : the state there
        """
        if not self.is_at_rest:
            return
        self.last_states[depth.tobytes()] = state
        while len(self.last_states) > LAST_STATES:
            del self.last_states[next(iter(self.last_states))]

    def last_state(self, depth: Array) -> coupled.WearState | None:
        """Return the state at depths if it is one of the last, to the last bit.

        Parameters
        ----------
        depth : (n_entries,) [m]
        """
        return self.last_states.get(depth.tobytes())

    @property
    def work(self) -> float:
        """Right-hand sides evaluated so far."""
        return float(self.coupling.work)

    @property
    def shared(self) -> tuple[Any, ...]:
        """What responses belong to, told apart by identity."""
        return self.coupling.shared

    def accounted(self) -> list[dict[str, int]]:
        """Return the work counted so far, of every block of a duty."""
        return [dict(account.counts) for account in self.coupling.accounts]

    def account_for(self, counted: list[dict[str, int]]) -> None:
        """Count that work, and no other, as done."""
        for account, counts in zip(self.coupling.accounts, counted, strict=True):
            account.counts.update(counts)

    def remember(self) -> Memory:
        """Return the last orbits, the widths, and the noise of the rate."""
        return Memory(self.last, self.widths, self.noise)

    def recall(self, memory: Memory) -> None:
        """Put earlier orbits and widths back."""
        self.last, self.widths, self.noise = memory


def history(
    coupling: coupled.Coupled,
    wear: coupled.Wear,
    integration: Callable[..., integrate.Life],
    *,
    snapshots: limits.Snapshots,
    kept_work: float = np.inf,
    max_kept: int | None = None,
    worn_beyond: Array | None = None,
) -> History:
    """Integrate the wear of a gear set to its limit and evaluate every kept state.

    Parameters
    ----------
    coupling : contact, dynamics and wear of the gear set
    wear : wear depth of every kind of mesh at cycle 0 [m]
    integration : :func:`wearlab.life.integrate.integrate` of all but rate, wear,
        snapshots and progress
    snapshots : states wanted on the way
    kept_work : work on states that nobody asked for, beyond which no more of them are
        kept
    max_kept : of these states, None: as many as there are
    worn_beyond : what pairs beyond A and E have worn off before, flat [m], None:
        nothing

    Notes
    -----
    A kept state starts from the orbit at the last accepted state before it, so that
    asking for further snapshots changes none of the others. Where nothing moves, no
    accepted state is evaluated twice. Without snapshots all accepted states are kept;
    where their motions repeat in no period and take long to follow, those that spread
    best over the life.
    """
    rate = SetRate(coupling)
    first = coupling.evaluate(wear)
    begun = coupling.flat(wear)
    rate.note(begun, first)
    if is_at_rest(coupling):
        rate.note_state(begun, first)
    states = _KeptStates(coupling, rate)
    states.accept(0.0, begun)
    beyond = wear_beyond.begun(coupling, first, begun, worn_beyond)

    def accepted(node: step.Node) -> None:
        states.accept(node.cycle, node.depth)
        if beyond is not None:
            share = rate.share_beyond(node.depth)
            beyond.add(node.cycle, node.depth, share)

    life = integration(rate, begun, snapshots=snapshots, progress=accepted)
    requested = list(zip(*life.updates(only_snapshots=snapshots.asked), strict=True))
    if max_kept is not None and not snapshots.asked:
        requested = [requested[k] for k in spread_over(len(requested), max_kept)]
    chosen = [(life.cycle[k], life.depth[k]) for k in spread_over(len(life.cycle))]

    states.evaluate(requested if snapshots.asked else (requested[0], requested[-1]))
    states.evaluate(chosen)
    spread = [requested[k] for k in halving(len(requested))]
    states.evaluate(spread, work_limit=coupling.work + kept_work)
    found = states.at(requested)._replace(life=life, sampled=states.at(chosen))
    if beyond is None:
        return found
    whole = tuple(
        beyond.joined_to(coupling, cycle, state)
        for cycle, state in zip(found.cycle, found.state, strict=True)
    )
    return found._replace(state=whole, worn_beyond=beyond.worn[-1])


class _KeptStates:
    """States of a life, each evaluated from the orbits accepted last before it.

    Where nothing moves, the accepted ones are those that the rate has evaluated.

    Parameters
    ----------
    coupling : contact, dynamics and wear of the gear set
    rate : the wear rate of the life, at its first state
    """

    def __init__(self, coupling: coupled.Coupled, rate: SetRate) -> None:
        self._coupling = coupling
        self._rate = rate
        self._is_at_rest = is_at_rest(coupling)
        self._memories: list[tuple[float, Memory]] = [(-np.inf, rate.remember())]
        self._accepted: dict[float, coupled.WearState | None] = {}
        self._states: dict[float, coupled.WearState | None] = {}

    def accept(self, cycle: float, depth: Array) -> None:
        """Keep what the rate knows of a state that was accepted at a cycle.

        What it remembers, and where nothing moves the state itself.

        Parameters
        ----------
        cycle : of the state [1]
        depth : (n_entries,) [m]
        """
        self._memories.append((cycle, self._rate.remember()))
        if self._is_at_rest and cycle not in self._accepted:
            has_room = len(self._accepted) < ACCEPTED_STATES
            self._accepted[cycle] = self._rate.last_state(depth) if has_room else None

    def evaluate(
        self, places: Iterable[tuple[float, Array]], work_limit: float = np.inf
    ) -> None:
        """Evaluate the states at cycles and flat depths until the work is done.

        Parameters
        ----------
        places : cycle [1] and depth (n_entries,) [m] of each state
        work_limit : work after which no further state is evaluated
        """
        for cycle, depth in places:
            if cycle in self._states or self._coupling.work >= work_limit:
                continue
            self._states[cycle] = self._accepted.get(cycle)
            if self._states[cycle] is not None:
                continue
            counted = self._rate.accounted()
            before = [kept for reached, kept in self._memories if reached < cycle][-1]
            # the gears cannot run in the state that ended the life
            with suppress(limits.StopWear):
                wear = self._coupling.split(depth)
                start = before.start_at(depth)
                self._states[cycle] = self._coupling.evaluate(wear, start)
            if cycle in self._accepted:  # counted when it was accepted
                self._rate.account_for(counted)

    def at(self, places: Iterable[tuple[float, Array]]) -> History:
        """Return the evaluated states at these places in which the gears can run."""
        states = {
            cycle: state
            for cycle, _ in places
            if (state := self._states.get(cycle)) is not None
        }
        return History(np.array(list(states)), tuple(states.values()))


def worn(
    rate: limits.Rate,
    initial: ArrayLike,
    flanks: Mapping[str, tuple[limits.Flanks, float]],
    **bounds: Any,
) -> Array:
    """Return the depths after wear by the law to a depth of each named flank, (n,) [m].

    All flanks run and wear together until the named one has its depth; then only the
    named flank keeps its wear (its mate is taken as new). Several named flanks are worn
    one run each, all from ``initial``.

    Parameters
    ----------
    rate : h (n,) [m] -> dh/dN (n,) [m per cycle]
    initial : (n,) depths before [m]
    flanks : name -> (entries of h on that flank, largest depth wanted there [m])
    bounds : tolerance, scale and work, see :func:`wearlab.life.integrate.integrate`

    Raises
    ------
    ValueError
        When a flank cannot be worn to that depth, with the reason.
    """
    h0 = np.array(initial, float)
    h = h0.copy()
    for name, (flank, depth) in flanks.items():
        if depth == 0.0:
            continue
        life = integrate.integrate(
            rate, h0, limits=limits.Limits(depth=depth, flank=flank), **bounds
        )
        if not life.worn_out:
            raise ValueError(
                f"flank {name!r} cannot be worn to {depth:.3g} m by this law: "
                f"{life.end_reason}"
            )
        h[flank] = life.depth[-1][flank]
    return h
