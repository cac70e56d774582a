"""How warm the gears are: temperatures, loss, what both change, and their limits."""

import math
from collections.abc import Iterator

import numpy as np

from wearlab import assembly
from wearlab.arrays import Array
from wearlab.life import history
from wearlab.life.coupled import WearState
from wearlab.life.thermal_coupling import ThermalCoupling
from wearlab.simulation import label
from wearlab.simulation.dataset.coordinates import States
from wearlab.thermal.balance import PLACES, ROOT, HeatState

DEEP = 0.02
"""Depth over the module above which gaps along the line of action are told to be first
order in wear (docs/model_error.md)."""
DEEP_ELASTIC = (
    "gaps along the line of action are first order in wear (lives to 0.1 modules "
    "within 4 % of those of whole outlines: docs/model_error.md)"
)
DEEP_OTHERWISE = (
    "gaps along the line of action shorten lives, those to 0.025 modules and more by "
    "a quarter (docs/model_error.md): give wear.contact_patch = 'elastic', or "
    "mesh.contact = 'exact'"
)
ALLOWED_WEAR = 0.1
"""Wear depth over the module that VDI 2736 allows."""
MUCH_BEYOND = 0.03
"""Share of the load beyond A and E above which a run says that it wears no flank."""


def warm_kinds(
    model: assembly.GearModel, states: States
) -> list[tuple[assembly.MeshKindModel, ...]]:
    """Return the kinds of mesh as warm as they are in each state.

    Parameters
    ----------
    model : the physics
    states : the wear states
    """
    warm = []
    for state in states:
        kinds = model.kinds
        if state.heat is not None:
            at_temperature = assembly.thermal.model_at(
                model.scene, model.gears, kinds[0], state.heat.temperature
            )
            kinds = (at_temperature,)
        warm.append(kinds)
    return warm


def thermal_values(model: assembly.GearModel, states: States) -> label.Values:
    """Return temperatures, moduli and loss of the stored states, {} without [thermal].

    Parameters
    ----------
    model : the physics in one condition of operation
    states : the wear states that are stored
    """
    if model.scene.thermal is None:
        return {}
    heats = _heats(states)
    changes = [_backlash_change(model, heat) for heat in heats]
    left_cold = [_cold_backlash(model, state) for state in states]
    return {
        "tooth_temperature": _by_member(model, [heat.temperature for heat in heats]),
        "elastic_modulus": _by_member(model, [heat.modulus for heat in heats]),
        "friction_power": [[heat.friction_power] for heat in heats],
        "loss_factor": [[heat.loss_factor] for heat in heats],
        "load_beyond_path": [[heat.load_beyond] for heat in heats],
        "thermal_backlash_change": [[change] for change in changes],
        "warm_backlash": [
            [cold + change] for cold, change in zip(left_cold, changes, strict=True)
        ],
        "limit_share": [
            [
                _worn_share(model, state),
                _warm_share(model, heat),
                -change / cold if cold > 0.0 else math.nan,
            ]
            for state, heat, cold, change in zip(
                states, heats, left_cold, changes, strict=True
            )
        ],
    }


def _heats(states: States) -> list[HeatState]:
    """Return how warm the gears are in each state."""
    return [state.heat for state in states if state.heat is not None]


def _cold_backlash(model: assembly.GearModel, state: WearState) -> float:
    """Return the circumferential backlash of worn teeth as cold as the housing [m].

    Wear adds the least unloaded error of the mesh period, where flanks are nearest.
    """
    pair = model.kinds[0].pair
    normal = model.scene.mesh.normal_backlash
    if normal is None:
        normal = max(pair.backlash, 0.0)
    worn = float(state.kind[0].static.unloaded.min())
    return (normal + worn) / math.cos(pair.working_pressure_angle)


def _worn_share(model: assembly.GearModel, state: WearState) -> float:
    """Return the largest depth over its limit, or over VDI's 0.1 modules [1]."""
    wear = model.scene.wear
    until = None if wear is None else wear.until
    limit = assembly.life.build_limits(model.scene, model.gears, model.coupling)
    depths = model.coupling.flat(state.wear)
    if until is None or limit.depth is None:
        return float(depths.max()) / (ALLOWED_WEAR * model.scene.gears.module)
    return float(depths[limit.flank].max()) / limit.depth


