"""A campaign of two short static lives, for tests of what happens around runs."""

from pathlib import Path

BASE = Path(__file__).parents[2] / "campaigns" / "base" / "spur_50_50.toml"
STUDY = f"""
title = "Two torques"
extends = "{BASE.as_posix()}"
drop = ["dynamics"]
[wear]
load = "static"
until = {{ depth = "20 um", flank = "pinion" }}
[[sweep]]
"operation.torque" = ["100 N*m", "120 N*m"]
"""
