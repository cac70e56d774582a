"""Every refusal of ``[update]`` as it is read: an input, and its advice, taken."""

import copy
import re
from typing import Any, NamedTuple

import pytest
from geometry_refusals import PACKAGE, changed, sites_of

from wearlab.campaign.blocks import CampaignError
from wearlab.campaign.update import read_update

FACTOR = "wear.coefficient.factor"
LOGNORMAL = {"lognormal": {"median": 1.0, "cov": 1.0}}
UNKNOWN = {FACTOR: LOGNORMAL}
WEIGHINGS = {
    "file": "w.csv",
    "quantity": "worn_mass",
    "member": "pinion",
    "columns": {"hours": "h", "value": "loss"},
    "error": {"sd": "5 mg"},
}
BOXES = {**WEIGHINGS, "columns": {**WEIGHINGS["columns"], "unit": "box"}}
CURVE = {
    "file": "pinion.mka",
    "quantity": "wear_depth",
    "flank": "pinion",
    "side": "right",
    "at": "5000 h",
    "error": {"sd": "1 um"},
}
RECORD = {"file": "r.csv", "columns": {"hours": "h"}}
OIL = {"volume": "60 l"}
OF_OIL = {
    **WEIGHINGS,
    "columns": {**WEIGHINGS["columns"], "oil_hours": "oil"},
    "error": {"sd": "1 ppm", "gain_sd": 0.5},
    "oil": OIL,
}
SCENARIOS = [
    {"label": name, "from": "9000 h", "torque_factor": 0.8} for name in ("less", "more")
]
FILES = (
    PACKAGE / "campaign" / "update.py",
    PACKAGE / "campaign" / "update_options.py",
)
NO_REFUSALS = (
    "update.read_update.1",
    "update.refuse_unknown_keys.1",
    "update._settings.1",
    "update._settings.2",
    "update._not_of_a_fleet.4",
)
"""Raises and yields of what others found."""


class UpdateRefusal(NamedTuple):
    """A section that is refused, and changes by which its advice is taken."""

    section: dict[str, Any]
    advice: dict[str, dict[str, Any]]


def section(**options: Any) -> dict[str, Any]:
    """Return the section of one unit with its weighings."""
    return copy.deepcopy({"unknown": UNKNOWN, "data": [WEIGHINGS], **options})


def block(base: dict[str, Any], **options: Any) -> dict[str, Any]:
    """Return a section whose data are one block, None dropping an option."""
    return section(data=data(base, **options))


def data(base: dict[str, Any], **options: Any) -> list[dict[str, Any]]:
    """Return the data of one block, None dropping an option."""
    merged = {**base, **options}
    return [{key: value for key, value in merged.items() if value is not None}]


def fleet(**options: Any) -> dict[str, Any]:
    """Return the section of a fleet."""
    return section(**{"data": [BOXES], **options})


