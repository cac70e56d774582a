"""The finite elements of one sector: biquadratic quadrilaterals on the chart of tooth and body."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from skfem import Basis, ElementQuad2, ElementVector, MeshQuad, MeshQuad2, asm
from skfem.models.elasticity import linear_elasticity

from wearlab.arrays import Array, Index
from wearlab.gears.materials import Material
from wearlab.mesh.finite_element.chart import DEEP, Chart
from wearlab.mesh.finite_element.options import Plane

INNER = 5.0  # element on the centre line over element on the flank


@dataclass(frozen=True)
class Sector:
    """One sector of a gear, of unit face width.

    Parameters
    ----------
    chart : its shape
    mesh : the elements
    logical : (2, n_nodes) u and v of the nodes
    dofs : (2, n_nodes) unknowns of the nodes' displacements (x, y)
    stiffness : (n_dofs, n_dofs) [Pa]
    """

    chart: Chart
    mesh: MeshQuad2
    logical: Array
    dofs: Index
    stiffness: csr_matrix

    def nodes(self, *, u: float | None = None, v: float | None = None) -> Index:
        """Return the nodes on a line of the chart, from the clamp to the tip or from −u to +u."""
        across, along = self.logical
        on = np.full(len(across), True)
        if u is not None:
            on &= np.isclose(across, u)
        if v is not None:
            on &= np.isclose(along, v)
        numbers = np.flatnonzero(on)
        return numbers[np.argsort(along[numbers] if u is not None else across[numbers])]


def mesh_lines(chart: Chart, refinement: int) -> tuple[Array, Array]:
    """Return the lines of the mesh in u and in v.

    Parameters
    ----------
    chart : the sector
    refinement : every count of elements is a multiple of it
    """
    n = refinement
    under, beside = 1.0 - _graded(3 * n, INNER)[::-1], 1.0 + _graded(2 * n, INNER)
    half = np.concatenate([under, beside[1:]])
    across = np.concatenate([-half[:0:-1], half])
    depth = abs(chart.deep - chart.flank.gear.bore_radius)
    body = DEEP * (1.0 - _graded(3 * n, max(1.0, depth / (chart.deep * chart.half_pitch)))[::-1])
    root = 1.0 - (1.0 - DEEP) * _graded(2 * n, INNER)[::-1]
    tooth = np.linspace(1.0, 2.0, 12 * n + 1)
    return across, np.concatenate([body, root[1:], tooth[1:]])


def _graded(count: int, ratio: float) -> Array:
    """Return count + 1 points in [0, 1] whose spacing grows geometrically by a ratio in all."""
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
    squares = MeshQuad.init_tensor(*mesh_lines(chart, refinement))
    middle = squares.p[:, squares.t].mean(axis=1)
    squares = squares.remove_elements(np.flatnonzero((np.abs(middle[0]) > 1.0) & (middle[1] > 1.0)))
    plain = MeshQuad2.from_mesh(squares)
    mesh = MeshQuad2(chart.map(*plain.doflocs), plain.t)
    return Sector(chart, mesh, plain.doflocs, *assemble(mesh, material, plane))


def assemble(mesh: MeshQuad2, material: Material, plane: Plane) -> tuple[Index, csr_matrix]:
    """Return the unknowns of the nodes, (2, n_nodes), and the stiffness matrix for unit face width [Pa]."""
    basis = Basis(mesh, ElementVector(ElementQuad2()))
    dofs = np.hstack([basis.nodal_dofs, basis.facet_dofs, basis.interior_dofs])
    return dofs, asm(linear_elasticity(*lame(material, plane)), basis)


def lame(material: Material, plane: Plane) -> tuple[float, float]:
    """Return Lamé's parameters of the plane problem, ``λ = E ν/(1 − ν²)`` and G [Pa]; see `in_plane`."""
    modulus, nu, _ = material.in_plane(plane)
    return modulus * nu / (1.0 - nu**2), material.shear_modulus
