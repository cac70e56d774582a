"""Explicit Euler over cycles, as published: by a wear threshold or a fixed size.

First order, and stable only while ``ΔN ρ < 2``. Both are named methods for comparison,
not the default. Source: L16 Eq. 21–24; W23 §3.2; PHYSICS §8.

Beyond ΔN ρ = 2 an explicit step overshoots the balance of load between teeth and back.
Where neighbouring nodes relax at different speeds, or the body couples them, the
profile becomes a saw; where they relax alike, the whole flank swings from step to step.
Either mark is enough.
"""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.life.limits import CountedRate
from wearlab.life.step import EULER, Node, SawTooth, Step, Stepper, growth
from wearlab.life.stiffness import random_direction, spectrum

WORST_ZIGZAG = 0.2
"""Share of node-to-node alternation in the wear of one step that counts as a saw (a
single jump has 0.03)."""


UNDAMPED = 0.95
"""Ratio of successive alternating changes of rate from which the swing does not die
out."""


SMALLEST_SWING = 0.02
"""Change of rate, relative to the rate, below which a swing is noise."""


class Euler(NamedTuple):
    """Euler's method of the papers: a step ends when the wear anywhere reaches ε.

    ``ΔN = ε / max r(h)`` (L16 Eq. 22). A saw-tooth is flagged and the run goes on, as
    published.

    Parameters
    ----------
    threshold : ε [m]
    """

    threshold: float

    def start(
        self, node: Node, rate: CountedRate, tolerance: float, scale: float
    ) -> "EulerStepper":
        """Return the stepper at the first state."""
        if not self.threshold > 0.0:
            raise ValueError(f"wear threshold {self.threshold:g} m must be positive")
        return EulerStepper(rate, threshold=self.threshold)


class Fixed(NamedTuple):
    """Euler's method with a fixed step; a saw-tooth rejects the step and ends the run.

    Parameters
    ----------
    size : ΔN [cycles]; or None and then
    stability : ΔN as a share of the stability limit 2/ρ at the first state [1]
    """

    size: float | None = None
    stability: float | None = None

    def start(
        self, node: Node, rate: CountedRate, tolerance: float, scale: float
    ) -> "EulerStepper":
        """Return the stepper at the first state, its size resolved."""
        size = (
            self.size
            if self.stability is None
            else self.stability * stability_limit(node, rate, scale)
        )
        if size is None or not size > 0.0:
            raise ValueError(
                "a fixed step needs a positive size in cycles or a share of the "
                "stability limit"
            )
        return EulerStepper(rate, size=size)


class EulerStepper(Stepper):
    """Steps of Euler's method: one rate evaluation each, none rejected for its error.

    Parameters
    ----------
    rate : the wear rate
    threshold : largest wear of a step [m], where its size is not given
    size : cycles of a step, of which a saw-tooth ends the run; None: by the threshold
    """

    def __init__(
        self, rate: CountedRate, *, threshold: float = np.inf, size: float | None = None
    ) -> None:
        self.rate = rate
        self.threshold = threshold
        self.size = size
        self.last_rate: Array | None = None

    def advance(self, node: Node, largest: float) -> tuple[Step, None]:
        """Return the step from ``node``, at most ``largest`` cycles long.

        Parameters
        ----------
        node : the state from which the step starts
        largest : longest step allowed [1]

        Raises
        ------
        SawTooth
            When the step makes a saw-tooth and the method stops there.
        """
        by_threshold = self.size or (
            self.threshold / node.fastest if node.fastest > 0.0 else np.inf
        )
        self.trying = size = float(min(by_threshold, largest, self.max_size))
        depth = node.depth + size * node.rate
        end = Node(node.cycle + size, depth, self.rate(depth))
        if self.last_rate is not None and not self.saw_tooth:
            rates = self.last_rate, node.rate, end.rate
            self.saw_tooth = swings(*rates) or grows_saw(*rates)
        if self.saw_tooth and self.size is not None:
            self.rejected += 1
            raise SawTooth
        self.last_rate = node.rate
        error = 0.5 * size * (end.rate - node.rate)
        return Step(
            node, end, (node.rate, node.rate), error, growth(node, end), EULER
        ), None


def stability_limit(node: Node, rate: CountedRate, scale: float) -> float:
    """Return Euler's longest stable step ``2/ρ``, inf where nothing relaxes.

    Parameters
    ----------
    node : the state
    rate : the wear rate
    scale : depth scale of the life [m]
    """
    memory = rate.remember()
    probe = random_direction(node.rate)
    fastest = spectrum(
        rate, node.depth, probe, amplitude=1e-3 * scale, tolerance=1e-4, iterations=60
    )
    rate.recall(memory)
    return 2.0 / fastest.radius if fastest.radius > 0.0 else np.inf


def zigzag(profile: Array) -> float:
    """Return the node-to-node alternation of a profile: 0 smooth, 2 a pure saw [1].

    With ``d_i = h_i − (h_{i−1} + h_{i+1})/2``: ``√(Σ max(0, −d_i d_{i+1}) / Σ h²)``.

    Parameters
    ----------
    profile : (n,) values at the nodes
    """
    square = float(profile @ profile)
    if square == 0.0 or profile.size < 4:
        return 0.0
    d = profile[1:-1] - 0.5 * (profile[:-2] + profile[2:])
    return float(np.sqrt(np.maximum(0.0, -d[1:] * d[:-1]).sum() / square))


def grows_saw(first: Array, second: Array, third: Array) -> bool:
    """Whether the alternation of three successive rates rises twice and is a saw.

    Parameters
    ----------
    first, second, third : (n,) successive rates [m per cycle]
    """
    return (
        zigzag(first) < zigzag(second) < zigzag(third) and zigzag(third) > WORST_ZIGZAG
    )


def swings(first: Array, second: Array, third: Array) -> bool:
    """Whether three successive rates alternate without dying out.

    Parameters
    ----------
    first, second, third : (n,) successive rates [m per cycle]
    """
    last_change = second - first
    change = third - second
    last_swing = float(np.linalg.norm(last_change))
    swing = float(np.linalg.norm(change))
    heard = swing >= SMALLEST_SWING * float(np.linalg.norm(third)) and last_swing > 0.0
    return (
        heard
        and float(last_change @ change) < -0.5 * last_swing * swing
        and swing > UNDAMPED * last_swing
    )
