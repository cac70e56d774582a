"""Profiles measured at a place across a face, and coefficients that no run stores."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from made import ErrorModel, observed

from wearlab.campaign.update_options import Data, Limit
from wearlab.updating import UpdateError, run_curves

CYCLES = np.array([0.0, 1e6, 2e6])
FACE = np.array([-8e-3, 0.0, 8e-3])
DIAMETER = np.array([0.060, 0.062, 0.064])
LIMIT = Limit("max_wear_depth", 1e-5, "pinion")


def run_with_face(face=FACE):
    """Depth = 1e-12 m a cycle times (1 + 50 s/m), on both flanks and all nodes."""
    across = 1e-12 * (1.0 + 50.0 * face)
    depth = CYCLES[:, None, None, None] * across[None, None, :, None]
    depth = np.broadcast_to(depth, (3, 2, len(face), 3))
    rate = np.broadcast_to(across[None, None, :, None], depth.shape)
    dims = ("update", "flank", "face", "profile")
    return xr.Dataset(
        {
            "wear_depth": (dims, depth),
            "wear_rate": (dims, rate),
            "diameter": (("flank", "profile"), np.tile(DIAMETER, (2, 1))),
            "face_position": ("face", face),
            "cycle": ("update", CYCLES),
        },
        {"flank": ["pinion", "gear"]},
    )


def block(**select):
    seen = observed([1e6], [1e-6], ErrorModel(1e-7), quantity="wear_depth")
    data = Data.model_construct(
        file=Path("p.csv"),
        number=1,
        quantity="wear_depth",
        flank="pinion",
        error=ErrorModel(1e-7),
        select=select,
    )
    return replace(seen, data=data, place_kind="diameter", place=np.array([0.061]))


@pytest.mark.parametrize("place", ["-8 mm", "0 mm", "2 mm", "8 mm"])
def test_a_profile_is_compared_where_it_was_measured_across_the_face(place):
    seen = block(face_position=place)
    points = run_curves.points_of(run_with_face(), seen, LIMIT, None)
    at = 1e-3 * float(place.split()[0])
    expected = 1e-6 * (1.0 + 50.0 * at)
    assert points.curve.at(np.array([1e6]), points.column)[0] == pytest.approx(expected)
    assert (
        seen.data.label
        == f"wear_depth_pinion_face_position_{place.replace(' ', '_')}".replace(
            "_-", "_minus_"
        )
    )


@pytest.mark.parametrize(
    ("select", "said"),
    [
        ({}, 'required: .* such as select = { face_position = "-8 mm" }'),
        ({"face_position": "9 mm"}, "9 mm lies beside the face, from -8 to 8 mm"),
        ({"face_position": "centre"}, "'centre': write a length with its unit"),
    ],
)
def test_a_place_that_is_none_is_refused_by_its_key(select, said):
    with pytest.raises(UpdateError, match=rf"select\.face_position: {said}"):
        run_curves.points_of(run_with_face(), block(**select), LIMIT, None)


def test_gears_without_a_face_have_no_place_across_it():
    run = run_with_face().isel(face=1).drop_vars("face_position")
    plain = run_curves.points_of(run, block(), LIMIT, None)
    assert plain.curve.at(np.array([1e6]), plain.column)[0] == pytest.approx(1e-6)
    with pytest.raises(UpdateError, match="have no face: leave it out"):
        run_curves.points_of(run, block(face_position="0 mm"), LIMIT, None)


def test_a_coefficient_that_is_not_stored_is_that_of_the_scene():
    """Runs with a face store none along the flank: the answer had 'nan m²/N'."""
    constant = SimpleNamespace(value=1e-18, factor=2.0)
    scene = SimpleNamespace(wear=SimpleNamespace(coefficient=constant))
    assert run_curves._coefficient(run_with_face(), scene, "pinion") == 2e-18
    other = SimpleNamespace(wear=SimpleNamespace(coefficient=SimpleNamespace()))
    assert np.isnan(run_curves._coefficient(run_with_face(), other, "pinion"))
