"""Growth of waves of wear, by wavelength and contact patch: from the linearised rate,
and from runs.

``python tests/benchmarks/corrugation.py FILE [WAVES …]`` prints, for the first scene of
a campaign and every contact patch, by how much waves of the first flank grow per µm of
its wear.

Linear: a wave ``v = exp(2πi m s/p_b)`` put on unworn flanks grows by ``(1/r) Re ⟨v,
∂r/∂h v⟩/⟨v, v⟩``, r the rate where the flank wears fastest. Runs: two lives to the same
depth, one of which began with the wave; ``ln(|c_end|/|c_begin|)`` of its share c, over
the wear.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.assembly import GearModel, build
from wearlab.campaign import load
from wearlab.life.history import SetRate
from wearlab.life.integrate import integrate
from wearlab.life.limits import Limits
from wearlab.scene import Scene

Array = NDArray[np.float64]

PATCHES = ("none", "one-way", "two-way", "elastic")
WAVES = (2, 4, 6, 8, 10, 12, 14, 17, 20, 22, 25, 28, 31, 36, 42, 50)
AMPLITUDE = 2e-8
"""Of a wave: small beside the elastic deflection [m]."""
WORN = 1e-6
"""Wear of a run [m]."""
TOLERANCE = 1e-5
PER_MICROMETRE = 1e-6


@dataclass(frozen=True)
class Growth:
    """What waves of one length do under one contact patch.

    Parameters
    ----------
    waves : in a base pitch [1]
    linear, run : growth per µm of wear, of the linearised rate and from runs [1/µm]
    """

    waves: int
    linear: float
    run: float


class _Flank:
    """The first flank of a scene, and the rate of all."""

    def __init__(self, parts: GearModel) -> None:
        coupling = parts.coupling
        kind = parts.kinds[0]
        self.rate = SetRate(coupling)
        self.rate.responses = coupling.evaluate(coupling.unworn()).responses
        self.entries = coupling.entries(0, 0)
        self.unworn = coupling.flat(coupling.unworn())
        self.position = kind.analysis.grid.position
        self.pitch = kind.pair.base_pitch
        self.length = kind.path.arc_weight[0]
        self.memory = self.rate.remember()
        self.fastest = float(self(self.unworn)[self.entries].max())

    def __call__(self, depth: Array) -> Array:
        self.rate.recall(self.memory)
        return self.rate(depth)

    def wave(self, waves: float) -> NDArray[np.complex128]:
        return np.asarray(np.exp(2j * np.pi * waves * self.position / self.pitch))

    def share(self, values: Array, wave: NDArray[np.complex128]) -> complex:
        """Return the share of a wave in values (n_entries,) on the flank."""
        own = values[self.entries]
        return complex((self.length * wave.conj()) @ own / self.length.sum())

    def with_wave(self, real: Array) -> Array:
        """Return depths of a wave that nowhere refills a flank, about an even wear."""
        depth = self.unworn.copy()
        depth[self.entries] += AMPLITUDE * (1.0 + real)
        return depth

    def linear(self, waves: float) -> float:
        wave = self.wave(waves)
        even = self(self.with_wave(np.zeros_like(self.position)))
        parts = [
            self.share(self(self.with_wave(one)) - even, wave)
            for one in (wave.real, wave.imag)
        ]
        return float(
            (parts[0] + 1j * parts[1]).real / AMPLITUDE / self.fastest * PER_MICROMETRE
        )

    def run(self, waves: float) -> float:
        """Return the growth in a life, from the complex wave,
        whatever its phase along the path.
        """
        wave = self.wave(waves)
        ends = [
            self._worn(self.with_wave(one))
            for one in (0.0 * wave.real, wave.real, wave.imag)
        ]
        grown = self.share(ends[1] - ends[0], wave) + 1j * self.share(
            ends[2] - ends[0], wave
        )
        return float(np.log(abs(grown) / AMPLITUDE) / (WORN / PER_MICROMETRE))

    def _worn(self, depth: Array) -> Array:
        self.rate.recall(self.memory)
        cycles = WORN / self.fastest
        life = integrate(
            self.rate,
            depth,
            limits=Limits(cycles=cycles),
            tolerance=TOLERANCE,
            scale=WORN,
        )
        return np.asarray(life.depth[-1])


def growth_of(
    scene: Scene, patch: str, waves: Sequence[int], runs: bool = True
) -> list[Growth]:
    """Return how waves of the first flank grow.

    Parameters
    ----------
    scene : with a wear law
    patch : ``wear.contact_patch``
    waves : numbers of waves in a base pitch
    runs : whether lives are run as well; NaN else
    """
    flank = _Flank(build(scene.replace("wear.contact_patch", patch)))
    return [
        Growth(m, flank.linear(m), flank.run(m) if runs else float("nan"))
        for m in waves
    ]


def table(scene: Scene, waves: Sequence[int], runs: Sequence[int]) -> str:
    """Return the growth under every contact patch as text.

    ``runs`` are the waves that lives are run with.
    """
    found = {}
    for patch in PATCHES:
        linear = growth_of(scene, patch, waves, runs=False)
        ran = {one.waves: one.run for one in growth_of(scene, patch, runs)}
        found[patch] = [
            replace(one, run=ran.get(one.waves, float("nan"))) for one in linear
        ]
    head = "waves  " + "".join(f"{patch:>24}" for patch in PATCHES)
    lines = ["growth per µm of wear: linear, and from runs", head]
    for row in zip(*found.values(), strict=True):
        cells = "".join(f"{one.linear:>14.4f}{_or_dash(one.run):>10}" for one in row)
        lines.append(f"{row[0].waves:>5}  {cells}")
    return "\n".join(lines)


def _or_dash(value: float) -> str:
    return "-" if np.isnan(value) else f"{value:.4f}"


def main(arguments: Sequence[str]) -> None:
    """Print the table of a campaign's first scene."""
    scene: Any = load(arguments[0]).cases[0].scene
    waves = [int(one) for one in arguments[1:]] or list(WAVES)
    print(table(scene, waves, waves if arguments[1:] else (10, 17, 25)))


if __name__ == "__main__":
    main(sys.argv[1:])
