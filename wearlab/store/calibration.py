"""The run by which a run's wear coefficient was calibrated, as both tell it."""

from collections.abc import Mapping
from typing import Any, Protocol

CALIBRATION, CALIBRATION_LIFE = "calibration", "calibration_life"
"""Attributes of a run: the id of the run by which its wear coefficient was calibrated, and its life."""


class Summarised(Protocol):
    """What has scalar results by name."""

    @property
    def summary(self) -> Mapping[str, Any]:
        """Results by name."""
        ...


def calibration_of(entry: Summarised) -> str:
    """Return the id of the run that a run's wear coefficient was calibrated by, "" where none did."""
    return str(entry.summary.get(CALIBRATION) or "")
