"""Teeth in three dimensions on a mesh of their own, beside what ``face_coupling`` makes
of them.

``python tests/benchmarks/face_elements.py [NUMBER …]`` prints, for drawn gears, how far
the work of a line load is from that of solid elements: of ``elements`` and of
``pasternak``, under an even load, a tilted one and one on the last eighth of the face.
Nothing of a run's mesh is used: triangles of second degree between scattered points of
the outline, extruded in layers of second degree along the face, all unknowns solved at
once. The tooth stands in its sector, held at the bore and both cuts. The local
indentation is taken off in closed form.
"""

import math
import sys
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_banded
from scipy.sparse import bmat, csc_matrix, kron
from scipy.sparse.linalg import splu
from scipy.spatial import Delaunay, cKDTree
from skfem import Basis, BilinearForm, ElementTriP2, MeshTri

from wearlab.gears.outline import involute_point, load_angle, root_curve
from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import Basics, GearSpec
from wearlab.mesh.finite_element.compliance import of_unit_size
from wearlab.mesh.finite_element.elements import patch_rule
from wearlab.mesh.finite_element.solid import SOLID, indentation, tooth_in_sector

NU = 0.3
MESH = (0.15, 0.6, 0.35)
FINE_MESH = (0.06, 0.3, 0.2)
"""Distance of points on the loaded flank, the largest one, and its growth, in modules.

Works are scaled by what the finer mesh makes of the plane section.
"""
HEIGHTS = (1.3, 1.55, 1.8)
"""Places of the load on the flank, 1 where the involute begins, 2 at the tip."""
LOADS = ("even", "tilted", "on the last eighth")
SLICES = 40


class Drawn(NamedTuple):
    """A gear: teeth, shift, face width in modules, helix angle [deg]
    and bricks along the face.
    """

    teeth: int
    shift: float
    width: float
    helix: float
    bricks: int = 16


DRAWN = (
    Drawn(23, 0.0, 5.0, 0.0, 8),
    Drawn(41, 0.2, 10.0, 0.0),
    Drawn(71, 0.0, 20.0, 0.0, 24),
    Drawn(19, 0.3, 4.0, 12.0, 8),
    Drawn(30, 0.0, 8.0, 25.0),
    Drawn(57, -0.1, 14.0, 18.0),
    Drawn(100, 0.0, 5.0, 0.0, 8),
)
"""Drawn once: six gears, b/m 4 to 20, β 0 to 25°; and a narrow one of many teeth."""


def gear_of(drawn):
    """Return a drawn gear of module 1, its transverse section."""
    spec = GearSpec(
        name="pinion", teeth=drawn.teeth, profile_shift_coefficient=drawn.shift
    )
    mate = GearSpec(name="gear", teeth=60)
    return of_unit_size(
        gear_pair(spec, mate, Basics(1.0, face_width=drawn.width)).driving
    )


class Outline:
    """The outline of a sector: x from the gear's centre, the loaded
    flank towards y > 0.
    """

    def __init__(self, gear):
        self.gear = gear
        q = np.linspace(0.0, 1.0, 200)
        root = np.array(root_curve(gear, q)[:2])
        angles = np.linspace(
            *load_angle(gear, [gear.form_radius, gear.tip_radius]), 400
        )
        flank = np.stack(involute_point(gear, angles))
        self.curve = np.hstack([root, flank[:, 1:]])
        self.length = np.append(0.0, np.cumsum(np.hypot(*np.diff(self.curve))))
        self.begin = self.length[len(q) - 1]
        self.share = np.linspace(0.0, 1.0, 400), self.length[len(q) - 1 :]
        self.angles = angles

    def at(self, length):
        """Return points of the flank at lengths from the root circle, (2, n)."""
        return np.stack([np.interp(length, self.length, each) for each in self.curve])

    def arc(self, q):
        """Return the length of places on the flank in [1, 2]."""
        return np.interp(np.asarray(q) - 1.0, *self.share)

    def inward(self, q):
        """Return the inward normal of a place."""
        angle = np.interp(q - 1.0, self.share[0], self.angles)
        return -np.array([math.sin(angle), math.cos(angle)])


