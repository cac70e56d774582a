"""The flexibilities of a pair in series: teeth, bodies and contact.

A tooth by energy methods is a cantilever on the root circle, healthy or worn, at all
contact points at once. A unit force along the line of action at the contact point A
bends, shears and compresses every section between the root and A. In the section at
height x the moment about the section's own centroid is

    M(x) = r_b − x cosλ − ½ h_y(x) sinλ

(the line of action passes r_b from the gear's centre, and wear h on the loaded flank
moves the centroid by half of h_y = h / cosλ(x)). Wear of the back flank thins the
section as well, and moves the centroid the other way: h_y is then the difference of
both. A ring's tooth stands on the root circle too, and points inwards: with heights
counted inwards from its root, M = x cosλ − r_b − ½ h_y sinλ has the same form, and so
have all sums. M² is a polynomial in quantities of the contact point times quantities of
the section: running sums of 1/A, 1/I, x/I, x²/I, h_y/I, x h_y/I and h_y²/I give every
contact point in one pass.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import ArrayLike

from wearlab.arrays import Array, Index
from wearlab.compiled import jit, jit_inner
from wearlab.gears import outline
from wearlab.gears.gear import DRIVEN, DRIVING, Gear, GearPair
from wearlab.mesh import body, profile, stiffness
from wearlab.mesh.finite_element import compliance, elements

INNER = leggauss(2)
"""Places and weights between neighbouring nodes: fourth order in their distance."""
ROOT = leggauss(48)
"""The same over the root curve, and over the involute below the lowest node."""
BETWEEN_NODES = 0.5 * (INNER[0] + 1.0)
"""The same places as shares of the way to the next node [1]."""
REFINEMENT = 2
"""Of the elements of a scene: within 0.4 % of the teeth's compliance, in a third of a
second a pair."""
NARROW = 3.0
"""Face width in modules below which a pair is computed in plane stress; solid elements
say so for two modules."""


Foundation = Callable[[Gear, body.ForceLine], Array]
"""Compliance of a wheel body along lines of force (n,), (n,) [m/N]."""


class ToothFlexibility(NamedTuple):
    """Everything about one gear's tooth that wear does not change.

    Nodes in the order of the path.

    Heights are counted from the foot of the root curve towards the tip.

    Parameters
    ----------
    rising : whether contact moves from root to tip along the path (driving gear) or
        back (driven)
    root : (7,) the sums of `_add_section` from the root to the lowest node
    height, half_thickness : (n,) contact point (x, y) [m]
    foot : height of the foot of the root curve above the gear's centre [m]
    outwards : 1, of a ring −1
    angle : (n,) λ of the unworn flank's normal [rad]
    force : (n,) lines of the unit forces: the line of action, unless worn flanks turn
        it
    foundation : (n,) compliance of the wheel body [m/N]
    sections : (4, n − 1, points) x [m], healthy thickness 2y [m], 1 / cosλ(x) and dx
        [m] of the Gauss rule between the k-th and (k+1)-th node counted from the root
        upwards
    bending, shear, axial : 12/(E B) [m/N], shear_factor/(G B) [m/N], 1/(E B) [m/N]
    minimum_thickness : a section this thin counts as broken [m]
    back : (n,) wear of the back flank along its normal, at the radii of the nodes [m]
    """

    rising: bool
    root: Array
    height: Array
    half_thickness: Array
    foot: float
    outwards: float
    angle: Array
    force: body.ForceLine
    foundation: Array
    sections: Array
    bending: float
    shear: float
    axial: float
    minimum_thickness: float
    back: Array


def tooth_flexibility(
    gear: Gear,
    radius: ArrayLike,
    *,
    shear_factor: float = 1.2,
    foundation: Foundation = body.foundation_along,
) -> ToothFlexibility:
    """Prepare the tooth of a gear for contact at given radii.

    Parameters
    ----------
    gear : the gear
    radius : (n,) contact radii in the order of the path [m]: never falling or never
        rising; equal neighbours are the two sides of a jump
    shear_factor : shear correction of the section [1]; 1.2 for a rectangle
    foundation : compliance of the wheel body along lines of force (n,) [m/N]:
        Sainsot's, or the annulus's (:func:`wearlab.mesh.body.annulus_along`), which
        thin rims need

    Returns
    -------
    ToothFlexibility

    Raises
    ------
    ValueError : radii that are not monotone, or outside the involute

    References
    ----------
    Yang & Lin, J. Mech. Transm. Autom. Des. 109 (1987) 189–196; L16, W23 and Y23 use
    the same energies.
    """
    r = np.asarray(radius, dtype=float)
    growing = bool(r[-1] >= r[0])
    _check_radii(gear, r, growing)
    rising = growing != gear.internal
    upwards = gear.outwards
    force = body.line_of_action(gear, r)
    lam = force.angle
    foot = gear.root_radius * math.cos(outline.root_half_angle(gear))
    root = _root_sums(gear, lam[0 if rising else -1], foot)
    x, y = outline.involute_point(gear, lam)
    E = gear.material.youngs_modulus
    G = gear.material.shear_modulus
    B = gear.face_width
    tip_half_thickness = gear.tip_radius * gear.half_angle(gear.tip_radius)
    return ToothFlexibility(
        rising=rising,
        root=root,
        height=upwards * (x - foot),
        half_thickness=y,
        foot=foot,
        outwards=upwards,
        angle=lam,
        force=force,
        foundation=foundation(gear, force),
        sections=_sections(gear, lam if rising else lam[::-1], foot, INNER),
        bending=12.0 / (E * B),
        shear=shear_factor / (G * B),
        axial=1.0 / (E * B),
        minimum_thickness=min(0.02 * gear.module, tip_half_thickness),
        back=np.zeros_like(r),
    )


def _check_radii(gear: Gear, radius: Array, growing: bool) -> None:
    """Raise a `ValueError` for radii that turn back or lie beside the involute."""
    growth = np.diff(radius) if growing else -np.diff(radius)
    if np.any(growth < -1e-12 * gear.base_radius):
        raise ValueError(f"{gear.name}: contact radii must be monotone along the path")
    slack = 1e-9 * gear.base_radius
    low, high = sorted((gear.form_radius, gear.tip_radius))
    if radius.min() < low - slack or radius.max() > high + slack:
        raise ValueError(
            f"{gear.name}: contact radii {radius.min():.6g} to {radius.max():.6g} m "
            "leave the involute "
            f"between {gear.form_radius:.6g} and {gear.tip_radius:.6g} m"
        )


def _sections(gear: Gear, lam: Array, foot: float, rule: tuple[Array, Array]) -> Array:
    """Return Gauss sections between load angles, (4, n − 1, points).

    Height, thickness, slope and weight, see `ToothFlexibility`.
    """
    places, weights = rule
    step = np.diff(lam)[:, None]
    angle = lam[:-1, None] + 0.5 * step * (places + 1.0)
    x, y = outline.involute_point(gear, angle)
    height = gear.outwards * (x - foot)
    dx = 0.5 * weights * step * outline.involute_rise(gear, angle)
    return np.stack([height, 2.0 * y, 1.0 / np.cos(angle), gear.outwards * dx])


def _root_sums(gear: Gear, lowest: float, foot: float) -> Array:
    """Return the sums from the foot of the root curve to the lowest node, (7,)."""
    places, weights = ROOT
    x_root, y_root, rise = outline.root_curve(gear, 0.5 * (places + 1.0))
    height_root = gear.outwards * (x_root - foot)
    dx_root = gear.outwards * 0.5 * weights * rise

    start = float(outline.load_angle(gear, gear.form_radius))
    involute = _sections(gear, np.array([start, lowest]), foot, ROOT)[:, 0]
    height, thickness, _, dx = involute

    sums = np.zeros(7)
    _add_unworn(height_root, 2.0 * y_root, dx_root, sums)
    _add_unworn(height, thickness, dx, sums)
    return sums


@jit(counted=False)
def _add_unworn(x, t, dx, sums):  # type: ignore[no-untyped-def]
    """Add unworn sections of heights, thicknesses and weights (n,) to sums (7,)."""
    for section in range(len(x)):
        _add_section(x[section], t[section], dx[section], 0.0, sums)


def tooth_compliance(tooth: ToothFlexibility, wear: Array) -> Array:
    """Return the compliance of a worn tooth at every node, without its body.

    ``c = ∫ M²/(E I) + κ cos²λ ∫ 1/(G A) + sin²λ ∫ 1/(E A)`` with ``A = B t``, ``I = B
    t³/12`` and ``t = 2y − h_y`` less the back flank's wear, from the root to the worn
    contact point ``x_A − h sinλ``. Without wear every term in h is an exact zero. Wear
    between nodes is linear along the path. A force that a worn flank turns has its own
    λ and lever in M, shear and compression (`ToothFlexibility.force`).

    Parameters
    ----------
    tooth : the prepared tooth
    wear : (n,) wear depth along the flank normal [m]

    Returns
    -------
    (n,) bending, shear and axial compliance; NaN where a section no longer holds, and
    beyond [m/N]

    References
    ----------
    W23, whose Eq. 16 has the worn section: here about its own centroid, without the
    term that stays at h = 0.
    """
    compliance = np.empty(len(wear))
    _fill_compliance(tooth, np.array(tooth.root), wear, compliance)
    return compliance


@jit(counted=False)
def _fill_compliance(tooth, sums, wear, compliance):  # type: ignore[no-untyped-def]
    """Fill what `tooth_compliance` returns, from the root upwards.

    The sums of `_add_section` are those up to the lowest node at first.
    """
    n = len(wear)
    is_gone = False
    for k in range(n):
        node = k if tooth.rising else n - 1 - k
        if k > 0:
            _add_sections_below(tooth, wear, k, sums)
        compliance[node] = _compliance_at(tooth, wear[node], node, sums)

        is_gone = is_gone or np.isnan(compliance[node])
        if is_gone:
            compliance[node] = np.nan


@jit_inner(counted=False)
def _add_sections_below(tooth, wear, k, sums):  # type: ignore[no-untyped-def]
    """Add the sections between the k-th node, counted from the root, and that below."""
    node = k if tooth.rising else len(wear) - 1 - k
    below = node - 1 if tooth.rising else node + 1
    for point in range(len(BETWEEN_NODES)):
        way = BETWEEN_NODES[point]
        front = wear[below] + way * (wear[node] - wear[below])
        back = tooth.back[below] + way * (tooth.back[node] - tooth.back[below])

        x = tooth.sections[0, k - 1, point]
        unworn = tooth.sections[1, k - 1, point]
        slope = tooth.sections[2, k - 1, point]
        dx = tooth.sections[3, k - 1, point]
        h = slope * front
        b = slope * back
        t = unworn - h - b
        if not t > tooth.minimum_thickness:
            t = np.nan
        _add_section(x, t, dx, h - b, sums)


@jit_inner(counted=False)
def _add_section(x, t, dx, h, sums):  # type: ignore[no-untyped-def]
    """Add 1/t, 1/t³, x/t³, x²/t³, h/t³, x h/t³ and h²/t³ of a section, times dx."""
    cube = dx / t**3
    sums[0] += dx / t
    sums[1] += cube
    sums[2] += cube * x
    sums[3] += cube * x * x
    sums[4] += cube * h
    sums[5] += cube * h * x
    sums[6] += cube * h * h


@jit_inner(counted=False)
def _compliance_at(tooth, wear, node, sums):  # type: ignore[no-untyped-def]
    """Return the compliance of a tooth that touches at a node [m/N]."""
    K0 = sums[0]
    J0 = sums[1]
    J1 = sums[2]
    J2 = sums[3]
    H0 = sums[4]
    H1 = sums[5]
    HH = sums[6]
    cos = math.cos(tooth.force.angle[node])
    sin = math.sin(tooth.force.angle[node])
    arm = tooth.outwards * (tooth.force.lever[node] - tooth.foot * cos)

    stretch = tooth.shear * cos**2 + tooth.axial * sin**2
    bend = arm**2 * J0 - 2.0 * arm * cos * J1 + cos**2 * J2
    bend += sin * (cos * H1 - arm * H0) + 0.25 * sin**2 * HH

    # the strip above the worn contact point, at its middle, carries nothing any more
    flank_cos = math.cos(tooth.angle[node])
    flank_sin = math.sin(tooth.angle[node])
    strip = wear * flank_sin
    h = wear / flank_cos
    b = tooth.back[node] / flank_cos
    t = 2.0 * tooth.half_thickness[node] + strip * flank_sin / flank_cos - h - b
    if not t > tooth.minimum_thickness:
        return np.nan
    height = tooth.height[node] - 0.5 * strip
    moment = arm - height * cos - 0.5 * (h - b) * sin

    bending = tooth.bending * (bend - strip / t**3 * moment**2)
    return bending + stretch * (K0 - strip / t)


Sharing = tuple["SharedBodies", ...]
"""What pairs share with those 1, 2 … base pitches ahead."""
Teeth = tuple[ToothFlexibility, ...]
"""The two teeth of a pair, (driving, driven)."""


@dataclass(frozen=True, kw_only=True)
class InSeries(stiffness.PairStiffness):
    """Teeth and bodies in series with the contact.

    ``1/k = 1/k_h + Σ_gears (1/k_b + 1/k_s + 1/k_a + 1/(λ k_f))``: beams, and what wear
    does not change: the foundations, or for elements of the unworn gears what they
    yield beyond the unworn beams. Wear makes them softer by as much as it does the
    beams: 100 µm off both flanks of a module of 3 mm by some 2.7 per cent near the tip
    (:func:`wearlab.mesh.finite_element.compliance.solve_gear` takes a worn outline for
    comparison). What wear does to gaps and load sharing is not part of a stiffness.

    Parameters
    ----------
    hertz : how the contact itself yields
    rest : (2, n) what yields of each gear beside its beam, or (1, n) of both where
        nothing tells them apart [m/N]
    shared : (n_apart, n) compliance shared with the pair 1, 2 … base pitches ahead, 0
        where there is none [m/N]
    scale : factor on the stiffness of the whole pair, 1 unless tuned [1]
    teeth : the two teeth as beams, (driving, driven); none: wear takes nothing off
        their sections
    """

    hertz: stiffness.HertzContact
    rest: Array
    shared: Array
    scale: float = 1.0
    teeth: Teeth = ()

    @property
    def load_dependent(self) -> bool:
        """Whether the contact's compliance depends on the force."""
        return self.hertz.load_dependent

    def contact(self, force: Array | None) -> Array | float:
        """Return the compliance of the contact [m/N].

        Parameters
        ----------
        force : (n,) of the pairs [N]; None where it does not matter
        """
        return self.hertz.compliance(force) / self.scale

    @property
    def softening(self) -> float:
        """Growth of the contact's compliance as the force falls, ``−F dc/dF`` [m/N]."""
        return self.hertz.softening / self.scale

    def with_worn_backs(self, depth: Array) -> Self:
        """Return the stiffness of teeth whose back flanks are worn as well.

        Parameters
        ----------
        depth : (2, n) along the normal of the back flanks [m]
        """
        teeth = tuple(
            tooth._replace(back=np.array(back))
            for tooth, back in zip(self.teeth, depth, strict=False)
        )
        return replace(self, teeth=teeth)

    def beams_and_rest(self, wear: Array) -> tuple[Array, Array]:
        """Return what yields of each gear as a beam, and beside it [m/N].

        (2, n), and like `rest`.

        Parameters
        ----------
        wear : (2, n) depths, (driving, driven) [m]
        """
        return beams_of(self.teeth, wear), self.rest

    def body(self, wear: Array) -> Array:
        """Return the compliance of both teeth and bodies, (n,) [m/N].

        Parameters
        ----------
        wear : (2, n) depths, (driving, driven) [m]
        """
        beams, rest = self.beams_and_rest(wear)
        return np.asarray((beams.sum(axis=0) + rest.sum(axis=0)) / self.scale)

    def body_where(
        self, wear: Array, nodes: Array, driving: Array, driven: Array
    ) -> Array:
        """Return the compliance where flanks meet off the line of action, (n,) [m/N].

        Of each tooth and body at its own flank point, see `PairStiffness.body_where`.
        """
        if len(self.rest) == 1:
            return self.body(wear)
        beams, rest = self.beams_and_rest(wear)
        first, second = (beams + rest) / self.scale
        of_driving = np.interp(driving, nodes, first)
        of_driven = np.interp(driven, nodes, second)
        return np.asarray(of_driving + of_driven)

    def cross(self, wear: Array) -> Array:
        """Return the compliance shared with pairs ahead, (n_apart, n) [m/N]."""
        return self.shared / self.scale


