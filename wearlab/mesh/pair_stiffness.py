"""What a contact analysis asks of a stiffness, whatever it comes from."""

from typing import TYPE_CHECKING, Protocol

import numpy as np

from wearlab.arrays import Array

if TYPE_CHECKING:
    from wearlab.mesh.profile import Lookup


class PairStiffness(Protocol):
    """How a pair of teeth yields at the nodes of its path; what a subclass leaves out has a default here."""

    @property
    def load_dependent(self) -> bool:
        """Whether :meth:`contact` depends on the force."""
        return False

    @property
    def softening(self) -> float:
        """By how much :meth:`contact` grows as the force shrinks, ``−F dc/dF``, about [m/N].

        However rough, it changes only how soon compliances and forces agree.
        """
        return 0.0

    @property
    def bends(self) -> Array:
        """Phases at which a prescribed course bends, (n,) [1]."""
        return np.empty(0)

    def body(self, wear: Array) -> Array:
        """Return the compliance of both teeth and bodies for wear (2, n), (n,) [m/N].

        Raises
        ------
        SectionVanished
            When a worn section of a tooth has no thickness left.
        """

    def body_where(self, wear: Array, nodes: Array, driving: Array, driven: Array) -> Array:
        """Return the compliance of teeth and bodies whose flanks meet off the line of action, (n,) [m/N].

        Where a stiffness does not tell the two gears apart, that of the nodes stands for it.

        Parameters
        ----------
        wear : (2, n) [m]
        nodes : (n,) path positions of the nodes [m]
        driving, driven : (n,) path positions of the flank points that meet there [m]
        """
        return self.body(wear)

    def contact(self, force: Array | None) -> Array | float:
        """Return the compliance of the contact under pair forces (n,), (n,) [m/N]."""
        return 0.0

    def cross(self, wear: Array) -> Array:
        """Return the compliance shared with pairs 1, 2 … base pitches ahead, (n_apart, n) [m/N]."""
        return np.zeros((0, wear.shape[1]))

    def at_phases(self, where: "Lookup") -> Array | None:
        """Return the stiffness of pairs at phases, 0 out of the path, (n, n_pairs) [N/m]; None: by nodes."""
        return None
