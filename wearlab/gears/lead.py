"""Lead modifications: material removed on purpose that varies over the face."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wearlab.arrays import Array


class Lead(NamedTuple):
    """What is taken off one flank over its face, normal to the flank.

    ``g = 4 C η² − f η + r max(0, 1 − d/l) − t η (ξ − ½)`` with η = y/b, ξ the share of the active profile
    from its root end, and d the distance from the nearer end of the face.

    Parameters
    ----------
    crowning : C, removed at both ends of the face, a parabola with 0 at mid-face [m]
    slope : f, surplus of material at the end of positive y against the other, as f_Hβ [m]
    relief : r, removed at the very ends [m]
    relief_length : l, over which that fades to 0 [m]
    bias : t, profile slope at the end of positive y less that at the other [m]
    """

    crowning: float = 0.0
    slope: float = 0.0
    relief: float = 0.0
    relief_length: float = 1.0
    bias: float = 0.0

    def removed(self, face_position: ArrayLike, profile_share: ArrayLike, face_width: float) -> Array:
        """Return the material removed normal to the flank, (n_face, n_profile) [m].

        Parameters
        ----------
        face_position : (n_face,) y from mid-face [m]
        profile_share : (n_profile,) ξ, 0 at the root end and 1 at the tip end of the active profile [1]
        face_width : b [m]

        References
        ----------
        ISO 21771:2007, 8: crowning, end relief, helix slope and twist.

        Examples
        --------
        >>> (1e6 * Lead(crowning=8e-6).removed([-0.01, 0.0, 0.01], [0.5], 0.02)).round(6).ravel().tolist()
        [8.0, 0.0, 8.0]
        """
        y = np.asarray(face_position, float)[:, None]
        eta, xi = y / face_width, np.asarray(profile_share, float)[None, :]
        ends = np.clip(1.0 - (0.5 * face_width - np.abs(y)) / self.relief_length, 0.0, None)
        along = 4.0 * self.crowning * eta**2 - self.slope * eta + self.relief * ends
        return np.asarray(along - self.bias * eta * (xi - 0.5))
