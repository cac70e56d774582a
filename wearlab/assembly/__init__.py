"""A scene becomes physics: here its sections meet gears, mesh, dynamics and wear."""

from wearlab.assembly.gear_model import (
    GearModel,
    MeshKindModel,
    SceneModes,
    build,
    build_modes,
)
