"""Random scenes over many decades, and what must hold of each."""

from typing import Any

import numpy as np
from hypothesis import strategies as st

from wearlab.gears.specification import GearError
from wearlab.scene import Scene
from wearlab.simulation import Refused, simulate

MAY_BE_ABSENT = (
    "floquet_multiplier",  # of an aperiodic response
    *("error_estimate_mesh_force", "error_estimate_mesh_force_max"),
    "error_estimate_mesh_force_min",  # likewise
    "error_estimate_bearing_force",
    "preset_depth",  # of states that nobody asked for by depth
    "error_estimate_wear_depth",  # where every rougher twin responds otherwise
    *(
        "life",
        "remaining_useful_life",
        "service_life",
        "error_estimate_life",
    ),  # not reached
    *(
        "coexisting_multiplier",
        "coexisting_period",
        "coexisting_force_min",
        "coexisting_force_max",
    ),
    *("rival_multiplier", "rival_period", "rival_force_min", "rival_force_max"),
)
WORST_RESIDUAL = 0.01
MAX_MAPS = 2_000_000
MAX_OF_PAIR, MAX_OF_SET = 3e7, 1e6
"""Right-hand sides after which a life ends here: seconds, where a researcher may wait
for minutes."""


def decades(low: float, high: float) -> Any:
    """Draw log-uniformly between 10^low and 10^high."""
    return st.floats(low, high).map(lambda exponent: float(f"{10.0**exponent:.4g}"))


@st.composite
def scenes(draw: Any) -> dict[str, Any]:
    """Draw the mapping of a scene that gears could have."""
    module = draw(decades(-3.7, -1.52))
    teeth = draw(st.integers(12, 400)), draw(st.integers(17, 400))
    shift = max(0.0, round((17.5 - teeth[0]) / 17.0, 3)) + draw(
        st.sampled_from([0.0, 0.0, 0.2])
    )
    width = module * draw(decades(0.0, 2.0))
    torque = 1e7 * width * module * 0.5 * module * teeth[0] * draw(decades(-5.0, 1.5))
    mapping: dict[str, Any] = {
        "gears": {
            "kind": "external-pair",
            "module": f"{module} m",
            "face_width": f"{width} m",
            "pinion": {"teeth": teeth[0], "profile_shift_coefficient": shift},
            "gear": {"teeth": teeth[1]},
        },
        "operation": {
            "torque": f"{torque:.6g} N*m",
            "speed": f"{draw(decades(1.5, 4.5))} rpm",
        },
        "mesh": {"stiffness": draw(stiffness(width))},
    }
    if draw(st.booleans()):
        mapping["mesh"]["normal_backlash"] = (
            f"{draw(st.just(0.0) | decades(-9.0, -3.0))} m"
        )
    if draw(st.sampled_from([True, True, False])):
        mapping["mesh"] |= {"damping_ratio": draw(st.just(0.0) | decades(-4.0, 0.3))}
        mapping["mesh"] |= {"damping_in": draw(st.sampled_from(["contact", "always"]))}
        mapping["dynamics"] = draw(dynamics(width))
        if draw(st.booleans()):
            amplitude = module * draw(decades(-7.0, -2.5))
            order = draw(st.integers(1, 6))
            mapping["errors"] = {
                "harmonic": [{"order": order, "amplitude": f"{amplitude} m"}]
            }
    if draw(st.booleans()):
        coefficient = {
            "model": "constant",
            "value": f"{draw(decades(-20.0, -14.0))} m^2/N",
        }
        mapping["wear"] = {"coefficient": coefficient}
        if draw(st.booleans()):
            mapping["wear"]["until"] = {
                "depth": f"{module * draw(decades(-5.5, -2.5)):.4g} m"
            }
    return mapping


@st.composite
def internal_pairs(draw: Any, *, moving: bool = False) -> dict[str, Any]:
    """Draw the mapping of a pinion in a ring; some that stand where they may move."""
    module = draw(decades(-3.7, -1.52))
    pinion = draw(st.integers(20, 90))
    ring = pinion + draw(st.integers(9, 150))
    rim = module * (ring + 2.5 + draw(decades(0.3, 1.5)))
    return _loaded(
        draw,
        module,
        {
            "kind": "internal-pair",
            "pinion": {"teeth": pinion},
            "ring": {"teeth": ring, "rim_diameter": f"{rim:.6g} m", **draw(tips)},
        },
        pinion,
        moving=moving,
    )


