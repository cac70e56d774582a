"""What VDI 2736 says of a pair of plastic gears, beside what is computed of it.

One temperature for the whole life, mean wear, one pressure: the closed loss factor of
the guideline, whatever `[thermal]` finds of each wear state.
"""

from typing import Any, NamedTuple

import numpy as np

from wearlab.arrays import Array
from wearlab.assembly import GearModel, heat, life
from wearlab.gears import vdi
from wearlab.gears.gear import GearPair
from wearlab.life.thermal_coupling import ThermalCoupling, Warming
from wearlab.simulation.dataset.rating import specific_load
from wearlab.thermal.balance import ROOT, NoSteadyTemperature
from wearlab.wear.law import effective_coefficient

ZERO_CELSIUS = 273.15


class GuidelineHeat(NamedTuple):
    """How warm a pair becomes by the guideline.

    Parameters
    ----------
    loss_factor : H_V [1]
    temperature : (2, 2) of (driving, driven) at (root, flank) [K], None where none is
        steady
    why_not : why none is steady, with its numbers, "" where one is
    """

    loss_factor: float
    temperature: Array | None
    why_not: str = ""


def vdi_rating(model: GearModel) -> dict[str, Any]:
    """Return what VDI 2736 says in one condition, {} without [rating] and [thermal].

    Parameters
    ----------
    model : the physics in one condition of operation

    Returns
    -------
    Variable → values of the mesh (1,), of the members (2,), or of their places (2, 2);
    mean wear where load cycles and wear coefficients are known, stress and safety of
    the root where form factors are; the loss factor alone where no temperature is
    steady.
    """
    scene = model.scene
    rating = scene.rating
    coupling = model.coupling
    if rating is None or not isinstance(coupling, ThermalCoupling):
        return {}
    cold_pair = model.gears.kinds[0].pair
    factor, temperature, _ = guideline_heat(cold_pair, coupling.warming)
    if temperature is None:
        return {"vdi_loss_factor": [factor]}
    pair = heat.at_moduli(cold_pair, coupling.warming.moduli_at(temperature))
    names = [gear.name for gear in pair.gears]
    order = [names.index(member) for member in model.gears.members]

    tangential = rating.application_factor * specific_load(model.gears)
    root_moduli = [gear.material.youngs_modulus for gear in pair.gears]
    load = rating.application_factor * model.gears.kinds[0].load
    values: dict[str, Any] = {
        "vdi_loss_factor": [factor],
        "vdi_tooth_temperature": temperature[order],
        "vdi_tooth_displacement": [
            vdi.tooth_displacement(
                tangential * pair.face_width, pair.face_width, root_moduli
            )
        ],
    }
    if pair.contact_ratio < vdi.MAX_CONTACT_RATIO:
        values["vdi_contact_stress"] = [vdi.contact_stress(pair, load)]
    cycles = load_cycles(model)
    if cycles is not None and model.kinds[0].law is not None:
        wear = _mean_wear(model, pair, temperature, cycles)
        values["vdi_mean_wear"] = wear[order]
    if rating.root_form_factors is not None:
        stress = _root_stresses(pair, tangential, rating.root_form_factors, order)
        values["vdi_root_stress"] = stress
        if cycles is not None:
            values |= _root_safety(model, temperature[order], stress, cycles)
    return values


def guideline_heat(pair: GearPair, warming: Warming) -> GuidelineHeat:
    """Return how warm a pair becomes by the guideline.

    Parameters
    ----------
    pair : the gears, as cold as their surroundings
    warming : what warms them
    """
    factor = vdi.loss_factor(pair)
    nominal = factor * warming.sliding.power
    balance = warming.balance
    try:
        power = balance.steady_power(lambda warm: warming.friction_at(warm) * nominal)
    except NoSteadyTemperature as error:
        return GuidelineHeat(factor, None, str(error))
    return GuidelineHeat(factor, balance.temperatures(power))


