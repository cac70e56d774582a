"""Run a fake campaign as its own process; no main guard, on purpose.

``run_fake.py STORE COUNT LOG GATE [PHASE AT PHASES]``: with the last three, this process kills itself when it
reaches PHASE for the AT-th time, and says so in the file PHASES.
"""

import sys

import fake_campaign

import wearlab
from wearlab.runner import Interrupted
from wearlab.store import StoreError

store, count, log, gate, *kill = sys.argv[1:]
log, gate = (name.strip("-") for name in (log, gate))
campaign = fake_campaign.sweep(int(count), log=log, gate=gate)
if kill:
    import phases

    phase, at, phase_log = kill
    phases.install(phases.Dying(phase_log, phase, int(at)))
try:
    report = wearlab.run(campaign, wearlab.Store(store), workers=2, simulate=fake_campaign.SIMULATE)
except Interrupted as interrupted:
    print(interrupted, flush=True)
    sys.exit(130)
except StoreError as error:
    print(error, flush=True)
    sys.exit(2)
for note in report.notes:
    print(note)
print(f"computed {report.computed} of {report.total}", flush=True)
