"""``[thermal]`` → what warms a pair of gears, and what their temperatures change.

Temperature enters the road in one place: `model_at` builds contact and wear law of a
pair whose materials have the moduli of their temperatures, bodies and teeth that of
the root, the contact itself that of the flank.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from wearlab.arrays import Array
from wearlab.assembly import heat
from wearlab.assembly.coupling import mesh_kind
from wearlab.assembly.kinds import MeshKindModel, build_kind
from wearlab.assembly.on_clock import OnClock
from wearlab.life.coupled import MeshKind
from wearlab.life.thermal_coupling import Warming
from wearlab.mesh.gear_set import GearSet
from wearlab.scene import Scene
from wearlab.thermal.friction import sliding_pairs


def model_at(
    scene: Scene, gears: GearSet, cold: MeshKindModel, temperature: Array
) -> MeshKindModel:
    """Return the physics of the mesh of a pair at temperatures.

    Parameters
    ----------
    scene, gears : the scene and its gear set
    cold : the physics at the surroundings' temperature
    temperature : (2, 2) of (driving, driven) at (root, flank) [K]
    """
    kind = gears.kinds[0]
    curves = heat.moduli(scene, kind.pair)
    modulus = [
        [curve.at(float(place)) for place in of_gear]
        for curve, of_gear in zip(curves, temperature, strict=True)
    ]
    pair = heat.at_moduli(kind.pair, np.array(modulus))
    stiffness = scene.mesh.stiffness.warm(pair, kind.pair, cold.analysis.grid)
    analysis = replace(cold.analysis, stiffness=stiffness)
    warm_kind = kind._replace(pair=pair)
    flanks = heat.flank_temperatures(temperature)
    return build_kind(scene, gears, warm_kind, analysis, flanks)


def kinds_at(
    scene: Scene,
    gears: GearSet,
    cold: MeshKindModel,
    on_clock: OnClock,
    temperature: Array,
) -> tuple[MeshKind, ...]:
    """Return contact and wear of the mesh of a pair at temperatures.

    Parameters
    ----------
    scene, gears, cold, temperature : as of `model_at`
    on_clock : the mesh on its clock
    """
    model = model_at(scene, gears, cold, temperature)
    return (mesh_kind(scene, model, on_clock, np.zeros(1, np.int64)),)


def build_warming(
    scene: Scene, gears: GearSet, cold: MeshKindModel, on_clock: OnClock
) -> Warming:
    """Return what warms a pair of gears, and what that changes.

    Parameters
    ----------
    scene, gears : the scene and its gear set
    cold : the physics of its mesh at the surroundings' temperature
    on_clock : the mesh on its clock
    """
    thermal = heat.options_of(scene)
    kind = gears.kinds[0]
    grid = cold.analysis.grid
    return Warming(
        balance=heat.build_balance(scene, kind, kind.speed, thermal.relative_duty),
        sliding=sliding_pairs(kind.pair, grid, kind.speed, kind.load),
        friction=thermal.friction_curve,
        moduli=heat.moduli(scene, kind.pair),
        kinds_at=partial(kinds_at, scene, gears, cold, on_clock),
        loss_factor=thermal.fixed_loss_factor(kind.pair),
    )
