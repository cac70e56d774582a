"""The stiffness of a pair of gears from finite elements, at the nodes of its path."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.pair import DRIVING, GearPair
from wearlab.mesh.finite_element.cache import gear_compliance
from wearlab.mesh.finite_element.flank import LoadedFlank
from wearlab.mesh.finite_element.gear_compliance import GearCompliance
from wearlab.mesh.finite_element.options import Options
from wearlab.mesh.stiffness import HertzInSeries, SectionVanished
from wearlab.mesh.tooth import ToothFlexibility, tooth_compliance

DISTANCE_SLACK = 1e-9


@dataclass(frozen=True)
class FiniteElement(HertzInSeries):
    """Teeth and bodies of both gears by plane finite elements, and the contact in series.

    The elements are those of the unworn gears; what wear takes off their sections makes them softer by as
    much as it does the beams of the potential-energy method: 100 µm off both flanks of a module of 3 mm by
    some 2.7 per cent near the tip (:func:`solve_gear` takes a worn outline for comparison). What wear does to
    gaps and load sharing is not part of a stiffness.

    Parameters
    ----------
    hertz, scale : as of `HertzInSeries`
    own : (n,) compliance of both gears' teeth and bodies [m/N]
    shared : (n_apart, n) what it shares with the pair 1, 2 … base pitches ahead, 0 where there is none [m/N]
    teeth : the two teeth as beams, (driving, driven), None: wear takes nothing off their sections
    """

    own: Array
    shared: Array
    teeth: tuple[ToothFlexibility, ToothFlexibility] | None = None

    def body(self, wear: Array) -> Array:
        """Return the compliance of both teeth and bodies, (n,) [m/N]."""
        return (self.own + self._beams(wear) - self._unworn_beams) / self.scale

    @cached_property
    def _unworn_beams(self) -> Array:
        return self._beams(np.zeros((2, len(self.own))))

    def _beams(self, wear: Array) -> Array:
        """Return the compliance of both teeth as beams, without bodies, (n,) [m/N]."""
        total, out, unused = np.zeros((3, len(self.own)))
        for flexibility, depth in zip(self.teeth or (), wear, strict=False):
            if not tooth_compliance(flexibility, depth, out, unused):
                raise SectionVanished("section vanished")
            total += out
        return total

    def cross(self, wear: Array) -> Array:
        """Return the compliance shared with pairs 1, 2 … base pitches ahead, (n_apart, n) [m/N]."""
        return self.shared / self.scale


def pair_compliance(
    pair: GearPair,
    position: Array,
    pairs: int,
    options: Options = Options(),  # noqa: B008
    solved: tuple[GearCompliance, GearCompliance] | None = None,
    recess: float = 0.0,
) -> tuple[Array, Array]:
    """Return what pairs of teeth yield along the line of action, own and shared.

    Parameters
    ----------
    pair : the gears
    position : (n,) path positions [m]
    pairs : largest number of pairs in contact
    options : of mesh and load
    solved : what the two gears yield, (driving, driven), when they are worn; absent: unworn gears
    recess : how far beyond E pairs may touch; there they yield as at E [m]

    Returns
    -------
    own (n,) and shared (pairs − 1, n) [m/N]; the latter with the pair 1, 2 … base pitches ahead, 0 where
    that one is out of the path
    """
    s = np.asarray(position, dtype=float)
    compliances = solved or tuple(gear_compliance(gear, options) for gear in pair.gears)
    own, shared = np.zeros(len(s)), np.zeros((pairs - 1, len(s)))
    for index, (gear, compliance) in enumerate(zip(pair.gears, compliances, strict=True)):
        flank = LoadedFlank(gear)
        here = compliance.weights(flank.parameter(pair.radius(index, s)))
        own += here @ compliance.own / gear.face_width
        for apart in range(1, pairs):
            ahead = s + apart * pair.base_pitch
            inside = ahead <= pair.path.E + recess + DISTANCE_SLACK * pair.base_pitch
            touched = np.minimum(ahead[inside], pair.path.E) if recess else ahead[inside]
            there = compliance.weights(flank.parameter(pair.radius(index, touched)))
            both = _across(compliance, apart, here[inside], there, leads=index == DRIVING)
            shared[apart - 1, inside] += both / gear.face_width
    return own, shared


def _across(solved: GearCompliance, apart: int, here: Array, there: Array, *, leads: bool) -> Array:
    """Return the compliance between a tooth and the one ahead of it.

    The mate pushes a driving tooth back and a driven tooth on: the tooth ahead lies on the loaded flank's
    side of a driving tooth, and on the other side of a driven one.
    """
    first, second = (here, there) if leads else (there, here)
    between: Array = np.einsum("no,ol,nl->n", second, solved.across[apart - 1], first)
    return between
