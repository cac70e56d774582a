"""Lives of a worn spur pair from its outlines alone: where flanks touch, there they
wear.

``python tests/benchmarks/touching_wear.py`` prints the life of an external pair (20/40,
m 2, one stiffness of all pairs) to some depths over that of the displacement form, with
the wear of a contact at the points that touch, and with it at the point of the unworn
path. Gaps are the least rotation of whole outlines, over all their points; nothing here
is code of the package.
"""

import math
from typing import NamedTuple

import numpy as np

MODULE, ANGLE = 2e-3, math.radians(20.0)
TEETH = (20, 40)
NODES_PER_PITCH = 100
HALF_WIDTH = 60e-6
"""Half width over which wear is spread and felt [m]."""
STEP = 0.5e-6
"""Wear of a step [m]."""
DEPTHS = (20e-6, 50e-6, 100e-6, 200e-6)
COEFFICIENT_OVER_WIDTH = 1e-16 / 20e-3


class Pair(NamedTuple):
    """An unworn pair: base radii, radii of curvature at the pitch point, nodes [m]."""

    base_radius: tuple[float, float]
    curvature: tuple[float, float]
    nodes: np.ndarray
    turned: np.ndarray


def pair():
    """Return the pair, with nodes on A-E and turns of the driving gear beyond both."""
    r_b = [0.5 * MODULE * z * math.cos(ANGLE) for z in TEETH]
    rho = [radius * math.tan(ANGLE) for radius in r_b]
    tip = [0.5 * MODULE * (z + 2) for z in TEETH]
    begin = rho[1] - math.sqrt(tip[1] ** 2 - r_b[1] ** 2)
    end = math.sqrt(tip[0] ** 2 - r_b[0] ** 2) - rho[0]
    step = math.pi * MODULE * math.cos(ANGLE) / NODES_PER_PITCH
    count = int((end - begin) / step) + 1
    beyond = int(0.6 * NODES_PER_PITCH)
    nodes = begin + step * np.arange(count)
    turned = begin + step * np.arange(-beyond, count + beyond)
    return Pair(tuple(r_b), tuple(rho), nodes, turned)


def touching(gears, wear):
    """Return the least rotation gap at every turn, and both points that meet there."""
    s = gears.nodes
    r_1, r_2 = gears.base_radius
    rho_1, rho_2 = gears.curvature
    u_1 = rho_1 + s - wear[0]
    u_2 = s + wear[1] - rho_2
    turn = (gears.turned[:, None] - s) / r_1
    angle = np.arctan2(u_1, r_1) + turn
    radius = np.hypot(r_1, u_1)
    n = radius * np.cos(angle) - r_1 - r_2
    u = radius * np.sin(angle) - rho_1 - rho_2
    distance = np.hypot(n, u)

    reach = np.hypot(r_2, u_2)[::-1]
    of_flank = (np.arctan2(u_2, -r_2) % (2.0 * math.pi) + s / r_2)[::-1]
    mate = np.interp(distance, reach, of_flank, left=np.nan, right=np.nan)
    partner = np.interp(distance, reach, s[::-1])
    gap = gears.turned[:, None] + r_2 * (np.arctan2(u, n) % (2.0 * math.pi) - mate)
    gap = np.where(np.isnan(gap), np.inf, gap)
    at = gap.argmin(axis=1)
    rows = np.arange(len(at))
    return gap[rows, at], s[at], partner[rows, at]


def kernel(arc):
    """Return which share of the area worn at each node falls on each other one."""
    edges = np.concatenate([arc[:1], 0.5 * (arc[1:] + arc[:-1]), arc[-1:]])
    share = np.zeros((len(arc), len(arc)))
    low = arc - HALF_WIDTH
    high = arc + HALF_WIDTH
    mirrors = (
        (low, high),
        (2.0 * edges[0] - high, 2.0 * edges[0] - low),
        (2.0 * edges[-1] - high, 2.0 * edges[-1] - low),
    )
    for begin, end in mirrors:
        inside = np.minimum(edges[1:, None], end) - np.maximum(edges[:-1, None], begin)
        share += np.maximum(0.0, inside) / (2.0 * HALF_WIDTH)
    return share, np.diff(edges)


