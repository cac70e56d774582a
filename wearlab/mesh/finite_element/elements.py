"""The finite elements of one sector of a gear, its loads, and the local indentation.

A load on a flank sinks in without bound as its patch shrinks. That part is the half
plane's, known in closed form: with a unit load on the half plane (Flamant),

    u_z(r, φ) = 2 (1 − ν²)/(πE) [−ln r − sin²φ / (2 (1 − ν))]

φ from the load's direction. Averaged over the patch (half width w) with the pressure
itself, and against the point at depth t below its middle,

    c = 2 (1 − ν²)/(πE) {¼ − ln(w/2) − 1/(2(1 − ν)) + ⟨ln r + sin²φ/(2 (1 − ν))⟩_t}.

A tooth's compliance less this one is finite, and no longer depends on the patch. It
complements exactly the Hertzian approach of the flank against the same depth (Weber &
Banaschek, Johnson Eq. 5.57).

References
----------
Johnson, Contact Mechanics, 1985, 2.2 and 5.6; Andersson & Vedmar, J. Sound Vib. 260
(2003) 195–212, and Vedmar & Henriksson, J. Mech. Des. 120 (1998) 665–673: elements for
the tooth, a formula for the contact.
"""

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_matrix, csr_matrix

from wearlab.arrays import Array, Index
from wearlab.gears.gear import Gear
from wearlab.gears.specification import Material
from wearlab.gears.specification import Plane as Plane
from wearlab.mesh.finite_element.outline import DEEP, Chart, LoadedFlank, Wear, chart

if TYPE_CHECKING:
    from skfem import Basis, MeshQuad2

INNER = 5.0  # element on the centre line over element on the flank


class Options(NamedTuple):
    """How a gear is meshed and loaded.

    Parameters
    ----------
    plane : plane strain or stress
    refinement : multiples of the coarsest mesh's elements; the mesh error falls at
        least with its square
    patch : half width of the loaded patch in modules; the answer does not depend on it
        [1]
    samples : load positions on a flank
    teeth_apart : how many neighbouring teeth are looked at
    """

    plane: Plane = "strain"
    refinement: int = 3
    patch: float = 0.1
    samples: int = 21
    teeth_apart: int = 3


class Sector(NamedTuple):
    """One sector of a gear, of unit face width.

    Parameters
    ----------
    chart : its shape
    mesh : the elements
    logical : (2, n_nodes) u and v of the nodes
    dofs : (2, n_nodes) unknowns of the nodes' displacements (x, y); (3, n_nodes) with
        those along the face
    stiffness : (n_dofs, n_dofs) [Pa]
    """

    chart: Chart
    mesh: "MeshQuad2"
    logical: Array
    dofs: Index
    stiffness: csr_matrix

    def nodes(self, *, u: float = math.nan, v: float = math.nan) -> Index:
        """Return the nodes on a line of the chart, clamp to tip or −u to +u."""
        across, along = self.logical
        numbers = np.flatnonzero(np.isclose(across, u) | np.isclose(along, v))
        return numbers[np.argsort((along if math.isnan(v) else across)[numbers])]

    @property
    def mirrored(self) -> tuple[Index, Array]:
        """The mirror image of each unknown across the centre line, and its sign."""
        across, along = np.round(self.logical, 9)
        image, sign = np.empty((2, self.stiffness.shape[0]))
        here = np.lexsort((across, along))
        there = np.lexsort((-across, along))
        for axis, turned in zip(range(len(self.dofs)), (1.0, -1.0, 1.0), strict=False):
            image[self.dofs[axis, here]] = self.dofs[axis, there]
            sign[self.dofs[axis]] = turned
        return image.astype(np.int64), sign


def mesh_lines(chart: Chart, refinement: int) -> tuple[Array, Array]:
    """Return the lines of the mesh in u and in v.

    Parameters
    ----------
    chart : the sector
    refinement : every count of elements is a multiple of it
    """
    n = refinement
    under = 1.0 - _graded(3 * n, INNER)[::-1]
    beside = 1.0 + _graded(2 * n, INNER)
    half = np.concatenate([under, beside[1:]])
    across = np.concatenate([-half[:0:-1], half])
    depth = abs(chart.deep - chart.flank.gear.bore_radius)
    body = DEEP * (
        1.0 - _graded(3 * n, max(1.0, depth / (chart.deep * chart.half_pitch)))[::-1]
    )
    root = 1.0 - (1.0 - DEEP) * _graded(2 * n, INNER)[::-1]
    return across, np.concatenate(
        [body, root[1:], np.linspace(1.0, 2.0, 12 * n + 1)[1:]]
    )