def beams_of(teeth: Teeth, wear: Array) -> Array:
    """Return the compliance of teeth as beams, (2, n) [m/N].

    Parameters
    ----------
    teeth : both, or none
    wear : (2, n) depths, (driving, driven) [m]

    Raises
    ------
    SectionVanished
        When a worn section of a tooth has no thickness left.
    """
    beams = np.zeros_like(wear)
    for tooth, depth, beam in zip(teeth, wear, beams, strict=False):
        beam[:] = tooth_compliance(tooth, depth)
    if np.isnan(beams).any():
        raise stiffness.SectionVanished("section vanished")
    return beams


def plane_of(option: Any, pair: GearPair) -> elements.Plane:
    """Return the plane state in which a pair is computed.

    Parameters
    ----------
    option : strain, stress, or by-width: strain for gears that are wide enough
    pair : the gears
    """
    is_wide = pair.face_width >= NARROW * pair.driving.module
    by_width: elements.Plane = "strain" if is_wide else "stress"
    return by_width if option == "by-width" else option


def finite_element(model: Any, pair: GearPair, grid: profile.ProfileGrid) -> InSeries:
    """Return the stiffness of a pair at its nodes, from the elements of both gears.

    Parameters
    ----------
    model : options of the variant
    pair : the gears
    grid : the nodes
    """
    plane = plane_of(model.plane, pair)
    options = elements.Options(plane=plane, refinement=REFINEMENT)
    recess = float(grid.contact_position[-1] - grid.position[-1])
    by_elements, shared = compliance.pair_compliance(
        pair, grid.position, grid.n_pairs, options, recess=recess
    )
    teeth = _teeth(in_plane(pair, plane), grid)
    unworn = beams_of(teeth, np.zeros((2, len(grid.loaded)))).sum(axis=0)
    rest = (grid.beyond(by_elements) - unworn)[None]
    return InSeries(
        hertz=contact_of(model.hertz, pair, grid),
        rest=rest,
        shared=grid.beyond(shared),
        scale=model.scale,
        teeth=teeth,
    )