def mesh_of(outline, sizes):
    """Return triangles between scattered points, and the lengths along the loaded flank
    of its vertices.
    """
    gear = outline.gear
    (fine, coarse, growth) = sizes
    half = math.pi / gear.teeth
    bore = gear.bore_radius
    on_flank = outline.length[-1] * np.linspace(
        0.0, 1.0, round(outline.length[-1] / fine) + 1
    )
    flank = outline.at(on_flank)
    other = flank[:, ::2] * [[1.0], [-1.0]]
    foot = math.atan2(flank[1, 0], flank[0, 0])
    arcs = np.linspace(
        foot, half, max(2, math.ceil((half - foot) * gear.root_radius / 0.3) + 1)
    )
    right = gear.root_radius * np.stack([np.cos(arcs), np.sin(arcs)])
    deep = gear.root_radius - bore
    cut = np.unique(
        np.concatenate([bore + deep * (1 - np.linspace(0, 1, 8) ** 2), [bore]])
    )[::-1]
    side = cut * np.array([[math.cos(half)], [math.sin(half)]])
    below = np.linspace(half, -half, max(5, math.ceil(2 * half * bore / coarse) + 1))
    base = bore * np.stack([np.cos(below), np.sin(below)])
    tip = np.linspace(-1.0, 1.0, 5)[1:-1] * flank[1, -1]
    land = np.stack([np.sqrt(gear.tip_radius**2 - tip**2), tip])
    mirror = np.array([[1.0], [-1.0]])
    polygon = np.hstack(
        [
            flank[:, ::-1],
            right[:, 1:],
            side[:, 1:],
            base[:, 1:-1],
            (side * mirror)[:, :0:-1],
            (right * mirror)[:, :0:-1],
            other,
            land,
        ]
    )
    tree = cKDTree(flank.T)
    random = np.random.default_rng(7)
    low = polygon.min(axis=1)
    high = polygon.max(axis=1)
    drawn = low[:, None] + (high - low)[:, None] * random.random((2, 60000))
    drawn = drawn[:, _inside(polygon, drawn)]
    size = np.minimum(coarse, fine + growth * tree.query(drawn.T)[0])
    points = []
    edge = cKDTree(polygon.T)
    near = edge.query(drawn.T)[0] > 0.7 * size
    for place, apart in zip(drawn.T[near], size[near], strict=True):
        if not points or np.min(np.hypot(*(np.array(points) - place).T)) > 0.85 * apart:
            points.append(place)
    every = np.hstack([polygon, np.array(points).T])
    triangles = Delaunay(every.T).simplices
    middle = every[:, triangles].mean(axis=2)
    corners = every[:, triangles]
    (a, b) = corners[:, :, 1] - corners[:, :, 0]
    (c, d) = corners[:, :, 2] - corners[:, :, 0]
    area = 0.5 * np.abs(a * d - b * c)
    kept = triangles[_inside(polygon, middle) & (area > 1e-6)]
    used, kept = np.unique(kept, return_inverse=True)
    return MeshTri(every[:, used], kept.reshape(-1, 3).T), on_flank


def _inside(polygon, points):
    from matplotlib.path import Path

    return Path(polygon.T).contains_points(points.T, radius=-1e-9)


def _matrices(basis, oblique):
    """Return the matrices for products of derivatives, each 3 by 3 blocks of (n, n)."""
    lame = NU / ((1 + NU) * (1 - 2 * NU))
    shear = 0.5 / (1 + NU)

    def derivative(v, kind):
        if kind == 0:
            return [v.grad[0], v.grad[1], -oblique * v.grad[1]]
        return [0.0 * v.value, 0.0 * v.value, v.value]

    def product(left, right):
        def block(a, b):
            @BilinearForm
            def form(u, v, _):
                du = derivative(u, right)
                dv = derivative(v, left)
                total = lame * dv[a] * du[b] + shear * dv[b] * du[a]
                if a == b:
                    total = total + shear * sum(
                        x * y for x, y in zip(dv, du, strict=True)
                    )
                return total

            return form.assemble(basis)

        return bmat([[block(a, b) for b in range(3)] for a in range(3)]).tocsr()

    return product(0, 0), product(0, 1), product(1, 1)


