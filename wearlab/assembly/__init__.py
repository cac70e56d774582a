"""A scene becomes physics: here its sections meet gears, mesh, dynamics and wear."""

from wearlab.assembly.construction import build
from wearlab.assembly.gear_model import GearModel
from wearlab.assembly.kinds import MeshKindModel
from wearlab.assembly.scene_modes import SceneModes, build_modes