def in_plane(pair: GearPair, plane: elements.Plane) -> GearPair:
    """Return a pair that in plane stress yields as this one in a plane state.

    Parameters
    ----------
    pair : the gears
    plane : the plane state
    """
    driving, driven = (
        gear._replace(material=gear.material.in_plane(plane)) for gear in pair.gears
    )
    return pair._replace(driving=driving, driven=driven)


def _teeth(pair: GearPair, grid: profile.ProfileGrid, **options: Any) -> Teeth:
    """Return both teeth of a pair, prepared at the nodes; see `tooth_flexibility`."""
    return tuple(
        tooth_flexibility(gear, radius, **options)
        for gear, radius in zip(pair.gears, _radii(pair, grid), strict=True)
    )


def _radii(pair: GearPair, grid: profile.ProfileGrid) -> list[Array]:
    """Return the contact radii of both gears at the nodes, (n_contact,) each [m]."""
    return [pair.radius(i, grid.loaded) for i in (DRIVING, DRIVEN)]


def potential_energy(model: Any, pair: GearPair, grid: profile.ProfileGrid) -> InSeries:
    """Return the flexibilities of a pair by the potential-energy method.

    Parameters
    ----------
    model : options of the variant
    pair : the gears
    grid : the nodes

    References
    ----------
    L16, W23, Y23: ``1/k = 1/k_h + Σ (1/k_b + 1/k_s + 1/k_a + 1/(λ k_f))``; L16 prints
    Eq. 16 inverted.
    """
    flat = in_plane(pair, model.plane)
    return sharing_bodies(model, pair, grid, shared_bodies(model, flat, grid))