def _along(width, bricks):
    """Return ∫ZZ, ∫ZZ', ∫Z'Z' of bricks of second degree, and for
    each load its nodal values.
    """
    h = width / bricks
    n = 2 * bricks + 1
    mass, mixed, stiff = np.zeros((3, n, n))
    loads = np.zeros((3, n))
    x, w = np.polynomial.legendre.leggauss(4)
    for e in range(bricks):
        own = slice(2 * e, 2 * e + 3)
        for xi, weight in zip(x, w * h / 2, strict=True):
            value = np.array([xi * (xi - 1) / 2, 1 - xi**2, xi * (xi + 1) / 2])
            slope = np.array([xi - 0.5, -2 * xi, xi + 0.5]) * 2 / h
            y = ((e + 0.5 + xi / 2) * h) / width - 0.5
            mass[own, own] += weight * np.outer(value, value)
            mixed[own, own] += weight * np.outer(value, slope)
            stiff[own, own] += weight * np.outer(slope, slope)
            for k, given in enumerate((1.0, y, float(y > 0.375))):
                loads[k, own] += weight * given * value / width
    return mass, mixed, stiff, loads


class Loaded(NamedTuple):
    """A section under unit loads: matrices, free unknowns, those of
    the plane first, and loads.
    """

    matrices: tuple
    free: np.ndarray
    plane: np.ndarray
    loads: np.ndarray

    def compliance(self):
        """Return that of the plane section, with indentation, (n_heights,)."""
        across = self.matrices[0][self.plane][:, self.plane]
        loads = self.loads[self.plane]
        return (loads * splu(csc_matrix(across)).solve(loads)).sum(axis=0)


def loaded(gear, oblique, sizes):
    """Return the section of a gear under patches of pressure, each
    along the normal of the flank.
    """
    outline = Outline(gear)
    mesh, vertices = mesh_of(outline, sizes)
    basis = Basis(mesh, ElementTriP2())
    places = basis.doflocs
    n = places.shape[1]
    radius = np.hypot(*places)
    angle = np.arctan2(places[1], places[0])
    cut = math.pi / gear.teeth
    free = np.flatnonzero(
        (radius > gear.bore_radius * 1.0001) & (np.abs(np.abs(angle) - cut) > 1e-7)
    )
    tree = cKDTree(places.T)
    loads = np.zeros((3 * n, len(HEIGHTS)))
    offset, weight = patch_rule()
    for column, q in enumerate(HEIGHTS):
        normal = outline.inward(q)
        for s, w in zip(outline.arc(q) + SOLID.patch * offset, weight, strict=True):
            e = np.searchsorted(vertices, s) - 1
            x = (s - vertices[e]) / (vertices[e + 1] - vertices[e])
            ends = outline.at(vertices[e : e + 2])
            nodes = tree.query([ends[:, 0], ends.mean(axis=1), ends[:, 1]])[1]
            shape = [(1 - x) * (1 - 2 * x), 4 * x * (1 - x), x * (2 * x - 1)]
            for axis, part in enumerate((*normal, -oblique * normal[1])):
                loads[nodes + axis * n, column] += w * part * np.array(shape)
    every = np.concatenate([free, free + n, free + 2 * n])
    return Loaded(_matrices(basis, oblique), every, every[: 2 * len(free)], loads)


