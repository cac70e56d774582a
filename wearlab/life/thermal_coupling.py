"""One wear state of gears that friction warms: temperature ⇄ contact, forces and loss.

The temperatures are found anew in every wear state that is evaluated, so that a step
over cycles keeps its order. The state is that of flanks and teeth at the temperatures
that its own friction holds.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.life import limits
from wearlab.life.coupled import MeshKind, StartingPoint, Wear, WearState
from wearlab.life.coupling import Coupling, LoadedFlanks
from wearlab.life.duty_coupling import DutyCoupling, mixed
from wearlab.life.loads import Forces
from wearlab.life.loads.static import static_forces
from wearlab.materials.over_temperature import TemperatureCurve
from wearlab.thermal.balance import (
    FLANK,
    HeatBalance,
    HeatState,
    NoSteadyTemperature,
)
from wearlab.thermal.friction import SlidingPairs

KindsAt = Callable[[Array], tuple[MeshKind, ...]]
"""Temperatures of (driving, driven) at (root, flank), (2, 2) [K], to the kinds of mesh
there."""


class Warming(NamedTuple):
    """What warms a pair of gears, and what their temperatures change.

    Parameters
    ----------
    balance : how warm a power of friction makes them
    sliding : where and how fast pairs slide
    friction : coefficient of friction over the temperature of the warmer flank [1]
    moduli : Young's modulus of (driving, driven) over temperature [Pa]
    kinds_at : contact and wear law at temperatures
    loss_factor : H_V of all wear states [1], None: of the forces of each
    """

    balance: HeatBalance
    sliding: SlidingPairs
    friction: TemperatureCurve
    moduli: tuple[TemperatureCurve, TemperatureCurve]
    kinds_at: KindsAt
    loss_factor: float | None

    def friction_at(self, temperature: Array) -> float:
        """Return the coefficient of friction at temperatures (2, 2) [1]."""
        return self.friction.at(float(temperature[:, FLANK].max()))

    def moduli_at(self, temperature: Array) -> Array:
        """Return Young's moduli at temperatures, both (2, 2) [Pa]."""
        moduli = [
            [curve.at(float(place)) for place in of_gear]
            for curve, of_gear in zip(self.moduli, temperature, strict=True)
        ]
        return np.array(moduli)


@dataclass(frozen=True)
class ThermalCoupling(Coupling):
    """Contact, dynamics and wear of one pair of gears that friction warms.

    Parameters
    ----------
    warming : what warms them, and what that changes
    """

    warming: Warming = field(kw_only=True)

    def evaluate(
        self,
        wear: Wear,
        start: StartingPoint | None = None,
        near: WearState | None = None,
    ) -> WearState:
        """Evaluate one wear state at the temperatures that its friction holds.

        Parameters
        ----------
        wear, start, near : as of `Coupling.evaluate`

        Raises
        ------
        StopWear
            When no temperature is steady, and as of `Coupling.evaluate`.
        """

        def at(start: StartingPoint) -> WearState:
            settling = Settling([self], np.ones(1), wear, [start], near)
            return settling.steady_states(self.warming.balance)[0]

        return self.as_wide_as_loaded(at, wear, start)

    def at(self, temperature: Array) -> "ThermalCoupling":
        """Return the coupling of gears at temperatures.

        Parameters
        ----------
        temperature : (2, 2) of (driving, driven) at (root, flank) [K]
        """
        return replace(self, kinds=self.warming.kinds_at(temperature))

    def held_at(self, temperature: Array) -> Coupling:
        """Return the coupling of gears that are held at temperatures.

        Parameters
        ----------
        temperature : (2, 2) of (driving, driven) at (root, flank) [K]
        """
        kinds = self.warming.kinds_at(temperature)
        return Coupling(kinds, self.vibration, self.load, account=self.account)

    def forces_that_rub(self, loaded: LoadedFlanks) -> Forces:
        """Return the forces that make heat: those that wear, of the moment or at rest.

        Parameters
        ----------
        loaded : the flanks under their load
        """
        if self.load.moving:
            return loaded.forces[0]
        return static_forces(loaded.worn[0], loaded.at_rest[0])

    def loss_over_friction(self, loaded: LoadedFlanks) -> float:
        """Return the loss over the coefficient of friction, P_V/μ [W].

        Parameters
        ----------
        loaded : the flanks under their load
        """
        sliding = self.warming.sliding
        if self.warming.loss_factor is not None:
            return self.warming.loss_factor * sliding.power
        force = self.forces_that_rub(loaded)
        return sliding.loss(force.weight, force.pair)


