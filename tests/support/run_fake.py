"""Run a fake campaign as its own process; no main guard, on purpose.

``run_fake.py STORE COUNT LOG GATE [WORD=VALUE …]``, with a dash for no log and no gate.

- ``alone=1``: all cases in this process, without a cluster
- ``act=slow``: what the cases do
- ``die=PHASE:AT``: this process kills itself when it reaches PHASE for the AT-th time,
  and says so in FILE
- ``phases=FILE``: that file
- ``scheduler=A``: work is given to the workers of a scheduler elsewhere
"""

import sys

import fake_campaign

import wearlab
from wearlab.runner import Interrupted, RunnerError
from wearlab.store import StoreError

store, count, log, gate, *words = sys.argv[1:]
log = log.strip("-")
gate = gate.strip("-")
options = dict(word.split("=", 1) for word in words)
campaign = fake_campaign.sweep(
    int(count), log=log, gate=gate, act=options.get("act", "finish")
)
if "die" in options:
    import phases

    phase, _, at = options["die"].partition(":")
    phases.install(phases.Dying(options["phases"], phase, int(at)))
try:
    report = wearlab.run(
        campaign,
        wearlab.Store(store),
        workers=0 if "alone" in options else 2,
        simulate=fake_campaign.SIMULATE,
        scheduler=options.get("scheduler"),
    )
except Interrupted as interrupted:
    print(interrupted, flush=True)
    sys.exit(130)
except (StoreError, RunnerError) as error:
    print(error, flush=True)
    sys.exit(2)
for note in report.notes:
    print(note)
print(f"computed {report.computed} of {report.total}", flush=True)