@st.composite
def planetary_sets(draw: Any, *, moving: bool = False) -> dict[str, Any]:
    """Draw the mapping of a planetary set, its planets at angles
    where they can be assembled.
    """
    module = draw(decades(-3.7, -1.52))
    sun = draw(st.integers(18, 90))
    planet = draw(st.integers(18, 60))
    ring = sun + 2 * planet
    planets = draw(st.integers(2, most_planets(sun, planet)))
    steps = [round(2 * (sun + planet) * n / planets) for n in range(planets)]
    rim = module * (ring + 2.5 + draw(decades(0.3, 1.5)))
    gears = {
        "kind": "planetary",
        "planets": planets,
        "planet_angles": [
            f"{180.0 * step / (sun + planet):.12g} deg" for step in steps
        ],
        "sun": {"teeth": sun},
        "planet": {"teeth": planet},
        "ring": {"teeth": ring, "rim_diameter": f"{rim:.6g} m", **draw(tips)},
        "carrier": {"mass": "1 kg", "inertia": "1 kg*m^2"},
    }
    return _loaded(draw, module, gears, sun, moving=moving)


def most_planets(sun: int, planet: int) -> int:
    """Return how many planets pass each other, eight at most, where
    teeth leave none an equal space.
    """
    widest = np.sin(0.5 * (2 * np.pi / np.arange(3, 9) - np.pi / (sun + planet))) * (
        sun + planet
    )
    return 2 + int(np.sum(widest > planet + 2.5))


tips = st.sampled_from([*3 * [{"tip_alteration": "wang-2023"}], {}])
"""A ring's full tips reach below the involute of many a pinion."""


def _loaded(
    draw: Any, module: float, gears: dict[str, Any], driving: int, *, moving: bool
) -> dict[str, Any]:
    """Return gears with a load, a stiffness and wear over many decades.

    Some rub, or have a duty.

    The largest torques bend teeth with a gigapascal and more.
    """
    width = module * draw(decades(0.0, 2.0))
    torque = 1e7 * width * module * 0.5 * module * driving * draw(decades(-5.0, 2.0))
    speed = draw(decades(1.5, 4.5))
    if (
        gears["kind"] == "planetary" and moving
    ):  # no faster than pins can hold: by the pitch-line velocity
        speed = 60.0 * draw(decades(-1.0, 2.0)) / (np.pi * module * driving)
        gears["carrier"] = _carrier(
            width, module * (driving + gears["planet"]["teeth"])
        )
    coefficient = {"model": "constant", "value": f"{draw(decades(-20.0, -14.0))} m^2/N"}
    mapping: dict[str, Any] = {
        "gears": {**gears, "module": f"{module} m", "face_width": f"{width} m"},
        "operation": {"torque": f"{torque:.6g} N*m", "speed": f"{speed} rpm"},
        "mesh": {"stiffness": draw(stiffness(width))},
        "wear": {"coefficient": coefficient},
    }
    if (gears["kind"] == "internal-pair" or moving) and draw(st.booleans()):
        depth = module * draw(decades(-5.5, -2.5))
        mapping["wear"]["until"] = {"depth": f"{depth:.4g} m"}
        if draw(st.booleans()):
            flank = "sun" if gears["kind"] == "planetary" else "pinion"
            mapping["wear"]["until"]["flank"] = flank
            mapping["wear"]["snapshots"] = {
                "depth": [f"{part * depth:.4g} m" for part in (0.3, 0.7)],
                "flank": flank,
            }
    if moving:
        mapping["mesh"]["damping_ratio"] = draw(decades(-3.0, -0.3))
        pair = gears["kind"] == "internal-pair"
        mapping["dynamics"] = draw(dynamics(width, "ring") if pair else motion(width))
        if draw(st.booleans()):
            mapping["dynamics"]["friction"] = {"coefficient": draw(decades(-3.0, -0.3))}
        if draw(st.booleans()):
            mapping["mesh"]["normal_backlash"] = (
                f"{draw(st.just(0.0) | decades(-9.0, -3.0))} m"
            )
    if draw(st.sampled_from([True, False, False])):
        mapping["operation"] = {"duty": draw(duty(torque, speed))}
    most = MAX_OF_SET if gears["kind"] == "planetary" else MAX_OF_PAIR
    mapping["numerics"] = {"most_right_hand_sides": most}
    return mapping


def _carrier(width: float, diameter: float) -> dict[str, str]:
    """Return a carrier as heavy as a disc of steel."""
    mass = 7830.0 * 0.25 * np.pi * diameter**2 * width
    return {
        "mass": f"{mass:.4g} kg",
        "inertia": f"{mass * diameter**2 / 8.0:.4g} kg*m^2",
    }


