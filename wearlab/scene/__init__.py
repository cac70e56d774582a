"""Scenes: what one run depends on, read from a campaign file, free of physics."""

from wearlab.scene.identity import MODEL_VERSION
from wearlab.scene.problems import SceneError
from wearlab.scene.scene import Scene, calibrated_coefficient, calibrating
from wearlab.scene.summary import oversights, parts_left_out, parts_present
