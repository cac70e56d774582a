"""``[wear.initial]``: wear of flanks before the first cycle."""

from typing import Any

import pydantic

from wearlab import options
from wearlab.scene import gears
from wearlab.wear import initials

OF_FLANK: Any = {
    flank: (
        initials.InitialModel | None,
        options.option(None, f"initial wear of {flank}"),
    )
    for flank in gears.ALL_FLANKS
}
InitialWears = pydantic.create_model(
    "InitialWears",
    __base__=options.Part,
    __doc__="Initial wear of each flank.",
    **OF_FLANK,
)  # some flanks have names that Python could not spell
