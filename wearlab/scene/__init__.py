"""Scenes: what one run depends on, read from a campaign file, free of physics."""

from wearlab.scene import renewal as renewal  # plug-ins may bring variants
from wearlab.scene.calibration import calibrated_coefficient, calibrating
from wearlab.scene.identity import MODEL_VERSION
from wearlab.scene.problems import SceneError
from wearlab.scene.scene import Scene
from wearlab.scene.summary import oversights, parts_left_out, parts_present
