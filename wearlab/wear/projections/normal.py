"""Depth along the flank normal."""

from typing import Literal

from wearlab.wear.projections import ProjectionModel


class NormalProjection(ProjectionModel):
    """Depth along the flank normal, counted and felt."""

    model: Literal["normal"] = "normal"
    """along the normal. Source: Archard 1953"""
