"""Speeds and torques of a planetary gear train, for any choice of input, output and fixed member."""

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

from wearlab.gears.specification import GearError

Central = Literal["sun", "ring", "carrier"]


class TrainSpeeds(NamedTuple):
    """Speeds of a train, positive in one sense for all members.

    Parameters
    ----------
    sun, planet, ring, carrier : absolute [rad/s]
    sun_relative, planet_relative, ring_relative : relative to the carrier [rad/s]
    """

    sun: float
    planet: float
    ring: float
    carrier: float
    sun_relative: float
    planet_relative: float
    ring_relative: float


class TrainTorques(NamedTuple):
    """External torques on the central members, positive in the sense of positive speeds [N·m]."""

    sun: float
    ring: float
    carrier: float


@dataclass(frozen=True)
class Train:
    """A planetary train with one degree of freedom.

    ``z_s (ω_s − ω_c) + z_r (ω_r − ω_c) = 0``, ``z_p (ω_p − ω_c) = −z_s (ω_s − ω_c)``,
    ``T_s / z_s = T_r / z_r = −T_c / (z_s + z_r)``.

    Parameters
    ----------
    sun_teeth, planet_teeth, ring_teeth : z_s, z_p, z_r [1]
    input, output, fixed : the three central members, in the three roles

    Raises
    ------
    GearError : a member in two roles

    References
    ----------
    Willis's equation; VDI 2157:2012.
    """

    sun_teeth: int
    planet_teeth: int
    ring_teeth: int
    input: Central = "sun"
    output: Central = "carrier"
    fixed: Central = "ring"

    def __post_init__(self) -> None:
        if {self.input, self.output, self.fixed} != set(get_args(Central)):
            raise GearError(
                f"input {self.input!r}, output {self.output!r} and fixed {self.fixed!r} must be sun, ring "
                "and carrier, each once"
            )

    def _weight(self, member: Central) -> float:
        """Return w with Σ w ω = 0 over the central members; torques are in the same ratio."""
        total = self.sun_teeth + self.ring_teeth
        return {"sun": self.sun_teeth, "ring": self.ring_teeth, "carrier": -total}[member]

    @property
    def ratio(self) -> float:
        """Speed of the output over that of the input [1]."""
        return -self._weight(self.input) / self._weight(self.output)

    def speeds(self, speed: float) -> TrainSpeeds:
        """Return all speeds from that of the input.

        Parameters
        ----------
        speed : of the input member [rad/s]
        """
        turning = {self.input: speed, self.output: speed * self.ratio, self.fixed: 0.0}
        sun, ring, carrier = turning["sun"], turning["ring"], turning["carrier"]
        planet = -(sun - carrier) * self.sun_teeth / self.planet_teeth
        return TrainSpeeds(sun, planet + carrier, ring, carrier, sun - carrier, planet, ring - carrier)

    def torques(self, torque: float, member: Central | None = None) -> TrainTorques:
        """Return the external torques on all central members from that on one, without losses.

        Parameters
        ----------
        torque : on that member [N·m]
        member : which; absent: the input
        """
        per_weight = torque / self._weight(member or self.input)
        return TrainTorques(*(per_weight * self._weight(name) for name in get_args(Central)))

    @property
    def sun_drives(self) -> bool:
        """Whether power flows from the sun over the planets to the ring, as seen from the carrier.

        It does when the torque on the sun acts in the sense in which the sun turns relative to the carrier.
        """
        return self.torques(1.0).sun * self.speeds(1.0).sun_relative > 0.0

    def mesh_frequency(self, speed: float) -> float:
        """Return the mesh frequency of both meshes, ``z_s |ω_s − ω_c| / 2π`` [Hz].

        Parameters
        ----------
        speed : of the input member [rad/s]
        """
        return self.sun_teeth * abs(self.speeds(speed).sun_relative) / (2.0 * math.pi)