def sharing_bodies(
    model: Any, pair: GearPair, grid: profile.ProfileGrid, sharing: Sharing
) -> InSeries:
    """Return the flexibilities of a pair that shares bodies with others.

    Parameters
    ----------
    model : options of the variant
    pair : the gears
    grid : the nodes
    sharing : what it shares, as of `shared_bodies`
    """
    flat = in_plane(pair, model.plane)
    foundation = BODIES[model.foundation]
    teeth = _teeth(flat, grid, shear_factor=model.shear_factor, foundation=foundation)
    bodies = []
    for tooth, correction in zip(teeth, model.correction, strict=True):
        bodies.append(tooth.foundation / correction)
    rest = np.stack(bodies)

    return InSeries(
        hertz=contact_of(model.hertz, pair, grid),
        rest=rest,
        shared=shared_compliance(sharing, rest),
        scale=model.scale,
        teeth=teeth,
    )


def contact_of(
    hertz: str, pair: GearPair, grid: profile.ProfileGrid
) -> stiffness.HertzContact:
    """Return how the contact of a pair yields.

    Parameters
    ----------
    hertz : weber: by its load; yang-sun: in proportion to it
    pair : the gears
    grid : the nodes
    """
    materials = pair.driving.material.at_flank, pair.driven.material.at_flank
    if hertz == "yang-sun":
        compliance_of_line = stiffness.yang_sun(*materials, pair.face_width)
        return stiffness.ConstantContact(compliance_of_line)

    depth = np.stack([*map(outline.contact_depth, pair.gears, _radii(pair, grid))])
    return stiffness.WeberContact(
        equivalent_radius=pair.equivalent_curvature(grid.loaded),
        depth=depth,
        materials=materials,
        face_width=pair.face_width,
    )


