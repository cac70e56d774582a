"""A tooth in three dimensions: the section's elements, extruded along the face.

Both ends of the face are free.

On the section displacements are sums of shapes, ``u(x, y, z) = Σ φ_i(x, y) a_i(z)``;
along the face each a_i is piecewise quadratic. The shapes are what the section does
under loads that vary as ``e^{sz}`` along an endless face, for some s: waves, and what
dies away from an end. With N the section's shape functions,

    ``K = K00 ⊗ ∫ZZ + K01 ⊗ ∫ZZ' + K01ᵀ ⊗ ∫Z'Z + K11 ⊗ ∫Z'Z'``

of derivatives ``(∂x, ∂y, −t ∂y) N Z + (0, 0, 1) N Z'``: a helical tooth is extruded
obliquely, by t sideways for each length along the face, and pressed along its own
normal (n, −t n_y).

The tooth stands in its sector, held at the bore and at both cuts. What the rest of the
wheel adds is known for waves along the face (:func:`wheel_beyond`), and mirrored at its
ends.

Teeth are kept on disk: each shape is solved once for all runs and processes. A file is
named by what its tooth was made from: shape, slices, options, and the sources that
compute. It holds numbers alone, and then its SHA-256, which is compared before anything
is read out of the file; a file that was cut short or changed is made anew. The folder
(`wearlab.files.cache_folder`) keeps the teeth used last.

References
----------
Thomas, Int. J. Numer. Methods Eng. 14 (1979) 81–102, for the wheel; Kantorovich &
Krylov, Approximate Methods of Higher Analysis, 1958, ch. 4, for shapes of the section
with functions along the face.
"""

import hashlib
import math
import os
import time
from collections.abc import Callable, Sequence
from functools import cache, lru_cache, partial
from io import BytesIO
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.sparse import csr_matrix, diags
from scipy.sparse.linalg import splu

from wearlab.arrays import Array, Index
from wearlab.files import cache_folder, read_regular
from wearlab.gears.gear import Gear
from wearlab.gears.specification import Material
from wearlab.mesh.finite_element import compliance, elements, outline
from wearlab.sources import PACKAGE, hash_of
from wearlab.threads import one_thread

KEPT_BYTES = 500_000_000
"""Of teeth on disk: 2 MB each of 26 slices, 10 MB of 53, 90 MB of 161."""
DIGEST = hashlib.sha256().digest_size
Arrays = tuple[Array, Array]


def kept_or_made(given: tuple[object, ...], make: Callable[[], Arrays]) -> Arrays:
    """Return two arrays as they were kept, or made and kept.

    Parameters
    ----------
    given : what they are made from; its repr tells them apart
    make : makes them
    """
    name = _digest(f"{_sources()} {given!r}".encode()).hex()
    file = cache_folder() / "teeth" / f"{name}.npz"
    arrays = _read(file)
    if arrays is None:
        with one_thread():
            arrays = make()
        _write(file, arrays)
    return arrays


@cache
def _sources() -> str:
    """Return the hash of what computes: elements, outlines and gears."""
    of_elements = (PACKAGE / "mesh" / "finite_element").glob("*.py")
    of_gears = (PACKAGE / "gears").glob("*.py")
    return hash_of(sorted([*of_elements, *of_gears]))


def _digest(content: bytes) -> bytes:
    """Return the SHA-256 of a content."""
    return hashlib.sha256(content).digest()


def _mark_as_used(file: Path) -> None:
    """Set the time of a file to now, in nanoseconds.

    File systems themselves count milliseconds.
    """
    now = time.time_ns()
    os.utime(file, ns=(now, now))


def _read(file: Path) -> Arrays | None:
    """Return the arrays of a file; None where it is absent, cut short or changed."""
    try:
        whole = read_regular(file, KEPT_BYTES)
        _mark_as_used(file)
    except OSError:
        return None
    content = whole[:-DIGEST]
    digest = whole[-DIGEST:]
    if _digest(content) != digest:
        return None
    with np.load(BytesIO(content), allow_pickle=False) as kept:
        return kept["first"], kept["second"]


