"""Missing cases become stored runs: one in this process, several on dask workers."""

from wearlab.runner.local import foresee
from wearlab.runner.report import CaseReport, Interrupted, Report, RunnerError
from wearlab.runner.running import run
