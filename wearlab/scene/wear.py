"""``[wear]``: law, coefficient, initial wear and end of a life."""

from typing import Annotated, Any

import pydantic

from wearlab import options
from wearlab.life import loads, steps
from wearlab.scene.coefficient import Coefficient, coefficient_of
from wearlab.scene.initial_wear import InitialWears
from wearlab.scene.limits import Positive, SnapshotOptions, Until
from wearlab.wear import laws, patches, pressures, projections


class WearSection(options.Part):
    """Archard's law along the path, stepped over cycles."""

    alternatives = ((("contact_patch",), ("average_over_contact_width",)),)

    coefficient: Coefficient | None = None
    """wear coefficient k; required with until [nothing wears]. Source: Archard 1953"""
    law: laws.LawModel = laws.LawModel.named()
    """how much is worn away in a cycle. Source: Archard 1953"""
    load: loads.LoadModel = options.option(None)
    """force that wears: when the point is in contact, L16's Miner torque, or static
    [instant with dynamics, static without]. Source: L16 Eq. 25"""
    wohler_slope: Positive | None = None
    """Wöhler slope of the equivalent load; not printed in L16 [no equivalent_load].
    Source: L16 Eq. 25"""
    pressure: pressures.PressureModel = pressures.PressureModel.named()
    """Hertz pressure in the law; peak is 4/π times. Source: Archard 1953"""
    projection: projections.ProjectionModel = projections.ProjectionModel.named()
    """direction of the depth: along the normal, or W23's h/cos α. Source: W23 Eq. 33"""
    contact_patch: patches.PatchModel = patches.PatchModel.named()
    """over the width of contact wear is: taken point by point; spread; spread and felt;
    spread, felt and levelled by the pressure that redistributes inside. Source: Johnson
    1985"""
    beyond_path: options.Switch | None = None
    """let pairs that touch before A and after E wear both flanks, at the points that
    meet there; needs mesh.contact = 'exact' and extended contact [true with [thermal]
    and these, else false]. Source: Munro, Morrish & Palmer 1999"""
    average_over_contact_width: options.Switch | None = None
    """another word: true for contact_patch = one-way, false for none [as contact_patch
    says]. Source: Archard 1953"""
    initial: Annotated[
        InitialWears | None,
        pydantic.BeforeValidator(lambda given: None if given == {} else given),
    ] = None
    """wear before the first cycle [new flanks]"""
    until: Until | None = None
    """where the life ends [one wear state]"""
    snapshots: SnapshotOptions | None = None
    """states stored on the way [accepted steps]"""
    step: steps.StepMethod = steps.StepMethod.named()
    """how the wear is stepped over cycles. Source: wearlab"""

    @classmethod
    def _complete(
        cls, table: dict[str, Any], info: pydantic.ValidationInfo
    ) -> dict[str, Any]:
        """Read the other word for a contact patch as what it means."""
        averaged = table.get("average_over_contact_width")
        if "contact_patch" in table or not isinstance(averaged, bool):
            return table
        rest = {
            key: value
            for key, value in table.items()
            if key != "average_over_contact_width"
        }
        return {**rest, "contact_patch": "one-way" if averaged else "none"}

    def coefficient_of(self, flank: str) -> Any:
        """Return the coefficient of a flank, that of its member, None without wear."""
        return coefficient_of(self.coefficient, flank)

    def initial_of(self, flank: str) -> Any:
        """Return the initial wear of one flank, None when it is new."""
        return None if self.initial is None else getattr(self.initial, flank)
