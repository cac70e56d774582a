"""The elements against closed forms, and the wheel from one sector against the wheel
element by element.
"""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve
from skfem import MeshQuad, MeshQuad2

from wearlab.gears.making import build_gear
from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import STEEL, Basics, GearSpec
from wearlab.mesh.finite_element.compliance import through_cuts
from wearlab.mesh.finite_element.elements import (
    assemble,
    flank_loads,
    half_plane_compliance,
    sector,
)
from wearlab.mesh.finite_element.outline import LoadedFlank, chart

E = STEEL.youngs_modulus
NU = STEEL.poisson_ratio


def few_teeth():
    """Return gears of so few teeth that the whole wheel can be
    assembled: external, and a ring.
    """
    external = gear_pair(
        GearSpec(
            name="first", teeth=10, profile_shift_coefficient=0.5, bore_diameter=0.006
        ),
        GearSpec(name="second", teeth=40),
        Basics(0.002, face_width=0.01),
    ).driving
    ring = build_gear(
        GearSpec(name="ring", teeth=25, tip_diameter=0.0485, rim_diameter=0.065),
        Basics(0.002, pressure_angle=math.radians(20), face_width=0.01, material=STEEL),
        profile_shift=0.0,
        internal=True,
    )
    return external, ring


EXTERNAL, RING = few_teeth()


def wheel(one, loads, teeth_apart):
    held, beyond = through_cuts(one, loads, teeth_apart)
    return np.concatenate([beyond[:1] + held, beyond[1:]])


