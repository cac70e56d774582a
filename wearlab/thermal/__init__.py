"""Friction warms teeth: its power, the heat's way out, and where both balance."""