def judged(drawn):
    """Return works without indentation in the solid, (3 loads, 3 heights), in the
    plane, and unknowns.
    """
    gear = gear_of(drawn)
    oblique = math.tan(math.radians(drawn.helix))
    coarse = loaded(gear, oblique, MESH)
    local = _local(gear)
    plane = loaded(gear, 0.0, FINE_MESH).compliance() - local
    scale = plane / (loaded(gear, 0.0, MESH).compliance() - local)
    M, C, S, given = _along(drawn.width, drawn.bricks)
    across, mixed, along = (
        each[coarse.free][:, coarse.free] for each in coarse.matrices
    )
    whole = csc_matrix(
        kron(M, across) + kron(C, mixed) + kron(C.T, mixed.T) + kron(S, along)
    )
    factors = splu(whole, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    squares = (
        np.array([1.0, 1.0 / 12.0, 1.0 / 8.0]) / drawn.width / _cosine(gear, drawn)
    )
    works = np.empty((3, len(HEIGHTS)))
    for k, row in enumerate(given):
        for c in range(len(HEIGHTS)):
            force = np.kron(row, coarse.loads[coarse.free, c])
            works[k, c] = (
                force @ factors.solve(force) - squares[k] * local[c]
            ) * scale[c]
    return works, plane, whole.shape[0]


def _cosine(gear, drawn):
    """Return cos β_b of the oblique tooth: along the action
    indentations are larger by it.
    """
    return math.cos(
        math.atan(
            math.tan(math.radians(drawn.helix))
            * gear.base_radius
            / gear.reference_radius
        )
    )


def _local(gear):
    return indentation(gear, np.array(HEIGHTS))


def of_run(drawn):
    """Return the works of the tooth in its sector that a run uses, likewise."""
    gear = gear_of(drawn)
    oblique = math.tan(math.radians(drawn.helix))
    found = tooth_in_sector(gear, np.linspace(0.0, drawn.width, SLICES + 1), oblique)
    local = indentation(gear, found.q) / _cosine(gear, drawn)
    y = (np.arange(SLICES) + 0.5) / SLICES - 0.5
    works = []
    for shape in (np.ones(SLICES), y, (y > 0.375).astype(float)):
        force = shape / SLICES
        each = np.array(
            [force @ found.table[a, :, a] @ force for a in range(len(found.q))]
        )
        each -= local * (force @ force) * SLICES / drawn.width
        works.append(np.interp(HEIGHTS, found.q, each))
    return np.array(works)


def of_layer(drawn, plane, modules=1.07, n=4000):
    """Return the works of a layer in shear on a section of such
    compliances, likewise.
    """
    y = (np.arange(n) + 0.5) / n - 0.5
    step = drawn.width / n
    works = np.empty((3, len(plane)))
    for k, shape in enumerate((np.ones(n), y, (y > 0.375).astype(float))):
        for c, compliance in enumerate(plane):
            joint = modules**2 / compliance / step
            bands = np.zeros((3, n))
            bands[1] = step / compliance + 2.0 * joint
            bands[1, [0, -1]] -= joint
            bands[0, 1:] = bands[2, :-1] = -joint
            force = shape / n
            works[k, c] = force @ solve_banded((1, 1), bands, force)
    return works


def main():
    """Print the table."""
    wanted = [int(each) for each in sys.argv[1:]] or range(len(DRAWN))
    for number in wanted:
        drawn = DRAWN[number]
        works, plane, unknowns = judged(drawn)
        elements = of_run(drawn) / works - 1.0
        layer = (
            of_layer(drawn, plane / math.cos(math.radians(drawn.helix))) / works - 1.0
        )
        softer = works[0] * drawn.width / plane - 1.0
        print(
            f"{drawn}, {unknowns} unknowns: even load against plane strain "
            + _row(softer)
        )
        for k, name in enumerate(LOADS):
            print(
                f"  {name:20} elements {_row(elements[k])}   pasternak "
                f"{_row(layer[k])}",
                flush=True,
            )


def _row(values):
    return " ".join(f"{100 * value:+6.2f} %" for value in values)


if __name__ == "__main__":
    main()