def mapped(across, along, shape):
    """Return a mesh of a rectangle's image."""
    plain = MeshQuad2.from_mesh(MeshQuad.init_tensor(across, along))
    return MeshQuad2(np.stack(shape(*plain.doflocs)), plain.t)


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_cantilever_with_shear(plane):
    """Deflection of a beam under a parabolic end shear, held as in
    the exact solution: Timoshenko's (21).
    """
    length, height, force = 10.0, 1.0, 1.0
    mesh = mapped(
        np.linspace(0, length, 41),
        np.linspace(-height / 2, height / 2, 5),
        lambda x, y: (x, y),
    )
    dofs, K = assemble(mesh, STEEL, plane)
    x, y = mesh.doflocs
    modulus = E if plane == "stress" else E / (1 - NU**2)
    nu = NU if plane == "stress" else NU / (1 - NU)
    inertia = height**3 / 12
    end = np.isclose(x, length)
    held = dofs[:, end]
    c = height / 2
    G = E / (2 * (1 + NU))
    # clamped by the exact displacements for an end whose middle stands upright
    # (Timoshenko & Goodier, 21)
    u = -nu * y**3 / (6 * modulus * inertia) + y**3 / (6 * inertia * G)
    u = force * (u - (x**2 - length**2) * y / (2 * modulus * inertia))
    v = nu * x * y**2 / 2 + x**3 / 6 - length**2 * x / 2 + length**3 / 3
    v = force * v / (modulus * inertia) + force * c**2 / (2 * inertia * G) * (
        length - x
    )
    tip = np.flatnonzero(np.isclose(x, 0.0))
    tip = tip[np.argsort(y[tip])]
    load = np.zeros(K.shape[0])
    points, weights = np.polynomial.legendre.leggauss(4)
    for low, middle, high in zip(tip[:-2:2], tip[1::2], tip[2::2], strict=True):
        t = 0.5 * (points + 1)
        place = y[low] + (y[high] - y[low]) * t
        shear = (
            force
            / (2 * inertia)
            * (c**2 - place**2)
            * 0.5
            * weights
            * (y[high] - y[low])
        )
        shapes = ((1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1))
        for node, shape in zip((low, middle, high), shapes, strict=True):
            load[dofs[1, node]] += np.sum(shear * shape)
    solution = np.zeros(K.shape[0])
    solution[held] = np.stack([u, v])[:, end]
    free = np.setdiff1d(np.arange(K.shape[0]), held.ravel())
    rest = load - K @ solution
    solution[free] = spsolve(K[free][:, free].tocsc(), rest[free])
    assert np.abs(solution[dofs[1]] - v).max() < 1e-4 * v.max()
    slender = force * length**3 / (3 * modulus * inertia)
    assert (
        1.004 < solution[dofs[1, tip[len(tip) // 2]]] / slender < 1.02
    )  # the shear's share


@pytest.mark.parametrize(("plane", "refinement"), [("strain", 2), ("stress", 2)])
def test_thick_ring_under_pressure(plane, refinement):
    """Lamé: u_r(a) = p a/E' [(a² + b²)/(b² − a²) + ν'] under internal pressure.

    Quarter ring by symmetry.
    """
    a, b = 1.0, 2.0

    def shape(r, t):
        return r * np.cos(t), r * np.sin(t)

    errors = []
    for n in (refinement, 2 * refinement):
        radii = np.linspace(a, b, 2 * n + 1)
        angles = np.linspace(0, np.pi / 2, 2 * n + 1)
        mesh = mapped(radii, angles, shape)
        dofs, K = assemble(mesh, STEEL, plane)
        x, y = mesh.doflocs
        inner = np.flatnonzero(np.isclose(np.hypot(x, y), a, rtol=1e-6))
        inner = inner[np.argsort(np.arctan2(y[inner], x[inner]))]
        load = np.zeros(K.shape[0])
        t, w = np.polynomial.legendre.leggauss(4)
        t = 0.5 * (t + 1)
        w = 0.5 * w
        shapes = np.stack([(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)])
        slopes = np.stack([4 * t - 3, 4 - 8 * t, 4 * t - 1])
        for first in range(0, len(inner) - 2, 2):
            nodes = inner[first : first + 3]
            tangent = np.stack([x[nodes] @ slopes, y[nodes] @ slopes])
            normal = np.stack(
                [tangent[1], -tangent[0]]
            )  # outwards from the centre, with its length
            for axis in range(2):
                np.add.at(load, dofs[axis, nodes], shapes @ (w * normal[axis]))
        symmetric = np.concatenate(
            [dofs[1, np.isclose(y, 0.0)], dofs[0, np.isclose(x, 0.0)]]
        )
        free = np.setdiff1d(np.arange(K.shape[0]), symmetric)
        solution = np.zeros(K.shape[0])
        solution[free] = spsolve(K[free][:, free].tocsc(), load[free])
        modulus = E if plane == "stress" else E / (1 - NU**2)
        nu = NU if plane == "stress" else NU / (1 - NU)
        exact = a / modulus * ((a**2 + b**2) / (b**2 - a**2) + nu)
        errors.append(abs(solution[dofs[0, inner[0]]] / exact - 1))
    assert errors[1] < 1e-4
    assert math.log2(errors[0] / errors[1]) > 3.0  # superconvergent at a vertex: near 4


def test_loads_push_inwards_or_as_asked():
    one = sector(chart(LoadedFlank(EXTERNAL)), STEEL, "strain", 1)
    width = 0.2 * EXTERNAL.module
    inwards = -LoadedFlank(EXTERNAL).normal([1.2, 1.6])
    asked = np.array([[0.6, -0.8], [0.8, 0.6]])
    for direction, loads in (
        (inwards, flank_loads(one, [1.2, 1.6], width)),
        (asked, flank_loads(one, [1.2, 1.6], width, asked)),
    ):
        np.testing.assert_allclose(
            [loads[one.dofs[axis]].sum(axis=0) for axis in (0, 1)], direction
        )


@pytest.mark.parametrize("gear", [EXTERNAL, RING], ids=["external", "ring"])
def test_the_wheel_from_one_sector_is_the_whole_wheel(gear):
    """All sectors turned into place, common nodes merged, solved at once."""
    z = gear.teeth
    reach = 2
    one = sector(chart(LoadedFlank(gear)), STEEL, "strain", 1)
    loads = flank_loads(one, [1.2, 1.6], 0.2 * gear.module)
    found = wheel(one, loads, reach)
    points = []
    turned = []
    n = one.stiffness.shape[0]
    axis = np.empty(n, dtype=int)
    place = np.empty((2, n))
    for k in range(2):
        axis[one.dofs[k]] = k
        place[:, one.dofs[k]] = one.mesh.doflocs
    partner = np.empty(n, dtype=int)
    partner[one.dofs[0]], partner[one.dofs[1]] = one.dofs[1], one.dofs[0]
    for k in range(z):
        cos = np.cos(2 * np.pi * k / z)
        sin = np.sin(2 * np.pi * k / z)
        points.append(np.array([[cos, -sin], [sin, cos]]) @ place)
        # global displacements of a node from the sector's own: local = Rᵀ global
        T = coo_matrix((np.full(n, cos), (np.arange(n), np.arange(n))), (n, n))
        T = T + coo_matrix(
            (np.where(axis == 0, sin, -sin), (np.arange(n), partner)), (n, n)
        )
        turned.append(T.tocsr())
    keys = np.concatenate(
        [np.vstack([np.round(p / 1e-9), axis]) for p in points], axis=1
    )
    _, number = np.unique(keys, axis=1, return_inverse=True)
    number = number.reshape(z, n)
    size = number.max() + 1
    K = coo_matrix((size, size)).tocsr()
    for k in range(z):
        local = (turned[k].T @ one.stiffness @ turned[k]).tocoo()
        K = (
            K
            + coo_matrix(
                (local.data, (number[k][local.row], number[k][local.col])), (size, size)
            ).tocsr()
        )
    clamped = np.unique(number[:, one.dofs[:, one.nodes(v=0.0)].ravel()])
    free = np.setdiff1d(np.arange(size), clamped)
    F = np.zeros((reach + 1, size, 2))
    for k in range(reach + 1):
        np.add.at(F[k], number[k], turned[k].T @ loads)
    u = np.zeros((size, 2))
    u[free] = spsolve(K[free][:, free].tocsc(), F[0][free])
    expected = np.stack([F[k].T @ u for k in range(reach + 1)])
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


def test_reciprocity_round_the_wheel():
    """Maxwell and Betti: tooth k under a load at a and b on tooth 0 is tooth 0 under a
    load at b.
    """
    one = sector(chart(LoadedFlank(EXTERNAL)), STEEL, "strain", 1)
    loads = flank_loads(one, [1.1, 1.5, 1.8], 0.2 * EXTERNAL.module)
    C = wheel(one, loads, EXTERNAL.teeth - 1)
    for k in range(1, EXTERNAL.teeth):
        assert C[k] == pytest.approx(
            C[EXTERNAL.teeth - k].T, rel=1e-9, abs=1e-12 * C[0].max()
        )
    assert C[0] == pytest.approx(C[0].T, rel=1e-12, abs=0)
    assert np.abs(C[1] - C[1].T).max() > 0.01 * C[1].max()  # a side of the tooth it is


@pytest.mark.parametrize("gear", [EXTERNAL, RING], ids=["external", "ring"])
def test_loads_are_unit_forces_along_the_line_of_action(gear):
    """Their sum is one, their moment about the centre the base
    radius, whatever the patch.
    """
    one = sector(chart(LoadedFlank(gear)), STEEL, "strain", 2)
    parameter = LoadedFlank(gear).parameter(
        [
            gear.form_radius + f * (gear.tip_radius - gear.form_radius)
            for f in (0.1, 0.5, 0.9)
        ]
    )
    loads = flank_loads(one, parameter, 0.05 * gear.module)
    force = np.stack([loads[one.dofs[k]].sum(axis=0) for k in range(2)])
    assert np.hypot(*force) == pytest.approx(1.0, rel=1e-12, abs=0)
    x, y = one.mesh.doflocs
    moment = x @ loads[one.dofs[1]] - y @ loads[one.dofs[0]]
    assert moment == pytest.approx(-gear.base_radius, rel=1e-3, abs=0)
    assert np.all(force[1] < 0.0)
    assert np.all(force[0] > 0.0) if gear.internal else np.all(force[0][1:] < 0.0)


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_half_plane_against_stresses_summed_up(plane):
    """Hertz's stresses below a patch, integrated down to the depth:
    the middle sinks in ¼ further.
    """
    w, depth = 1e-4, 3e-3
    p0 = 2 / (np.pi * w)

    def strain(z):
        root = math.sqrt(1 + (z / w) ** 2)
        along = -p0 / root
        beside = -p0 * ((1 + 2 * (z / w) ** 2) / root - 2 * z / w)
        if plane == "strain":
            return -(1 - NU**2) / E * (along - NU / (1 - NU) * beside)
        return -(along - NU * beside) / E

    middle = quad(strain, 0, depth, points=[w, 10 * w], limit=200)[0]
    factor = 2 / np.pi * ((1 - NU**2) / E if plane == "strain" else 1 / E)
    found = half_plane_compliance(STEEL, plane, w, np.array([depth]))[0]
    assert found == pytest.approx(middle - 0.25 * factor, rel=3e-4, abs=0)
