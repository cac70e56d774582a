"""Quasi-static contact over the face: gaps at every slice, then loads at every phase.

Every slice is the section that a spur pair has on its whole face, with gaps of its own.
What does not change with wear - compliances, who meets whom - is laid out once a gear
set.

A line meets each slice at a node of its own. On solid teeth both teeth of the pair
yield along the line of action, by
:func:`wearlab.mesh.finite_element.solid.solid_compliance`. Beyond its outermost load a
tooth yields in proportion to its plane section. A driving tooth lags behind at larger y
by ``y tan β`` against its loaded flank, a driven one towards it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array, Flags, Index
from wearlab.gears.gear import DRIVING, GearPair
from wearlab.gears.helix import SPUR, Helix
from wearlab.gears.specification import GearError
from wearlab.mesh.contact import MIN_CONTACT_LOAD_SHARE, ContactAnalysis
from wearlab.mesh.exact.gaps import DisplacementBeyond
from wearlab.mesh.face.deepest import deepest_deflection
from wearlab.mesh.face.grid import FaceGrid
from wearlab.mesh.face.solve import Section, ShearLayer, Slices, layer_of, solve_phases
from wearlab.mesh.finite_element import compliance, elements, outline, solid
from wearlab.mesh.stages import Springs

LIGHT = 1.0
"""Force under which the stiffness of a mesh without a load is evaluated [N]."""
LEVELS = (0.1, 0.25, 0.45, 0.65, 0.85, 1.0, 1.2, 1.5, 2.0, 3.0, 4.5)
"""Forces over the static one at which springs and contact agree."""
MIN_STEP = 1e-12
"""Least deflection from one of these forces to the next [m]."""


class SolidLines(NamedTuple):
    """How lines of contact yield.

    Parameters
    ----------
    compliance : (n_phases, n_lines, n_face, n_face) deflection of slices under forces
        on slices [m/N]
    even : (n_contact,) compliance of teeth and bodies at a node under an even load, per
        width [m²/N]
    """

    compliance: Array
    even: Array


def solid_lines(pair: GearPair, grid: FaceGrid, turned: Helix) -> SolidLines:
    """Return how the lines of contact of a face yield, both solid teeth together.

    Parameters
    ----------
    pair : the gears, in their transverse section
    grid : slices and nodes
    turned : the helix
    """
    n_face = grid.node.shape[-1]
    lines, line_of = np.unique(
        grid.node.reshape(-1, n_face), axis=0, return_inverse=True
    )
    of_lines = np.zeros((len(lines), n_face, n_face))
    even = np.zeros(len(grid.profile.contact_position))
    share = grid.width / grid.face_width
    for number in range(len(pair.gears)):
        tooth = _solid_tooth(pair, number, grid, turned)
        table = tooth.table
        per_width = np.einsum("j,ajbk,k->ab", share, table, share) * grid.face_width
        at_nodes = np.einsum("na,ab,nb->n", tooth.weights, per_width, tooth.weights)
        even += (at_nodes - tooth.local) * tooth.beyond**2
        _add_tooth(of_lines, lines, tooth, grid.width)

    of_lines += np.tril(of_lines, -1).swapaxes(1, 2)
    by_line = of_lines[line_of.ravel()]
    return SolidLines(by_line.reshape(*grid.node.shape, -1), even)


class _SolidTooth(NamedTuple):
    """How a solid tooth yields at the touching nodes of its profile.

    Parameters
    ----------
    table : (m, n_face, m, n_face) of its samples, see `solid.SolidCompliance` [m/N]
    weights : (n_contact, m) of the samples at the nodes [1]
    local : (n_contact,) local indentation per width [m²/N]
    beyond : (n_contact,) factor beyond the outermost sample, 1 within [1]
    """

    table: Array
    weights: Array
    local: Array
    beyond: Array


def _solid_tooth(
    pair: GearPair, number: int, grid: FaceGrid, turned: Helix
) -> _SolidTooth:
    """Return the tooth of one gear of a pair, 0 driving or 1 driven."""
    gear = pair.gears[number]
    sense = -1.0 if number == DRIVING else 1.0
    oblique = turned.sense * math.tan(turned.angle) * sense
    edges = np.concatenate([[0.0], np.cumsum(grid.width)])
    tooth = solid.solid_compliance(gear, edges, oblique)

    position = np.clip(grid.profile.contact_position, pair.path.A, pair.path.E)
    q = outline.LoadedFlank(gear).parameter(pair.radius(number, position))
    sampled = np.clip(q, tooth.q[0], tooth.q[-1])

    # plane elements by which compliances are continued to the tip
    plane = compliance.gear_compliance(gear, elements.Options(refinement=2))
    at_node = plane.weights(q) @ plane.own
    at_sampled = plane.weights(sampled) @ plane.own
    return _SolidTooth(
        table=tooth.table,
        weights=compliance.spline_weights(tooth.q, sampled),
        local=solid.indentation(gear, sampled) / turned.cosine,
        beyond=np.sqrt(at_node / at_sampled),
    )


def _add_tooth(
    of_lines: Array, lines: Index, tooth: _SolidTooth, widths: Array
) -> None:
    """Add the compliance of a tooth to that of lines, on and below the diagonals.

    Parameters
    ----------
    of_lines : (n, n_face, n_face) added to [m/N]
    lines : (n, n_face) node that each line meets on each slice, −1 without
    tooth : the tooth
    widths : (n_face,) of the slices [m]
    """
    weights = tooth.weights
    beyond = tooth.beyond
    for j, width in enumerate(widths):
        for k in range(j + 1):
            reaching = np.flatnonzero((lines[:, j] >= 0) & (lines[:, k] >= 0))
            at_j = lines[reaching, j]
            at_k = lines[reaching, k]
            under_load = weights @ tooth.table[:, j, :, k]
            value = (under_load[at_j] * weights[at_k]).sum(axis=1)
            if j == k:
                value -= tooth.local[at_j] / width
            of_lines[reaching, j, k] += value * beyond[at_j] * beyond[at_k]


class LineLoads(NamedTuple):
    """The mesh under its static load, at the phases of its face.

    Parameters
    ----------
    deflection : (n_phases,) static transmission error δ, at mid-face [m]
    tangent : (n_phases,) mesh stiffness, NaN where it was not asked for [N/m]
    load : (n_phases, n_lines, n_face) force in the plane of action per face width,
        which is also the normal load per length of line [N/m]
    unloaded : (n_phases,) unloaded transmission error, the least gap [m]
    """

    deflection: Array
    tangent: Array
    load: Array
    unloaded: Array


@dataclass(frozen=True)
class FaceContact:
    """Contact of the worn flanks of one kind of mesh over its face.

    Parameters
    ----------
    grid : slices and nodes
    analysis : contact of the section
    lead : (2, n_face, n_profile) material removed on purpose that varies over the face,
        (driving, driven), normal to the flank [m]
    opening : (n_face,) gap by misalignment, along the line of action [m]
    shear_length : ℓ over which slices hold each other, 0: they do not [m]
    pitch : transverse base pitch [m]
    helix : of the gears
    solid : how the slices of each line hold each other as solid teeth, None: as a layer
        in shear
    """

    grid: FaceGrid
    analysis: ContactAnalysis
    lead: Array
    opening: Array
    shear_length: float
    pitch: float
    helix: Helix = SPUR
    solid: SolidLines | None = None

    @cached_property
    def unworn(self) -> LineLoads:
        """The loads of unworn flanks under the static load."""
        return self.solve(np.zeros((2, *self.grid.shape)))

    @cached_property
    def section(self) -> Section:
        """How a slice yields, from the contact of the section over the whole face.

        The load per length of line is the force in the transverse plane per face width;
        along the line of action the contact yields by 1/cos β_b more than along the
        normal, and its radius is that of the normal section, larger by as much. Teeth
        and bodies yield by 1/cos β more than the transverse section: their own section
        lies across the tooth (c′ of ISO 6336-1 falls by cos β likewise), but for solid
        teeth, which are oblique as they are.
        """
        stiffness = self.analysis.stiffness
        face_width = self.grid.face_width
        cosine = self.helix.cosine
        unworn = np.zeros((2, len(self.analysis.grid.contact_position)))
        body = stiffness.body(unworn) * face_width
        softening = stiffness.softening * face_width

        min_force = MIN_CONTACT_LOAD_SHARE * (self.analysis.load or LIGHT)
        under_min_force = stiffness.contact(np.full(len(body), min_force))
        contact = np.broadcast_to(under_min_force, body.shape) * face_width
        contact = (contact - softening * np.log(cosine)) / cosine
        if not contact.any():
            # a stiffness that is prescribed does not say which part is the contact's
            contact = 0.5 * body
            body = 0.5 * body
        elif self.solid is None:
            body = body / math.cos(self.helix.angle)

        return Section(
            body=body,
            cross=self._shared_bodies(stiffness.cross(unworn)),
            hertz=contact,
            softening=softening / cosine,
            min_load=min_force / face_width,
        )

    def _shared_bodies(self, cross: Array) -> Array:
        """Return what pairs share of their bodies, of helical ones where both touch.

        Oblique lines share in proportion to the width on which both may be loaded.
        Nodes beyond A and E reach as far as the heaviest condition of a scene asks for,
        and would count wherever they lie.

        Parameters
        ----------
        cross : (n_apart, n_contact) with pairs 1, 2 … base pitches ahead [m/N]
        """
        if not self.helix.angle:
            return cross
        touches = self._touches
        step = float(np.diff(self.grid.profile.position[:2]).item())
        per_pitch = round(self.pitch / step)
        shared = np.zeros_like(cross)
        for row, pitches in enumerate(range(per_pitch, len(touches), per_pitch)):
            if row < len(cross):
                both = touches[:-pitches] & touches[pitches:]
                shared[row, :-pitches] = np.where(both, cross[row, :-pitches], 0.0)
        return shared

    @property
    def _touches(self) -> Flags:
        """Whether unworn flanks may touch at a node under the static load (n_contact,).

        On A to E, and beyond where the gap of tip corners is less than the deepest
        deflection.
        """
        gap = self.gap(np.zeros((2, *self.grid.shape)))
        of_section = self.analysis.unworn[1].deflection
        even = float(of_section[np.isfinite(of_section)].max())
        on_path = self.grid.profile.on_flank
        deepest = [deepest_deflection(slices, even) for slices in gap[:, on_path].T]

        touches = np.asarray(gap.min(axis=0) <= max(deepest) + gap[:, on_path].min())
        touches[on_path] = True
        return touches

    @cached_property
    def _slices(self) -> Slices:
        """The slices, as the solver takes them."""
        return Slices(self.grid.node, self.grid.width, self.grid.filled)

    @cached_property
    def _layer(self) -> ShearLayer | None:
        """The layer in shear by which slices hold each other; None: as solid teeth."""
        if self.solid is not None:
            return None
        return layer_of(
            self._slices, self.grid.position, self.section.body, self.shear_length
        )

    @property
    def mean_stiffness(self) -> float:
        """Mean of the mesh stiffness of unworn flanks over the mesh period [N/m]."""
        return float(self.grid.weight @ self.unworn.tangent)

    def gap(self, wear: Array) -> Array:
        """Return the gap of each slice at each touching node, (n_face, n_contact) [m].

        Along the line of action: depths over cos β_b.

        Parameters
        ----------
        wear : (2, n_face, n) depths normal to the flank, (driving, driven) [m]

        Raises
        ------
        SectionVanished
            When wear is deeper than a tooth is thick.
        """
        gaps = self.analysis.gaps
        removed = (wear + self.lead) / self.helix.cosine
        if isinstance(gaps, DisplacementBeyond):
            gaps.flanks.check_thickness(wear.max(axis=1))
            gap = gaps.of(removed + gaps.flanks.modification[:, None, :])
        else:
            gap = self.analysis.grid.beyond(
                removed.sum(axis=0) + self.analysis.modification
            )
        return np.asarray(gap + self.opening[:, None])

    def solve(
        self,
        wear: Array,
        near: LineLoads | None = None,
        force: Array | float | None = None,
        *,
        stiffness: bool = True,
    ) -> LineLoads:
        """Return the line loads of flanks worn by (2, n_face, n) [m].

        Parameters
        ----------
        wear : (2, n_face, n), (driving, driven) [m]
        near : loads in a neighbouring state, to start from
        force : in the plane of action, one or (n_phases,); None: the static load of the
            mesh [N]
        stiffness : whether the mesh stiffness is asked for

        Raises
        ------
        GearError
            When slices are pressed so hard that no loads balance.
        """
        grid = self.grid
        gap = self.gap(wear)
        force = self.analysis.load if force is None else force
        forces = np.broadcast_to(force, len(grid.phase))
        is_loaded = forces > 0.0
        load, deflection, tangent = solve_phases(
            self._slices,
            self.section,
            gap,
            np.where(is_loaded, forces, LIGHT),
            np.zeros(grid.node.shape) if near is None else near.load,
            self._layer,
            None if self.solid is None else self.solid.compliance,
            stiffness,
        )

        self._require_balance(load, forces)

        # without a force: as stiff as under a light touch, and not deflected
        unloaded = self._unloaded(gap)
        if not is_loaded.all():
            load[~is_loaded] = 0.0
            deflection[~is_loaded] = unloaded[~is_loaded]
        return LineLoads(deflection, tangent, load, unloaded)

    def _require_balance(self, load: Array, forces: Array) -> None:
        """Refuse line loads that are no numbers.

        The indentation of a solid tooth is taken out of its elements and the contact's
        put in its place; under a load by which the contact is as wide as the tooth is
        deep, less than nothing would be left.

        Parameters
        ----------
        load : (n_phases, n_lines, n_face) [N/m]
        forces : (n_phases,) in the plane of action [N]
        """
        if np.isfinite(load).all():
            return
        line_load = forces.max() / self.grid.face_width
        raise GearError(
            f"operation.torque: under {line_load / 1e3:.3g} N per mm of face no loads "
            "of the slices balance: the contact grows as wide as the teeth are deep; "
            "give less torque, or a wider face"
        )

    def gap_rate(self, wear: Array, loads: LineLoads) -> Array:
        """Return the mean rate of the gaps that touch, by phase, (n_phases,) [m].

        ``Σ k_j ġ_j/Σ k_j``.

        Parameters
        ----------
        wear : (2, n_face, n) [m]
        loads : of the lines; what has a load touches
        """
        grid = self.grid
        position = grid.profile.contact_position
        is_new_place = np.append(True, np.diff(position) > 0.0)
        gap = self.gap(wear)[:, is_new_place]
        slope = np.gradient(gap, position[is_new_place], axis=1)
        slope = slope[:, np.cumsum(is_new_place) - 1] * self.pitch

        node = np.where(grid.node >= 0, grid.node, 0)
        compliance = self.section.body + self.section.hertz
        of_slices = grid.width * grid.filled / compliance[node]
        stiffness = np.where(loads.load > 0.0, of_slices, 0.0)
        total = stiffness.sum(axis=(1, 2))
        slope_at_lines = slope[np.arange(len(grid.position)), node]
        weighted = (stiffness * slope_at_lines).sum(axis=(1, 2))
        return np.divide(weighted, total, out=np.zeros_like(total), where=total > 0.0)

    def _unloaded(self, gap: Array) -> Array:
        """Return the least gap at every phase, (n_phases,) [m]."""
        node = self.grid.node
        of_lines = gap[np.arange(gap.shape[0]), node]
        return np.where(node >= 0, of_lines, np.inf).min(axis=(1, 2))

    @cached_property
    def unworn_least_gap(self) -> float:
        """Least gap of unworn flanks, in the mean over a mesh period [m]."""
        return self.mean_least_gap(np.zeros((2, *self.grid.shape)))

    def mean_least_gap(self, wear: Array) -> float:
        """Return the least gap over the face, in the mean over a mesh period [m].

        Parameters
        ----------
        wear : (2, n_face, n) depths, (driving, driven) [m]
        """
        return float(self.grid.weight @ self._unloaded(self.gap(wear)))

    def residuals(self, loads: LineLoads, force: float) -> Array:
        """Return the sum of line loads over the force less 1, (n_phases,).

        Parameters
        ----------
        loads : of all lines
        force : static force of the mesh [N]
        """
        grid = self.grid
        total = (loads.load * grid.filled * grid.width).sum(axis=(1, 2))
        return np.asarray(total / force - 1.0)


class FaceFlanks(NamedTuple):
    """The flanks of one kind of mesh in one wear state: their force over deflection.

    ``W'(δ, φ)`` is the force under which the contact over the face is deflected by δ:
    convex, since ever more of the face touches. It is given as the sum of one-sided
    springs that meets it at some multiples of the static force, so that the equations
    of motion see a mesh as they see pairs. Its damping acts on what deforms,

        ``N = max(0, W' + c (δ̇ − Σ k_j ġ_j/Σ k_j))``

    over the points that touch under the static load: all springs belong to one force,
    with one rate.

    Parameters
    ----------
    analysis : contact of the section
    contact : over the face
    force : (n_levels,) [N]
    deflection : (n_levels + 1, n_phases) under no force, and under these [m]
    rate : (n_phases,) mean rate of the gaps that touch, by phase [m]
    loads : (n_levels,) under these forces
    """

    analysis: ContactAnalysis
    contact: FaceContact
    force: Array
    deflection: Array
    rate: Array
    loads: tuple[LineLoads, ...]
    series: None = None

    def springs(self, phase: Array) -> Springs:
        """Return the springs at phases, (n, n_levels), all of one force.

        Parameters
        ----------
        phase : (n,) of the mesh [1]

        Returns
        -------
        springs with rates by phase
        """
        grid = self.contact.grid
        phase = phase % 1.0
        rows = [grid.at_phases(row, phase) for row in self.deflection]
        deflection = np.stack(rows, axis=1)
        step = np.maximum(np.diff(deflection, axis=1), MIN_STEP)
        slope = np.diff(self.force, prepend=0.0) / step
        stiffness = np.maximum(np.diff(slope, axis=1, prepend=0.0), 0.0)

        n_levels = stiffness.shape[1]
        rate = grid.at_phases(self.rate, phase)
        part = np.zeros((*stiffness.shape, n_levels))
        part[..., 0] = 1.0
        return Springs(
            stiffness=stiffness,
            gap=deflection[:, :-1],
            pair_rate=np.repeat(rate[:, None], n_levels, axis=1),
            lead_rate=rate,
            part=part,
        )


def face_flanks(
    contact: FaceContact,
    wear: Array,
    static: LineLoads,
    near: FaceFlanks | None = None,
    levels: Sequence[float] = LEVELS,
) -> FaceFlanks:
    """Return flanks worn by (2, n_face, n) [m], with their force over the deflection.

    Parameters
    ----------
    contact : over the face
    wear : effective wear of the mesh [m]
    static : loads under the static force
    near : the same flanks in a neighbouring wear state, whose loads to start from
    levels : forces over the static one at which springs and contact agree [1]
    """
    load = contact.analysis.load
    force = load * np.array(levels)
    loads: list[LineLoads] = []
    for number, level in enumerate(force):
        if level == load:
            loads.append(static)
            continue
        start = loads[-1] if loads else static
        if near is not None:
            start = near.loads[number]
        loads.append(contact.solve(wear, start, float(level), stiffness=False))
    rows = [static.unloaded, *(state.deflection for state in loads)]
    return FaceFlanks(
        analysis=contact.analysis,
        contact=contact,
        force=force,
        deflection=np.maximum.accumulate(np.stack(rows)),
        rate=contact.gap_rate(wear, static),
        loads=tuple(loads),
    )
