"""A gear that was replaced while its mate went on worn: against real
runs, one after the other.
"""

import numpy as np
import pytest
from conftest import STATIC

import wearlab as wl
from wearlab.campaign import CampaignError
from wearlab.updating import UpdateError, update
from wearlab.updating.report_text import text_of

AT, TRUE = 1e8, 1.3
REPLACED = STATIC.replace("5 mg", "0.5 mg").replace(
    "[[update.data]]",
    '[[update.replaced]]\nmembers = ["pinion"]\ncycle = 1e8\n[[update.data]]',
)
OF_BOTH = (
    REPLACED
    + """
[[update.data]]
file     = "gear.csv"
quantity = "worn_mass"
member   = "gear"
columns  = { cycle = "cycles", value = "loss" }
units    = { loss = "mg" }
error    = { sd = "0.5 mg" }
"""
)


def campaign(folder, text=REPLACED, pinion="50000000,1\n", gear=""):
    (folder / "weighings.csv").write_text("cycles,loss\n" + pinion)
    (folder / "gear.csv").write_text("cycles,loss\n" + (gear or "50000000,1\n"))
    (folder / "replaced.toml").write_text(text)
    return wl.load(folder / "replaced.toml")


@pytest.fixture(scope="module")
def truth(tmp_path_factory):
    """The old pinion until 1e8 cycles, then a new one against the
    gear as it was then.
    """
    scene = (
        campaign(tmp_path_factory.mktemp("truth"))
        .cases[0]
        .scene.replace("wear.coefficient.factor", TRUE)
    )
    old = wl.simulate(
        scene.replace(
            {"wear.until": {"cycles": AT}, "wear.snapshots": {"cycles": [0.5 * AT]}}
        )
    )
    worn = old.wear_depth.isel(update=-1).sel(flank="gear").values
    place = old.path_position.sel(flank="gear").values
    order = np.argsort(place)
    rows = "".join(
        f"{x!r},{y!r}\n"
        for x, y in zip(place[order].tolist(), worn[order].tolist(), strict=True)
    )
    file = tmp_path_factory.mktemp("profile") / "gear.csv"
    file.write_text("path_position [m],depth [m]\n" + rows)
    initial = {
        "file": str(file),
        "x": "path_position",
        "y": "depth",
        "continuation": "hold",
    }
    new = wl.simulate(scene.replace("wear.initial.gear", initial))
    return old, new


def weighed(run, member, cycle):
    mass = run.worn_mass.sel(member=member).values
    return 1e6 * np.interp(cycle, run.cycle.values, mass)


@pytest.fixture(scope="module")
def tree(truth, tmp_path_factory):
    old, new = truth
    at = new.cycle.values[[1, 2]]  # states that the run has: nothing is interpolated
    pinion = [
        (0.5 * AT, weighed(old, "pinion", 0.5 * AT)),
        (AT, weighed(old, "pinion", AT)),
    ]
    pinion += [(AT + n, weighed(new, "pinion", n)) for n in at]
    gear = [
        (0.5 * AT, weighed(old, "gear", 0.5 * AT)),
        *((AT + n, weighed(new, "gear", n)) for n in at),
    ]
    rows = [
        "".join(f"{float(n)!r},{float(m)!r}\n" for n, m in each)
        for each in (pinion, gear)
    ]
    folder = tmp_path_factory.mktemp("replaced")
    return update(
        campaign(folder, OF_BOTH, *rows), wl.Store(folder / "store"), progress=False
    )


def test_the_new_gear_counts_from_its_day_and_the_mate_goes_on(tree, truth):
    predictions = tree["predictions"].to_dataset()
    assert float(predictions["factor_quantile"][2]) == pytest.approx(TRUE, rel=2e-3)
    life = AT + float(truth[1].life)
    assert float(predictions["life_quantile"][2]) == pytest.approx(life, rel=3e-3)
    stats = tree["sample_stats"].to_dataset()
    assert str(stats["notes"].values) == "" and float(stats["contradiction"]) < 3.0


def test_it_is_told(tree):
    assert (
        "  replaced: pinion new at 1e+08 cycles; their wear counts from then on"
        in text_of(tree)
    )
    assert {"worn_mass_pinion_1", "worn_mass_pinion_2"} <= set(
        tree["observed_data"].data_vars
    )


def test_without_it_the_answer_is_wrong(truth, tmp_path):
    old, new = truth
    rows = (
        f"{AT!r},{weighed(old, 'pinion', AT)}\n"
        f"{2 * AT!r},{weighed(new, 'pinion', AT)}\n"
    )
    plain = STATIC.replace("5 mg", "0.5 mg")
    tree = update(
        campaign(tmp_path, plain, rows), wl.Store(tmp_path / "store"), progress=False
    )
    assert abs(float(tree["predictions"]["factor_quantile"][2]) / TRUE - 1.0) > 0.2


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "cycle = 1e8",
            "cycle = 1e8\nhours = 5",
            "update.replaced[0]: give one of cycle, hours, date",
        ),
        ("cycle = 1e8", "cycles = 1e8", "did you mean 'cycle'?"),
        ('["pinion"]', "[]", "update.replaced[0].members"),
        (
            "[update]",
            "[update]\ncheck = { power = 0.8 }",
            "update.replaced: does not go with update.check yet: leave one of them out",
        ),
        (
            "cycle = 1e8",
            'cycle = 1e8\nunit = "G01"',
            "update.replaced[0].unit: 'G01': here is one gear set",
        ),
    ],
)
def test_what_cannot_be_is_one_line(tmp_path, old, new, said):
    with pytest.raises(CampaignError) as caught:
        campaign(tmp_path, REPLACED.replace(old, new, 1))
    assert any(said in line for line in caught.value.problems), caught.value.problems


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            '["pinion"]',
            '["sun"]',
            r"update.replaced\[0\].members: 'sun' is not one of pinion, gear",
        ),
        (
            "cycle = 1e8",
            "date = 2026-01-01",
            r"update.replaced\[0\].date: needs update.calendar",
        ),
    ],
)
def test_a_wrong_gear_or_day_is_one_line(tmp_path, old, new, said):
    made = campaign(tmp_path, REPLACED.replace(old, new, 1))
    with pytest.raises(UpdateError, match=said):
        update(made, wl.Store(tmp_path / "store"), progress=False)