def forces(gap, load, stiffness):
    """Return the force of the pair at every turn: pairs a base pitch apart share it."""
    force = np.zeros(len(gap))
    for first in range(NODES_PER_PITCH):
        pairs = np.arange(first, len(gap), NODES_PER_PITCH)
        pairs = pairs[np.isfinite(gap[pairs])]
        gaps = np.sort(gap[pairs])
        for count in range(len(gaps), 0, -1):
            deflection = (load / stiffness + gaps[:count].sum()) / count
            if deflection >= gaps[count - 1]:
                break
        force[pairs] = stiffness * np.maximum(0.0, deflection - gap[pairs])
    return force


def life(form, load, stiffness):
    """Return the cycles to the depths, (n,).

    Parameters
    ----------
    form : "displacement", or where the wear of exact contacts goes: "touching" points
        or "path"
    load, stiffness : of the mesh [N], of a pair [N/m]
    """
    gears = pair()
    s = gears.nodes
    on_path = np.searchsorted(gears.turned, s - 1e-9)
    sliding = np.abs(gears.turned) * sum(1.0 / r for r in gears.base_radius)
    step = gears.turned[1] - gears.turned[0]
    arc = [
        (gears.curvature[0] + s) ** 2 / (2.0 * gears.base_radius[0]),
        -((gears.curvature[1] - s) ** 2) / (2.0 * gears.base_radius[1]),
    ]
    passes = (1.0, gears.base_radius[0] / gears.base_radius[1])
    spreads, lengths = zip(*map(kernel, arc), strict=True)
    wear = np.zeros((2, len(s)))
    cycles = 0.0
    found = []
    while len(found) < len(DEPTHS):
        felt = [spread.T @ depth for spread, depth in zip(spreads, wear, strict=True)]
        gap = np.full(len(gears.turned), np.inf)
        points = (gears.turned, gears.turned)
        if form == "displacement":
            gap[on_path] = felt[0] + felt[1]
        else:
            gap, *points = touching(gears, felt)
        if form != "touching":
            gap = np.where(np.isin(gears.turned, gears.turned[on_path]), gap, np.inf)
            points = (gears.turned, gears.turned)
        force = forces(gap, load, stiffness)
        area = COEFFICIENT_OVER_WIDTH * force * sliding * step
        rate = np.zeros_like(wear)
        for gear in (0, 1):
            place = np.interp(points[gear], s, np.arange(len(s)))
            low = np.minimum(place.astype(int), len(s) - 2)
            worn = np.zeros(len(s))
            np.add.at(worn, low, area * (low + 1 - place))
            np.add.at(worn, low + 1, area * (place - low))
            rate[gear] = passes[gear] * (spreads[gear] @ worn) / lengths[gear]
        size = STEP / rate.max()
        following = wear + size * rate
        while len(found) < len(DEPTHS) and following.max() >= DEPTHS[len(found)]:
            share = DEPTHS[len(found)] - wear.max()
            found.append(cycles + size * share / (following.max() - wear.max()))
        wear = following
        cycles += size
    return np.array(found)


def main():
    """Print the table."""
    base_radius = pair().base_radius[0]
    for name, torque, stiffness in (
        ("steel on plastic, 1.5 N m", 1.5, 1.0e7),
        ("steel, 20 N m", 20.0, 2.6e8),
        ("steel, 1.5 N m", 1.5, 2.2e8),
    ):
        load = torque / base_radius
        first_order = life("displacement", load, stiffness)
        for form in ("touching", "path"):
            ratios = life(form, load, stiffness) / first_order
            print(f"{name:28}{form:10}", *(f"{ratio:8.3f}" for ratio in ratios))


if __name__ == "__main__":
    main()
