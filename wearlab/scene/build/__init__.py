"""A scene becomes physics: the only place where sections of a campaign file meet gears, mesh, dynamics and wear."""

from wearlab.scene.build.parts import PairParts, build

__all__ = ["PairParts", "build"]
