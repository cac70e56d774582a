"""A scene becomes physics: only here do sections of a campaign file meet gears, mesh, dynamics and wear."""

from wearlab.assembly.parts import KindParts, Parts, SceneModes, build, build_modes
