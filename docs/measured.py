"""Record how far checks are from what they expect: ``python docs/measured.py gears wear …``.

Runs the tests of these rooms and keeps, for each test, the comparison that came nearest
to its tolerance: ``docs/evidence/measured.json`` has tolerance and error, relative where the
tolerance is.
"""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

ApproxScalar = type(pytest.approx(1.0))
TOP = Path(__file__).parents[1]
FILE = TOP / "docs" / "evidence" / "measured.json"


class Recorder:
    """A plug-in of pytest that watches `pytest.approx` and `numpy.testing.assert_allclose`."""

    def __init__(self) -> None:
        self.found: dict[str, dict[str, float]] = {}
        self.test = ""
        self.nearest: dict[str, float] = {}

    def pytest_runtest_call(self, item: pytest.Item) -> None:
        """Begin a test."""
        self.test = item.nodeid.partition("[")[0]
        self.nearest = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Keep what a test that passed came nearest to."""
        if report.when != "call" or not report.passed or not self.nearest:
            return
        known = self.found.get(self.test)
        if known is None or self.nearest["share"] > known["share"]:
            self.found[self.test] = dict(self.nearest)

    def compare(self, actual: float, expected: float, tolerance: float) -> None:
        """Note one comparison."""
        error = abs(actual - expected)
        if not (np.isfinite(error) and tolerance > 0.0) or error > tolerance:
            return
        share = error / tolerance
        scale = abs(expected) or 1.0
        if share > self.nearest.get("share", -1.0):
            self.nearest = {
                "share": share,
                "tolerance": tolerance / scale,
                "error": error / scale,
            }


def main(rooms: list[str]) -> int:
    """Run the tests of rooms and add what they measure to the file."""
    recorder = Recorder()
    approx = ApproxScalar.__eq__
    allclose = np.testing.assert_allclose

    def watched(self, actual):
        equal = approx(self, actual)
        if isinstance(actual, int | float | np.number) and isinstance(
            self.expected, int | float | np.number
        ):
            recorder.compare(float(actual), float(self.expected), float(self.tolerance))
        return equal

    def watched_arrays(actual, desired, rtol=1e-7, atol=0.0, **more):
        allclose(actual, desired, rtol=rtol, atol=atol, **more)
        pairs = np.broadcast_arrays(np.asarray(actual), np.asarray(desired))
        if all(one.dtype.kind in "fiu" and one.size for one in pairs):
            a, b = (one.astype(float).ravel() for one in pairs)
            allowed = atol + rtol * np.abs(b)
            with np.errstate(all="ignore"):
                shares = np.where(allowed > 0.0, np.abs(a - b) / allowed, -1.0)
            if np.isfinite(shares).any():
                at = int(np.nanargmax(np.where(np.isfinite(shares), shares, -1.0)))
                recorder.compare(a[at], b[at], allowed[at])

    ApproxScalar.__eq__, np.testing.assert_allclose = watched, watched_arrays
    folders = [str(TOP / "tests" / room) for room in rooms]
    status = pytest.main(
        ["-q", "-p", "no:cacheprovider", "--rootdir", str(TOP), *folders],
        plugins=[recorder],
    )
    kept = json.loads(FILE.read_text()) if FILE.exists() else {}
    for test, numbers in recorder.found.items():
        kept[test] = {
            name: float(f"{numbers[name]:.2g}") for name in ("tolerance", "error")
        }
    FILE.write_text(json.dumps(dict(sorted(kept.items())), indent=1) + "\n")
    return int(status)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
