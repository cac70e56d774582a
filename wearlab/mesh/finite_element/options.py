"""What can be chosen of the finite elements."""

from typing import NamedTuple

from wearlab.gears.materials import Plane as Plane


class Options(NamedTuple):
    """How a gear is meshed and loaded.

    Parameters
    ----------
    plane : plane strain or stress
    refinement : multiples of the coarsest mesh's elements; the mesh error falls at least with its square
    patch : half width of the loaded patch in modules; the answer does not depend on it [1]
    samples : load positions on a flank
    teeth_apart : how many neighbouring teeth are looked at
    """

    plane: Plane = "strain"
    refinement: int = 3
    patch: float = 0.1
    samples: int = 21
    teeth_apart: int = 3
