"""Flanks that have no place in common are not squeezed into one axis."""

import numpy as np
import pytest
from made_up import SPEEDS, run

from wearlab.figures import FigureError, plotting, single
from wearlab.figures.kind import read


def plot_of(diameters, **wishes):
    data = run(SPEEDS[0])
    along = np.linspace(0.0, 8e-3, data.sizes["profile"])
    places = np.add.outer(np.array(diameters), along)
    data = data.assign_coords(
        diameter=(("flank", "profile"), places, data.diameter.attrs)
    )
    data = data.assign_attrs(id="1" * 32)
    spec = single.specified({"kind": "wear-profile", "x": "diameter", **wishes})
    return plotting.plotted(single.grid_of(data), read(spec, 1, None))[0]


LAST = {"select": {"update": -1}}


def test_both_gears_over_one_axis_of_diameters_are_refused_with_the_remedy():
    apart = (0.08, 0.15)
    with pytest.raises(FigureError, match="pinion 80 to 88 mm, gear 150 to 158 mm"):
        plot_of(apart, hue="flank", **LAST)
    with pytest.raises(FigureError, match="write cols = 'flank' instead of hue"):
        plot_of(apart, hue="flank", **LAST)
    assert len(plot_of(apart, cols="flank", **LAST).panels) == 2
    with pytest.raises(FigureError, match="write rows = 'flank' instead of hue"):
        plot_of(apart, hue="flank", cols="update")
    assert len(plot_of(apart, cols="update", rows="flank").panels) == 6


def test_gears_that_share_diameters_and_other_abscissae_stay_in_one_panel():
    assert len(plot_of((0.08, 0.082), hue="flank", **LAST).panels) == 1
    along_path = plot_of((0.08, 0.15), hue="flank", **LAST | {"x": "path_position"})
    assert len(along_path.panels) == 1
