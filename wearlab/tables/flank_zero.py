"""What counts as unworn on a measured flank."""

import numpy as np

from wearlab.arrays import Array

ZEROS = ("as-measured", "max", "pitch", "tip", "root", "line")
"""What may count as unworn."""


def zero_line(zero: str, gear: int, s: Array, depth: Array) -> Array | float:
    """Return the depth that counts as zero, at the nodes [m].

    Parameters
    ----------
    zero : one of `ZEROS`
    gear : 0 driving, whose root end is touched first; 1 driven
    s : (n,) path positions of the nodes, rising [m]
    depth : (n,) at these [m]
    """
    if zero == "line":
        return _outer_line(s, depth)
    root, tip = depth[[0, -1]] if gear == 0 else depth[[-1, 0]]
    pitch = np.interp(0.0, s, depth)
    highest = depth.min()
    return float(
        {"as-measured": 0.0, "max": highest, "pitch": pitch, "tip": tip, "root": root}[
            zero
        ]
    )


def _outer_line(s: Array, depth: Array) -> Array:
    """Return the line that touches the profile outside, beside the pitch point.

    Where the pitch point itself stands highest, the line is the tangent there, if that
    stays outside.
    """
    away = 1e-9 * np.ptp(s)
    below = s < -away
    above = s > away
    at_pitch = float(np.interp(0.0, s, depth))
    left = (depth[below] - at_pitch) / s[below]
    right = (depth[above] - at_pitch) / s[above]
    if left.max() <= right.min():
        near = -s[below][-1]
        far = s[above][0]
        tangent = (left[-1] * far + right[0] * near) / (near + far)
        return np.asarray(at_pitch + np.clip(tangent, left.max(), right.min()) * s)
    # the edge of the lower hull of the depth that crosses the pitch point: the lowest
    # there of all chords
    slope = (depth[above] - depth[below][:, None]) / (s[above] - s[below][:, None])
    crossing = depth[below][:, None] - slope * s[below][:, None]
    i, j = np.unravel_index(np.argmin(crossing), crossing.shape)
    return np.asarray(crossing[i, j] + slope[i, j] * s)
