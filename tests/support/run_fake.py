"""Run a fake campaign as its own process: ``run_fake.py STORE COUNT LOG GATE``; no main guard, on purpose."""

import sys

import fake_campaign

import wearlab
from wearlab.runner import Interrupted

store, count, log, gate = sys.argv[1:]
campaign = fake_campaign.sweep(int(count), log=log, gate=gate)
try:
    report = wearlab.run(campaign, wearlab.Store(store), workers=2, simulate=fake_campaign.SIMULATE)
except Interrupted as interrupted:
    print(interrupted, flush=True)
    sys.exit(130)
print(f"computed {report.computed} of {report.total}", flush=True)
