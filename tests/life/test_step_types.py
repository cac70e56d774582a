"""A step over cycles is one file that type checks, and one that does
not fit is refused.
"""

import subprocess
import sys
from pathlib import Path

TOP = Path(__file__).parents[2]
EXAMPLE = TOP / "campaigns/plugins/heun_steps.py"
NO_STEPPER = """
from wearlab.life.limits import CountedRate
from wearlab.life.step import Node
from wearlab.life.steps import StepMethod


class Counter:
    def start(
        self, node: Node, rate: CountedRate, tolerance: float, scale: float
    ) -> int:
        return 0


class Options(StepMethod):
    def build(self) -> Counter:
        return Counter()
"""


def test_the_example_is_typed_and_a_method_without_stepper_is_not(tmp_path):
    wrong = tmp_path / "no_stepper.py"
    wrong.write_text(NO_STEPPER)
    checked = subprocess.run(
        [sys.executable, "-m", "mypy", "--disallow-untyped-defs", EXAMPLE, wrong],
        cwd=TOP,
        capture_output=True,
        text=True,
    )
    errors = [line for line in checked.stdout.splitlines() if ": error:" in line]
    assert len(errors) == 1, checked.stdout + checked.stderr
    assert "no_stepper.py" in errors[0]
    assert 'incompatible with return type "Method"' in errors[0]
