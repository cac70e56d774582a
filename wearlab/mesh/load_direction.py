"""The direction in which worn flanks press on their teeth.

A force without friction stands on the flank. Wear that deepens along a flank tilts it,
so that the force no longer follows the line of action. With the load angle λ and the
depth h along the unworn flank's normal n, a worn flank is ``P = r_b t + (ρ ∓ h) n``: t
stands on n, the upper sign is that of a wheel, the lower that of a ring. Both vectors
turn with λ, so that

    dP/dλ = (ρ ∓ h) t ∓ h' n,   h' = dh/dλ.

The worn flank's normal has the load angle λ + Δ with ``tan Δ = ± h' / (ρ ∓ h)``, and
the line of force passes the centre at the lever ``(r_b ∓ h') cos Δ``. To the first
order that is Y23's ``λ1 = arctan(tan α1 + dh/dx)``, whose h and x lie across and along
the tooth. Towards a tip that wears deeper the force points more along the tooth and
bends it less; towards a root it bends it more.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.gear import Gear, GearPair
from wearlab.gears.outline import load_angle
from wearlab.mesh import series
from wearlab.mesh.body import ForceLine, Foundation
from wearlab.mesh.exact.flank import smooth_runs
from wearlab.mesh.profile import ProfileGrid


def worn_line(
    gear: Gear, radius: Array, depth: Array, runs: list[slice] | None = None
) -> ForceLine:
    """Return the lines along which a worn flank is pressed.

    Parameters
    ----------
    gear : the gear
    radius : (n,) contact radii of the nodes [m]
    depth : (n,) wear along the flank normal [m]
    runs : between which wear may jump, three nodes or more each; None: nowhere

    Returns
    -------
    ForceLine : of a flank that is not worn, the line of action to the bit

    References
    ----------
    Y23 Eqs. 20 and 23.
    """
    angle = load_angle(gear, radius)
    slope = np.zeros_like(depth)
    for run in runs or [slice(None)]:
        slope[run] = np.gradient(depth[run], angle[run], edge_order=2)

    roll = np.sqrt(np.maximum(radius**2 - gear.base_radius**2, 0.0))
    inwards = gear.outwards * slope
    turn = np.arctan2(inwards, roll - gear.outwards * depth)
    return ForceLine(angle + turn, (gear.base_radius - inwards) * np.cos(turn))


@dataclass(frozen=True, kw_only=True)
class AlongWornNormals(series.InSeries):
    """Teeth and bodies in series, pressed along the normals of their worn flanks.

    The gears themselves still turn each other along the line of action. What pairs
    share of a body keeps its ratio to what each of them has of it.

    Parameters
    ----------
    pair : the gears as they yield in their plane
    grid : the nodes
    foundation : compliance of a wheel body along lines of force
    correction : factors on the foundation stiffness, (driving, driven) [1]
    sharing : what pairs share of the bodies
    """

    pair: GearPair
    grid: ProfileGrid
    foundation: Foundation
    correction: tuple[float, float]
    sharing: series.Sharing

    def beams_and_rest(self, wear: Array) -> tuple[Array, Array]:
        """Return what yields of each gear as a beam, and of its body, (2, n) [m/N].

        Parameters
        ----------
        wear : (2, n) depths, (driving, driven) [m]
        """
        lines = self._lines(wear)
        turned = tuple(
            tooth._replace(force=line)
            for tooth, line in zip(self.teeth, lines, strict=True)
        )
        return series.beams_of(turned, wear), self._bodies(lines)

    def cross(self, wear: Array) -> Array:
        """Return the compliance shared with pairs ahead, (n_apart, n) [m/N].

        Parameters
        ----------
        wear : (2, n) depths, (driving, driven) [m]
        """
        if not self.sharing:
            return super().cross(wear)
        bodies = self._bodies(self._lines(wear))
        return series.shared_compliance(self.sharing, bodies) / self.scale

    def _lines(self, wear: Array) -> list[ForceLine]:
        """Return the lines of force of both gears; beyond A and E those at A and E."""
        grid = self.grid
        runs = smooth_runs(grid)
        lines = []
        for number, depth in enumerate(wear):
            radius = self.pair.radius(number, grid.position)
            gear = self.pair.gears[number]
            line = worn_line(gear, radius, depth[grid.on_flank], runs)
            lines.append(ForceLine(*map(grid.beyond, line)))
        return lines

    def _bodies(self, lines: list[ForceLine]) -> Array:
        """Return the compliance of the wheel bodies along lines of force, (2, n)."""
        compliances = []
        for gear, line, factor in zip(
            self.pair.gears, lines, self.correction, strict=True
        ):
            compliances.append(self.foundation(gear, line) / factor)
        return np.stack(compliances)


def along_worn_normals(
    model: Any, pair: GearPair, grid: ProfileGrid
) -> AlongWornNormals:
    """Return the flexibilities of a pair whose worn flanks turn the load.

    Parameters
    ----------
    model : options of the potential-energy method
    pair : the gears
    grid : the nodes
    """
    flat = series.in_plane(pair, model.plane)
    sharing = series.shared_bodies(model, flat, grid)
    ideal = series.sharing_bodies(model, pair, grid, sharing)
    return AlongWornNormals(
        hertz=ideal.hertz,
        rest=ideal.rest,
        shared=ideal.shared,
        scale=ideal.scale,
        teeth=ideal.teeth,
        pair=flat,
        grid=grid,
        foundation=series.BODIES[model.foundation],
        correction=model.correction,
        sharing=sharing,
    )
