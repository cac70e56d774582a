"""Where each variable of a dataset comes from: which part of a scene makes it."""

from wearlab.results import RESULTS
from wearlab.schema import ON_REQUEST, VARIABLES

FIRST_OF = {
    "cycle": ("coordinates", "every run"),
    "duty_torque": ("coordinates", "operation.duty or operation.stage"),
    "flank_side": ("coordinates", "every run"),
    "wear_depth": ("wear", "[wear], or initial wear"),
    "tooth_force": ("along the path", "every run"),
    "film_thickness": ("along the path", "[lubricant] and roughness_ra"),
    "effective_wear_coefficient": ("along the path", "[wear]"),
    "mesh_stiffness": ("mesh", "every run"),
    "contact_angle": ("mesh", 'mesh.contact = "exact" or "algorithm-1"'),
    "mesh_frequency": ("mesh", "every run"),
    "excitation_stiffness": ("mesh", "mesh.excitation by series"),
    "slow_error": ("mesh", "[errors]"),
    "dynamic_mesh_force": ("dynamics", "[dynamics]"),
    "response_speed": ("response over speed", "dynamics.response"),
    "mode_kind": ("dynamics", "[dynamics]"),
    "friction_force": ("dynamics", "dynamics.friction"),
    "mesh_acceleration": ("dynamics", "[dynamics], where [store] variables names it"),
    "natural_frequency": ("dynamics", "[dynamics]"),
    "life": ("life", "wear.until"),
    "verdict": ("trust", "every run"),
}
"""First variable of each stretch of the table of variables → group, and what makes it."""


def origin_of(name: str) -> tuple[str, str]:
    """Return the group of a variable, and what must be there for it to be made.

    Parameters
    ----------
    name : a key of `wearlab.schema.VARIABLES`
    """
    made_of = next((result.needs for result in RESULTS if result.name == name), ())
    if made_of:
        return origin_of(made_of[0])
    group, needs = "", ""
    for variable in VARIABLES:
        group, needs = FIRST_OF.get(variable, (group, needs))
        if variable == name:
            break
    else:
        raise KeyError(name)
    return group, FIRST_OF["mesh_acceleration"][1] if name in ON_REQUEST else needs
