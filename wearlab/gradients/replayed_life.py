"""The numbers of a scene, and a life whose accepted steps can be taken again with one of them moved."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, get_args

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.dynamics.integrators.kernel import is_small
from wearlab.dynamics.steady.periodic import Periodic
from wearlab.gears.specification import GearError
from wearlab.life import coupled, history, limits
from wearlab.life.coupling import Coupling
from wearlab.life.step import Node, Step, depth_at, retake_step
from wearlab.mesh.profile import ExtensionInPitches
from wearlab.options import Part, Unit
from wearlab.scene import Scene, SceneError
from wearlab.simulation.life_run import initial_wear, life_at_rate
from wearlab.units import KINDS

STEP, STEP_OF_LARGE = 1e-7, 1e-6
"""Change of a number over its size: the second order is lost, and round-off is still a millionth of it.

Orbits of many coordinates round off more: wear depths of a planetary set are 7e-4 of
the largest derivative off by 1e-7, and 4e-5 by 1e-6 (5e-6 and 1e-5 do no better). """
SIZES = {"": 1.0, "length": 1e-3, "depth": 1e-6, "angle": 0.1}
"""Least size of a number, by its kind: of one that is 0 or next to it."""


class GradientError(ValueError):
    """A derivative that is not there, or not asked for rightly.

    The message says why and what to do.
    """


class Number(NamedTuple):
    """A number of a scene.

    Parameters
    ----------
    key : dotted key
    value : in SI
    kind : of its unit, "" for a plain number
    """

    key: str
    value: float
    kind: str

    @property
    def unit(self) -> str:
        """SI unit."""
        return KINDS[self.kind].unit if self.kind else "1"

    def moved(self, scene: Scene, by: float) -> tuple[Scene, float]:
        """Return the scene with this number moved by a share of its size, and by how much it moved.

        Raises
        ------
        GradientError
            When no such scene is valid.
        """
        step = by * max(abs(self.value), SIZES.get(self.kind, 0.0))
        if step == 0.0:
            raise GradientError(
                f"{self.key}: is 0, and no size of a step is known: give it a small "
                "value"
            )
        value = self.value + step
        try:
            changed = scene.replace(
                self.key, f"{value!r} {self.unit}" if self.kind else value
            )
        except SceneError as error:
            raise GradientError("\n".join(error.problems)) from None
        moved = number(changed, self.key).value - self.value
        if not moved > 0.0:
            raise GradientError(
                f"{self.key}: {self.value:g} cannot be moved: it is no continuous "
                "number"
            )
        return changed, moved


def number(scene: Scene, key: str) -> Number:
    """Return a number of a scene.

    Raises
    ------
    GradientError
        When there is no number at the key.
    """
    value: Any = scene
    for word in key.split("."):
        part = value
        if not isinstance(part, Part | Scene) or word not in type(part).model_fields:
            known = "(`wearlab schema` lists keys; items of lists have none)"
            raise GradientError(f"{key}: this scene has no such number {known}")
        field = type(part).model_fields[word]
        value = getattr(part, word)
    if not isinstance(value, float):
        said = (
            "a count"
            if isinstance(value, int) and not isinstance(value, bool)
            else "no number"
        )
        raise GradientError(
            f"{key}: {value!r} is {said}: derivatives are with respect to numbers"
        )
    return Number(key, value, _kind((*field.metadata, field.annotation)))


def _kind(marked: Iterable[Any]) -> str:
    """Return the kind of the first unit among marks and annotations, "" of a plain number."""
    kinds = (
        each.kind if isinstance(each, Unit) else _kind(get_args(each))
        for each in marked
    )
    return next(filter(None, kinds), "")


CLOSED = 1e-13
"""Distance of an orbit from closing, over its size, that differences by `STEP` do not
see."""
ROUNDING = 1e-15
"""Of depths, over the deepest: a hundred-millionth of what derivatives move them by."""
LOOSEST = 0.5
"""Tolerance of a rougher twin, at most [1]."""


class RecordedRate(history.SetRate):
    """The wear rate of all flanks, and every state in which it was evaluated.

    Parameters
    ----------
    coupling : contact, dynamics and wear of the gear set
    wear : of every kind of mesh at cycle 0, whose state is evaluated in full [m]
    """

    def __init__(self, coupling: Coupling, wear: coupled.Wear) -> None:
        super().__init__(coupling)
        first = coupling.evaluate(wear)
        self.states: list[tuple[Array, coupled.WearState]] = [
            (coupling.flat(wear), first)
        ]
        self.responses = first.responses

    def evaluate(self, depth: Array) -> coupled.WearState:
        """Return the state at depths (n_entries,), from the last orbits."""
        state, same = self.nearest(depth)
        if not (same and len(self.states) == 1):
            state = super().evaluate(depth)
            self.states.append((np.array(depth), state))
        return state

    def nearest(self, depth: Array) -> tuple[coupled.WearState, bool]:
        """Return the state kept nearest to depths (n_entries,), and whether only rounding lies between."""
        apart = [
            float(np.abs(known - depth).max(initial=0.0)) for known, _ in self.states
        ]
        nearest = int(np.argmin(apart))
        return self.states[nearest][1], apart[nearest] <= ROUNDING * float(
            np.abs(depth).max(initial=0.0)
        )


class HeldNumerics(NamedTuple):
    """What the numerics of a scene came to: kept while its numbers move.

    Parameters
    ----------
    profile_points : nodes asked for on the path
    steps_per_period : of the dynamics, None without
    reach : how far beyond A and E the nodes of every kind of mesh reach, in base
        pitches
    """

    profile_points: int
    steps_per_period: int | None
    reach: tuple[ExtensionInPitches, ...]

    def built(self, scene: Scene) -> tuple[Scene, assembly.GearModel]:
        """Return a scene with these numerics, and its physics.

        Raises
        ------
        GradientError
            When no such gears can exist or run.
        """
        given = {
            "profile_points": self.profile_points,
            "steps_per_period": self.steps_per_period,
        }
        held = scene.model_copy(
            update={"numerics": scene.numerics.model_copy(update=given)}
        )
        try:
            parts = assembly.build(held, self.reach)
        except GearError as error:
            raise GradientError(f"no such gears: {error}") from error
        if parts.vibration is not None and isinstance(parts.vibration.method, Periodic):
            # orbits close to round-off
            closing = parts.vibration._replace(
                method=replace(parts.vibration.method, closed=CLOSED)
            )
            parts = replace(parts, coupling=replace(parts.coupling, vibration=closing))
        return held, parts

    def rougher(self, scene: Scene, factor: float) -> Scene:
        """Return the scene to a tolerance rougher by a factor, with fewer nodes and steps by its cube root.

        Fewer than what the scene came to: a tolerance alone leaves both as they are
        where the meshes or the motion ask for more than it does, and their errors would
        show in no difference.
        """
        share = factor ** (-1.0 / 3.0)
        changed: dict[str, float] = {
            "tolerance": min(LOOSEST, factor * scene.numerics.tolerance)
        }
        changed["profile_points"] = max(9, round(share * self.profile_points))
        if self.steps_per_period is not None:
            changed["steps_per_period"] = max(4, round(share * self.steps_per_period))
        return scene.replace(
            {f"numerics.{name}": value for name, value in changed.items()}
        )


def frozen(scene: Scene) -> HeldNumerics:
    """Return what the numerics of a scene come to."""
    parts = assembly.build(scene)
    steps = scene.numerics.steps_per_period
    reach = []
    if parts.vibration is not None and steps is None:
        steps = len(parts.vibration.sampling.grid.width)
    for kind in parts.kinds:
        grid = kind.analysis.grid
        pitch = kind.pair.base_pitch
        before = grid.position[0] - grid.contact_position[0]
        after = grid.contact_position[-1] - grid.position[-1]
        extension = ExtensionInPitches(float(before / pitch), float(after / pitch))
        reach.append(extension)
    return HeldNumerics(assembly.mesh.profile_points(scene), steps, tuple(reach))


class Ends(NamedTuple):
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


def _places(parts: assembly.GearModel) -> list[Array]:
    """Return how many nodes there are, where they lie, and in which segments the steps, to be compared."""
    grids = [kind.analysis.grid for kind in parts.kinds]
    steps = [] if parts.vibration is None else [parts.vibration.sampling.grid.segment]
    return [np.append(grid.intervals, len(grid.position)) for grid in grids] + steps


class LivedSteps:
    """A life and its accepted steps.

    Parameters
    ----------
    scene : in one condition of operation
    """

    def __init__(self, scene: Scene) -> None:
        try:
            self.frozen = frozen(scene)
            self.scene, parts = self.frozen.built(scene)
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
        self.ends = self._ends(parts, rate)

    @property
    def step(self) -> float:
        """Change of a number over its size by which derivatives are taken [1]."""
        moves = self.ends.parts.vibration
        return STEP if moves is None or is_small(moves.system) else STEP_OF_LARGE

    def moved(self, scene: Scene) -> Ends:
        """Return the ends of the same steps for a scene that differs a little."""
        _, parts = self.frozen.built(scene)
        if not all(map(np.array_equal, _places(self.ends.parts), _places(parts))):
            raise GradientError(
                "nodes or steps come and go as this number moves: give another value "
                "of it"
            )
        return self._ends(parts, self.ends.evaluated)

    def _ends(
        self,
        parts: assembly.GearModel,
        known: RecordedRate | Sequence[coupled.WearState],
    ) -> Ends:
        """Take the steps, from states of the integration to its end or from those known before, in turn."""
        coupling = parts.coupling
        states = list[coupled.WearState]()
        wearing = coupling.rate_only()

        def evaluate(of: Coupling, wear: Array) -> coupled.WearState:
            if isinstance(known, RecordedRate):
                near, same = known.nearest(wear)
                # whose orbits close as well as those of moved scenes will, which start
                # from them
                closed = all(response.residual <= CLOSED for response in near.responses)
                if (
                    same
                    and closed
                    and bool(near.responses) == (of.vibration is not None)
                ):
                    states.append(near)
                    return near
            else:
                near = known[len(states)]
            start = near.responses or next(
                (state.responses for state in states[::-1] if state.responses), ()
            )
            state = of.evaluate(of.split(wear), tuple(start) or None, near)
            here = [response.period for response in state.responses]
            there = [response.period for response in near.responses]
            if 0 in here:
                raise GradientError(
                    "the response does not repeat on the way: it has no derivative"
                )
            if not isinstance(known, RecordedRate) and here != there:
                raise GradientError(
                    "the response changes its period as this number moves"
                )
            states.append(state)
            return state

        def rate(wear: Array) -> Array:
            return wearing.flat(evaluate(wearing, wear).rate)

        wear = initial_wear(self.scene, parts)
        first = evaluate(coupling, coupling.flat(wear))
        if not self.steps:
            return Ends(parts, (first,), (), states)
        node = Node(0.0, coupling.flat(wear), coupling.flat(first.rate))
        taken = list[Step]()
        for step in self.steps:
            try:
                taken.append(retake_step(step, rate, node))
            except limits.StopWear as stop:
                raise GradientError(
                    f"the worn gears can no longer run: {stop.reason}"
                ) from stop
            node = taken[-1].end
        return Ends(
            parts,
            (first, evaluate(coupling, depth_at(taken[-1], self.cycle))),
            tuple(taken),
            states,
        )

    def life_of(self, ends: Ends) -> float:
        """Return the cycle at which the depth limit is met, where it is within or next to the last step [1].

        By the slope of the last step's own curve at the end of the life of the scene
        itself.
        """
        step = self.ends.steps[-1]
        known = self.ends.parts
        counts = assembly.wear.build_limits(
            self.scene, known.gears, known.coupling
        ).flank
        here = depth_at(step, self.cycle)[counts]
        deepest = int(np.argmax(here))
        half = 1e-4 * step.size
        change = depth_at(ends.steps[-1], self.cycle)[counts][deepest] - here[deepest]
        before = max(step.start.cycle, self.cycle - half)
        after = min(step.end.cycle, self.cycle + half)
        low = depth_at(step, before)[counts][deepest]
        high = depth_at(step, after)[counts][deepest]
        return self.cycle - float(change * (after - before) / (high - low))
