import sys
from pathlib import Path

import pytest
from scenes import SPUR_50_50

import wearlab as wl
from wearlab.updating import update

sys.path.insert(0, str(Path(__file__).parent))
STATIC = f"""
title   = "weighings"
extends = "{SPUR_50_50.as_posix()}"
drop    = ["dynamics"]
[mesh]
stiffness        = "potential-energy"
extended_contact = false
[wear]
load          = "static"
contact_patch = "none"
until         = {{ depth = "20 um", flank = "pinion" }}
snapshots     = {{ depth = ["2 um", "5 um", "10 um", "15 um"], flank = "pinion" }}
[update]
discrepancy = "none"
draws = 500
[update.unknown]
"wear.coefficient.factor" = {{ lognormal = {{ median = 1.0, cov = 3.0 }} }}
[[update.data]]
file     = "weighings.csv"
quantity = "worn_mass"
member   = "pinion"
columns  = {{ cycle = "cycles", value = "loss" }}
units    = {{ loss = "mg" }}
error    = {{ sd = "5 mg" }}
"""
WEIGHINGS = "cycles,loss\n5e7,140\n1e8,265\n1.5e8,390\n"


@pytest.fixture(scope="session")
def campaign(tmp_path_factory):
    folder = tmp_path_factory.mktemp("weighed")
    (folder / "weighings.csv").write_text(WEIGHINGS)
    (folder / "weighed.toml").write_text(STATIC)
    return wl.load(folder / "weighed.toml")


@pytest.fixture(scope="session")
def store(campaign, tmp_path_factory):
    return wl.Store(tmp_path_factory.mktemp("store"))


@pytest.fixture(scope="session")
def tree(campaign, store):
    return update(campaign, store, progress=False)
