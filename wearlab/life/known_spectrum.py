"""What a march knows of the stiffness of its rate, and what it does to know more.

Stages of a step tell a lower bound of the spectral radius ρ of ∂r/∂h. As long as ρ times the whole way left
is small by it, no step can be stiff and no wave can grow much, and nothing else is asked. A longer way, or a
step that fails its test, is worth a power iteration. A noisy rate hides its spectrum: what was known stays.

**Growing waves.** Under the load of the moment a flank may corrugate: below the natural frequency of a mesh
the force is largest where the flank is worn most, and waves of wear grow until teeth part. Errors grow with
them, so that no step is short enough to tell where a wave will be many e-foldings later; what the waves do on
the average is all that can be known.
"""

from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.life import rkc
from wearlab.life.counted import CountedRate
from wearlab.life.spectrum import RADIUS_SAFETY, Spectrum, growth_rate, random_direction, spectrum
from wearlab.life.step import Node

STEEP, SLOPE = 3.0, 0.75
"""Growth of the spectral radius from one look to the next that may be a jump of the rate, and how much of
it must be found over twice the way."""
PROBE = 1e-3
"""Amplitude of the power iteration over the depth scale."""
NOTHING_KNOWN = Spectrum(0.0, 1.0, np.empty(0))
"""Until the first look."""


class KnownSpectrum:
    """The spectrum of ∂r/∂h as it was last seen.

    ``age``: steps since; ``looked``: whether more than stages of steps told it; ``wave_growth``: the fastest
    growth of a wave of wear that was seen [1/cycle]; ``foreseeable``: whether errors made at the start stay
    small to the end.

    Parameters
    ----------
    scale : depth scale of the march [m]
    heard : noise above which a rate hides its spectrum [m per cycle]
    """

    def __init__(self, scale: float, heard: float) -> None:
        self.amplitude, self.heard = PROBE * scale, heard
        self.spectrum = NOTHING_KNOWN
        self.age = 0
        self.wave_growth = 0.0
        self.looked = self.growth_known = False
        self.foreseeable = True

    @property
    def radius(self) -> float:
        """Spectral radius with a margin [1/cycle]."""
        return RADIUS_SAFETY * self.spectrum.radius

    @property
    def damping(self) -> float:
        """RKC damping that suits the spectrum."""
        return rkc.SHARP if self.spectrum.is_real else rkc.WIDE

    @property
    def reach(self) -> float:
        """The longest step that any method takes [cycles]."""
        return rkc.longest_reach(self.damping) / self.radius if self.radius > 0.0 else np.inf

    def told(self, rate: CountedRate, radius: float) -> None:
        """Take what the stages of a step tell of the spectral radius, where nothing better is known."""
        if not self.looked and rate.noise <= self.heard and radius > self.spectrum.radius:
            self.spectrum = NOTHING_KNOWN._replace(radius=radius)

    def look(self, rate: CountedRate, node: Node, memory: Any, direction: Array | None = None) -> None:
        """Estimate the spectrum at a state, and put the rate's memory back.

        Parameters
        ----------
        rate : the wear rate
        node : the state
        memory : of the rate there
        direction : (n,) in which to look first, None: the one seen last
        """
        if rate.noise > self.heard:
            self.age = 0
            return
        direction = self.spectrum.direction if direction is None else direction
        direction = direction if direction.size == node.rate.size else random_direction(node.rate)
        seen = spectrum(rate, node.depth, direction, amplitude=self.amplitude)
        if not self.looked or seen.radius <= STEEP * self.spectrum.radius or self._is_slope(rate, node, seen):
            self.spectrum = seen
        rate.recall(memory)
        self.age, self.looked, self.growth_known = 0, True, self.spectrum.is_real or not self.foreseeable

    def foresee(self, rate: CountedRate, node: Node, left: float, tolerance: float) -> None:
        """Find out whether an error made at the start grows to less than 1/tolerance before the limit."""
        if not self.foreseeable:
            return
        whole, most = node.cycle + (left if np.isfinite(left) else 0.0), -np.log(tolerance)
        if self.spectrum.radius * whole > most and not self.growth_known:
            self._look_for_growth(rate, node)
        self.foreseeable = bool(self.wave_growth * whole <= most)

    def _is_slope(self, rate: CountedRate, node: Node, seen: Spectrum) -> bool:
        """Whether a steep rate is as steep over twice the way; over a jump it is half as steep."""
        again = spectrum(rate, node.depth, seen.direction, amplitude=2.0 * self.amplitude, iterations=1)
        return again.radius > SLOPE * seen.radius

    def _look_for_growth(self, rate: CountedRate, node: Node) -> None:
        """Measure the growth of waves at a state where the spectrum was looked at, and is complex."""
        if rate.noise > self.heard or not self.looked:
            return
        memory = rate.remember()
        growth = growth_rate(rate, node.depth, self.spectrum.direction, amplitude=self.amplitude)
        rate.recall(memory)
        self.wave_growth, self.growth_known = max(self.wave_growth, growth), True
