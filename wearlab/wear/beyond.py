"""Wear by pairs that touch beyond A and E, before and after the path of contact.

Before A the corner of the driven tip rubs on the driving flank, after E that of the
driving tip on the driven one: both points lie on the flanks between A and E, where
contact on whole outlines finds them. What comes off is Archard's ``k F/B |v_s| dt`` of
both flanks. Its coefficient is that of the end of the path; ``v_s`` is taken as on the
line of action, as the loss is (:mod:`wearlab.thermal.friction`): worn volume and heat
of these pairs have one ratio.

A corner is one point: what it loses makes it round, and then contact goes inside.
"""

from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Index
from wearlab.gears.gear import GearPair
from wearlab.mesh.profile import ProfileGrid
from wearlab.wear.law import PreparedLaw
from wearlab.wear.patch import ascending, cell_edges
from wearlab.wear.path import WearPath
from wearlab.wear.touching import LARGEST_STRETCH, take_off

CORNER_STRETCH = 10.0
"""Largest length of a flank over that of a contact's cell from which its wear comes
off: a corner passes over four times as much of its mate; beyond it, contacts jump."""


class ContactsBeyond(NamedTuple):
    """Pairs at the nodes before A and after E, and what they wear.

    Parameters
    ----------
    law : the wear law with the radii of the ends of the path and the sliding beyond
    end : (n_beyond,) node on the path where it ends, the first or the last
    passed : (2, n_beyond) length of each flank that passes the contact while it is
        nearest to the node, as at the end of the path [m]
    position : (n,) path positions of the nodes on the path [m]
    path : the path of contact at these
    """

    law: PreparedLaw
    end: Index
    passed: Array
    position: Array
    path: WearPath

    def worn(self, rate: Array, met: Array) -> Array:
        """Return the wear rate of the flanks between A and E, (2, n) [m per cycle].

        What a contact wears off comes off the flank from halfway to the contact before
        to halfway to the next; the worn area is conserved.

        Parameters
        ----------
        rate : (2, n_beyond) wear rate by the law [m per cycle]
        met : (2, n_beyond) path positions of the points that touch; NaN where flanks do
            not meet [m]
        """
        ends = self.position[self.end]
        worn = np.zeros((2, len(self.position)))
        for gear, arc_of_flank in enumerate(self.path.arc):
            arc = ascending(arc_of_flank)
            area = rate[gear] * self.passed[gear]
            touched = np.interp(
                np.where(np.isnan(met[gear]), ends, met[gear]), self.position, arc
            )
            reach = self.passed[gear] * CORNER_STRETCH / LARGEST_STRETCH
            taken = np.zeros(len(arc))
            for node in (0, len(arc) - 1):
                side = self.end == node
                if side.any():
                    take_off(area[side], reach[side], touched[side], arc, taken)
            length = np.diff(cell_edges(arc_of_flank))
            np.divide(taken, length, out=worn[gear], where=length > 0.0)
        return worn


def ends_of_path(grid: ProfileGrid) -> Index:
    """Return the node on the path nearest to each node beyond, (n_beyond,).

    Parameters
    ----------
    grid : the nodes
    """
    last = len(grid.position) - 1
    beyond = np.flatnonzero(grid.is_beyond)
    return np.where(beyond < grid.before, 0, last)


def path_of_contacts_beyond(
    pair: GearPair, grid: ProfileGrid, path: WearPath
) -> WearPath:
    """Return the path as the wear law sees it of contacts beyond A and E.

    Radii and velocities are those of the ends of the path, at which both flanks still
    meet; the sliding is that of the place beyond.

    Parameters
    ----------
    pair : the gears
    grid : the nodes
    path : the path of contact at the nodes on it
    """
    end = ends_of_path(grid)
    teeth = np.array([float(gear.teeth) for gear in pair.gears])[:, None]
    # velocities over that of the driving gear's turning
    surface = path.curvature[:, end] * teeth[0] / teeth
    sliding = np.abs(pair.sliding(grid.contact_position[grid.is_beyond]))
    return path._replace(
        curvature=path.curvature[:, end],
        equivalent_radius=path.equivalent_radius[end],
        surface_velocity=path.surface_velocity[:, end],
        specific_sliding=sliding / surface,
        arc_weight=path.arc_weight[:, end],
        arc=path.arc[:, end],
        pressure_angle=path.pressure_angle[:, end],
    )


def contacts_beyond(
    pair: GearPair, grid: ProfileGrid, law: PreparedLaw, path: WearPath
) -> ContactsBeyond:
    """Return the pairs that touch beyond A and E.

    Parameters
    ----------
    pair : the gears
    grid : the nodes
    law : the wear law on `path_of_contacts_beyond`
    path : the path of contact at the nodes on it
    """
    end = ends_of_path(grid)
    is_beyond = grid.is_beyond
    turned = np.empty(len(end))
    for node in (0, len(grid.position) - 1):
        side = end == node
        turned[side] = np.diff(cell_edges(grid.contact_position[is_beyond][side]))
    base_radius = np.array([gear.base_radius for gear in pair.gears])[:, None]
    return ContactsBeyond(
        law=law,
        end=end,
        passed=path.curvature[:, end] / base_radius * turned,
        position=grid.position,
        path=path,
    )
