"""Whether wear goes on under the load with which a record of what ran ends."""

from typing import NamedTuple

import numpy as np

from wearlab.scene import Scene
from wearlab.units import MINUTE
from wearlab.updating.measurements import OperatingRecord

OTHER_LOAD = 0.02  # of torque or speed, from which a load is another one


class OperatingLoad(NamedTuple):
    """Torque and speed of the input member.

    Parameters
    ----------
    torque : [N m]
    speed : [rad/s]
    """

    torque: float
    speed: float

    @property
    def rpm(self) -> float:
        """The speed in revolutions per minute."""
        return self.speed * MINUTE / (2.0 * np.pi)


class LoadChange(NamedTuple):
    """Another load from the end of a record on.

    Parameters
    ----------
    last, ahead : the last one that ran, and the one with which wear goes on
    """

    last: OperatingLoad
    ahead: OperatingLoad


def load_change(record: OperatingRecord | None, scene: Scene) -> LoadChange | None:
    """Return how the load changes at the end of a record.

    None where wear goes on as it ended, or where bins do not say how it did.

    Parameters
    ----------
    record : what ran, where that is known
    scene : with the operation that goes on
    """
    if record is None or record.mixed:
        return None
    operation = scene.operation
    if operation is None or operation.duty:
        return None
    works = np.flatnonzero((record.torque > 0.0) & (record.speed > 0.0))
    if not len(works):
        return None
    row = works[-1]
    last = OperatingLoad(float(record.torque[row]), float(record.speed[row]))
    ahead = OperatingLoad(operation.torque, operation.speed)
    is_alike = np.allclose(last, ahead, rtol=OTHER_LOAD)
    return None if is_alike else LoadChange(last, ahead)