def load_cycles(model: GearModel) -> float | None:
    """Return the turns of the pinion that are rated, None where nothing tells them.

    Parameters
    ----------
    model : the physics in one condition of operation
    """
    rating = model.scene.rating
    if rating is not None and rating.load_cycles is not None:
        return rating.load_cycles
    return life.build_limits(model.scene, model.gears, model.coupling).cycles


def _mean_wear(
    model: GearModel, pair: GearPair, temperature: Array, cycles: float
) -> Array:
    """Return the mean wear of (driving, driven) at the guideline's temperatures [m]."""
    coupling = model.coupling
    assert isinstance(coupling, ThermalCoupling)
    law = coupling.at(temperature).kinds[0].law
    assert law is not None
    kind = model.gears.kinds[0]
    along_path = np.full(law.path.equivalent_radius.shape, kind.load)
    coefficient = effective_coefficient(law, along_path).mean(axis=1)
    factor = vdi.loss_factor(pair)
    depths = []
    for number, gear in enumerate(pair.gears):
        torque = kind.load * gear.base_radius
        worn = vdi.WornGear(
            torque=torque,
            cycles=cycles * float(kind.passes[number]),
            loss_factor=factor,
            coefficient=float(coefficient[number]),
            width=pair.face_width,
            teeth=gear.teeth,
            flank_length=vdi.flank_length(pair, number),
        )
        depths.append(vdi.mean_wear(worn))
    return np.array(depths)


def _root_stresses(
    pair: GearPair, tangential: float, form: tuple[float, float], order: list[int]
) -> list[float]:
    """Return the stress of the root of every member [Pa], by F_t/b [N/m]."""
    force = tangential * pair.face_width
    return [
        vdi.root_stress(
            force, pair.face_width, pair.gears[number].module, pair.contact_ratio, of
        )
        for number, of in zip(order, form, strict=True)
    ]


def _root_safety(
    model: GearModel, temperature: Array, stress: list[float], cycles: float
) -> dict[str, Any]:
    """Return 2 σ_Flim/σ_F of members whose strength is known, NaN of others [1].

    {} where there is none. Temperatures (2, 2) [K] and stresses [Pa] are by member.
    """
    safety = np.full(len(stress), np.nan)
    for number, member in enumerate(model.gears.members):
        plastic = heat.material_of(model.scene, member).name
        degrees = float(temperature[number, ROOT]) - ZERO_CELSIUS
        if plastic not in vdi.STRENGTHS or degrees > vdi.HIGHEST_STRENGTH:
            continue
        passes = model.gears.reference_teeth / model.gears.gears[member].teeth
        strength = vdi.root_strength(plastic, degrees, cycles * passes)
        safety[number] = 2.0 * strength / stress[number]
    return {} if np.isnan(safety).all() else {"vdi_root_safety": safety}


def vdi_flags(model: GearModel) -> list[str]:
    """Return what a rating by VDI 2736 must say of itself.

    Parameters
    ----------
    model : the physics in one condition of operation
    """
    rating = model.scene.rating
    coupling = model.coupling
    if rating is None or not isinstance(coupling, ThermalCoupling):
        return []
    flags = [
        "rating: VDI 2736-2 second-hand, checked against printed values of others; one "
        "temperature for all the life; wear is allowed up to 0.1 modules, λ up to 0.07 "
        "modules, S_F from 2.0 on"
    ]
    heated = guideline_heat(model.gears.kinds[0].pair, coupling.warming)
    if heated.temperature is None:
        flags.append(f"rating: VDI 2736: {heated.why_not}")
    elif rating.root_form_factors:
        flags += _strength_flags(heated.temperature)
    if model.scene.operation.several:
        flags.append(
            "rating: VDI 2736 of each condition as if it acted in all load cycles"
        )
    return flags


def _strength_flags(temperature: Array) -> list[str]:
    """Return that teeth, (2, 2) [K], are warmer than strengths are known of."""
    warmest = float(temperature.max()) - ZERO_CELSIUS
    if warmest <= vdi.HIGHEST_STRENGTH:
        return []
    return [
        f"rating: {warmest:.4g} °C by VDI 2736, and strengths of plastics are known up "
        f"to {vdi.HIGHEST_STRENGTH:g} °C: no safety beyond"
    ]
