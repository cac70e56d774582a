"""The load that worn flanks turn: against quadrature over the outline that is left, and
against the equations that Y23 prints.
"""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from wearlab.gears.outline import involute_point, load_angle, root_curve
from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import Basics, GearSpec
from wearlab.mesh import body, profile
from wearlab.mesh.load_direction import worn_line
from wearlab.mesh.stiffnesses.potential_energy import PotentialEnergyStiffness
from wearlab.mesh.tooth import tooth_compliance, tooth_flexibility

DEPTH = 100e-6


def internal_pair():
    """Y23, Table 1."""
    return gear_pair(
        GearSpec(name="pinion", teeth=40, bore_diameter=0.112),
        GearSpec(name="ring", teeth=100, tip_alteration="wang-2023", rim_diameter=0.7),
        Basics(0.006, face_width=0.05),
        driving="pinion",
        internal=True,
    )


def external_pair():
    return gear_pair(
        GearSpec(name="pinion", teeth=25, profile_shift_coefficient=0.3),
        GearSpec(name="gear", teeth=40),
        Basics(0.003, face_width=0.02),
    )


PAIRS = {"internal": internal_pair, "external": external_pair}


def quadratic(position):
    """Wear that is 0 at the pitch point."""
    return DEPTH * (position / np.abs(position).max()) ** 2


def by_quadrature(gear, angle, wear_at, back_at=lambda angle: 0.0):
    """Press on the worn outline along its own normal, and integrate the energies.

    The outline is told by points alone: its tangent is their difference, the moment is
    about the centroid of each section that is left.
    """
    up = gear.outwards

    def worn_point(lam):
        x, y = (float(value) for value in involute_point(gear, lam))
        depth = wear_at(lam)
        return np.array([x - up * depth * math.sin(lam), y - depth * math.cos(lam)])

    step = 1e-5
    tangent = worn_point(angle + step) - worn_point(angle - step)
    tangent /= np.linalg.norm(tangent)
    force = np.array([tangent[1], -tangent[0]])  # into the material
    force *= -np.sign(force[1])
    contact = worn_point(angle)
    E = gear.material.youngs_modulus
    G = gear.material.shear_modulus
    B = gear.face_width

    def energy(x, y, front, back):
        t = 2.0 * y - front - back
        centroid = 0.5 * (back - front)
        arm = contact - np.array([x, centroid])
        moment = arm[0] * force[1] - arm[1] * force[0]
        bending = moment**2 / (E * B * t**3 / 12.0)
        shear = 1.2 * force[1] ** 2 / (G * B * t)
        return bending + shear + force[0] ** 2 / (E * B * t)

    def on_root(fraction):
        x, y, rise = root_curve(gear, fraction)
        return energy(float(x), float(y), 0.0, 0.0) * up * float(rise)

    def on_flank(lam):
        x, y = (float(value) for value in involute_point(gear, lam))
        rise = float(involute_point(gear, lam + step)[0]) - float(
            involute_point(gear, lam - step)[0]
        )
        cos = math.cos(lam)
        left = energy(x, y, wear_at(lam) / cos, back_at(lam) / cos)
        return left * up * rise / (2.0 * step)

    def height_over_contact(lam):
        return up * (float(involute_point(gear, lam)[0]) - contact[0])

    start = float(load_angle(gear, gear.form_radius))
    low, high = sorted((start, angle))
    for _ in range(60):  # where the height of the worn contact point is
        middle = 0.5 * (low + high)
        inside = (height_over_contact(middle) < 0.0) == (start < angle)
        low, high = (middle, high) if inside else (low, middle)
    root = quad(on_root, 0.0, 1.0, epsrel=1e-9, limit=200)[0]
    return root + quad(on_flank, start, low, epsabs=0, epsrel=1e-9, limit=200)[0]