@dataclass(frozen=True)
class ThermalDuty(DutyCoupling):
    """Conditions that take turns faster than gears cool: one temperature for all.

    Parameters
    ----------
    time : (n_blocks,) share of the operating time of each, of idle ones the rest [1]
    balance : how warm the mean power of friction makes the gears
    """

    time: Array
    balance: HeatBalance

    def evaluate(self, wear: Wear, start: StartingPoint | None = None) -> WearState:
        """Evaluate one wear state in every block, at the temperatures of all.

        Parameters
        ----------
        wear, start : as of `DutyCoupling.evaluate`
        """
        blocks = [block for block in self.blocks if isinstance(block, ThermalCoupling)]

        def at(start: StartingPoint) -> WearState:
            starts = self.apart(start)
            settling = Settling(blocks, self.time, wear, starts, is_shared=True)
            return mixed(settling.steady_states(self.balance), self.weight)

        return self.as_wide_as_loaded(at, wear, start)


@dataclass
class Settling:
    """The search for the temperatures of one wear state in one or several conditions.

    Parameters
    ----------
    blocks : the pair in each condition
    time : (n_blocks,) share of the time of each [1]
    wear : of the kind of mesh [m]
    starts : what a neighbouring state leaves of each condition
    near : a neighbouring state whose contact to start from, of a single condition
    is_shared : whether they take turns and have one temperature
    couplings, loaded, temperature : what was last looked at: the gears at temperatures
        (2, 2) [K], and their flanks under load
    """

    blocks: Sequence[ThermalCoupling]
    time: Array
    wear: Wear
    starts: Sequence[StartingPoint]
    near: WearState | None = None
    is_shared: bool = False
    couplings: list[Coupling] = field(default_factory=list)
    loaded: list[LoadedFlanks] = field(default_factory=list)
    temperature: Array | None = None

    def loss_at(self, temperature: Array) -> float:
        """Return the mean power of friction at temperatures, keeping what was loaded.

        Parameters
        ----------
        temperature : (2, 2) of (driving, driven) at (root, flank) [K]
        """
        self.temperature = temperature
        self.couplings = [block.at(temperature) for block in self.blocks]
        self.loaded = [
            coupling.loaded(self.wear, start, self.near)
            for coupling, start in zip(self.couplings, self.starts, strict=True)
        ]
        self.starts = [
            start._replace(responses=loaded.responses)
            for start, loaded in zip(self.starts, self.loaded, strict=True)
        ]
        powers = [self._power(number) for number in range(len(self.blocks))]
        return float(self.time @ powers)

    def _power(self, number: int) -> float:
        """Return the power of friction in a condition at the last temperatures [W]."""
        assert self.temperature is not None
        block = self.blocks[number]
        friction = block.warming.friction_at(self.temperature)
        return friction * block.loss_over_friction(self.loaded[number])

    def steady_states(self, balance: HeatBalance) -> tuple[WearState, ...]:
        """Return the wear state in each condition at the temperatures that it holds.

        Parameters
        ----------
        balance : how warm the mean power of friction makes the gears

        Raises
        ------
        StopWear
            When there are no such temperatures.
        """
        try:
            balance.steady_power(self.loss_at)
        except NoSteadyTemperature as error:
            raise limits.StopWear(limits.TOO_WARM, str(error)) from error
        return tuple(self._state(number) for number in range(len(self.blocks)))

    def _state(self, number: int) -> WearState:
        """Return the wear state in a condition at the last temperatures."""
        assert self.temperature is not None
        block = self.blocks[number]
        warming = block.warming
        loaded = self.loaded[number]
        forces = block.forces_that_rub(loaded)
        power = self._power(number)
        nominal = warming.friction_at(self.temperature) * warming.sliding.power
        heat = HeatState(
            friction_power=power,
            loss_factor=power / nominal if nominal > 0.0 else 0.0,
            load_beyond=warming.sliding.load_beyond(forces.weight, forces.pair),
            temperature=self.temperature,
            modulus=warming.moduli_at(self.temperature),
            is_shared=self.is_shared,
        )
        return self.couplings[number].worn_by(loaded)._replace(heat=heat)
