"""``[mesh.stiffness]``: a stiffness model, finite elements where nothing else is said."""

from typing import Annotated

from pydantic import BeforeValidator

from wearlab.mesh.stiffnesses import StiffnessModel
from wearlab.options import named


def _implied(given: object) -> object:
    """Let options that one model alone has choose it."""
    if isinstance(given, dict) and "model" not in given:
        for name, part in StiffnessModel.slot.variants.items():
            if part.implied_by.intersection(given):
                return {"model": name, **given}
    return given


Stiffness = Annotated[StiffnessModel, *named("finite-element"), BeforeValidator(_implied)]