@pytest.mark.parametrize("kind", PAIRS)
@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("both", [False, True])
def test_a_turned_load_against_quadrature_at_tip_and_root(kind, side, both):
    pair = PAIRS[kind]()
    gear = pair.gears[side]
    s = np.linspace(pair.path.A, pair.path.E, 801)
    radius = pair.radius(side, s)
    angle = load_angle(gear, radius)
    depth = quadratic(s) + 5e-6
    order = np.argsort(angle)

    def wear_at(lam):
        # the grid's own wear where it is known, none below the active flank
        position = np.interp(lam, angle[order], s[order])
        lowest = angle.max() if gear.internal else angle.min()
        is_active = gear.outwards * (lam - lowest) >= -2e-5
        return is_active * (DEPTH * (position / np.abs(s).max()) ** 2 + 5e-6)

    flexibility = tooth_flexibility(gear, radius)
    if both:
        flexibility = flexibility._replace(back=depth)
    ideal = tooth_compliance(flexibility, depth)
    line = worn_line(gear, radius, depth)
    worn = tooth_compliance(flexibility._replace(force=line), depth)

    for node in (40, 200, 600, 760):
        back_at = wear_at if both else lambda lam: 0.0
        expected = by_quadrature(gear, float(angle[node]), wear_at, back_at)
        assert worn[node] == pytest.approx(expected, rel=3e-5, abs=0)
        turned_by = abs(worn[node] / ideal[node] - 1.0)
        assert turned_by > 1e-3  # so that the turn is seen


@pytest.mark.parametrize("kind", PAIRS)
@pytest.mark.parametrize(
    "options",
    [
        {"coupling": "none"},
        {"coupling": "shared", "foundation": "annulus", "correction": (1.1, 0.9)},
        {"foundation": "none"},
    ],
)
def test_flanks_that_are_not_worn_turn_nothing_to_the_bit(kind, options):
    pair = PAIRS[kind]()
    grid = profile.profile_grid(
        pair, 81, extension=profile.Extension(approach=2e-4, recess=3e-4)
    )
    ideal, worn = (
        PotentialEnergyStiffness(load_direction=direction, **options).build(pair, grid)
        for direction in ("ideal", "worn")
    )
    none = np.zeros((2, len(grid.contact_position)))
    s = grid.contact_position
    assert np.array_equal(ideal.body(none), worn.body(none))
    assert np.array_equal(ideal.cross(none), worn.cross(none))
    assert np.array_equal(
        ideal.body_where(none, s, s, s), worn.body_where(none, s, s, s)
    )
    # wear of one depth everywhere tilts no flank
    even = none + DEPTH
    assert worn.body(even) == pytest.approx(ideal.body(even), rel=1e-12, abs=0)


def test_a_turned_line_passes_the_worn_contact_point():
    """Its lever about the centre is that of the point along the force."""
    for kind in PAIRS:
        pair = PAIRS[kind]()
        for side, gear in enumerate(pair.gears):
            s = np.linspace(pair.path.A, pair.path.E, 2001)
            radius = pair.radius(side, s)
            depth = quadratic(s)
            line = worn_line(gear, radius, depth)
            x, y = involute_point(gear, load_angle(gear, radius))
            lam = load_angle(gear, radius)
            x = x - gear.outwards * depth * np.sin(lam)
            y = y - depth * np.cos(lam)
            lever = x * np.cos(line.angle)
            lever -= gear.outwards * y * np.sin(line.angle)
            assert line.lever == pytest.approx(lever, rel=1e-9, abs=0)
            tangent = np.gradient(y, x, edge_order=2)
            tan = -gear.outwards * tangent
            assert np.tan(line.angle) == pytest.approx(tan, abs=2e-6)


