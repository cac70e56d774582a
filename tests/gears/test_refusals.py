"""Every refusal of the geometry: an input that raises it, and its advice, taken."""

import math
import re
from typing import Any

import pytest
from geometry_refusals import Refusal, build, changed, sites
from scenes import external_pair, internal_pair, planetary_set

from wearlab.gears import iso, pairs, planetary, vdi
from wearlab.gears.helix import helix
from wearlab.gears.making import build_gear
from wearlab.gears.shifts import inverse_involute
from wearlab.gears.specification import (
    Basics,
    GearError,
    GearSpec,
    Material,
    Modification,
    Relief,
    check_reliefs,
)
from wearlab.scene import SceneError

BASICS = Basics(3e-3, face_width=0.02)


def gear(**given: Any):
    """Return a call that builds one gear."""
    name = {"name": "gear", "teeth": 30}
    internal = given.pop("internal", False)
    basics = given.pop("basics", BASICS)
    spec = GearSpec(**{**name, **given})
    return lambda: build_gear(spec, basics, 0.0, internal=internal)


def pair(basics: Basics = BASICS, first: str = "pinion", **given: Any):
    """Return a call that builds a pair."""
    pinion = GearSpec(name=first, teeth=20)
    wheel = GearSpec(name="gear", teeth=40)
    return lambda: pairs.gear_pair(pinion, wheel, basics, **given)


def angles(*turns: float, planets: int = 3):
    """Return a call that assembles planets among 96 teeth."""
    given = [2.0 * math.pi * turn for turn in turns] or None
    return lambda: planetary.assembled_angles(96, planets, given)


def ring_of(**given: Any) -> dict[str, Any]:
    """Return the table of a ring of 100 teeth."""
    return {"teeth": 100, "rim_diameter": "340 mm", **given}


def set_of(**given: Any) -> dict[str, Any]:
    """Return the table of a planetary set of 24, 24 and 72 teeth."""
    ring = {"teeth": 72, "rim_diameter": "250 mm"}
    return planetary_set(24, 24, ring, **given)


def pinion(**given: Any) -> dict[str, Any]:
    """Return the table of an external pair of 20 and 40 teeth."""
    return external_pair({"teeth": 20, **given}, 40)


