"""``[dynamics]``: a dynamic model that belongs to the kind of gear set."""

from typing import Annotated, Any

from pydantic import BeforeValidator, ValidationInfo
from pydantic_core import PydanticCustomError

from wearlab.dynamics.models import DynamicModel
from wearlab.options import named
from wearlab.scene.gears import set_in


def _of_the_set(value: Any, info: ValidationInfo) -> Any:
    """Refuse a model of another kind of gear set before what that model requires is missed."""
    kind = set_in(info.context).kind
    model = value.get("model") if isinstance(value, dict) else value
    variants = DynamicModel.slot.variants
    chosen = variants.get(model) if isinstance(model, str) else None
    if chosen is not None and kind and kind not in _kinds(chosen):
        own = [name for name, variant in variants.items() if kind in _kinds(variant)]
        raise PydanticCustomError(
            "not_of_the_set", "{model} does not belong to gears of kind {kind}; give {own}",
            {"model": repr(model), "kind": repr(kind), "own": " or ".join(map(repr, own))},
        )  # fmt: skip
    return value


def _kinds(model: Any) -> tuple[str, ...]:
    kinds: tuple[str, ...] = model.kinds
    return kinds


Dynamics = Annotated[DynamicModel, *named(), BeforeValidator(_of_the_set)]