def as_printed(gear, angle, across, slope, wear_at):
    """Y23 Eqs. 20 and 34 to 37, letter by letter: beam and foundation of a wheel."""
    R = gear.base_radius
    root = gear.root_radius
    a2 = gear.base_half_angle
    E = gear.material.youngs_modulus
    nu = gear.material.poisson_ratio
    G = E / (2 * (1 + nu))
    b = gear.face_width
    a1 = angle
    lam = math.atan(math.tan(a1) + slope)
    sin = math.sin
    cos = math.cos
    h = R * ((a1 + a2) * cos(a1) - sin(a1)) - across
    d = R * ((a1 + a2) * sin(a1) + cos(a1)) - R * cos(a2)
    I_d1 = (2 * R * sin(a2)) ** 3 * b / 12
    A_d1 = 2 * R * sin(a2) * b

    def D(a):
        first = (a1 + a2) * sin(a1) + cos(a1) - (a - a2) * sin(a) - cos(a)
        second = across / R + sin(a1) - (a1 + a2) * cos(a1)
        return cos(lam) * first + sin(lam) * second

    def H(a):
        return sin(a) + (a2 - a) * cos(a) - wear_at(-a) / R

    def bend(a):
        return 3 * (a2 - a) * cos(a) * D(a) ** 2 / (2 * E * b * H(a) ** 3)

    def below(x):
        return ((d + x) * cos(lam) - h * sin(lam)) ** 2 / (E * I_d1)

    def area(a):
        return (a2 - a) * cos(a) / (E * b * H(a))

    thickness = quad(area, -a1, a2, epsrel=1e-9)[0]
    bending = quad(bend, -a1, a2, epsrel=1e-9)[0] + quad(below, 0, R - root)[0]
    shear = 1.2 * cos(lam) ** 2 * ((1 + nu) * thickness + (R - root) / (G * A_d1))
    axial = sin(lam) ** 2 * (0.5 * thickness + (R - root) / (E * A_d1))

    theta = body.root_half_angle(gear)
    L, M, P, Q = body.sainsot_coefficients(body.body_ratio(gear), theta)
    u = (R / cos(lam) - root) / (2 * root * theta)
    shape = L * u**2 + M * u + P * (1 + Q * math.tan(lam) ** 2)
    return bending + shear + axial, cos(lam) ** 2 * shape / (E * b)


@pytest.mark.parametrize(("end", "printed"), [(-1, 0.85), (0, -1.92)])
def test_signs_at_tip_and_root_are_those_of_the_printed_equations(end, printed):
    """A worn tip is stiffer by the printed beam, a root worn 100 µm deep softer.

    The line of action, which wear does not turn, says the opposite at both. Y23's Eq.
    37 puts the crossing at R_b/cos λ1 all the same, where no line through the worn
    point crosses: its foundation changes the other way.
    """
    pair = internal_pair()
    gear = pair.driving
    s = np.linspace(pair.path.A, pair.path.E, 801)
    radius = pair.radius(0, s)
    angle = load_angle(gear, radius)
    depth = quadratic(s)
    across = depth / np.cos(angle)
    height, _ = involute_point(gear, angle)
    slope = np.gradient(across, height, edge_order=2)

    def wear_at(lam):
        return float(np.interp(lam, angle, across, left=0.0))

    sound, foundation = as_printed(gear, angle[end], 0.0, 0.0, lambda lam: 0.0)
    worn, worn_foundation = as_printed(
        gear, angle[end], across[end], slope[end], wear_at
    )
    by_print = 100.0 * (sound / worn - 1.0)
    assert by_print == pytest.approx(printed, abs=0.02)

    flexibility = tooth_flexibility(gear, radius)._replace(back=depth)
    before = tooth_compliance(tooth_flexibility(gear, radius), np.zeros(801))
    line = worn_line(gear, radius, depth)
    turned = tooth_compliance(flexibility._replace(force=line), depth)
    ideal = tooth_compliance(flexibility, depth)
    here = 100.0 * (before / turned - 1.0)[end]
    unturned = 100.0 * (before / ideal - 1.0)[end]
    assert here * by_print > 0.0 > unturned * by_print
    assert here == pytest.approx(by_print, abs=0.9)

    body_here = foundation / float(body.foundation_along(gear, line)[end]) - 1.0
    assert body_here * by_print > 0.0
    assert (foundation / worn_foundation - 1.0) * by_print < 0.0
