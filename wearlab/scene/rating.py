"""``[rating]``: what ISO 6336 says of the pair, beside what is computed."""

from typing import Annotated, ClassVar

from annotated_types import Le

from wearlab import options

STIFFNESS, PITTING = "ISO 6336-1", "ISO 6336-2"


class Rating(options.Part):
    """Mesh stiffness and face load factor by methods B and C of ISO 6336-1, S_H by method B of ISO 6336-2.

    Nothing else asks for it.
    """

    of_pitting: ClassVar[tuple[str, ...]] = ("allowable_contact_stress", "viscosity_40", "hours")
    """What S_H takes, besides roughnesses and a misalignment."""

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
    allowable_contact_stress: Annotated[options.Pressure, options.POSITIVE] | None = options.option(
        None,
        "σ_Hlim of both gears, such as '1500 MPa', for the safety against pitting",
        derived="no safety against pitting",
        source=PITTING,
    )
    viscosity_40: Annotated[options.KinematicViscosity, options.POSITIVE] | None = options.option(
        None, "kinematic viscosity of the oil at 40 °C, for it", derived="none", source=PITTING
    )
    hours: Annotated[options.Hours, options.POSITIVE] | None = options.option(
        None, "life wanted of it", derived="none", source=PITTING
    )
    transverse_load_factor: Annotated[options.Number, options.POSITIVE] = options.option(
        1.0, "K_Hα on the contact stress", source=PITTING
    )