def _write(file: Path, arrays: Arrays) -> None:
    """Write a file as a whole, and delete those that were used longest ago.

    Nothing is kept in a folder that cannot be written.
    """
    buffer = BytesIO()
    np.savez(buffer, first=arrays[0], second=arrays[1])
    content = buffer.getvalue()
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with NamedTemporaryFile(dir=file.parent, suffix=".part", delete=False) as part:
            part.write(content + _digest(content))
        _mark_as_used(Path(part.name))
        os.replace(part.name, file)
        _delete_oldest(file.parent)
    except OSError:
        pass


def _delete_oldest(folder: Path) -> None:
    """Delete the files used longest ago, until the folder holds `KEPT_BYTES` at most.

    Raises
    ------
    OSError
        When a file is gone or cannot be deleted.
    """
    teeth = [(file.stat(), file) for file in folder.iterdir()]
    teeth.sort(key=lambda tooth: -tooth[0].st_mtime)
    size = 0
    for status, file in teeth:
        size += status.st_size
        if size > KEPT_BYTES:
            file.unlink(missing_ok=True)


Options = elements.Options
SOLID = Options(refinement=1, patch=0.2, samples=21)
"""Elements and loads of a solid tooth: twice the patch of a plane one, so that samples
overlap."""
WAVES = (0.0, 0.15, 0.4, 0.8, 1.5, 3.0)
"""Waves along the face whose shapes a tooth has, 1/m [1]."""
DYING = (0.5, 1.2, 2.5)
"""What dies away from one end or the other, likewise."""
KEPT = 1e-5
"""Least share of a shape that is kept, of the largest."""
OF_WHEEL = (0.0, 0.1, 0.2, 0.4, 0.7, 1.2, 2.0, 3.5)
"""Waves at which the rest of the wheel is known, none beyond [1]."""
LONGEST = 0.3
"""Longest element along the face, in modules."""


class Extruded(NamedTuple):
    """Matrices of a section for derivatives across and along the face.

    Each (n_dofs, n_dofs).
    """

    across: csr_matrix
    mixed: csr_matrix
    along: csr_matrix

    def wave(self, s: complex) -> csr_matrix:
        """Return the stiffness for displacements ``e^{sz}`` along an endless face."""
        return self.across + s * (self.mixed - self.mixed.T) - s * s * self.along


