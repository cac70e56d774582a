"""A scene becomes physics: only here do sections of a campaign file meet gears, mesh, dynamics and wear."""

from wearlab.assembly.gear_model import (
    GearModel,
    MeshKindModel,
    SceneModes,
    build,
    build_modes,
)