REFUSALS: dict[str, Refusal] = {
    "helix.helix.1": Refusal(
        lambda: helix(math.radians(80.0), math.radians(20.0)),
        {"between 0 and 45 deg": lambda: helix(math.radians(45.0), 0.3)},
    ),
    "iso.allowed.1": Refusal(
        lambda: iso.allowed(13, 3e-3, 0.1, 1.5),
        {"classes 0 to 12": lambda: iso.allowed(12, 3e-3, 0.1, 1.5)},
    ),
    "iso._middle.1": Refusal(
        lambda: iso.allowed(5, 0.1e-3, 0.1, 1.5),
        {"module of 0.5 to 70 mm": lambda: iso.allowed(5, 0.5e-3, 0.1, 1.5)},
    ),
    "making._specification_problems.1": Refusal(
        pinion(teeth=4),
        {"give at least 5": {"pinion.teeth": 12}},
    ),
    "making._specification_problems.2": Refusal(
        gear(tip_diameter=0.096, addendum_coefficient=1.0),
        {
            "give tip_diameter": gear(tip_diameter=0.096),
            "or addendum": gear(addendum_coefficient=1.0),
        },
    ),
    "making._specification_problems.3": Refusal(
        gear(root_diameter=0.082, dedendum_coefficient=1.25),
        {
            "give root_diameter": gear(root_diameter=0.082),
            "or dedendum_coefficient": gear(dedendum_coefficient=1.25),
        },
    ),
    "making._specification_problems.4": Refusal(
        gear(basics=Basics(3e-3)),
        {
            "give it for the gear": gear(basics=Basics(3e-3), face_width=0.02),
            "or for the pair": gear(),
        },
    ),
    "making._specification_problems.5": Refusal(
        gear(tip_chamfer=1e-4, usable_tip_diameter=0.0955),
        {
            "give tip_chamfer": gear(tip_chamfer=1e-4),
            "or usable_tip_diameter": gear(usable_tip_diameter=0.0955),
        },
    ),
    "making._specification_problems.6": Refusal(
        gear(
            internal=True,
            teeth=100,
            rim_diameter=0.34,
            tip_alteration="wang-2023",
            tip_alteration_coefficient=-0.1,
        ),
        {
            "give tip_alteration,": gear(
                internal=True, teeth=100, rim_diameter=0.34, tip_alteration="wang-2023"
            ),
            "tip_alteration_coefficient or": gear(
                internal=True,
                teeth=100,
                rim_diameter=0.34,
                tip_alteration_coefficient=-0.1,
            ),
            "tip_diameter, not two": gear(
                internal=True, teeth=100, rim_diameter=0.34, tip_diameter=0.295
            ),
        },
    ),
    "making._specification_problems.7": Refusal(
        gear(mass=-1.0),
        {"must be positive": gear(mass=1.0)},
    ),
    "making._ring_problems.1": Refusal(
        gear(internal=True, teeth=100),
        {
            "rim_diameter is missing.* above its root diameter": gear(
                internal=True, teeth=100, rim_diameter=0.34
            )
        },
    ),
    "making._ring_problems.2": Refusal(
        gear(internal=True, teeth=100, rim_diameter=0.34, bore_diameter=0.2),
        {"give rim_diameter": gear(internal=True, teeth=100, rim_diameter=0.34)},
    ),
    "making._ring_problems.3": Refusal(
        gear(internal=True, teeth=100, rim_diameter=0.34, root_profile="trochoid"),
        {
            'give "fillet"': gear(
                internal=True, teeth=100, rim_diameter=0.34, root_profile="fillet"
            ),
            'or "radial"': gear(
                internal=True, teeth=100, rim_diameter=0.34, root_profile="radial"
            ),
        },
    ),
    "making._ring_problems.4": Refusal(
        gear(
            internal=True, teeth=100, rim_diameter=0.34, fillet_radius_coefficient=-0.1
        ),
        {
            "must not be negative": gear(
                internal=True,
                teeth=100,
                rim_diameter=0.34,
                fillet_radius_coefficient=0.0,
            )
        },
    ),
    "making._external_problems.1": Refusal(
        gear(rim_diameter=0.34), {"leave it out": gear()}
    ),
    "making._external_problems.2": Refusal(
        gear(root_profile="fillet"),
        {
            'give "trochoid"': gear(root_profile="trochoid"),
            'or "radial"': gear(root_profile="radial"),
        },
    ),
    "making._ring_circle_problems.1": Refusal(
        internal_pair(20, {"teeth": 30, "rim_diameter": "110 mm"}),
        {
            r"a tip_diameter of ([\d.]+) mm at least": {"ring.tip_diameter": "{0} mm"},
        },
    ),
    "making._ring_circle_problems.2": Refusal(
        internal_pair(20, ring_of(tip_diameter="310 mm")),
        {"a smaller tip_diameter": {"ring.tip_diameter": "295 mm"}},
    ),
    "making._ring_circle_problems.3": Refusal(
        internal_pair(20, ring_of(rim_diameter="300 mm")),
        {
            r"must lie above the root diameter ([\d.]+) mm": {
                "ring.rim_diameter": "330 mm"
            }
        },
    ),
    "making._circle_problems.1": Refusal(
        pinion(tip_diameter="50 mm"),
        {"a larger tip_diameter": {"pinion.tip_diameter": "66 mm"}},
    ),
    "making._circle_problems.2": Refusal(
        pinion(tip_diameter="56 mm"),
        {"enlarge the tip": {"pinion.tip_diameter": "66 mm"}},
    ),
    "making._circle_problems.3": Refusal(
        pinion(bore_diameter="60 mm"),
        {r"below the root diameter ([\d.]+) mm": {"pinion.bore_diameter": "30 mm"}},
    ),
    "making._material_problems.1": Refusal(
        gear(material=Material(206e9, 0.6, 7830.0)),
        {"0 <= poisson_ratio < 0.5": gear(material=Material(206e9, 0.3, 7830.0))},
    ),
    "making._tip_problems.1": Refusal(
        pinion(usable_tip_diameter="80 mm"),
        {"lies within it": {"pinion.usable_tip_diameter": "65.5 mm"}},
    ),
    "making._tip_problems.2": Refusal(
        internal_pair(20, ring_of(tip_chamfer="6.6 mm")),
        {"reduce the chamfer": {"ring.tip_chamfer": "0.3 mm"}},
    ),
    "making._tip_problems.3": Refusal(
        external_pair(
            {"teeth": 12, "profile_shift_coefficient": 1.1},
            40,
        ),
        {
            r"tip_diameter of ([\d.]+) mm at most": {"pinion.tip_diameter": "{0} mm"},
            "reduce profile_shift_coefficient": {
                "pinion.profile_shift_coefficient": 0.4
            },
        },
    ),
    "pairs.gear_pair.1": Refusal(
        pair(driving="ring"), {"'pinion' nor 'gear'": pair(driving="gear")}
    ),
    "pairs.gear_pair.2": Refusal(
        internal_pair(100, ring_of()),
        {"give the ring more teeth": {"pinion.teeth": 40}},
    ),
    "pairs.check_basics.1": Refusal(
        pair(Basics(-3e-3, face_width=0.02)), {"must be positive": pair()}
    ),
    "pairs.check_basics.2": Refusal(
        external_pair(20, 40, pressure_angle="50 deg"),
        {"between 0 and 45 deg": {"pressure_angle": "25 deg"}},
    ),
    "pairs.check_basics.3": Refusal(
        pair(first="gear"), {"give them two names": pair()}
    ),
    "pairs._low_contact_ratio.1": Refusal(
        external_pair(
            {"teeth": 38, "addendum_coefficient": 0.4},
            {"teeth": 57, "addendum_coefficient": 0.4},
            helix_angle="5 deg",
        ),
        {
            "enlarge the tips": {
                "pinion.addendum_coefficient": 1.0,
                "gear.addendum_coefficient": 1.0,
            },
            r"give a common face width of ([\d.]+) mm": {"face_width": "{0} mm"},
        },
        {"mesh": {"misalignment": "0 um"}},
    ),
    "pairs._involute_interference.1": Refusal(
        internal_pair(
            20, {"teeth": 30, "rim_diameter": "110 mm", "tip_diameter": "85 mm"}
        ),
        {
            r"tip_diameter of ([\d.]+) mm at least": {"ring.tip_diameter": "{0} mm"},
        },
    ),
    "pairs._involute_interference.2": Refusal(
        external_pair({"teeth": 50, "tip_diameter": "157 mm"}, 50),
        {
            r"tip_diameter of ([\d.]+) mm at most": {"pinion.tip_diameter": "{0} mm"},
            "deepen the root of gear": {"gear.dedendum_coefficient": 1.4},
            "reduce its fillet_radius_coefficient": {
                "gear.fillet_radius_coefficient": 0.25
            },
        },
    ),
    "pairs._corner_in_undercut.1": Refusal(
        internal_pair(
            16,
            {
                "teeth": 24,
                "profile_shift_coefficient": 0.5,
                "tip_diameter": "68.5 mm",
                "rim_diameter": "100 mm",
            },
        ),
        {r"tip_diameter of ([\d.]+) mm at least": {"ring.tip_diameter": "{0} mm"}},
    ),
    "pairs._tip_in_root.1": Refusal(
        internal_pair(
            {"teeth": 40, "tip_diameter": "128 mm"}, ring_of(root_profile="radial")
        ),
        {
            "shorten the tip of pinion": {"pinion.tip_diameter": "127 mm"},
            "deepen the root of ring": {"ring.dedendum_coefficient": 1.5},
        },
    ),
    "pairs._tip_interference.1": Refusal(
        internal_pair(94, ring_of()),
        {
            r"tip_diameter of ([\d.]+) mm at most": {"pinion.tip_diameter": "{0} mm"},
            "use a larger difference": {"pinion.teeth": 90},
            "or centre distance": {"centre_distance": "10 mm"},
        },
    ),
    "pairs.check_backlash.1": Refusal(
        external_pair(
            {"teeth": 20, "profile_shift_coefficient": 0.0},
            {"teeth": 40, "profile_shift_coefficient": 0.0},
            centre_distance="89.9 mm",
        ),
        {
            r"raise the centre distance by ([\d.]+) mm": {"centre_distance": "90 mm"},
            "tooth_thickness_allowance below 0": {
                "pinion.tooth_thickness_allowance": "-100 um"
            },
            "leave out one of shifts": {"gear.profile_shift_coefficient": None},
            "and centre distance": {"centre_distance": None},
        },
    ),
    "planetary.Train.__post_init__.1": Refusal(
        lambda: planetary.Train(24, 24, 72, fixed="sun"),
        {"each once": lambda: planetary.Train(24, 24, 72, fixed="ring")},
    ),
    "planetary.assembled_angles.1": Refusal(
        angles(planets=1), {"at least 2 planets": angles(planets=2)}
    ),
    "planetary.assembled_angles.2": Refusal(
        angles(0.0, 0.5), {"one angle each": angles(0.0, 1 / 3, 2 / 3)}
    ),
    "planetary.assembled_angles.3": Refusal(
        set_of(planet_angles=["0 deg", "240 deg", "120 deg"]),
        {"must rise": {"planet_angles": ["0 deg", "120 deg", "240 deg"]}},
    ),
    "planetary.assembled_angles.4": Refusal(
        set_of(planet_angles=["0 deg", "121 deg", "240 deg"]),
        {
            r"nearest planet_angles are ([\d.]+), ([\d.]+), ([\d.]+) deg": {
                "planet_angles": ["{0} deg", "{1} deg", "{2} deg"]
            }
        },
    ),
    "planetary.check_neighbours.1": Refusal(
        set_of(planets=6),
        {"use fewer planets": {"planets": 4}},
    ),
    "planetary._pin_circle.1": Refusal(
        lambda: planetary._pin_circle(planetary.Carrier(mass=-1.0), 0.07, 0.07),
        {
            "must be positive": lambda: planetary._pin_circle(
                planetary.Carrier(mass=1.0), 0.07, 0.07
            )
        },
    ),
    "planetary._pin_circle.2": Refusal(
        set_of(centre_distance={"sun_planet": "72 mm", "planet_ring": "72.1 mm"}),
        {
            "give pin_circle_diameter": {
                "carrier.pin_circle_diameter": "144.1 mm",
            }
        },
    ),
    "planetary._pin_circle.3": Refusal(
        set_of(carrier={"pin_circle_diameter": "72 mm"}),
        {
            r"give ([\d.]+) mm or nearly so": {"carrier.pin_circle_diameter": "{0} mm"},
            "or leave it out": {"carrier.pin_circle_diameter": None},
        },
    ),
    "root.root_of.1": Refusal(
        pinion(root_profile="trochoid", fillet_radius_coefficient=0.6),
        {
            r"fillet_radius_coefficient <= ([\d.]+)": {
                "pinion.fillet_radius_coefficient": "{0}"
            },
            'root_profile = "radial"': {"pinion.root_profile": "radial"},
        },
    ),
    "root.form_radius.1": Refusal(
        pinion(teeth=5, profile_shift_coefficient=-0.6),
        {
            "10 teeth or more with a profile_shift_coefficient of 0": {
                "pinion.teeth": 10,
                "pinion.profile_shift_coefficient": 0.0,
            },
        },
    ),
    "root.ring_root.1": Refusal(
        internal_pair(20, ring_of(dedendum_coefficient=2.3)),
        {
            "a smaller dedendum_coefficient": {"ring.dedendum_coefficient": 1.25},
            "or root_diameter": {
                "ring.dedendum_coefficient": None,
                "ring.root_diameter": "307.5 mm",
            },
        },
    ),
    "shifts.inverse_involute.1": Refusal(
        lambda: inverse_involute(-0.1),
        {"give 0 or more": lambda: inverse_involute(0.0)},
    ),
    "shifts._position_of_shifts.1": Refusal(
        pinion(profile_shift_coefficient=-2.0),
        {"bring it towards 0": {"pinion.profile_shift_coefficient": 0.0}},
    ),
    "shifts._working_angle.1": Refusal(
        external_pair(20, 40, centre_distance="80 mm"),
        {r"give about ([\d.]+) mm": {"centre_distance": "{0} mm"}},
    ),
    "shifts._shared.1": Refusal(
        external_pair(
            {"teeth": 20, "profile_shift_coefficient": 0.0},
            {"teeth": 40, "profile_shift_coefficient": 0.0},
            centre_distance="91 mm",
        ),
        {
            "leave out one": {"gear.profile_shift_coefficient": None},
            "of the three": {"centre_distance": None},
        },
    ),
    "shifts.planetary_position.1": Refusal(
        planetary_set(24, 24, {"teeth": 20, "rim_diameter": "250 mm"}),
        {"give the ring more teeth": {"ring.teeth": 72}},
    ),
    "shifts.planetary_position.2": Refusal(
        planetary_set(24, 24, {"teeth": 75, "rim_diameter": "250 mm"}),
        {
            "give a common centre_distance": {
                "centre_distance": "73.5 mm",
            },
            "{sun_planet, planet_ring}": {
                "centre_distance": {"sun_planet": "72 mm", "planet_ring": "76.5 mm"},
                "carrier.pin_circle_diameter": "148 mm",
            },
        },
    ),
    "specification.ReliefFrom.of.1": Refusal(
        pinion(tip_relief={"amount": "20 um", "start_diameter": "50 mm"}),
        {
            r"of ([\d.]+) mm; give a start_diameter .* of ([\d.]+) mm": {
                "pinion.tip_relief": {"amount": "20 um", "start_diameter": "63 mm"}
            }
        },
    ),
    "specification.ReliefFrom.of.2": Refusal(
        pinion(tip_relief={"amount": "20 um", "start_diameter": "70 mm"}),
        {
            r"a diameter of ([\d.]+) mm": {
                "pinion.tip_relief": {"amount": "20 um", "start_diameter": "63 mm"}
            },
            r"roll angle of ([\d.]+) deg": {
                "pinion.tip_relief": {"amount": "20 um", "start_roll_angle": "28 deg"}
            },
        },
    ),
    "specification.check_reliefs.1": Refusal(
        lambda: check_reliefs(Modification(Relief(-1e-6, 1e-3)), 1e-2, "gear"),
        {
            "give >= 0": lambda: check_reliefs(
                Modification(Relief(0.0, 1e-3)), 1e-2, "gear"
            )
        },
    ),
    "specification.check_reliefs.2": Refusal(
        pinion(tip_relief={"amount": "20 um", "length": "30 mm"}),
        {
            r"active path of ([\d.]+) mm": {
                "pinion.tip_relief": {"amount": "20 um", "length": "14 mm"}
            }
        },
    ),
    "gears.ReliefOptions._check.1": Refusal(
        pinion(tip_relief={"amount": "20 um"}),
        {
            "give length": {"pinion.tip_relief": {"amount": "20 um", "length": "2 mm"}},
            "start_diameter or": {
                "pinion.tip_relief": {"amount": "20 um", "start_diameter": "63 mm"}
            },
            "start_roll_angle": {
                "pinion.tip_relief": {"amount": "20 um", "start_roll_angle": "28 deg"}
            },
        },
    ),
    "gears.ThicknessAllowance._check.1": Refusal(
        pinion(tooth_thickness_allowance={"upper": "-50 um", "lower": "-30 um"}),
        {
            "lower must not be above upper": {
                "pinion.tooth_thickness_allowance": {
                    "upper": "-30 um",
                    "lower": "-50 um",
                }
            }
        },
    ),
    "gears.Toothed._check.1": Refusal(
        pinion(root_relief={"amount": "20 um", "start_diameter": "57 mm"}),
        {
            "give its length": {
                "pinion.root_relief": {"amount": "20 um", "length": "2 mm"}
            }
        },
    ),
    "gears.PlanetaryOptions._check.1": Refusal(
        set_of(planet_angles=["0 deg", "180 deg"]),
        {
            "give one angle each": {"planet_angles": ["0 deg", "120 deg", "240 deg"]},
            "or none": {"planet_angles": None},
        },
    ),
    "vdi._check_strength.1": Refusal(
        lambda: vdi.root_strength("PEEK", 20.0, 1e6),
        {
            r"of POM and": lambda: vdi.root_strength("POM", 20.0, 1e6),
            r"PA66 it is": lambda: vdi.root_strength("PA66", 20.0, 1e6),
        },
    ),
    "vdi._check_strength.2": Refusal(
        lambda: vdi.flank_strength(500.0, 1e6),
        {r"known from 0 to": lambda: vdi.flank_strength(60.0, 1e6)},
    ),
    "pitch.with_module.1": Refusal(
        external_pair(20, 40, diametral_pitch=8),
        {
            "give one of 'module'": {"diametral_pitch": None},
            "and 'diametral_pitch'": {"module": None},
        },
    ),
    "rules._widths.1": Refusal(
        external_pair(20, 40, face_width="20 m"),
        {"check its unit": {"face_width": "20 mm"}},
    ),
    "rules._hands.1": Refusal(
        pinion(hand="left"),
        {
            "give gears.helix_angle": {"helix_angle": "15 deg"},
            "or leave it out": {"pinion.hand": None},
        },
    ),
    "rules._hands.2": Refusal(
        external_pair(
            {"teeth": 20, "hand": "left"},
            {"teeth": 40, "hand": "left"},
            helix_angle="15 deg",
        ),
        {"opposite hands": {"gear.hand": "right"}},
    ),
    "rules._one_face.1": Refusal(
        planetary_set(
            {"teeth": 24, "face_width": "18 mm"},
            24,
            {"teeth": 72, "rim_diameter": "250 mm"},
        ),
        {"give the planets the narrowest": {"planet.face_width": "18 mm"}},
        {"mesh": {"misalignment": "0 um"}},
    ),
}


@pytest.mark.parametrize("site", sites(), ids=lambda site: site.name)
def test_every_refusal_raises_and_its_advice_leads_on(site):
    assert site.name in REFUSALS, "no entry in the walk: add an input and its advice"
    refusal = REFUSALS[site.name]
    with pytest.raises((GearError, SceneError, ValueError)) as raised:
        build(refusal.gears, refusal.scene)
    message = str(raised.value)
    assert site.text.search(message), message
    assert refusal.advice, "a refusal without a remedy"
    for words, change in refusal.advice.items():
        found = re.search(words, message)
        assert found, f"{words!r} is not in {message!r}"
        if callable(change):
            change()
        else:
            build(changed(refusal.gears, change, found.groups()), refusal.scene)


def test_walk_has_no_refusal_that_is_gone():
    assert set(REFUSALS) == {site.name for site in sites()}
