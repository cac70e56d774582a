"""Where the mate of a member touches, and how far it has turned.

Y23's relations α1–α1′ and φ1–φ2.
"""

from typing import TYPE_CHECKING

from wearlab.variable import Result, Variable

if TYPE_CHECKING:
    import xarray as xr

_TURNING = ("update", "member", "mesh", "pair", "phase")


def of_the_mate(angle: "xr.DataArray") -> "xr.DataArray":
    """Return for each member of a mesh the angle of its mate [rad].

    It is NaN where there is none.

    >>> import xarray as xr
    >>> angles = [[0.2, float("nan")], [0.5, float("nan")]]
    >>> angle = xr.DataArray(angles, dims=("member", "pair"))
    >>> of_the_mate(angle).round(6).values.tolist()
    [[0.5, nan], [0.2, nan]]
    """
    both = angle.sum("member", min_count=2)
    return (both - angle).transpose(*angle.dims)


CONTACT = Result(
    "mate_contact_angle",
    Variable(
        _TURNING,
        "rad",
        "rad",
        "angle of the touching point on the mate's flank",
        "Y23's α1′ over α1",
    ),
    lambda run: of_the_mate(run["contact_angle"]),
    needs=("contact_angle",),
)
ROTATION = Result(
    "mate_rotation_angle",
    Variable(
        _TURNING,
        "rad",
        "rad",
        "rotation of the mate",
        "each pair as if alone; Y23's φ2 over φ1",
    ),
    lambda run: of_the_mate(run["rotation_angle"]),
    needs=("rotation_angle",),
)
