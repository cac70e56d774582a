"""Flanks with a width: sections side by side, coupled along the face, touching where a gap closes."""
