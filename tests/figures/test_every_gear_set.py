"""Every kind of figure of every kind of gear set, as they are computed: drawn, or one
line says why not.
"""

from types import SimpleNamespace

import pytest
from scenes import CAMPAIGNS

import wearlab as wl
from wearlab.figures import KINDS, FigureError
from wearlab.figures.kind import read
from wearlab.figures.plotting import plotted
from wearlab.figures.render import rendered

BASE = CAMPAIGNS / "base"
SPUR, INTERNAL, NGW, FRICTION = (
    str(BASE / f"{name}.toml")
    for name in (
        "spur_50_50",
        "internal_40_100",
        "planetary_ngw11",
        "planetary_friction",
    )
)
WEAR = {
    "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
    "until": {"cycles": 1e6},
}
STATIC = {**WEAR, "load": "static"}
DUTY = [
    {"torque": "150 N*m", "speed": "1500 rpm", "share": 0.4},
    {"torque": "90 N*m", "speed": "1200 rpm", "share": 0.6},
]
STAGES = [{**DUTY[0], "label": "heavy", "cycles": 5e5}, {**DUTY[1], "label": "light"}]
for stage in STAGES:
    del stage["share"]
ERRORS = {"total_composite": "20 um", "tooth_composite": "10 um"}
CAMPAIGNS = {
    "one analysis": {"extends": SPUR, "drop": ["dynamics", "wear", "lubricant"]},
    "four torques": {
        "extends": SPUR,
        "wear": {"until": {"cycles": 1e7}},
        "sweep": [{"operation.torque": ["100 N*m", "200 N*m", "300 N*m", "400 N*m"]}],
        "case": [{"label": "static", "drop": ["dynamics"], "wear.load": "static"}],
    },
    "two cases": {
        "extends": SPUR,
        "wear": {"until": {"cycles": 1e7}},
        "case": [
            {"label": "wide", "gears.face_width": "25 mm"},
            {"label": "narrow", "gears.face_width": "15 mm"},
        ],
    },
    "samples": {
        "extends": SPUR,
        "drop": ["dynamics"],
        "wear": {"load": "static", "until": {"depth": "1 um"}},
        "sweep": [
            {
                "sample": {"method": "sobol", "n": 16, "seed": 1},
                "wear.coefficient.value": {
                    "lognormal": {"median": "1e-18 m^2/N", "cov": 0.5}
                },
            }
        ],
    },
    "duty": {
        "extends": SPUR,
        "operation": {"duty": DUTY},
        "wear": {"until": {"cycles": 1e6}},
    },
    "stages": {
        "extends": SPUR,
        "operation": {"stage": STAGES},
        "wear": {"until": {"cycles": 1e6}},
    },
    "averaged errors": {
        "extends": SPUR,
        "errors": {"seed": 1, "pinion": ERRORS, "gear": ERRORS},
        "wear": {"until": {"cycles": 1e6}},
    },
    "response": {
        "extends": SPUR,
        "drop": ["dynamics", "wear"],
        "dynamics": {
            "model": "torsional",
            "response": {
                "speed": {"from": "4000 rpm", "to": "5000 rpm", "points": 8},
                "direction": "both",
                "transient": 4,
                "strobe": 4,
            },
        },
    },
    "internal, static": {"extends": INTERNAL, "wear": STATIC},
    "internal, torsional": {
        "extends": INTERNAL,
        "mesh": {"damping_ratio": 0.07},
        "dynamics": {"model": "torsional"},
        "wear": WEAR,
    },
    "planetary, static": {"extends": NGW, "wear": STATIC},
    "planetary, lateral": {
        "extends": str(BASE / "planetary_ngw11_vibration.toml"),
        "wear": {**WEAR, "until": {"cycles": 1e4}},
        "sweep": [{"operation.torque": ["100 N*m", "134 N*m"]}],
    },
    "planetary, friction": {
        "extends": FRICTION,
        "mesh": {"damping_ratio": 0.07},
        "dynamics": {"model": "planetary-torsional", "friction": {"coefficient": 0.1}},
        "operation": {"speed": "400 rpm"},
        "wear": {**WEAR, "until": {"cycles": 1e4}},
    },
}
ORDINARY = [
    name for name, kind in KINDS.items() if kind.of == "runs" and name != "line"
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("sets") / "store"


@pytest.mark.slow
@pytest.mark.parametrize("name", CAMPAIGNS)
def test_each_kind_is_drawn_or_says_why_not(name, folder):
    study = {"title": name, **CAMPAIGNS[name]}
    grid = wl.run(study, folder, workers=0, progress=False).to_xarray()
    drawn = 0
    for kind in ORDINARY:
        try:
            plot = plotted(grid, read(SimpleNamespace(kind=kind), 1, None))[0]
        except FigureError as error:
            assert str(error).startswith(f"figure 1 ({kind}): ") and "\n" not in str(
                error
            )
            continue
        assert rendered(plot, {})[:4] == b"\x89PNG"
        assert all(len(curve.x) for panel in plot.panels for curve in panel.curves), (
            kind
        )
        drawn += 1
    assert drawn >= 4