def _graded(count: int, ratio: float) -> Array:
    """Return count + 1 points in [0, 1]; spacings grow, by a ratio in all."""
    sizes = ratio ** (np.arange(count) / max(1, count - 1))
    return np.concatenate([[0.0], np.cumsum(sizes) / np.sum(sizes)])


def sector(chart: Chart, material: Material, plane: Plane, refinement: int) -> Sector:
    """Mesh and assemble the sector of a gear.

    Parameters
    ----------
    chart : its shape
    material : elastic constants
    plane : plane strain or stress
    refinement : elements, in multiples
    """
    from skfem import MeshQuad, MeshQuad2

    squares = MeshQuad.init_tensor(*mesh_lines(chart, refinement))
    middle = squares.p[:, squares.t].mean(axis=1)
    squares = squares.remove_elements(
        np.flatnonzero((np.abs(middle[0]) > 1.0) & (middle[1] > 1.0))
    )
    plain = MeshQuad2.from_mesh(squares)
    mesh = MeshQuad2(chart.map(*plain.doflocs), plain.t)
    return Sector(chart, mesh, plain.doflocs, *assemble(mesh, material, plane))


def assemble(
    mesh: "MeshQuad2", material: Material, plane: Plane
) -> tuple[Index, csr_matrix]:
    """Return the unknowns of the nodes and the stiffness matrix for unit face width.

    Parameters
    ----------
    mesh : the elements
    material : elastic constants
    plane : plane strain or stress

    Returns
    -------
    dofs : (2, n_nodes)
    stiffness : (n_dofs, n_dofs) [Pa]
    """
    basis, gradient = gradients(mesh)
    numbers = np.hstack([basis.nodal_dofs, basis.facet_dofs, basis.interior_dofs])[0]
    K = product(basis, gradient, gradient, lame(material, plane))
    return 2 * numbers + np.arange(2)[:, None], K


def gradients(mesh: "MeshQuad2") -> tuple["Basis", Array]:
    """Return the shape functions of a mesh, and their slopes.

    Parameters
    ----------
    mesh : the elements

    Returns
    -------
    basis : the shape functions
    slopes : (n_elements, n_shapes, 2, n_points) [1/m]
    """
    from skfem import Basis, ElementQuad2

    basis = Basis(mesh, ElementQuad2())
    return basis, np.stack([shape[0].grad for shape in basis.basis]).transpose(
        2, 0, 1, 3
    )


def product(
    basis: "Basis", left: Array, right: Array, moduli: tuple[float, float]
) -> csr_matrix:
    """Return the product of shape functions that a stiffness is made of.

    ``∫ λ A_ia B_jb + G (A_ib B_ja + δ_ab A_i·B_j)`` of shapes i, j and axes a, b.

    That is a stiffness for unit face width where A and B are the gradients of the shape
    functions [Pa].

    Parameters
    ----------
    basis : the shape functions
    left, right : A and B, (n_elements, n_shapes, n_axes, n_points)
    moduli : λ and G [Pa]
    """
    count, shapes, axes, points = left.shape
    left = left.reshape(count, shapes * axes, points)
    right = right.reshape(count, shapes * axes, points)
    both = ((left * basis.dx[:, None, :]) @ right.transpose(0, 2, 1)).reshape(
        -1, shapes, axes, shapes, axes
    )
    first, shear = moduli
    own = first * both + shear * both.swapaxes(2, 4)
    own += shear * np.einsum("eicjc,ab->eiajb", both, np.eye(axes))
    unknown = (axes * basis.element_dofs.T[:, :, None] + np.arange(axes)).reshape(
        count, -1
    )
    row, column = np.broadcast_arrays(unknown[:, :, None], unknown[:, None, :])
    size = axes * basis.N
    return coo_matrix(
        (own.ravel(), (row.ravel(), column.ravel())), (size, size)
    ).tocsr()


def lame(material: Material, plane: Plane) -> tuple[float, float]:
    """Return Lamé's parameters of the plane problem, ``λ = E ν/(1 − ν²)`` and G [Pa].

    See `in_plane`.
    """
    in_plane = material.in_plane(plane)
    modulus = in_plane.youngs_modulus
    nu = in_plane.poisson_ratio
    return modulus * nu / (1.0 - nu**2), material.shear_modulus


