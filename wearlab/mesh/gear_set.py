"""A gear set in operation: its pairs, its meshes on one clock, its load."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.gears.gear import Gear, GearPair
from wearlab.gears.helix import SPUR, Helix
from wearlab.mesh import clock, harmonics


def mesh_load(torque: float, base_radius: float, meshes: int = 1) -> float:
    """Return the static normal force of each of a gear's meshes, ``F = T/(n r_b)`` [N].

    Parameters
    ----------
    torque : T on the gear [N·m]
    base_radius : r_b [m]
    meshes : n, among which it is shared

    References
    ----------
    ISO 6336-1:2019, 4: the nominal load, normal to the flanks.

    >>> round(mesh_load(134.0, 0.021145, 3), 1)
    2112.4
    """
    return torque / (meshes * base_radius)


class Body(NamedTuple):
    """A member as it moves.

    Parameters
    ----------
    mass, inertia : [kg], [kg·m²]
    radius : at which its rotation is counted as a path: the base radius; of a carrier
        the radius of its pins [m]
    """

    mass: float
    inertia: float
    radius: float

    @property
    def equivalent(self) -> float:
        """I/r², the inertia seen at the radius [kg]."""
        return self.inertia / self.radius**2


class PairOfSet(NamedTuple):
    """One kind of mesh of a gear set.

    Parameters
    ----------
    pair : the gears in their operating position, driving and driven by the flow of
        power
    flanks : names of the flanks that touch, (driving, driven)
    section : where the campaign file may say something of this mesh alone, "" for
        nowhere
    speed : of the driving gear relative to the carrier [rad/s]
    passes : (2,) passes of a flank per cycle, (driving, driven) [1]
    load : static normal force of one mesh [N]
    loaded : the gear whose torque the load is, 0 driving or 1 driven; the mate of a
        planet
    """

    pair: GearPair
    flanks: tuple[str, str]
    section: str
    speed: float
    passes: Array
    load: float
    loaded: int

    def key(self, name: str) -> str:
        """Return the dotted key of an option of this mesh in a campaign file."""
        return ".".join(part for part in ("mesh", self.section, name) if part)


class GearSet(NamedTuple):
    """A gear set in operation.

    Parameters
    ----------
    kinds : the kinds of mesh; of teeth that are loaded on either side, front flanks
        and back flanks, of which one kind has no mesh
    mesh_names : names of the meshes
    mesh_kinds : which kind each mesh is of
    mesh_lags : (n_mesh,) γ, phase of the clock at which a pair enters at A [1]
    flanks : names of the flanks, as datasets order them
    members : names of the members, as datasets order them
    gears : the gears among them, by name
    reference_teeth : teeth of the gear whose turns relative to the carrier are the
        cycles
    input_teeth : mesh periods in a turn of the input member: its teeth, in a pair
    speed : of that gear relative to the carrier [rad/s]
    bodies : the members as they move, by name; every planet is "planet"
    coordinate_speeds : speed of each coordinate of the dynamic models in the nominal
        rotation [m/s]
    angles : where the planets stand, in the sense in which the models count; none in a
        pair [rad]
    sense : −1 for a set that the models see mirrored: the one whose sun is driven
    notes : what the set as a whole assumes, in words
    helix : of all gears, as the driving gear of the first kind of mesh has it
    """

    kinds: tuple[PairOfSet, ...]
    mesh_names: tuple[str, ...]
    mesh_kinds: tuple[int, ...]
    mesh_lags: Array
    flanks: tuple[str, ...]
    members: tuple[str, ...]
    gears: dict[str, Gear]
    reference_teeth: int
    input_teeth: float
    speed: float
    bodies: dict[str, Body]
    coordinate_speeds: dict[str, float]
    angles: tuple[float, ...] = ()
    sense: float = 1.0
    notes: tuple[str, ...] = ()
    helix: Helix = SPUR

    @property
    def mesh_frequency(self) -> float:
        """Mesh frequency [Hz]."""
        return self.speed / (2 * np.pi) * self.reference_teeth

    @property
    def period(self) -> float:
        """Duration of one mesh period [s]."""
        return 2 * np.pi / (self.speed * self.reference_teeth)

    @property
    def shares(self) -> bool:
        """Whether several meshes of a kind share the load."""
        return len(self.mesh_kinds) > len(self.sections)

    @property
    def sections(self) -> tuple[str, ...]:
        """Names of the meshes that are made alike, each once."""
        return tuple(dict.fromkeys(kind.section for kind in self.kinds))

    @property
    def kind_of_each_section(self) -> "tuple[PairOfSet, ...]":
        """The first kind of each section: back flanks have the gears of the front."""
        first = {kind.section: kind for kind in reversed(self.kinds)}
        return tuple(first[section] for section in self.sections)

    @property
    def planets_are_apart(self) -> bool:
        """Whether every planet has flanks of its own: each mesh is of its own kind."""
        return bool(self.angles) and len(self.kinds) > len(self.sections)

    def with_planets_apart(self) -> "GearSet":
        """Return the set whose meshes are each of their own kind, in their order."""
        kinds = tuple(self.kinds[kind] for kind in self.mesh_kinds)
        return self._replace(kinds=kinds, mesh_kinds=tuple(range(len(kinds))))

    def planet_of(self, kind: int) -> int:
        """Return the number of the planet, from 0, of a kind of mesh of planets apart.

        Parameters
        ----------
        kind : number of the kind of mesh
        """
        return kind % len(self.angles)

    def places_of(self, name: str) -> list[tuple[int, int]]:
        """Return kind of mesh and gear of a flank, of planets apart wherever it is.

        The flanks of sun and ring meet all planets: they are in all of these kinds.

        Parameters
        ----------
        name : of the flank
        """
        return [
            (kind, pair.flanks.index(name))
            for kind, pair in enumerate(self.kinds)
            if name in pair.flanks
        ]

    def flank(self, name: str) -> tuple[int, int]:
        """Return the kind of mesh and the gear (0 driving, 1 driven) of a flank."""
        for kind, pair in enumerate(self.kinds):
            if name in pair.flanks:
                return kind, pair.flanks.index(name)
        raise KeyError(name)

    def transverse_backlash(
        self, kind: PairOfSet, normal: float | None
    ) -> float | None:
        """Return backlash along the line of action, ``j_bn / cos β_b`` [m].

        Parameters
        ----------
        kind : of mesh
        normal : j_bn, normal to the flanks; None: what a drawing's numbers leave [m]

        Returns
        -------
        The backlash, None where there is none to be modelled.

        References
        ----------
        ISO 21771:2007, 5.5: circumferential and normal backlash.
        """
        if normal is None:
            return kind.pair.drawn_backlash
        return normal / self.helix.cosine

    def lever(self, kind: int) -> float:
        """Return the base radius of the gear by whose torque a load is given [m].

        The pinion's for a pair, the sun's or the ring's in a planetary set.

        Parameters
        ----------
        kind : number of the kind of mesh
        """
        gears = {gear.name: gear for gear in self.kinds[kind].pair.gears}
        first_member = next(name for name in self.members if name in gears)
        return gears[first_member].base_radius

    @property
    def torque(self) -> float:
        """Torque from which the loads follow, on the driving gear or sun [N·m]."""
        number = self.mesh_kinds[0]
        first = self.kinds[number]
        base_radius = first.pair.gears[first.loaded].base_radius
        count = sum(
            self.kinds[kind].section == first.section for kind in self.mesh_kinds
        )
        return first.load * count * base_radius

    def is_loaded(self, kind: int) -> bool:
        """Say whether a kind of mesh touches: back flanks do under reversed torque.

        Parameters
        ----------
        kind : its number
        """
        return kind in self.mesh_kinds

    def slow_errors(self, meshes: Sequence[clock.Mesh]) -> Array | None:
        """Return the slow errors of meshes at equally weighted angles of the members.

        Parameters
        ----------
        meshes : the meshes of the set

        Returns
        -------
        (n_angles, n_mesh) once-per-revolution errors [m], None without any
        """
        if not any(len(mesh.error.slow.amplitude) for mesh in meshes):
            return None
        turns = harmonics.quadrature(gear.teeth for gear in self.gears.values())
        return np.stack([mesh.error.slow_at(turns) for mesh in meshes], axis=1)

    def columns_at(self, kind: int, gear: str) -> list[int]:
        """Return the numbers of the members that a gear of a kind of mesh stands for.

        Of planets apart it is one of them; sun and ring are counted at the first.

        Parameters
        ----------
        kind : number of the kind of mesh
        gear : name of the gear
        """
        columns = self.columns_of(gear)
        if not self.planets_are_apart:
            return columns
        planet = self.planet_of(kind)
        if len(columns) > 1:
            return [columns[planet]]
        return columns if planet == 0 else []

    def columns_of(self, gear: str) -> list[int]:
        """Return the numbers of the members that are a gear: all for "planet"."""
        return [
            number
            for number, name in enumerate(self.members)
            if name == gear or name.startswith(f"{gear}-")
        ]

    @property
    def flank_places(self) -> list[tuple[int, int]]:
        """Kind of mesh and gear of every flank, in the datasets' order."""
        return [self.flank(name) for name in self.flanks]

    @property
    def assumed(self) -> tuple[str, ...]:
        """What was assumed about the gears, with their names."""
        of_gears = tuple(
            f"{gear.name}: {flag}"
            for gear in self.gears.values()
            for flag in gear.assumed
        )
        of_pairs = tuple(
            note for kind in self.kinds for note in kind.pair.undercut_notes
        )
        return (*of_gears, *of_pairs, *self.notes)
