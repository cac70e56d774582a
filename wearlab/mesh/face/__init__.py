"""Flanks with a width: coupled sections, which touch where a gap closes."""