def loaded_sector(
    gear: Gear, options: Options, wear: Wear | None = None
) -> tuple[Sector, Array, Array]:
    """Return the sector of a gear, places on its flank (m,), loads (n_dofs, m).

    The outermost load touches the tip edge with its patch.

    Parameters
    ----------
    gear : the gear
    options : of mesh and load
    wear : of every tooth's loaded flank; the other flank wears alike
    """
    shape = chart(LoadedFlank(gear, wear))
    half_width = options.patch * gear.module
    last = float(shape.at_length(shape.length[-1] - half_width))
    q = 1.0 + 0.5 * (last - 1.0) * (
        1.0 - np.cos(np.linspace(0.0, np.pi, options.samples))
    )
    cut = sector(shape, gear.material, options.plane, options.refinement)
    return cut, q, flank_loads(cut, q, half_width)


def flank_loads(
    sector: Sector,
    parameter: ArrayLike,
    half_width: float,
    direction: Array | None = None,
) -> Array:
    """Return the nodal loads of unit Hertzian patches on the flank.

    The patch is a half ellipse of pressure in the length along the flank, ``p ∝ √(1 −
    (x/w)²)``, integrated by the Gauss rule made for it.

    Parameters
    ----------
    sector : the sector
    parameter : (m,) middles of the patches on the flank, in [1, 2]
    half_width : w [m]
    direction : (2, m) unit vectors in the tooth's frame; None: the inward normals [1]

    Returns
    -------
    (n_dofs, m) [1]
    """
    q = np.atleast_1d(np.asarray(parameter, dtype=float))
    chart = sector.chart
    flank = sector.chart.flank
    offset, weight = patch_rule()
    v = chart.height(chart.at_length(chart.length_of(q)[:, None] + half_width * offset))
    nodes = sector.nodes(u=1.0)
    nodes = nodes[sector.logical[1, nodes] > 1.0 - 1e-9]
    element, shape = _quadratic(sector.logical[1, nodes], v)
    direction = -flank.normal(q) if direction is None else direction
    loads = np.zeros((sector.stiffness.shape[0], len(q)))
    touched = nodes[2 * element[..., None] + np.arange(3)]
    value = weight[:, None] * shape * direction[:, :, None, None]
    column = np.broadcast_to(np.arange(len(q))[:, None, None], value.shape)
    np.add.at(loads, (sector.dofs[:2, touched], column), value)
    return loads


def _quadratic(nodes: Array, v: Array) -> tuple[Index, Array]:
    """Return the element of each v and its three shape functions there."""
    ends = nodes[::2]
    element = np.clip(np.searchsorted(ends, v, side="right") - 1, 0, len(ends) - 2)
    x = (v - ends[element]) / (ends[element + 1] - ends[element])
    return element, np.stack(
        [(1 - x) * (1 - 2 * x), 4 * x * (1 - x), x * (2 * x - 1)], axis=-1
    )


def patch_rule(points: int = 24) -> tuple[Array, Array]:
    """Return positions x/w and weights of a half ellipse (Gauss–Chebyshev).

    Parameters
    ----------
    points : n

    Returns
    -------
    each (n,) [1]; the weights add up to 1

    References
    ----------
    Abramowitz & Stegun, Handbook of Mathematical Functions, 1964, 25.4.40.
    """
    angle = np.arange(1, points + 1) * math.pi / (points + 1)
    return np.cos(angle), 2.0 / (points + 1) * np.sin(angle) ** 2


def half_plane_compliance(
    material: Material, plane: Plane, half_width: float, depth: Array
) -> Array:
    """Return the compliance of a half plane under a patch, per unit face width.

    It is that of the patch against points at depths below it.

    Parameters
    ----------
    material : elastic constants
    plane : plane strain or stress
    half_width : w [m]
    depth : (n,) t [m]

    Returns
    -------
    (n,) [1/Pa]

    References
    ----------
    Johnson 1985, §2.2: the half plane under a line load (Flamant).
    """
    in_plane = material.in_plane(plane)
    modulus = in_plane.youngs_modulus
    nu = in_plane.poisson_ratio
    lateral = 0.5 * (1.0 + nu)
    offset, weight = patch_rule()
    x = half_width * offset
    t = np.asarray(depth, dtype=float)[:, None]
    square = x**2 + t**2
    deep = np.sum(weight * (0.5 * np.log(square) + lateral * x**2 / square), axis=1)
    surface = 0.25 - math.log(0.5 * half_width) - lateral
    return np.asarray(2.0 / (math.pi * modulus) * (surface + deep))