def duty(torque: float, speed: float) -> Any:
    """Draw two or three loads that take turns around one torque and one speed."""
    loads = st.lists(
        st.tuples(decades(-1.0, 1.0), decades(-0.5, 0.5)), min_size=2, max_size=3
    )
    return loads.map(
        lambda each: [
            {
                "torque": f"{torque * load:.6g} N*m",
                "speed": f"{speed * fast:.6g} rpm",
                "share": 1.0 / len(each),
            }
            for load, fast in each
        ]
    )


@st.composite
def motion(draw: Any, width: float) -> dict[str, Any]:
    """Draw the moving coordinates of a planetary set."""
    if draw(st.booleans()):
        return {"model": "planetary-torsional"}
    bearing = {
        "radial_stiffness": f"{width * draw(decades(8.0, 11.0)):.6g} N/m",
        "damping_ratio": draw(decades(-3.0, -0.3)),
    }
    held = {
        **bearing,
        "tangential_stiffness": f"{width * draw(decades(8.0, 11.0)):.6g} N/m",
    }
    supports = {"sun": bearing, "planet": bearing, "ring": held, "carrier": bearing}
    return {"model": "planetary", "supports": supports}


def stiffness(width: float) -> Any:
    """Draw a stiffness: computed, tuned, or constant over decades."""
    constant = decades(7.5, 12.0).map(lambda k: f"{k * width:.6g} N/m")
    return (
        st.just({"model": "potential-energy"})
        | st.builds(
            lambda s: {"model": "potential-energy", "scale": s}, decades(-2.0, 2.0)
        )
        | st.just({"model": "potential-energy", "coupling": "shared", "hertz": "weber"})
        | st.builds(
            lambda k, of: {"model": "constant", "value": k, "of": of},
            constant,
            st.sampled_from(["pair", "mesh"]),
        )
    )


@st.composite
def dynamics(draw: Any, width: float, driven: str = "gear") -> dict[str, Any]:
    """Draw moving coordinates."""
    if draw(st.booleans()):
        return {"model": "torsional"}
    bearing = {
        "radial_stiffness": f"{width * draw(decades(9.0, 12.0)):.6g} N/m",
        "damping_ratio": draw(decades(-3.0, -0.3)),
    }
    return {"model": "spur-3dof", "supports": {"pinion": bearing, driven: bearing}}


def outcome(mapping: dict[str, Any]) -> tuple[str, list[str]]:
    """Return the verdict of a random scene ("refused" included), and every rule that
    its data breaks.
    """
    try:
        dataset = simulate(Scene.from_mapping(mapping))
    except (Refused, GearError) as refusal:
        return "refused", [] if str(refusal) else ["a refusal without a reason"]
    return str(dataset.verdict.item()), broken(dataset)


def broken(dataset: Any) -> list[str]:
    """Return every rule that a dataset breaks."""
    rules = [
        f"{name} is not finite"
        for name in dataset.variables
        if not _finite(dataset, str(name))
    ]
    if float(dataset.residual_load_share.max()) > 1e-9:
        rules.append(
            f"load shares sum to 1 ± {float(dataset.residual_load_share.max()):.3g}"
        )
    if "residual_mean_force" in dataset and dataset.verdict.item() not in (
        "aperiodic",
        "not converged",
    ):
        largest = (dataset.dynamic_factor * dataset.static_mesh_force).max("mesh")
        unknown = (
            dataset.error_estimate_mesh_force > largest
        )  # states that call their own force unknown
        residual = float(np.abs(dataset.residual_mean_force).where(~unknown, 0.0).max())
        peak = float(
            np.nanmax(dataset.dynamic_factor)
        )  # short blows are hard to integrate
        if residual > WORST_RESIDUAL * max(1.0, peak):
            rules.append(f"mean force is off by {residual:.3g}")
    if "wear_depth" in dataset:
        depth = dataset.wear_depth.values
        if depth.min() < 0.0 or np.diff(depth, axis=0).min(initial=0.0) < 0.0:
            rules.append("wear is negative or shrinks")
    if "count_period_maps" in dataset and int(dataset.count_period_maps) > MAX_MAPS:
        rules.append(f"{int(dataset.count_period_maps)} period maps")
    return rules


def _finite(dataset: Any, name: str) -> bool:
    variable = dataset[name]
    if variable.dtype.kind != "f" or name in MAY_BE_ABSENT:
        return True
    if (
        "mesh_period" in variable.dims
    ):  # padded where other updates have a longer period
        variable = variable.isel(mesh_period=0)
    return bool(np.isfinite(variable.values).all())
