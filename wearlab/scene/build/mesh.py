"""``[mesh]`` and ``[errors]`` → contact analysis, excitation and prescribed errors."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.gears.gear import Gear
from wearlab.gears.outline import contact_depth
from wearlab.gears.pair import GearPair
from wearlab.mesh.annulus import body_compliance, body_coupling
from wearlab.mesh.body import foundation_compliance
from wearlab.mesh.clock import Mesh
from wearlab.mesh.contact import ContactAnalysis
from wearlab.mesh.curve import Curve, constant
from wearlab.mesh.excitation import Excitation, Fourier, Modulated, Pairs
from wearlab.mesh.gear_set import GearSet, PairOfSet
from wearlab.mesh.hertz import yang_sun
from wearlab.mesh.modulation import Modulation
from wearlab.mesh.profile import NO_EXTENSION, Extension, ProfileGrid, profile_grid
from wearlab.mesh.stiffness import GivenStiffness, PairStiffness, PotentialEnergy, WeberContact
from wearlab.mesh.tooth import tooth_flexibility
from wearlab.scene import Scene
from wearlab.scene.build.contact import build_gaps, extension_wanted
from wearlab.scene.build.errors import build_errors
from wearlab.scene.build.finite_element import finite_element, in_plane
from wearlab.scene.build.gears import kinks, modifications
from wearlab.scene.build.sets import build_set

Array = NDArray[np.float64]

NODES_AT_DEFAULT = 201
DEFAULT_TOLERANCE = 1e-3
MOST_MORE_POINTS = 60


def build_analyses(scene: Scene, gears: GearSet) -> tuple[ContactAnalysis, ...]:
    """Return the contact analysis of every kind of mesh at the static load of the scene."""
    points = profile_points(scene)
    reach = [_reach(scene, one, points) for one in gears.kinds]
    matched = matched_points([one.pair for one in gears.kinds], points, reach)
    return tuple(
        _analysis(scene, one, n, far) for one, n, far in zip(gears.kinds, matched, reach, strict=True)
    )


def matched_points(pairs: Sequence[GearPair], points: int, reach: Sequence[Extension]) -> list[int]:
    """Return the points to ask for on each path so that all have equally many nodes, as near as can be."""
    if len(pairs) == 1:
        return [points]
    found: list[dict[int, int]] = [{} for _ in pairs]
    for asked in range(points, points + MOST_MORE_POINTS):
        for pair, far, nodes in zip(pairs, reach, found, strict=True):
            grid = profile_grid(pair, asked, kinks(pair), extension=far)
            nodes.setdefault(len(grid.position), asked)
        if common := set(found[0]).intersection(*found[1:]):
            return [nodes[min(common)] for nodes in found]
    return [points] * len(pairs)


def build_analysis(scene: Scene, one: PairOfSet, points: int | None = None) -> ContactAnalysis:
    """Return the contact analysis of one kind of mesh at its static load, on as many nodes as asked for."""
    points = points or profile_points(scene)
    return _analysis(scene, one, points, _reach(scene, one, points))


def _reach(scene: Scene, one: PairOfSet, points: int) -> Extension:
    """Return how far beyond A and E the nodes of a mesh reach."""
    if not scene.mesh.of(one.section).extended_contact:
        return NO_EXTENSION
    plain = replace(_analysis(scene, one, points, NO_EXTENSION), load=largest_load(scene, one))
    return extension_wanted(scene, one.pair, plain)


def largest_load(scene: Scene, one: PairOfSet) -> float:
    """Return the static normal force of a mesh in the heaviest of conditions that share its flanks [N]."""
    here, most = scene.operation.torque, scene.operation.largest_torque
    if most == here:
        return one.load
    if here > 0.0:
        return one.load * most / here
    heaviest = scene.model_copy(update={"operation": scene.operation.alone(most, scene.operation.speed)})
    return next(found.load for found in build_set(heaviest).kinds if found.section == one.section)


def _analysis(scene: Scene, one: PairOfSet, points: int, extension: Extension) -> ContactAnalysis:
    pair, mesh = one.pair, scene.mesh.of(one.section)
    asked: Any = mesh.stiffness
    given = _given_curve(asked, pair)
    of_mesh = given is not None and asked.of == "mesh"
    jumps = given.jumps if given is not None and of_mesh else ()
    pair_jumps = tuple(x % 1.0 for x in given.jumps) if given is not None and not of_mesh else ()
    grid = profile_grid(pair, points, kinks(pair), jumps + pair_jumps, extension)
    stiffness: PairStiffness
    if given is not None:
        stiffness = GivenStiffness(given, asked.of, grid)
    elif asked.model == "finite-element":
        stiffness = finite_element(asked, pair, grid, _hertz(asked, pair, grid))
    else:
        stiffness = _potential_energy(asked, pair, grid)
    contact = mesh.contact
    return ContactAnalysis(
        grid,
        stiffness,
        modifications(pair, grid.position).sum(axis=0),
        one.load,
        contact.threshold * pair.driven.base_radius if contact.engagement == "threshold" else np.inf,
        build_gaps(contact, mesh.extended_contact, pair, grid),
    )


def profile_points(scene: Scene) -> int:
    """Return the nodes on the path: as asked, or for a third-order error from the tolerance."""
    if scene.numerics.profile_points is not None:
        return int(scene.numerics.profile_points)
    ratio = DEFAULT_TOLERANCE / scene.numerics.tolerance
    return int(np.clip(NODES_AT_DEFAULT * ratio ** (1 / 3), 81, 1601))


def _given_curve(stiffness: Any, pair: GearPair) -> Curve | None:
    if stiffness.model == "constant":
        return constant(stiffness.value)
    if stiffness.model == "tabulated":
        x = np.asarray(stiffness.abscissa, float)
        if stiffness.along == "path_position":
            x = (x - pair.path.A) / pair.base_pitch
        return Curve(x, np.asarray(stiffness.stiffness, float))
    return None


def _potential_energy(given: Any, pair: GearPair, grid: ProfileGrid) -> PotentialEnergy:
    body = body_compliance if given.foundation == "annulus" else foundation_compliance
    gears = [in_plane(gear, given.plane) for gear in pair.gears]
    teeth = [
        tooth_flexibility(gear, pair.radius(i, grid.loaded), shear_factor=given.shear_factor, body=body)
        for i, gear in enumerate(gears)
    ]
    coupling, partner = _coupling(given, gears, pair, grid)
    return PotentialEnergy(
        teeth=(teeth[0], teeth[1]),
        hertz=_hertz(given, pair, grid),
        foundation=given.foundation != "none",
        correction=tuple(given.correction),
        coupling=coupling,
        partner=partner,
        scale=given.scale,
    )


def _hertz(given: Any, pair: GearPair, grid: ProfileGrid) -> float | WeberContact:
    first, second = (gear.material for gear in pair.gears)
    if given.hertz == "yang-sun":
        return yang_sun(first, second, pair.face_width)
    return WeberContact(
        equivalent_radius=pair.equivalent_curvature(grid.loaded),
        depth=np.stack(
            [contact_depth(gear, pair.radius(i, grid.loaded)) for i, gear in enumerate(pair.gears)]
        ),
        modulus=(first.youngs_modulus, second.youngs_modulus),
        poisson=(first.poisson_ratio, second.poisson_ratio),
        face_width=pair.face_width,
    )


def _coupling(
    given: Any, gears: Sequence[Gear], pair: GearPair, grid: ProfileGrid
) -> tuple[Array, NDArray[np.int64]]:
    """Return for each gear what neighbouring pairs share of its body, and who the neighbour is."""
    n = len(grid.touching)
    if given.coupling == "none" or given.foundation == "none":
        return np.zeros((0, 2, n)), np.zeros((0, n), dtype=np.int64)
    ratios, partners = [], []
    pairs = grid.pairs_at_phase_nodes
    for apart in range(1, grid.n_pairs):
        partner = np.full(n, -1, dtype=np.int64)
        for ahead in range(grid.n_pairs - apart):
            both = (pairs[:, ahead] >= 0) & (pairs[:, ahead + apart] >= 0)
            partner[pairs[both, ahead + apart]] = pairs[both, ahead]
        ratio = np.zeros((2, n))
        have = partner >= 0
        for i, gear in enumerate(gears):
            radius = pair.radius(i, grid.loaded)
            ratio[i, have] = body_coupling(gear, radius[have], radius[partner[have]], teeth_apart=apart)
        ratios.append(ratio)
        partners.append(partner)
    return np.stack(ratios), np.stack(partners)


def build_excitation(scene: Scene) -> Excitation:
    """Return how the mesh force reaches the dynamics."""
    given = scene.mesh.of("sun_planet" if scene.gears.kind == "planetary" else "").excitation
    match given.model:
        case "fourier":
            return Fourier(given.stiffness_harmonics, given.error_harmonics, given.combination, given.error)
        case "modulated":
            return Modulated(
                given.combination,
                given.error,
                _modulation(given.stiffness_modulation),
                _modulation(given.error_modulation),
            )
        case _:
            return Pairs()


def _modulation(given: Any) -> Modulation | None:
    if given is None:
        return None
    return Modulation(
        given.mean, given.carrier, given.carrier_phase, given.am, given.am_phase, given.fm, given.fm_phase
    )


def build_meshes(scene: Scene, gears: GearSet) -> tuple[Mesh, ...]:
    """Return the meshes on their clock, each with one realisation of its errors."""
    found = build_errors(scene, gears)
    return tuple(
        Mesh(kind, float(lag), error)
        for kind, lag, error in zip(gears.mesh_kinds, gears.mesh_lags, found, strict=True)
    )
