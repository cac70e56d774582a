"""Sections choose among the variants that are known, also those of plug-ins."""

from typing import Any

from wearlab import slots
from wearlab.scene import sections
from wearlab.scene.completion import CompleteSections
from wearlab.scene.errors import ErrorsSection
from wearlab.scene.initial_wear import InitialWears
from wearlab.scene.mesh import MeshSection, OneMesh
from wearlab.scene.wear import WearSection

SECTIONS: tuple[Any, ...] = (
    OneMesh,
    MeshSection,
    ErrorsSection,
    InitialWears,
    WearSection,
    sections.Sections,
    CompleteSections,
)
"""Parts that hold a slot, inner ones first."""


def _renew() -> None:
    """Rebuild variants and sections after a slot has got other variants."""
    variants: list[Any] = [
        variant
        for slot in slots.Slot.all.values()
        for variant in slot.variants.values()
    ]
    for part in (*variants, *SECTIONS):
        part.model_rebuild(force=True)
    sections.forget()


slots.WHEN_CHANGED.append(_renew)