BODIES: dict[str, Foundation] = {
    "sainsot": body.foundation_along,
    "annulus": body.annulus_along,
    "none": body.rigid_along,
}


class SharedBodies(NamedTuple):
    """How much of their bodies two pairs share that touch at the same phases.

    Parameters
    ----------
    behind, ahead : (m,) nodes at which the two touch
    ratio : (2, m) shared compliance over the mean of both, (driving, driven) [1]
    """

    behind: Index
    ahead: Index
    ratio: Array


def shared_bodies(model: Any, pair: GearPair, grid: profile.ProfileGrid) -> Sharing:
    """Return what pairs share with those 1, 2 … base pitches ahead.

    Parameters
    ----------
    model : options of the variant
    pair : the gears as they yield in their plane
    grid : the nodes
    """
    if model.foundation == "none" or model.coupling == "none":
        return ()
    return tuple(_shared(pair, grid, apart) for apart in range(1, grid.n_pairs))


def _shared(pair: GearPair, grid: profile.ProfileGrid, pitches: int) -> SharedBodies:
    """Return what a pair shares with one some base pitches ahead."""
    behind = grid.pairs_at_phase_nodes[:, pitches:]
    ahead = grid.pairs_at_phase_nodes[:, :-pitches]
    in_path = (behind >= 0) & (ahead >= 0)
    first = behind[in_path]
    second = ahead[in_path]

    ratios = []
    for gear, radius in zip(pair.gears, _radii(pair, grid), strict=True):
        ratios.append(body.body_coupling(gear, radius[first], radius[second], pitches))
    return SharedBodies(first, second, np.stack(ratios))


def shared_compliance(sharing: Sharing, bodies: Array) -> Array:
    """Return the compliance shared with pairs ahead, (n_apart, n) [m/N].

    Parameters
    ----------
    sharing : with pairs 1, 2 … base pitches ahead
    bodies : (2, n) compliance of the wheel bodies, (driving, driven) [m/N]
    """
    shared = np.zeros((len(sharing), bodies.shape[1]))
    for row, (behind, ahead, ratio) in zip(shared, sharing, strict=True):
        mean = np.sqrt(bodies[:, behind] * bodies[:, ahead])
        row[behind] = (ratio * mean).sum(axis=0)
    return shared
