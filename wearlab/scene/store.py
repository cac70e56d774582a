"""``[store]``: what is kept of a run."""

from difflib import get_close_matches
from typing import Annotated

from annotated_types import MinLen
from pydantic import AfterValidator
from pydantic_core import PydanticCustomError

from wearlab.scene.part import Part, option
from wearlab.schema import VARIABLES


def _known(names: tuple[str, ...]) -> tuple[str, ...]:
    for name in names:
        if name not in VARIABLES:
            near = get_close_matches(name, VARIABLES, 1)
            raise PydanticCustomError(
                "variable",
                "{name} is no variable of a dataset{near}",
                {"name": repr(name), "near": f", did you mean {near[0]!r}?" if near else ""},
            )
    return tuple(sorted(set(names)))


class Store(Part):
    """What is kept of a run."""

    variables: Annotated[tuple[str, ...], MinLen(1), AfterValidator(_known)] | None = option(
        None, "variables to store", derived="all that the present parts make", source="wearlab"
    )