REFUSALS: dict[str, UpdateRefusal] = {
    "update._read_unknown.1": UpdateRefusal(
        section(unknown={FACTOR: 1.0}),
        {"is no distribution": {"unknown": UNKNOWN}},
    ),
    "update._read_unknown.2": UpdateRefusal(
        section(unknown={}),
        {'such as "wear.coefficient.factor" =': {"unknown": UNKNOWN}},
    ),
    "update._not_together.1": UpdateRefusal(
        section(discrepancy="accumulating"),
        {
            "needs error.drift in the data": {
                "data": data(WEIGHINGS, error={"sd": "5 mg", "drift": "2 mg"})
            }
        },
    ),
    "update._not_together.2": UpdateRefusal(
        section(
            change="once", unknown={"gears.pinion.roughness_ra": {"uniform": [0.1, 1]}}
        ),
        {f"goes with the unknown {FACTOR} alone": {"unknown": UNKNOWN}},
    ),
    "update._not_together.3": UpdateRefusal(
        section(scenario=[SCENARIOS[0], SCENARIOS[0]]),
        {"give each its own": {"scenario": SCENARIOS}},
    ),
    "update._not_together.4": UpdateRefusal(
        section(
            scenario=SCENARIOS,
            unknown={"gears.pinion.roughness_ra": {"uniform": [0.1, 1]}},
        ),
        {f"goes with the unknown {FACTOR} alone": {"unknown": UNKNOWN}},
    ),
    "update._not_together.5": UpdateRefusal(
        section(record=RECORD, data=data(CURVE, at=2e6)),
        {
            r"data\[0\].at: with update.record, say when by hours": {
                "data": data(CURVE)
            },
            "or date": {"data": data(CURVE, at="2026-02-28")},
        },
    ),
    "update._not_with_replaced.1": UpdateRefusal(
        fleet(replaced=[{"members": ["pinion"], "hours": 900}]),
        {
            "the unit in which they were replaced": {
                "replaced": [{"members": ["pinion"], "hours": 900, "unit": "A"}]
            }
        },
    ),
    "update._not_with_replaced.2": UpdateRefusal(
        section(replaced=[{"members": ["pinion"], "hours": 900, "unit": "A"}]),
        {
            "leave it out": {"replaced": [{"members": ["pinion"], "hours": 900}]},
            r"columns = \{ unit = \"…\" \}": {"data": [BOXES]},
        },
    ),
    "update._not_with_replaced.3": UpdateRefusal(
        section(replaced=[{"members": ["pinion"], "hours": 900}], check={"power": 0.9}),
        {"leave one of them out": {"check": None}, "": {"replaced": None}},
    ),
    "update._not_with_replaced.4": UpdateRefusal(
        section(
            replaced=[{"members": ["pinion"], "hours": 900}],
            unknown={"gears.pinion.roughness_ra": {"uniform": [0.1, 1]}},
        ),
        {f"goes with the unknown {FACTOR} alone": {"unknown": UNKNOWN}},
    ),
    "update._not_of_a_fleet.1": UpdateRefusal(
        fleet(unknown={**UNKNOWN, "operation.torque": {"uniform": [50, 90]}}),
        {
            "goes into update.unit.scene": {
                "unknown": UNKNOWN,
                "unit": [{"name": "A", "scene": {"operation.torque": "60 N*m"}}],
            }
        },
    ),
    "update._not_of_a_fleet.2": UpdateRefusal(
        fleet(change="running-in"),
        {"update.population.power below 1": {"change": None, "population.power": 0.8}},
    ),
    "update._not_of_a_fleet.3": UpdateRefusal(
        fleet(discrepancy="accumulating"),
        {
            "wear strays by update.population": {
                "discrepancy": None,
                "population.straying": 0.3,
            }
        },
    ),
    "update._data_not_of_a_fleet.1": UpdateRefusal(
        section(data=[CURVE], unit=[{"name": "A"}]),
        {"whose flank was measured": {"data": data(CURVE, unit="A")}},
    ),
    "update._data_not_of_a_fleet.2": UpdateRefusal(
        section(unit=[{"name": "A"}]),
        {"which unit a row is of": {"data": [BOXES]}},
    ),
    "update._data_not_of_a_fleet.3": UpdateRefusal(
        fleet(data=data(BOXES, error={"sd": "5 mg", "drift": "2 mg"})),
        {
            "use update.population.straying": {
                "data": [BOXES],
                "population.straying": 0.3,
            }
        },
    ),
    "update_options.Columns._one_of_each.1": UpdateRefusal(
        block(WEIGHINGS, columns={"cycle": "N", "hours": "h"}),
        {"name one": {"data": [WEIGHINGS]}},
    ),
    "update_options.ErrorBlock.read.1": UpdateRefusal(
        block(WEIGHINGS, error=None),
        {
            "required: sd": {"data": [WEIGHINGS]},
            "a distribution": {
                "data": data(
                    WEIGHINGS,
                    error={"sd": {"lognormal": {"median": "5 mg", "cov": 1.0}}},
                )
            },
            "relative": {"data": data(WEIGHINGS, error={"relative": 0.1})},
            "or columns.sd": {
                "data": data(
                    WEIGHINGS,
                    error=None,
                    columns={**WEIGHINGS["columns"], "sd": "s"},
                )
            },
        },
    ),
    "update_options.ErrorBlock.read.2": UpdateRefusal(
        block(WEIGHINGS, error={"sd": "5 mg", "gain_sd": 0.2, "offset_sd": "2 mg"}),
        {
            "leave out offset_sd": {
                "data": data(WEIGHINGS, error={"sd": "5 mg", "gain_sd": 0.2})
            },
            "or the gain": {
                "data": data(WEIGHINGS, error={"sd": "5 mg", "offset_sd": "2 mg"})
            },
        },
    ),
    "update_options._positive.1": UpdateRefusal(
        block(WEIGHINGS, error={"sd": {"a": 1}}),
        {"neither a value": {"data": [WEIGHINGS]}},
    ),
    "update_options._positive.2": UpdateRefusal(
        block(WEIGHINGS, error={"sd": {"normal": {"mean": "5 mg", "sd": "9 mg"}}}),
        {
            "truncate it": {
                "data": data(
                    WEIGHINGS,
                    error={
                        "sd": {
                            "normal": {"mean": "5 mg", "sd": "9 mg"},
                            "truncate": ["1 mg", "30 mg"],
                        }
                    },
                )
            },
            "or take a log-normal": {
                "data": data(
                    WEIGHINGS,
                    error={"sd": {"lognormal": {"median": "5 mg", "cov": 1.0}}},
                )
            },
        },
    ),
    "update_options._positive.3": UpdateRefusal(
        block(WEIGHINGS, error={"sd": LOGNORMAL}),
        {
            "need the quantity's unit": {
                "data": data(
                    WEIGHINGS,
                    error={"sd": {"lognormal": {"median": "5 mg", "cov": 1.0}}},
                )
            }
        },
    ),
    "update_options._number.1": UpdateRefusal(
        block(WEIGHINGS, error={"sd": 5.0}),
        {"write a number with its unit": {"data": [WEIGHINGS]}},
    ),
    "update_options._number.2": UpdateRefusal(
        block(WEIGHINGS, error={"sd": "-5 mg"}),
        {"must be greater than 0": {"data": [WEIGHINGS]}},
    ),
    "update_options.DataBlock._varies.1": UpdateRefusal(
        block(WEIGHINGS, quantity="wornmass"),
        {"did you mean '(worn_mass)'": {"data": data(WEIGHINGS)}},
    ),
    "update_options.DataBlock._begins.1": UpdateRefusal(
        block(WEIGHINGS, since="last"),
        {
            "'previous'": {"data": data(WEIGHINGS, since="previous")},
            "or a cycle": {"data": data(WEIGHINGS, since=1e6)},
        },
    ),
    "update_options.DataBlock._one_flank.1": UpdateRefusal(
        block(WEIGHINGS, unit="A"),
        {"columns.unit names the column": {"data": [BOXES]}},
    ),
    "update_options.DataBlock._one_flank.2": UpdateRefusal(
        block(WEIGHINGS, file="pinion.mka", member=None),
        {
            "say when, such as at = '(5000 h)'; give quantity = '(wear_depth)'; give "
            "flank = 'pinion' or another; leave out columns": {
                "data": data(CURVE, side=None)
            }
        },
    ),
    "update_options.DataBlock._one_gear.1": UpdateRefusal(
        block(WEIGHINGS, flank="pinion"),
        {"not both": {"data": [WEIGHINGS]}},
    ),
    "update_options.DataBlock.read.1": UpdateRefusal(
        block(OF_OIL, oil=None, error={"relative": 0.1}),
        {
            'oil = { volume = "(60 l)" }': {
                "data": data(OF_OIL, error={"relative": 0.1})
            }
        },
    ),
    "update_options.DataBlock.read.2": UpdateRefusal(
        block(
            WEIGHINGS,
            quantity="wear_depth",
            member=None,
            flank="gear",
            error={"sd": "1 um"},
        ),
        {
            "needs one of the columns (diameter)": {
                "data": data(
                    WEIGHINGS,
                    quantity="wear_depth",
                    member=None,
                    flank="gear",
                    columns={**WEIGHINGS["columns"], "diameter": "d"},
                    error={"sd": "1 um"},
                )
            }
        },
    ),
    "update_options.DataBlock._of_mass.1": UpdateRefusal(
        block(
            OF_OIL,
            quantity="max_wear_depth",
            member=None,
            flank="gear",
        ),
        {"iron in the oil is worn_mass": {"data": [OF_OIL]}},
    ),
    "update_options.DataBlock._of_mass.2": UpdateRefusal(
        block(
            OF_OIL,
            error={
                "sd": {"lognormal": {"median": 1e-6, "cov": 1.0}},
                "gain_sd": 0.5,
            },
        ),
        {
            "give relative": {"data": data(OF_OIL, error={"relative": 0.1})},
            "a sd in ppm, and gain_sd": {"data": [OF_OIL]},
        },
    ),
    "update_options.DataBlock._of_mass.3": UpdateRefusal(
        block(OF_OIL, since="previous"),
        {
            "leave one of them out": {"data": [OF_OIL]},
            "": {"data": data(OF_OIL, since="previous", columns=WEIGHINGS["columns"])},
        },
    ),
    "update_options.LimitBlock._one_limit.1": UpdateRefusal(
        section(limit={"depth": "20 um", "worn_mass": "1 g"}),
        {
            "give either depth": {"limit": {"depth": "20 um"}},
            "or worn_mass": {"limit": {"worn_mass": "1 g", "member": "pinion"}},
        },
    ),
    "update_options.LimitBlock._one_limit.2": UpdateRefusal(
        section(limit={"depth": "20 um", "member": "pinion"}),
        {
            "belongs to worn_mass": {"limit": {"worn_mass": "1 g", "member": "pinion"}},
            "a depth has a flank": {"limit": {"depth": "20 um", "flank": "pinion"}},
        },
    ),
    "update_options.LimitBlock._one_limit.3": UpdateRefusal(
        section(limit={"worn_mass": "1 g", "flank": "pinion"}),
        {
            "belongs to a depth": {"limit": {"depth": "20 um", "flank": "pinion"}},
            "a worn mass has a member": {
                "limit": {"worn_mass": "1 g", "member": "pinion"}
            },
        },
    ),
    "update_options.PopulationBlock.read.1": UpdateRefusal(
        fleet(unit=[{"name": "A"}, {"name": "A"}]),
        {"give each unit its own": {"unit": [{"name": "A"}, {"name": "B"}]}},
    ),
    "update_options._shared.1": UpdateRefusal(
        fleet(population={"power": 20.0}),
        {r"is not from (\S+) to 10": {"population.power": 10.0 - 1e-9}},
    ),
    "update_options.RecordColumns._one_time.1": UpdateRefusal(
        section(record={"file": "r.csv", "columns": {"hours": "h", "date": "d"}}),
        {"name one of hours, date": {"record": RECORD}},
    ),
    "update_options.Replaced._one_time.1": UpdateRefusal(
        section(replaced=[{"members": ["pinion"]}]),
        {
            "cycle": {"replaced": [{"members": ["pinion"], "cycle": 1e6}]},
            "hours": {"replaced": [{"members": ["pinion"], "hours": 900}]},
            "date": {"replaced": [{"members": ["pinion"], "date": "2026-01-01"}]},
        },
    ),
    "update_options.Decision._dearer.1": UpdateRefusal(
        section(decision={"planned": 9, "failure": 8}),
        {"is not more than the planned change": {"decision.failure": 10}},
    ),
}


def update_sites():
    """Return all refusals in the source of the section."""
    found = [site for file in FILES for site in sites_of(file, lambda _: True)]
    return [site for site in found if site.name not in NO_REFUSALS]


@pytest.mark.parametrize("site", update_sites(), ids=lambda site: site.name)
def test_every_refusal_of_an_update_raises_and_its_advice_leads_on(site):
    assert site.name in REFUSALS, "no entry in the walk: add an input and its advice"
    refusal = REFUSALS[site.name]
    with pytest.raises(CampaignError) as raised:
        read_update(refusal.section)
    message = str(raised.value)
    assert site.text.search(message), message
    for words, change in refusal.advice.items():
        found = re.search(words, message)
        assert found, f"{words!r} is not in {message!r}"
        advised = changed(refusal.section, change, found.groups())
        assert advised != refusal.section, "it recommends what is there"
        assert read_update(advised).data


def test_walk_over_updates_has_no_refusal_that_is_gone():
    assert set(REFUSALS) == {site.name for site in update_sites()}
