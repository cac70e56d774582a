"""``[dynamics]``: which coordinates move, one model a file."""

from collections.abc import Iterator
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, NamedTuple

from annotated_types import Ge, Le
from pydantic import create_model

from wearlab.gears.sets import SETS
from wearlab.options import NOT_NEGATIVE, POSITIVE, Count, Number, Part, Speed, option
from wearlab.slots import Slot, Variant

if TYPE_CHECKING:
    from wearlab.arrays import Array
    from wearlab.dynamics.system import System
    from wearlab.mesh.gear_set import GearSet

DEFAULT_METHOD = "periodic"


def method_names() -> tuple[str, ...]:
    """Return the names of the methods: the files of `wearlab.dynamics.methods`.

    They are not imported, for they compile. The default comes first.
    """
    folder = Path(__file__).parents[1] / "methods"
    names = sorted(module.name for module in iter_modules([str(folder)]))
    return (DEFAULT_METHOD, *(name for name in names if name != DEFAULT_METHOD))


if TYPE_CHECKING:
    MethodName = str
else:
    MethodName = Literal[method_names()]


class FrictionOptions(Part):
    """Sliding friction of the flanks.

    It is ``μ F`` against the sliding, reversed at the pitch point.
    """

    coefficient: Annotated[Number, NOT_NEGATIVE, Le(1.0)]
    """coefficient of friction μ, such as 0.05. Source: B23"""


END = Annotated[Speed, POSITIVE]
SPEEDS: Any = {
    "from": (END, option(..., "lowest speed")),
    "to": (END, option(..., "highest speed")),
}
SPEEDS["points"] = Annotated[Count, Ge(2)], option(61, "number of speeds")
SPACED = (
    "Equally spaced speeds of the input member; ``from`` is no name that Python could "
    "spell."
)
SpeedRange = create_model("SpeedRange", __base__=Part, __doc__=SPACED, **SPEEDS)


class ResponseOverSpeed(Part):
    """The response over speed of the first wear state.

    Each speed starts from the response of the last.
    """

    speed: SpeedRange
    """speeds of the input member"""
    direction: Literal["up", "down", "both"] = "both"
    """whether the speed rises, falls, or rises and then falls"""
    transient: Annotated[Count, POSITIVE] = 200
    """mesh periods integrated at a speed before it counts"""
    strobe: Annotated[Count, POSITIVE] = 64
    """mesh periods whose strobed states are kept"""

    @property
    def directions(self) -> tuple[str, ...]:
        """In which senses the speed is followed, one after another."""
        return ("up", "down") if self.direction == "both" else (self.direction,)


class InMotion(NamedTuple):
    """What a dynamic model is made of.

    Parameters
    ----------
    gears : the gear set in operation: kinds of mesh, gears with mass, inertia and base
        radius, members
    meshes : ``[mesh]`` of each kind of mesh: damping, damping_ratio, damping_in,
        normal_backlash
    operation : ``[operation]``: torque, speed, input, output, torque_fluctuation
    stiffness : (n_mesh,) mean stiffness of each mesh, to which damping ratios refer
        [N/m]
    slope : signed tan β_b of helical teeth: the mesh pushes its driving gear along −z
        by W tan β_b [1]
    """

    gears: "GearSet"
    meshes: tuple[Any, ...]
    operation: Any
    stiffness: "Array"
    slope: float = 0.0


class DynamicModel(Variant):
    """Any dynamic model: the coordinates, and the `System` they make.

    ``kinds`` names the kinds of gear sets that it describes: where it says none, every
    pair.
    """

    slot: ClassVar[Slot] = Slot("dynamics", __name__)
    kinds: ClassVar[tuple[str, ...]] = tuple(
        kind for kind, descriptor in SETS.items() if descriptor.is_pair
    )

    method: MethodName = DEFAULT_METHOD
    """how the steady response is found; periodic is shooting, the others integrate as
    the papers do. Source: wearlab"""
    friction: FrictionOptions | None = None
    """sliding friction of the flanks. Source: B23"""
    response: ResponseOverSpeed | None = None
    """the response over speed, followed up and down. Source: wearlab"""

    @property
    def follows_orbits(self) -> bool:
        """Whether an orbit is shot at, not integrated until it is steady."""
        return self.method == DEFAULT_METHOD

    def build(self, motion: InMotion) -> "System":
        """Return its equation of motion.

        Raises
        ------
        GearError
            When nothing can move so.
        """
        raise NotImplementedError(f"{type(self).__name__} has no build")

    def problems(self, scene: Any) -> Iterator[tuple[str, str]]:
        """Yield what this model asks of the sections of a scene, as key and reason."""
        return iter(())
