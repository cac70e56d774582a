"""A life whose accepted steps can be taken again with a number of its scene moved."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.dynamics.integrators.kernel import is_small
from wearlab.gears.specification import GearError
from wearlab.gradients.held_numerics import CLOSED, held_numerics
from wearlab.gradients.numbers import GradientError
from wearlab.gradients.recorded_rate import RecordedRate
from wearlab.life import coupled, limits
from wearlab.life.coupling import Coupling
from wearlab.life.history import Widths
from wearlab.life.step import Node, Step, depth_at, retake_step
from wearlab.scene import Scene
from wearlab.simulation.initial_wear import initial_wear
from wearlab.simulation.life_run import life_at_rate

STEP = 1e-7
"""Change of a number over its size: the second order is lost, and round-off is still a
millionth of it."""
STEP_OF_LARGE = 1e-6
"""That of large systems, whose orbits round off more: wear depths of a planetary set
are 7e-4 of the largest derivative off by 1e-7, and 4e-5 by 1e-6 (5e-6 and 1e-5 do no
better)."""
ROUNDED = 1e-13
"""Difference of forces, over them, that rounding may make [1]."""
HALF_WINDOW = 1e-4
"""Half the cycles over which the slope of the depth is taken at the end of a life, over
those of the last step."""


class LifeEnds(NamedTuple):
    """The first and the last state of a life, and what led from one to the other.

    Parameters
    ----------
    parts : the physics
    states : in full, two of them, or one where nothing wears on
    steps : the steps between them
    evaluated : every state that was evaluated, in that order
    """

    parts: assembly.GearModel
    states: tuple[coupled.WearState, ...]
    steps: tuple[Step, ...]
    evaluated: Sequence[coupled.WearState]


class Evaluation(Protocol):
    """How the states of a replay are evaluated, one after another.

    Parameters
    ----------
    states : every state so far
    widths : how wide contacts are felt since the last accepted one
    """

    states: list[coupled.WearState]
    widths: Widths = Widths()

    def accept(self, depth: Array) -> None:
        """Follow the load of the last state, which was accepted at depths, flat [m].

        Parameters
        ----------
        depth : (n_entries,)
        """
        self.widths = self.widths.accepted(depth, self.states[-1].start)

    def evaluate(self, coupling: Coupling, depth: Array) -> coupled.WearState:
        """Return the state at depths (n_entries,)."""
        ...

    def _evaluated(
        self, coupling: Coupling, depth: Array, near: coupled.WearState
    ) -> coupled.WearState:
        """Evaluate a state from the orbits of a near one, or of the last before it.

        Raises
        ------
        GradientError
            When its response does not repeat.
        """
        responses = near.responses
        for state in reversed(self.states):
            responses = responses or state.responses
        start = coupled.StartingPoint(responses, self.widths.at(depth))
        result = coupling.evaluate(coupling.split(depth), start, near)
        if 0 in _periods(result):
            raise GradientError(
                "the response does not repeat on the way: it has no derivative"
            )
        return result


class FromIntegration(Evaluation):
    """States of the integration of the life, evaluated anew where they do not serve.

    Parameters
    ----------
    rate : of the integration
    """

    def __init__(self, rate: RecordedRate) -> None:
        self.rate = rate
        self.states: list[coupled.WearState] = []

    def evaluate(self, coupling: Coupling, depth: Array) -> coupled.WearState:
        """Return the state at depths (n_entries,).

        A state of the integration serves if it has a response where one is asked for,
        and its orbits close as well as those of moved scenes will, which start from
        them.
        """
        near, is_same = self.rate.nearest(depth)
        is_closed = all(response.residual <= CLOSED for response in near.responses)
        asks_for_response = coupling.vibration is not None
        is_felt = _same(self.widths.at(depth), near.start_alike.forces)
        responds = bool(near.responses) == asks_for_response
        serves = is_same and is_felt and is_closed and responds
        state = near if serves else self._evaluated(coupling, depth, near)
        self.states.append(state)
        return state


class FromReplay(Evaluation):
    """States that each start from the state of the same turn of an earlier replay.

    Parameters
    ----------
    earlier : states of the earlier replay, in the order of their evaluation
    """

    def __init__(self, earlier: Sequence[coupled.WearState]) -> None:
        self.earlier = earlier
        self.states: list[coupled.WearState] = []

    def evaluate(self, coupling: Coupling, depth: Array) -> coupled.WearState:
        """Return the state at depths (n_entries,).

        Raises
        ------
        GradientError
            When its response has another period than in the earlier replay.
        """
        near = self.earlier[len(self.states)]
        state = self._evaluated(coupling, depth, near)
        if _periods(state) != _periods(near):
            raise GradientError("the response changes its period as this number moves")
        self.states.append(state)
        return state


def _same(
    forces: coupled.PatchForces | None, others: coupled.PatchForces | None
) -> bool:
    """Whether forces that make patches are the same but for rounding.

    Where none are known they are found in the state itself.
    """
    if forces is None:
        return True
    if others is None:
        return False
    pairs = zip(forces, others, strict=True)
    return all(np.allclose(one, other, rtol=ROUNDED, atol=0.0) for one, other in pairs)


def _periods(state: coupled.WearState) -> list[int]:
    """Return the mesh periods of the responses of a state."""
    return [response.period for response in state.responses]


class ReplayedLife:
    """A life and its accepted steps.

    Parameters
    ----------
    scene : in one condition of operation
    """

    def __init__(self, scene: Scene) -> None:
        try:
            self.numerics = held_numerics(scene)
            self.scene, parts = self.numerics.built(scene)
            wear = initial_wear(self.scene, parts)
            rate = RecordedRate(parts.coupling, wear)
            life = life_at_rate(self.scene, parts, rate, wear)
        except (GearError, limits.StopWear) as error:
            raise GradientError(f"the gears cannot run: {error}") from error

        if life is not None and life.jumps:
            raise GradientError(
                "the wear rate jumps to another branch: no derivative leads across"
            )
        self.steps = () if life is None else life.steps
        if any(step.by is None for step in self.steps):
            raise GradientError(
                "motion does not repeat or its work is short: steps hold part of the "
                "rate"
            )
        self.cycle = 0.0 if life is None else float(life.cycle[-1])
        self.reached = life is not None and life.worn_out
        self.ends = self._replay(parts, FromIntegration(rate))

    @property
    def step(self) -> float:
        """Change of a number over its size by which derivatives are taken [1]."""
        vibration = self.ends.parts.vibration
        is_large = vibration is not None and not is_small(vibration.system)
        return STEP_OF_LARGE if is_large else STEP

    def moved(self, scene: Scene) -> LifeEnds:
        """Return the ends of the same steps for a scene that differs a little.

        Parameters
        ----------
        scene : with a number moved

        Raises
        ------
        GradientError
            When its nodes or steps are others, or its response has no derivative.
        """
        _, parts = self.numerics.built(scene)
        if not all(map(np.array_equal, _places(self.ends.parts), _places(parts))):
            raise GradientError(
                "nodes or steps come and go as this number moves: give another value "
                "of it"
            )
        return self._replay(parts, FromReplay(self.ends.evaluated))

    def _replay(self, parts: assembly.GearModel, evaluation: Evaluation) -> LifeEnds:
        """Take the steps of the life again."""
        coupling = parts.coupling
        rate_coupling = coupling.rate_only()

        def rate(depth: Array) -> Array:
            state = evaluation.evaluate(rate_coupling, depth)
            return rate_coupling.flat(state.rate)

        depth = coupling.flat(initial_wear(self.scene, parts))
        first = evaluation.evaluate(coupling, depth)
        if not self.steps:
            return LifeEnds(parts, (first,), (), evaluation.states)

        node = Node(0.0, depth, coupling.flat(first.rate))
        steps: list[Step] = []
        for step in self.steps:
            if coupling.follows:
                evaluation.accept(node.depth)
            try:
                steps.append(retake_step(step, rate, node))
            except limits.StopWear as stop:
                raise GradientError(
                    f"the worn gears can no longer run: {stop.reason}"
                ) from stop
            node = steps[-1].end
        last = evaluation.evaluate(coupling, depth_at(steps[-1], self.cycle))
        return LifeEnds(parts, (first, last), tuple(steps), evaluation.states)

    def life_of(self, ends: LifeEnds) -> float:
        """Return the cycle at which the depth limit is met [1].

        It lies within the last step, or next to it: the change of depth at the end of
        the life of the scene itself, over the slope of its last step there.

        Parameters
        ----------
        ends : of the same steps for a scene that differs a little
        """
        step = self.ends.steps[-1]
        parts = self.ends.parts
        limit = assembly.life.build_limits(self.scene, parts.gears, parts.coupling)

        def counted_depth(of_step: Step, cycle: float) -> Array:
            return depth_at(of_step, cycle)[limit.flank]

        depth = counted_depth(step, self.cycle)
        deepest = int(np.argmax(depth))
        changed_depth = counted_depth(ends.steps[-1], self.cycle)
        change = changed_depth[deepest] - depth[deepest]

        half = HALF_WINDOW * step.size
        begin = max(step.start.cycle, self.cycle - half)
        end = min(step.end.cycle, self.cycle + half)
        low = counted_depth(step, begin)[deepest]
        high = counted_depth(step, end)[deepest]
        return self.cycle - float(change * (end - begin) / (high - low))


def _places(parts: assembly.GearModel) -> list[Array]:
    """Return nodes of every kind of mesh and segments of steps, to be compared.

    Nodes are their intervals, and how many they are.
    """
    grids = [kind.analysis.grid for kind in parts.kinds]
    places = [np.append(grid.intervals, len(grid.position)) for grid in grids]
    if parts.vibration is not None:
        places.append(parts.vibration.sampling.grid.segment)
    return places
