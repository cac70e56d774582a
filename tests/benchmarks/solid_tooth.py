"""One tooth in three dimensions beside plane strain and plane stress, over its face
width.

``python tests/benchmarks/solid_tooth.py`` prints how far each plane state is from the
solid tooth. All three have the same mesh of the section, the same clamp (bore and both
cuts of the sector) and the same even line load over the face. What yields is read off
the opposite flank: there the local indentation, which every plane state shares, has
died away, and tooth, root and their share of the body are left.
"""

from typing import NamedTuple

import numpy as np
from scipy.sparse.linalg import splu
from skfem import (
    Basis,
    ElementHex2,
    ElementQuad2,
    ElementVector,
    MeshHex,
    MeshQuad,
    asm,
)
from skfem.models.elasticity import lame_parameters, linear_elasticity

from wearlab.gears.pairs import gear_pair
from wearlab.gears.specification import Basics, GearSpec
from wearlab.mesh.finite_element.elements import lame, mesh_lines
from wearlab.mesh.finite_element.outline import LoadedFlank, chart

WIDTHS = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
"""Face widths in modules."""
LAYERS = 5
"""Elements over half the face, the thinner the nearer to its end."""
EXACT = 4
"""Degree up to which elements are integrated exactly: that of the square of a
strain."""
PLACES = (1.25, 1.5, 1.75)
"""Places on the flank, 1 where the involute begins, 2 at the tip."""


class Yields(NamedTuple):
    """Compliance of the tooth without indentation, at each place, per
    unit width [1/Pa].
    """

    strain: np.ndarray
    stress: np.ndarray
    solid: np.ndarray


def gear(teeth=50, module=0.003):
    """Return the gear that is looked at: full depth, unshifted,
    trochoid root, narrow bore.
    """
    given = GearSpec(name="pinion", teeth=teeth)
    return gear_pair(
        given, GearSpec(name="gear", teeth=teeth), Basics(module, face_width=0.02)
    ).driving


def _kept(squares):
    middle = squares.p[:, squares.t].mean(axis=1)
    return squares.remove_elements(
        np.flatnonzero((np.abs(middle[0]) > 1.0) & (middle[1] > 1.0))
    )


def _plane(shape, material, plane, refinement):
    squares = _kept(MeshQuad.init_tensor(*mesh_lines(shape, refinement)))
    mesh = MeshQuad(shape.map(*squares.p), squares.t)
    basis = Basis(mesh, ElementVector(ElementQuad2()))
    stiffness = asm(linear_elasticity(*lame(material, plane)), basis)
    logical = Basis(squares, ElementVector(ElementQuad2())).doflocs
    clamped = np.flatnonzero(
        np.isclose(logical[1], 0.0) | np.isclose(np.abs(logical[0]), 2.0)
    )
    return stiffness, logical, clamped, 2


def _solid(shape, material, width, refinement, layers):
    lines = (
        *mesh_lines(shape, refinement),
        0.5 * width * (1.0 - np.linspace(1.0, 0.0, layers + 1) ** 2),
    )
    cubes = _kept(MeshHex.init_tensor(*lines))
    place = shape.map(cubes.p[0], cubes.p[1])
    mesh = MeshHex(np.vstack([place, cubes.p[2]]), cubes.t)
    basis = Basis(mesh, ElementVector(ElementHex2()), intorder=EXACT)
    stiffness = asm(
        linear_elasticity(
            *lame_parameters(material.youngs_modulus, material.poisson_ratio)
        ),
        basis,
    )
    logical = Basis(cubes, ElementVector(ElementHex2()), intorder=1).doflocs
    held = np.isclose(logical[1], 0.0) | np.isclose(np.abs(logical[0]), 2.0)
    middle = np.isclose(logical[2], 0.0)
    middle[np.setdiff1d(np.arange(len(middle)), np.arange(2, len(middle), 3))] = False
    return stiffness, logical, np.flatnonzero(held | middle), 3


def _compliance(built, shape, refinement):
    """Return what the opposite flank yields along a unit load on the
    (half) face, at each place.
    """
    stiffness, logical, clamped, axes = built
    free = np.setdiff1d(np.arange(stiffness.shape[0]), clamped)
    solved = splu(
        stiffness[free][:, free].tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        options={"SymmetricMode": True},
    )
    found = []
    heights = mesh_lines(shape, refinement)[1]
    for q in PLACES:
        v = heights[np.argmin(np.abs(heights - float(shape.height(np.array([q]))[0])))]
        normal = _normal(shape, v)
        load = np.zeros(stiffness.shape[0])
        seen = np.zeros(stiffness.shape[0])
        for side, into in ((1.0, load), (-1.0, seen)):
            line = np.isclose(logical[0], side) & np.isclose(logical[1], v)
            weight = _even(logical[2][line]) if axes == 3 else np.ones(line.sum())
            dofs = np.flatnonzero(line)
            for axis in range(2):
                mine = dofs % axes == axis
                into[dofs[mine]] += weight[mine] * normal[axis]
        found.append(float(seen[free] @ solved.solve(load[free])))
    return np.array(found)


def _normal(shape, v):
    start, end = shape.length_of([shape.foot, 2.0])
    q = shape.at_length(start + (end - start) * (v - 1.0))
    return -LoadedFlank(shape.flank.gear).normal(np.array([q]))[:, 0]


def _even(z):
    """Return Simpson weights of the nodes along half the face that
    add up to 1, each node thrice.
    """
    levels = np.unique(np.round(z, 12))
    thick = np.diff(levels[::2])
    weight = np.zeros(len(levels))
    weight[1::2] = 4.0 * thick
    weight[:-1:2] += thick
    weight[2::2] += thick
    weight /= weight.sum()
    return weight[np.searchsorted(levels, np.round(z, 12))]


def yields(width, refinement=1, layers=LAYERS, teeth=50):
    """Return the compliances of a tooth whose face is ``width`` modules wide."""
    body = gear(teeth)
    shape = chart(LoadedFlank(body))
    plane = [
        _compliance(_plane(shape, body.material, state, refinement), shape, refinement)
        for state in ("strain", "stress")
    ]
    face = width * body.module
    solid = _compliance(
        _solid(shape, body.material, face, refinement, layers), shape, refinement
    )
    return Yields(plane[0], plane[1], solid * face / 2.0)


def main():
    """Print the table."""
    over_strain = f"solid over plane strain at q = {PLACES}"
    print(f"{'face width':>12}{over_strain:>52}{'over plane stress':>34}")
    for width in WIDTHS:
        found = yields(width)
        strain = found.solid / found.strain - 1.0
        stress = found.solid / found.stress - 1.0
        each = [
            "".join(f"{100 * x:+9.2f}%" for x in values) for values in (strain, stress)
        ]
        print(f"{width:10.1f} m{each[0]:>52}{each[1]:>34}", flush=True)


if __name__ == "__main__":
    main()
