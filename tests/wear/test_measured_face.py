"""Flanks measured over their face: leads and topographies, from file
to slices and nodes; refusals.
"""

import numpy as np
import pytest
from scenes import external_pair

from wearlab.assembly import build
from wearlab.assembly.wear_checks import check_initial_wear
from wearlab.gears.specification import GearError
from wearlab.scene import Scene, SceneError
from wearlab.simulation.initial_wear import initial_wear

B = 45.0
PAIR = {
    "gears": external_pair(
        {"teeth": 23, "lead_crowning": "8 um"}, 71, module="4 mm", face_width=f"{B} mm"
    ),
    "operation": {"torque": "320 N*m", "speed": "1450 rpm"},
    "mesh": {"stiffness": {"model": "potential-energy"}, "face_points": 21},
    "numerics": {"profile_points": 61},
}
ALL = build(Scene.from_mapping(PAIR))
PATH = ALL.kinds[0].pair
GEARS = ALL.kinds[0].pair.gears


def course(s, y):
    """Return a depth of bilinear course over path position [m] and
    face position [mm], [um].
    """
    along = (s - PATH.path.A) / (PATH.path.E - PATH.path.A)
    return 5.0 + 3.0 * along + 0.1 * y + 0.05 * along * y


def written(folder, rows, columns="diameter [mm];face_position [mm];depth [um]"):
    file = folder / "flank.csv"
    file.write_text(
        "\n".join(
            [columns, *(";".join(f"{value:.9g}" for value in row) for row in rows)]
        )
    )
    return file


def topography(
    gear=0, places=(-22.5, -10.0, 0.0, 15.0, 22.5), sign=1.0, removed=lambda s, y: 0.0
):
    s = np.linspace(PATH.path.A, PATH.path.E, 41)
    d = 1e3 * 2.0 * PATH.radius(gear, s)
    return [
        (one, y, sign * (course(at, y) + removed(at, y)))
        for y in places
        for one, at in zip(d, s, strict=True)
    ]


def scene(file, flank="pinion", **options):
    changed = Scene.from_mapping(PAIR).replace(
        {f"wear.initial.{flank}": {"file": str(file), **options}}
    )
    return changed


@pytest.mark.parametrize(("flank", "gear"), [("pinion", 0), ("gear", 1)])
def test_a_bilinear_topography_is_met_at_every_slice_and_node(tmp_path, flank, gear):
    """Straight from profile to profile across the face.

    Along them to the digits of the diameters.
    """
    given = scene(written(tmp_path, topography(gear)), flank)
    parts = build(given)
    wear = initial_wear(given, parts)[0]
    grid = parts.face.kinds[0].contact.grid
    wanted = 1e-6 * course(grid.profile.position[None, :], 1e3 * grid.position[:, None])
    np.testing.assert_allclose(wear[gear], wanted, atol=2e-9)
    assert not wear[1 - gear].any()
    state = parts.coupling.evaluate((wear,))
    assert np.ptp(state.kind[0].loads.load.max(axis=(0, 1))) > 0.0
    again = Scene.from_canonical(given.canonical())
    assert again.id == given.id != Scene.from_mapping(PAIR).id


def test_rows_may_come_in_any_order_of_traces_and_tell_the_content_not_the_path(
    tmp_path,
):
    rows = topography()
    mixed = [
        row for y in (0.0, 22.5, -10.0, -22.5, 15.0) for row in rows if row[1] == y
    ]
    first = scene(written(tmp_path, rows))
    wear = initial_wear(first, build(first))[0]
    second = scene(written(tmp_path, mixed))
    np.testing.assert_array_equal(initial_wear(second, build(second))[0], wear)


def test_a_deviation_counts_crowning_as_meant(tmp_path):
    crowned = topography(sign=-1.0, removed=lambda s, y: 4.0 * 8.0 * (y / B) ** 2)
    given = scene(
        written(tmp_path, crowned, "diameter [mm];face_position [mm];deviation [um]")
    )
    grid = build(given).face.kinds[0].contact.grid
    wear = initial_wear(given, build(given))[0][0]
    np.testing.assert_allclose(
        wear,
        1e-6 * course(grid.profile.position[None, :], 1e3 * grid.position[:, None]),
        atol=2e-9,
    )


def test_a_lead_holds_all_along_the_profile_and_goes_on_as_told(tmp_path):
    y = np.linspace(-18.0, 18.0, 37)
    file = written(
        tmp_path, [(a, 6.0 + 0.2 * a) for a in y], "face_position [mm];depth [um]"
    )
    with pytest.raises(
        GearError, match=r"pinion: .* face positions -18 to 18 mm, .* continuation"
    ):
        check_initial_wear(scene(file), build(Scene.from_mapping(PAIR)).gears)
    for how, end in (("hold", 2.4), ("slope", 6.0 - 0.2 * B * 10 / 21), ("zero", 0.0)):
        given = scene(file, continuation=how)
        wear = initial_wear(given, build(given))[0][0]
        assert np.ptp(wear, axis=1).max() == 0.0
        assert wear[10, 0] == pytest.approx(6e-6, rel=1e-12)
        assert wear[0, 0] == pytest.approx(1e-6 * end, abs=1e-12)
    zeroed = scene(file, continuation="hold", zero="max")
    assert initial_wear(zeroed, build(zeroed))[0][0].min() == 0.0


@pytest.mark.parametrize(
    ("rows", "columns", "said"),
    [
        (
            [(92.0, 0.0, 1.0), (93.0, 0.0, 1.0)],
            None,
            "in every row: give several traces",
        ),
        (
            [
                (92.0, -5.0, 1.0),
                (94.0, -5.0, 1.0),
                (93.0, -5.0, 1.0),
                (92.0, 5.0, 1.0),
                (93.0, 5.0, 1.0),
            ],
            None,
            "flank.csv: lines 2 to 4, face_position -5 mm: diameter neither rises nor "
            "falls",
        ),
        (
            [(92.0, 1.0, 1.0)],
            "diameter [mm];face_position;depth [um]",
            "units.face_position is required",
        ),
    ],
)
def test_what_is_no_topography_is_refused_by_file_row_and_remedy(
    tmp_path, rows, columns, said
):
    columns = columns or "diameter [mm];face_position [mm];depth [um]"
    with pytest.raises(SceneError) as caught:
        scene(written(tmp_path, rows, columns))
    assert said in str(caught.value)


def test_what_does_not_go_with_a_topography_is_refused(tmp_path):
    file = written(tmp_path, topography())
    flat = {**PAIR, "mesh": {}, "gears": {**PAIR["gears"], "pinion": {"teeth": 23}}}
    with pytest.raises(
        SceneError, match=r"wear\.initial\.pinion\.file: .* give mesh\.face_points"
    ):
        Scene.from_mapping(
            {**flat, "wear": {"initial": {"pinion": {"file": str(file)}}}}
        )
    with pytest.raises(
        SceneError, match=r"wear\.initial\.pinion\.sides: .* give 'drive'"
    ):
        scene(file, sides="both")
    with pytest.raises(GearError, match="zero = 'line' is a profile's"):
        check_initial_wear(scene(file, zero="line"), ALL.gears)
    raised = written(tmp_path, topography(sign=-1.0))
    with pytest.raises(
        GearError, match=r"stands .* µm above its unworn shape at face position"
    ):
        check_initial_wear(scene(raised), ALL.gears)
