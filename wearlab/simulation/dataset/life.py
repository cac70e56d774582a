"""How long a life lasts, and why it ends."""

import numpy as np

from wearlab.life import history
from wearlab.scene import Scene
from wearlab.simulation import label


def life_values(scene: Scene, life_history: history.History) -> label.Values:
    """Return the life to a depth limit and what is left of it at every stored state.

    Parameters
    ----------
    scene : the scene
    life_history : its wear states and the integration that led through them
    """
    life = life_history.life
    if life is None or scene.wear is None:
        return {}
    values: label.Values = {"end_reason": life.end_reason}
    if scene.wear.until is None or scene.wear.until.depth is None:
        return values

    cycles = float(life.cycle[-1]) if life.worn_out else np.nan
    values["life"] = cycles
    values["remaining_useful_life"] = cycles - life_history.cycle

    seconds = life_history.seconds
    if seconds is not None and np.isfinite(seconds).all():
        values["service_life"] = float(seconds[-1]) if life.worn_out else np.nan
    return values
