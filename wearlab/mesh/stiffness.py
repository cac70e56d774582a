"""How stiff one pair of teeth is: the choices a scene has, each a type.

Every choice answers the same three questions at the profile nodes: the compliance of
teeth and bodies for given wear, the compliance of the contact itself, and what
neighbouring pairs share.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array, Index
from wearlab.gears.specification import Material
from wearlab.mesh.profile import Lookup, ProfileGrid, at_phase_nodes


def yang_sun(first: Material, second: Material, face_width: float) -> float:
    """Return the constant Hertzian compliance of a line contact.

    ``c_h = 2/(π B) [(1 − ν1²)/E1 + (1 − ν2²)/E2]``: ``k_h = π E B / (4 (1 − ν²))`` for
    equal materials.

    Parameters
    ----------
    first, second : materials of the two flanks
    face_width : B [m]

    Returns
    -------
    compliance [m/N]

    References
    ----------
    Yang & Sun, J. Mech. Transm. Autom. Des. 107 (1985) 529–535,
    https://doi.org/10.1115/1.3260759, for equal materials; the sum over the two half
    spaces is the form that keeps each body's own share.
    """
    compliances = 1.0 / first.plane_strain_modulus + 1.0 / second.plane_strain_modulus
    return 2.0 / (math.pi * face_width) * compliances


@dataclass(frozen=True)
class ConstantContact:
    """A contact that yields in proportion to its force.

    Parameters
    ----------
    value : compliance [m/N]
    """

    load_dependent: ClassVar[bool] = False
    softening: ClassVar[float] = 0.0

    value: float

    def compliance(self, force: ArrayLike | None) -> float:
        """Return the compliance, whatever the force [m/N]."""
        return self.value


@dataclass(frozen=True)
class WeberContact:
    """Load-dependent line contact after Weber and Banaschek.

    Parameters
    ----------
    equivalent_radius : (n,) ρ, 1/ρ = 1/ρ1 + 1/ρ2 [m]
    depth : (2, n) t_i, from the contact point along the line of action to each tooth's
        centre line [m]
    materials : of the two gears
    face_width : B [m]
    """

    load_dependent: ClassVar[bool] = True

    equivalent_radius: ArrayLike
    depth: ArrayLike
    materials: tuple[Material, Material]
    face_width: float

    def compliance(self, force: ArrayLike | None) -> Array:
        """Return the secant compliance δ/F under pair forces (n,), (n,) [m/N].

        ``δ/F = 2/(π B) Σ_i (1 − ν_i²)/E_i [ln(2 t_i/a) − ν_i / (2 (1 − ν_i))]`` with
        the half width ``a² = 4 F ρ / (π B) [(1 − ν1²)/E1 + (1 − ν2²)/E2]``. It grows
        without bound, as −ln F, towards zero load: the half width is kept above a
        millionth of the depth. A contact wider than the tooth is deep has no such form:
        each bracket is kept at 0 or above.

        References
        ----------
        Weber & Banaschek, Formänderung und Profilrücknahme bei gerad- und
        schrägverzahnten Rädern, Schriftenreihe Antriebstechnik 11, Vieweg 1953;
        Johnson, Contact Mechanics, 1985, Eq. 5.57.
        """
        load = np.maximum(np.asarray(force, float), 0.0)
        half_width = np.sqrt(self._square_per_load * load)
        a = np.maximum(half_width, self._least_half_width)
        brackets = np.maximum(self._brackets_of_unit_width - np.log(a), 0.0)
        first = self._compliances[0] * brackets[0]
        second = self._compliances[1] * brackets[1]
        return np.asarray(2.0 / self._width * (first + second))

    @cached_property
    def _width(self) -> float:
        """π B [m]."""
        return math.pi * self.face_width

    @cached_property
    def _compliances(self) -> tuple[float, float]:
        """(1 − ν²)/E of both gears [1/Pa]."""
        first, second = self.materials
        return 1.0 / first.plane_strain_modulus, 1.0 / second.plane_strain_modulus

    @cached_property
    def _square_per_load(self) -> ArrayLike:
        """The square of the half width over the force, (n,) [m²/N]."""
        per_radius = 4.0 / self._width * sum(self._compliances)
        return per_radius * np.asarray(self.equivalent_radius)

    @cached_property
    def _least_half_width(self) -> Array:
        """Half width below which the contact yields no more, (n,) [m]."""
        return np.asarray(1e-6 * np.asarray(self.depth).max(axis=0))

    @cached_property
    def _brackets_of_unit_width(self) -> Array:
        """The brackets of a half width of 1 m, (2, n) [1]."""
        brackets = []
        for t, material in zip(np.asarray(self.depth), self.materials, strict=True):
            nu = material.poisson_ratio
            brackets.append(np.log(2.0 * t) - 0.5 * nu / (1.0 - nu))
        return np.stack(brackets)

    @property
    def softening(self) -> float:
        """Growth of the compliance as the force falls, ``−F dc/dF`` [m/N].

        ``1/(π B) Σ (1 − ν²)/E``, the same under all forces.
        """
        return sum(self._compliances) / self._width


HertzContact = ConstantContact | WeberContact
"""How the contact itself yields: ``load_dependent`` says whether that takes the force;
``softening`` by how much the compliance grows as the force shrinks, ``−F dc/dF``
[m/N]."""


@dataclass(frozen=True)
class PiecewiseCurve:
    """A piecewise smooth function through given points.

    Between jumps the shape-preserving cubic of Fritsch and Carlson (1980) is used: it
    never overshoots. Beyond its ends the curve keeps its end values.

    Parameters
    ----------
    x : (n,) abscissae, not descending; an abscissa that stands twice marks a jump
    y : (n,) ordinates
    """

    x: Array
    y: Array

    def __post_init__(self) -> None:
        if np.any(np.diff(self.x) < 0):
            raise ValueError("the abscissae of a table must not descend")

    @cached_property
    def _pieces(self) -> list[Any]:
        from scipy.interpolate import PchipInterpolator

        return [
            PchipInterpolator(x, y)
            if len(x) > 1
            else partial(np.full_like, fill_value=y[0])
            for x, y in zip(
                np.split(self.x, self._cuts), np.split(self.y, self._cuts), strict=True
            )
        ]

    @property
    def _cuts(self) -> Index:
        return np.flatnonzero(np.diff(self.x) == 0) + 1

    @property
    def jumps(self) -> tuple[float, ...]:
        """Abscissae at which the curve jumps."""
        return tuple(self.x[self._cuts].tolist())

    def value(self, x: Array, side: Array) -> Array:
        """Return the curve at places.

        Parameters
        ----------
        x : the places
        side : points on the side of a jump that is meant
        """
        x, side = np.broadcast_arrays(np.asarray(x, float), np.asarray(side, float))
        inside = np.clip(x, self.x[0], self.x[-1])
        piece = np.searchsorted(np.array(self.jumps), side, side="right")
        result = np.empty(x.shape)
        for index, curve in enumerate(self._pieces):
            on_piece = piece == index
            result[on_piece] = curve(inside[on_piece])
        return result


def constant(value: float) -> PiecewiseCurve:
    """Return the curve that has one value everywhere."""
    return PiecewiseCurve(np.array([0.0]), np.array([value]))


class PairStiffness(Protocol):
    """How a pair of teeth yields at the nodes of its path.

    What a subclass leaves out has a default here.
    """

    @property
    def load_dependent(self) -> bool:
        """Whether :meth:`contact` depends on the force."""
        return False

    @property
    def softening(self) -> float:
        """Growth of :meth:`contact` as the force falls, ``−F dc/dF``, roughly [m/N].

        However rough, it changes only how soon compliances and forces agree.
        """
        return 0.0

    @property
    def bends(self) -> Array:
        """Phases at which a prescribed course bends, (n,) [1]."""
        return np.empty(0)

    def body(self, wear: Array) -> Array:
        """Return the compliance of both teeth and bodies for wear (2, n), (n,) [m/N].

        Raises
        ------
        SectionVanished
            When a worn section of a tooth has no thickness left.
        """

    def body_where(
        self, wear: Array, nodes: Array, driving: Array, driven: Array
    ) -> Array:
        """Return the compliance where flanks meet off the line of action, (n,) [m/N].

        Where a stiffness does not tell the two gears apart, that of the nodes stands
        for it.

        Parameters
        ----------
        wear : (2, n) [m]
        nodes : (n,) path positions of the nodes [m]
        driving, driven : (n,) path positions of the flank points that meet there [m]
        """
        return self.body(wear)

    def contact(self, force: Array | None) -> Array | float:
        """Return the compliance of the contact under pair forces (n,), (n,) [m/N]."""
        return 0.0

    def cross(self, wear: Array) -> Array:
        """Return the compliance shared with pairs ahead, (n_apart, n) [m/N].

        Those 1, 2 … base pitches ahead.
        """
        return np.zeros((0, wear.shape[1]))

    def at_phases(self, where: Lookup) -> Array | None:
        """Return the stiffness of pairs at phases, (n, n_pairs) [N/m]; None: by nodes.

        0 out of the path.
        """
        return None

    def with_worn_backs(self, depth: Array) -> "PairStiffness":
        """Return the stiffness of teeth whose back flanks are worn as well.

        A stiffness that knows no sections stays as it is.
        """
        return self


@dataclass(frozen=True)
class EvenStiffness(PairStiffness):
    """One stiffness of a pair at all its nodes, of which wear takes nothing.

    Parameters
    ----------
    value : of the pair, the contact within it [N/m]
    """

    value: float

    def body(self, wear: Array) -> Array:
        """Return the compliance at the nodes, for any wear (2, n), (n,) [m/N]."""
        return np.full(wear.shape[1], 1.0 / self.value)


class SectionVanished(ValueError):
    """The wear is deeper than the tooth can bear: a section of it is gone."""


@dataclass(frozen=True)
class GivenStiffness(PairStiffness):
    """A prescribed stiffness, constant or from a table, of a pair or of the whole mesh.

    A mesh stiffness is shared out evenly among the pairs that are in the path at that
    phase.

    Parameters
    ----------
    curve : stiffness over phase (of the mesh, [0, 1]) or over ``(s − s_A)/p_b`` (of a
        pair, [0, ε]) [N/m]
    of_mesh : whether the curve is that of the whole mesh
    grid : the nodes
    """

    curve: PiecewiseCurve
    of_mesh: bool
    grid: ProfileGrid

    def scaled(self, factor: float) -> "GivenStiffness":
        """Return the stiffness times a factor.

        Parameters
        ----------
        factor : on all its values [1]
        """
        curve = PiecewiseCurve(self.curve.x, factor * self.curve.y)
        return replace(self, curve=curve)

    @property
    def bends(self) -> Array:
        """Phases of the points of the curve, (n,) [1]."""
        return np.asarray(self.curve.x % 1.0)

    def at_phases(self, where: Lookup) -> Array:
        """Return the stiffness of pairs, 0 out of the path, (n, n_pairs) [N/m]."""
        present = self.grid.first[where.segment] >= 0
        if self.of_mesh:
            low = self.grid.breaks[where.segment]
            high = self.grid.breaks[where.segment + 1]
            of_mesh = self.curve.value(where.phase, 0.5 * (low + high))
            value = of_mesh[:, None] / present.sum(axis=1, keepdims=True)
        else:
            place = where.phase[:, None] + self.grid.pair_numbers
            value = self.curve.value(place, place)
        return np.where(present, value, 0.0)

    def body(self, wear: Array) -> Array:
        """Return the reciprocal of the stiffness at the nodes, for any wear [m/N]."""
        pairs = self.grid.pairs_at_phase_nodes
        present = pairs >= 0
        at_phases = self.at_phases(at_phase_nodes(self.grid))
        nodal = np.empty(len(self.grid.contact_position))
        nodal[pairs[present]] = at_phases[present]
        return 1.0 / nodal
