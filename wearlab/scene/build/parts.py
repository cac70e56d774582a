"""A scene becomes physics: only here do sections of a campaign file meet gears, mesh, dynamics and wear."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wearlab.gears.pair import GearPair
from wearlab.life.state import Coupling, Vibration
from wearlab.mesh.contact import ContactAnalysis
from wearlab.mesh.errors import MeshError
from wearlab.mesh.profile import Lookup, lookup
from wearlab.scene import Scene
from wearlab.scene.build.gears import build_pair, gear_validity, modifications
from wearlab.scene.build.mesh import build_analysis, build_error
from wearlab.scene.build.vibration import build_vibration
from wearlab.scene.build.wear import build_film, build_law, build_load
from wearlab.wear.film import Film
from wearlab.wear.law import PreparedLaw
from wearlab.wear.path import WearPath, contact_modulus, wear_path

Array = NDArray[np.float64]

HARMONICS = 10
PHASE_POINTS = 256


@dataclass(frozen=True)
class PairParts:
    """The physics of a scene with one gear pair; what the scene leaves out is ``None``.

    Parameters
    ----------
    pair : the gears in their operating position
    names : members as datasets order them, ("pinion", "gear")
    order : for each of them its index among (driving, driven)
    analysis : contact of the worn flanks
    error : prescribed errors of the mesh
    constant_error : frozen once-per-revolution error [m]
    modification : (2, n) material removed on purpose, (driving, driven) [m]
    wear_path : velocities and radii along the path
    vibration, law, film : present parts
    coupling : all of them joined
    speed : of the reference gear, the pinion [rad/s]
    phase : (n_phases,) stored phases [1]
    output : their look-up among the nodes
    harmonics : number of harmonics stored
    drive_flank : "right" or "left"
    peak_pressure : whether the stored pressure is the peak of Hertz's ellipse
    wohler_slope : exponent of the equivalent load, None: not stored
    validity : assumed values and limits this scene touches, in words
    """

    pair: GearPair
    names: tuple[str, str]
    order: list[int]
    analysis: ContactAnalysis
    error: MeshError
    constant_error: float
    modification: Array
    wear_path: WearPath
    vibration: Vibration | None
    law: PreparedLaw | None
    film: Film | None
    coupling: Coupling
    speed: float
    phase: Array
    output: Lookup
    harmonics: int
    drive_flank: str
    peak_pressure: bool
    wohler_slope: float | None
    validity: tuple[str, ...]

    @property
    def mesh_frequency(self) -> float:
        """Mesh frequency [Hz]."""
        return self.speed / (2 * np.pi) * self.pair.gears[self.order[0]].teeth

    @property
    def has_bearings(self) -> bool:
        """Whether the gears move on their supports."""
        return self.vibration is not None and f"{self.names[0]}.y" in self.vibration.system.coordinates

    def look(self, phases: Array) -> Lookup:
        """Return the look-up of phases (n,) among the nodes."""
        return lookup(self.analysis.grid, phases)


def build(scene: Scene) -> PairParts:
    """Turn a scene into physics.

    Raises
    ------
    GearError
        When no such gears can exist or run.
    """
    pair = build_pair(scene)
    order = [0, 1] if pair.driving.name == "pinion" else [1, 0]
    teeth = [gear.teeth for gear in pair.gears]
    driving_speed = scene.operation.speed or 0.0
    speed = driving_speed * teeth[0] / teeth[order[0]]
    analysis = build_analysis(scene, pair)
    grid = analysis.grid
    error = build_error(scene, pair)
    path = wear_path(
        np.stack(pair.curvature(grid.position)),
        base_radius=[gear.base_radius for gear in pair.gears],
        teeth=teeth,
        driving_speed=driving_speed,
        face_width=pair.face_width,
        contact_modulus=contact_modulus(
            [gear.material.youngs_modulus for gear in pair.gears],
            [gear.material.poisson_ratio for gear in pair.gears],
        ),
        reference=order[0],
    )
    vibration = build_vibration(scene, pair, analysis, error)
    law = build_law(scene, pair, path)
    count = scene.numerics.phase_points or PHASE_POINTS
    phases = np.arange(count) / count
    wear: Any = scene.wear
    return PairParts(
        pair=pair,
        names=("pinion", "gear"),
        order=order,
        analysis=analysis,
        error=error,
        constant_error=_constant_error(scene, error),
        modification=modifications(pair, grid.position),
        wear_path=path,
        vibration=vibration,
        law=law,
        film=build_film(scene, pair),
        coupling=Coupling(analysis, vibration, law, build_load(scene)),
        speed=speed,
        phase=phases,
        output=lookup(grid, phases),
        harmonics=HARMONICS,
        drive_flank=scene.operation.drive_flank,
        peak_pressure=wear is not None and wear.pressure == "peak",
        wohler_slope=None if wear is None else wear.wohler_slope,
        validity=_validity(scene, pair),
    )


def _constant_error(scene: Scene, error: MeshError) -> float:
    """Return the frozen once-per-revolution error [m]; averaged and hunting errors enter elsewhere."""
    if scene.errors is None or scene.errors.slow != "frozen":
        return 0.0
    return float(error.slow(np.zeros(1))[0])


def _validity(scene: Scene, pair: GearPair) -> tuple[str, ...]:
    """Return assumed values and limits of validity that the scene touches, one line each."""
    flags = list(gear_validity(scene, pair))
    stiffness = scene.mesh.stiffness
    if stiffness.model == "potential-energy" and stiffness.scale != 1.0:
        flags.append(f"mesh.stiffness.scale = {stiffness.scale:g} is tuned")
    if build_film(scene, pair) is not None:
        flags.append("roughness: R_q = 1.25 R_a assumed")
    if scene.wear is not None and scene.wear.coefficient is not None:
        flags.append(
            "wear coefficient: usually unknown within a decade; depth and 1/life are proportional to it"
        )
    initial = scene.wear.initial if scene.wear is not None else None
    if any(
        flank is not None and flank.sides == "both"
        for flank in ((initial and (initial.pinion, initial.gear)) or ())
    ):
        flags.append("initial wear of back flanks is not part of the back contact")
    return tuple(flags)
