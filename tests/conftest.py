"""Helpers of tests that worker processes must be able to import live in ``tests/support``."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "support"))