def extruded(
    flat: elements.Sector, material: Material, oblique: float
) -> tuple[Index, Extruded]:
    """Return the unknowns (3, n_nodes) and matrices of an oblique extrusion.

    Parameters
    ----------
    flat : the plane sector
    material : elastic constants
    oblique : t, sideways for each length along the face [1]
    """
    basis, slope = elements.gradients(flat.mesh)
    values = [
        np.broadcast_to(np.asarray(shape[0]), basis.dx.shape) for shape in basis.basis
    ]
    across = np.concatenate([slope, -oblique * slope[:, :, 1:]], axis=2)
    along = np.zeros_like(across)
    along[:, :, 2] = np.stack(values, axis=1)

    moduli = elements.lame(material, "strain")
    matrices = Extruded(
        across=elements.product(basis, across, across, moduli),
        mixed=elements.product(basis, across, along, moduli),
        along=elements.product(basis, along, along, moduli),
    )
    dofs = 3 * (flat.dofs[0] // 2) + np.arange(3)[:, None]
    return dofs, matrices


class _PlacedElements(NamedTuple):
    """The elements of a section in three dimensions, with unit loads on its flank.

    Parameters
    ----------
    flat : the plane sector
    dofs : (3, n_nodes) its unknowns
    matrices : of the extruded section
    q : (m,) places of the loads on the flank
    loads : (n_dofs, m)
    """

    flat: elements.Sector
    dofs: Index
    matrices: Extruded
    q: Array
    loads: Array


def _placed(gear: Gear, oblique: float, options: Options) -> _PlacedElements:
    """Return the elements of a gear's section, extruded obliquely, and its loads."""
    flat, q, plane = elements.loaded_sector(gear, options)
    dofs, matrices = extruded(flat, gear.material, oblique)
    loads = np.zeros((dofs.size, len(q)))
    loads[dofs[:2]] = plane[flat.dofs]
    loads[dofs[2]] = -oblique * loads[dofs[1]]
    return _PlacedElements(flat, dofs, matrices, q, loads)


def _shapes(section: _PlacedElements, module: float) -> Array:
    """Return shapes of the section, (n_free, n_shapes).

    Those in the plane are orthonormal, and those along the face are.
    """
    free = _free(section)
    loads = section.loads[free].astype(complex)
    exponents = [1j * k / module for k in WAVES]
    for k in DYING:
        exponents += [k / module, -k / module]

    responses = []
    for s in exponents:
        stiffness = section.matrices.wave(s)[free][:, free].tocsc()
        response = splu(stiffness.astype(complex)).solve(loads)
        responses += [response.real, response.imag]
    displacements = np.hstack(responses)

    in_plane = ~np.isin(free, section.dofs[2])
    plane_shapes = _orthonormal(np.where(in_plane[:, None], displacements, 0.0))
    face_shapes = _orthonormal(np.where(in_plane[:, None], 0.0, displacements))
    return np.hstack([plane_shapes, face_shapes])


def _orthonormal(columns: Array) -> Array:
    """Return orthonormal columns that span given ones (n, m), but for least parts."""
    size = np.linalg.norm(columns, axis=0)
    columns = columns[:, size > 1e-9 * size.max()]
    normed = columns / np.linalg.norm(columns, axis=0)
    left, value, _ = np.linalg.svd(normed, full_matrices=False)
    return left[:, value > KEPT * value[0]]


def _free(section: _PlacedElements) -> Index:
    """Return the unknowns that are held neither at the bore nor at a cut, ascending."""
    across, along = section.flat.logical
    is_held = np.isclose(along, 0.0) | np.isclose(np.abs(across), 2.0)
    return np.sort(section.dofs[:, ~is_held].ravel())


class SolidCompliance(NamedTuple):
    """How a tooth with free ends yields to even loads on slices of its face.

    The local indentation is part of it: :func:`indentation` of each slice under its
    own load.

    Parameters
    ----------
    q : (m,) places on the flank, 1 where the involute begins, 2 at the tip
    table : (m, n, m, n) deflection along the loads, averaged over a slice, of a load on
        a place of a slice [m/N]
    """

    q: Array
    table: Array


def indentation(gear: Gear, q: Array, options: Options = SOLID) -> Array:
    """Return the local indentation under a load of unit width, (m,) [1/Pa].

    Parameters
    ----------
    gear : in its transverse section
    q : (m,) places on the flank
    options : of elements and loads
    """
    depth = outline.LoadedFlank(gear).depth(q)
    return elements.half_plane_compliance(
        gear.material, "strain", options.patch * gear.module, depth
    )


def tooth_in_sector(
    gear: Gear, edges: Array, oblique: float, options: Options = SOLID
) -> SolidCompliance:
    """Return how the tooth yields in its sector, held at the bore and both cuts.

    Parameters
    ----------
    gear : in its transverse section
    edges : (n + 1,) of the slices along the face [m]
    oblique : t
    options : of elements and loads
    """
    section = _placed(gear, oblique, options)
    shapes = _shapes(section, gear.module)
    free = _free(section)
    matrices = [
        shapes.T @ (matrix[free][:, free] @ shapes) for matrix in section.matrices
    ]
    loads = shapes.T @ section.loads[free]

    length = edges[-1] - edges[0]
    count = max(4, math.ceil(length / (LONGEST * gear.module)))
    carried = _carried(edges, count)
    diagonal, upper = _blocks(_element(length / count, *matrices), count)
    force = _forces(loads, carried)

    n_slices = len(edges) - 1
    n_places = loads.shape[1]
    met = n_places * _slices_met(carried)
    table = _compliance(diagonal, upper, force.reshape(*force.shape[:2], -1), met)
    by_slice = table.reshape(n_slices, n_places, n_slices, n_places)
    return SolidCompliance(section.q, by_slice.transpose(1, 0, 3, 2).copy())


def _element(h: float, across: Array, mixed: Array, along: Array) -> Array:
    """Return the stiffness of an element of length h along the face, (3 m, 3 m).

    Its unknowns are those of m shapes at the first end, the middle and the last end.
    """
    M, C, S = _quadratic(h)
    return np.asarray(
        np.kron(M, across)
        + np.kron(C, mixed)
        + np.kron(C.T, mixed.T)
        + np.kron(S, along)
    )


def _blocks(element: Array, count: int) -> Arrays:
    """Return the blocks of equal elements in a row, on and above the diagonal.

    A block holds the middle and the last end of an element; the first holds the end of
    the face alone, and the identity for want of a middle.
    """
    m = len(element) // 3
    diagonal = np.zeros((count + 1, 2 * m, 2 * m))
    upper = np.zeros((count, 2 * m, 2 * m))
    diagonal[0, :m, :m] = np.eye(m)
    for number in range(count):
        diagonal[number, m:, m:] += element[:m, :m]
        upper[number, m:] = element[:m, m:]
        diagonal[number + 1] += element[m:, m:]
    return diagonal, upper


def _forces(loads: Array, carried: Array) -> Array:
    """Return the forces of unit loads on places and slices, by block.

    Parameters
    ----------
    loads : (m, n_places) of a section on its shapes
    carried : (count, 3, n_slices) see `_carried`

    Returns
    -------
    (count + 1, 2 m, n_slices, n_places)
    """
    m, n_places = loads.shape
    count, _, n_slices = carried.shape
    force = np.zeros((count + 1, 2 * m, n_slices, n_places))
    for number, (first, middle, last) in enumerate(carried):
        for j in np.flatnonzero(carried[number].any(axis=0)):
            force[number, m:, j] += loads * first[j]
            force[number + 1, :m, j] += loads * middle[j]
            force[number + 1, m:, j] += loads * last[j]
    return force


def _slices_met(carried: Array) -> Index:
    """Return how many slices rest on the elements up to each block, (count + 1,)."""
    n_slices = carried.shape[2]
    last = [
        int(np.flatnonzero(part.any(axis=0)).max(initial=-1)) + 1 for part in carried
    ]
    return np.asarray(np.maximum.accumulate([*last, n_slices]))


def _carried(edges: Array, count: int) -> Array:
    """Return the parts of unit loads on slices that elements carry, (count, 3, n)."""
    ends = np.linspace(edges[0], edges[-1], count + 1)
    start = ends[:-1, None]
    length = np.diff(ends)[:, None]
    low = np.maximum(edges[:-1], start)
    high = np.minimum(edges[1:], ends[1:, None])
    overlap = np.maximum(0.0, high - low)
    share = (overlap / np.diff(edges))[:, None, :]

    carried = np.zeros((count, 3, len(edges) - 1))
    for x, w in zip(*np.polynomial.legendre.leggauss(2), strict=True):
        xi = (low + 0.5 * (1.0 + x) * overlap - start) / length
        first = (1 - xi) * (1 - 2 * xi)
        middle = 4 * xi * (1 - xi)
        last = xi * (2 * xi - 1)
        carried += 0.5 * w * np.stack([first, middle, last], axis=1) * share
    return carried


def _quadratic(h: float) -> tuple[Array, Array, Array]:
    """Return ∫ZZ, ∫ZZ' and ∫Z'Z' of a quadratic element of length h.

    Its nodes are the first end, the middle and the last end.
    """
    mass = h / 30.0 * np.array([[4.0, 2.0, -1.0], [2.0, 16.0, 2.0], [-1.0, 2.0, 4.0]])
    mixed = np.array([[-3.0, 4.0, -1.0], [-4.0, 0.0, 4.0], [1.0, -4.0, 3.0]]) / 6.0
    second = np.array([[7.0, -8.0, 1.0], [-8.0, 16.0, -8.0], [1.0, -8.0, 7.0]])
    return mass, mixed, second / (3.0 * h)


def _compliance(diagonal: Array, upper: Array, force: Array, met: Array) -> Array:
    """Return ``Fᵀ K⁻¹ F`` of blocks on three diagonals.

    Loads F are in the order in which blocks meet them. With ``K = L Lᵀ`` it is ``Σ y_eᵀ
    y_e`` of ``y = L⁻¹ F``, block after block; a load does nothing before its first
    block.

    Parameters
    ----------
    diagonal, upper : (n, m, m) and (n − 1, m, m) blocks of a symmetric positive
        definite K
    force : (n, m, n_loads) F
    met : (n,) loads met by each block or one before it
    """
    count = force.shape[2]
    table = np.zeros((count, count))
    moved = np.zeros((diagonal.shape[1], count))
    joint = None
    for e, (block, reached) in enumerate(zip(diagonal, met, strict=True)):
        right = force[e, :, :reached].copy()
        if joint is not None:
            block = block - joint.T @ joint
            right -= joint.T @ moved[:, :reached]
        lower = cholesky(block, lower=True)
        moved[:, :reached] = solve_triangular(lower, right, lower=True)
        table[:reached, :reached] += moved[:, :reached].T @ moved[:, :reached]
        if e < len(upper):
            joint = solve_triangular(lower, upper[e], lower=True)
    return table


def wheel_beyond(gear: Gear, waves: Sequence[float], options: Options = SOLID) -> Array:
    """Return the compliance that the wheel beyond a sector adds under waves ``cos κz``.

    Parameters
    ----------
    gear : in its transverse section
    waves : κ [1/m]
    options : of elements and loads

    Returns
    -------
    (n_waves, m, m) [1/Pa]
    """
    section = _placed(gear, 0.0, options)
    dofs = section.dofs
    sign = np.ones(dofs.size)
    sign[dofs[2]] = -1.0
    across, mixed, along = section.matrices
    turning = diags(sign) @ (mixed - mixed.T)

    beyond_sector = []
    for k in waves:
        stiffness = across + k * k * along + k * turning
        strip = section.flat._replace(dofs=dofs, stiffness=stiffness.tocsr())
        _, beyond = compliance.through_cuts(strip, section.loads, 0)
        beyond_sector.append(beyond[0])
    return np.stack(beyond_sector)


def solid_compliance(
    gear: Gear, edges: Array, oblique: float, options: Options = SOLID
) -> SolidCompliance:
    """Return how a tooth on its wheel yields; each shape is solved once.

    Parameters
    ----------
    gear : in its transverse section
    edges : (n + 1,) of the slices along the face [m]
    oblique : t, sideways for each length along the face [1]
    options : of elements and loads
    """
    shape = compliance.of_unit_size(gear)
    module = gear.module
    scaled = tuple(float(f"{edge / module:.11e}") for edge in edges - edges[0])
    q, table = _remembered(shape, scaled, float(f"{oblique:.11e}"), options)
    return SolidCompliance(q, table / (module * gear.material.youngs_modulus))


@lru_cache(compliance.KEPT_IN_PROCESS)
def _remembered(
    shape: Gear, edges: tuple[float, ...], oblique: float, options: Options
) -> SolidCompliance:
    """Return the tooth of a shape, as it was kept or solved anew."""
    solve = partial(_on_its_wheel, shape, np.array(edges), oblique, options)
    places, table = kept_or_made((shape, edges, oblique, options), solve)
    table.setflags(write=False)
    return SolidCompliance(places, table)


def _on_its_wheel(
    shape: Gear, ends: Array, oblique: float, options: Options
) -> SolidCompliance:
    """Return how the tooth yields in its sector, and the rest of the wheel with it.

    The wheel adds a series of waves ``cos κz`` whose slopes vanish at both ends of the
    face.
    """
    from scipy.interpolate import PchipInterpolator

    q, table = tooth_in_sector(shape, ends, oblique, options)
    by_wave = wheel_beyond(shape, OF_WHEEL, options)
    beyond = PchipInterpolator(np.array(OF_WHEEL), by_wave)

    width = np.diff(ends)
    length = ends[-1]
    for number in range(1 + int(OF_WHEEL[-1] * length / math.pi)):
        k = number * math.pi / length
        if number == 0:
            wave = np.ones(len(width))
            factor = 1.0
        else:
            wave = np.diff(np.sin(k * ends)) / (k * width)
            factor = 2.0
        places = (factor / length * beyond(k))[:, None, :, None]
        slices = (wave[:, None] * wave)[:, None, :]
        table += places * slices
    return SolidCompliance(q, table)
