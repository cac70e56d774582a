"""``[rating]``: what ISO 6336 says of the pair, beside what is computed."""

from typing import Annotated

from annotated_types import Le

from wearlab import options

STIFFNESS = "ISO 6336-1"


class Rating(options.Part):
    """Mesh stiffness by method B and face load factor by method C of ISO 6336-1; nothing else asks for it."""

    body_factor: Annotated[options.Number, options.POSITIVE, Le(1.0)] = options.option(
        1.0, "C_R, 1 for solid bodies", source=STIFFNESS
    )
    equivalent_misalignment: Annotated[options.Depth, options.NOT_NEGATIVE] | None = options.option(
        None,
        "F_βx before running-in, which the face load factor is for",
        derived="mesh.misalignment, else no face load factor",
        source=STIFFNESS,
    )
    running_in: Annotated[options.Number, options.NOT_NEGATIVE, Le(1.0)] = options.option(
        0.15, "share of it that runs in, y_β/F_βx; 0.15 of case-hardened gears", source=STIFFNESS
    )
    application_factor: Annotated[options.Number, options.POSITIVE] = options.option(
        1.0, "K_A K_v on the load of the face load factor", source=STIFFNESS
    )
