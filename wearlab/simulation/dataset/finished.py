"""A life that has ended, and what its conditions of operation say for themselves."""

from typing import NamedTuple

from wearlab.life import history
from wearlab.scene import Scene
from wearlab.simulation import estimates, initial_wear, label, operating
from wearlab.simulation.attractors import Searched
from wearlab.simulation.calibration import Calibration


class FinishedLife(NamedTuple):
    """A life that has ended.

    Parameters
    ----------
    scene : the scene, its wear coefficient calibrated
    stages : the stages of operation that the life has reached
    history : the life through them
    calibration : how the wear coefficient was found, None where it was not calibrated
    """

    scene: Scene
    stages: tuple[operating.OperatingCondition, ...]
    history: history.History
    calibration: Calibration | None

    @property
    def inherited(self) -> float:
        """Error of the wear that the run starts from [m]."""
        return initial_wear.inherited_error(self.scene, self.stages[0].first)


class ConditionsOfLife(NamedTuple):
    """What the conditions of operation of a life say for themselves.

    Parameters
    ----------
    variables : labelled variables of each condition, stage after stage
    errors : estimated errors of each stage
    searches : what the searches for other attractors came to, state after state
    """

    variables: list[label.Labelled]
    errors: list[estimates.Estimates]
    searches: list[Searched]
