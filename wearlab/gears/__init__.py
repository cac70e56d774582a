"""Involute gears: specifications, geometry, pairs and their path of contact."""
