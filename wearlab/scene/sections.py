"""The sections of a campaign file that one run depends on."""

from wearlab.options import Part, option
from wearlab.scene.dynamics import Dynamics
from wearlab.scene.errors import ErrorsSection
from wearlab.scene.gears import Gears
from wearlab.scene.lubricant import Lubricant
from wearlab.scene.mesh import MeshSection
from wearlab.scene.numerics import Numerics
from wearlab.scene.operation import Operation
from wearlab.scene.start import Start
from wearlab.scene.store import StoreSection
from wearlab.scene.wear import WearSection


class Sections(Part):
    """The sections of a scene; an absent one is ``None``."""

    gears: Gears = option(..., "shape of the gears")
    operation: Operation = option(..., "how they are driven")
    mesh: MeshSection = option(MeshSection(), "contact, stiffness, excitation and damping")
    errors: ErrorsSection | None = option(None, "prescribed errors", derived="none")
    dynamics: Dynamics | None = option(None, "moving coordinates", derived="quasi-static")
    lubricant: Lubricant | None = option(None, "the oil", derived="dry: no film")
    wear: WearSection | None = option(None, "the wear law and the life", derived="one unworn state")
    numerics: Numerics = option(Numerics(), "accuracy")
    start: Start | None = option(None, "the run whose wear this one goes on from", derived="its own wear")
    store: StoreSection = option(StoreSection(), "what is kept")