def _warm_share(model: assembly.GearModel, heat: HeatState) -> float:
    """Return the largest rise over the allowed one, NaN without a limit [1]."""
    coupling = model.coupling
    assert isinstance(coupling, ThermalCoupling)
    balance = coupling.warming.balance
    shares = [
        (float(heat.temperature[limit.number, limit.place]) - balance.ambient)
        / (limit.temperature - balance.ambient)
        for limit in balance.limits
        if limit.temperature > balance.ambient
    ]
    return max(shares, default=math.nan)


def _by_member(model: assembly.GearModel, values: list[Array]) -> Array:
    """Return values of (driving, driven) in the order of members, (n, member, 2)."""
    names = [gear.name for gear in model.kinds[0].pair.gears]
    order = [names.index(member) for member in model.gears.members]
    return np.stack(values)[:, order]


def _backlash_change(model: assembly.GearModel, heat: HeatState) -> float:
    """Return by how much warmth changes the circumferential backlash [m].

    ``−2 tan α_w Σ r_w α (ϑ_root − ϑ_0)``: gears grow, the housing stays as it is.
    """
    pair = model.kinds[0].pair
    ambient = assembly.heat.options_of(model.scene).ambient
    growth = 0.0
    for number, gear in enumerate(pair.gears):
        pitch_radius = gear.base_radius / math.cos(pair.working_pressure_angle)
        material = assembly.heat.material_of(model.scene, gear.name)
        rise = float(heat.temperature[number, ROOT]) - ambient
        growth += pitch_radius * material.expansion * rise
    return -2.0 * math.tan(pair.working_pressure_angle) * growth


def thermal_flags(
    model: assembly.GearModel, life_history: history.History
) -> Iterator[str]:
    """Yield what a run with [thermal] must say of its validity.

    Parameters
    ----------
    model : the physics in one condition of operation
    life_history : the life in that condition
    """
    if model.scene.thermal is None:
        return
    yield from _assumed(model)
    states = life_history.state
    beyond = max(heat.load_beyond for heat in _heats(states))
    if beyond > MUCH_BEYOND and not model.scene.sections.wears_beyond:
        yield (
            f"beyond A and E pairs carry up to {100.0 * beyond:.2g} % of the load: it "
            "warms the teeth and wears no flank, though it slides most "
            "(mesh.contact = 'exact' lets it: wear.beyond_path)"
        )
    yield from _deep(model, states)


def _deep(model: assembly.GearModel, states: States) -> Iterator[str]:
    """Yield that wear is so deep that gaps along the line of action are rough."""
    scene = model.scene
    deepest = max(float(wear.max()) for state in states for wear in state.wear)
    module = scene.gears.module
    if deepest <= DEEP * module or not scene.mesh.contact.along_line_of_action:
        return
    is_elastic = scene.wear is not None and scene.wear.contact_patch.chosen == "elastic"
    yield (
        f"wear of {1e6 * deepest:.4g} um is {deepest / module:.2g} modules: above "
        f"{DEEP:g} {DEEP_ELASTIC if is_elastic else DEEP_OTHERWISE}"
    )


def _assumed(model: assembly.GearModel) -> Iterator[str]:
    """Yield what of [thermal] is assumed and held."""
    scene = model.scene
    thermal = assembly.heat.options_of(scene)
    for name, transfer in assembly.heat.heat_transfers(scene).items():
        if getattr(thermal.heat_transfer, name) is None:
            numbers = " and ".join(f"{transfer[place]:g}" for place in PLACES)
            yield (
                f"thermal.heat_transfer: of {name} by the pair of materials, k_ϑ "
                f"{numbers} (root, flank; VDI 2736, second-hand)"
            )
    for name in scene.gears.toothed:
        material = assembly.heat.material_of(scene, name)
        if material.is_plastic and not material.softens:
            yield (
                f"gears.{name}.material: Young's modulus is held at one value, however "
                "warm the teeth become"
            )
        if material.is_plastic and material.thermal_expansion is None:
            yield (
                f"gears.{name}.material: thermal expansion {material.expansion:g} 1/K "
                "assumed; it moves no flank, thermal_backlash_change says how much it "
                "would"
            )
    if thermal.housing.model == "partly-open":
        yield "thermal.housing: R_λG of 0.03 K m²/W, between 0.015 and 0.045, assumed"


def pressure_velocity(pressure: Array, sliding: Array) -> Array:
    """Return pressure times sliding velocity along the path, (…) [Pa m/s].

    Parameters
    ----------
    pressure : contact pressure [Pa]
    sliding : sliding velocity, with its sign [m/s]
    """
    return np.asarray(pressure * np.abs(sliding))
