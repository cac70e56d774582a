"""Wear over the flank as it was measured, beside the computed map."""

import numpy as np
import pytest
from scenes import GEAR_UNIT

import wearlab as wl
from wearlab.figures.kind import FigureError

SCENE = {
    **GEAR_UNIT,
    "mesh": {
        "misalignment": "20 um",
        "face_points": 11,
        "stiffness": {"model": "potential-energy"},
    },
    "wear": {
        "coefficient": {"model": "constant", "value": "1e-18 m^2/N"},
        "until": {"depth": "15 um"},
    },
    "numerics": {"profile_points": 61},
}
PINION = {"flank": "pinion"}
OFFSET = 0.7  # µm that the measurement stands above what is computed


UNITS = {
    "diameter": ("mm", 1e3),
    "path_position": ("mm", 1e3),
    "roll_angle": ("deg", np.degrees(1.0)),
}


@pytest.fixture(scope="module")
def run():
    return wl.simulate(wl.Scene.from_mapping(SCENE))


def traces(
    run, along="diameter", places=(0, 3, 7, 10), backwards=False, column="depth"
):
    """Return the computed wear of some slices as a machine would
    write it, ``OFFSET`` deeper.
    """
    worn = run["wear_depth"].sel(flank="pinion").isel(update=-1)
    where = run[along].sel(flank="pinion").values.ravel()
    unit, scale = UNITS[along]
    rows = [f"{along} [{unit}],face_position [mm],{column} [um]"]
    order = slice(None, None, -1) if backwards else slice(None)
    for place in places:
        y = 1e3 * float(run["face_position"].values.ravel()[place])
        for x, h in zip(
            scale * where[order], 1e6 * worn.isel(face=place).values[order], strict=True
        ):
            rows.append(f"{x:.9f},{y:.9f},{h + OFFSET:.9f}")
    return "\n".join(rows) + "\n"


def plot_of(run, file, **options):
    from wearlab.figures import plotting, single
    from wearlab.figures.kind import read

    spec = single.specified(
        {"kind": "wear-map", "select": PINION, "published": str(file), **options}
    )
    return plotting.plotted(single.grid_of(run), read(spec, 1, None))[0]


@pytest.mark.parametrize("along", ["diameter", "path_position", "roll_angle"])
@pytest.mark.parametrize("backwards", [False, True])
def test_a_measured_flank_stands_beside_the_computed_one_on_the_same_colours(
    run, tmp_path, along, backwards
):
    file = tmp_path / "pinion.csv"
    file.write_text(traces(run, along, backwards=backwards))
    plot = plot_of(run, file)
    titles = [panel.title.partition(") ")[2] or panel.title for panel in plot.panels]
    assert titles == ["computed", "measured"]
    computed, measured = (panel.curves[0] for panel in plot.panels)
    assert computed.reach == measured.reach
    assert plot.bar.high == pytest.approx(
        max(computed.level.max(), measured.level.max())
    )
    worn = (
        1e6
        * run["wear_depth"]
        .sel(flank="pinion")
        .isel(update=-1, face=[0, 3, 7, 10])
        .values
    )
    level = measured.level.reshape(-1, worn.shape[1])[[0, 3, 7, 10]]
    x = measured.x[: worn.shape[1]]
    at_step = np.isin(
        x, x[:-1][np.diff(x) == 0.0]
    )  # both sides of a step lie at one place
    np.testing.assert_allclose(
        level[:, ~at_step], worn[:, ~at_step] + OFFSET, atol=1e-4
    )
    assert 2 <= at_step.sum() <= 4
    assert len(set(np.round(measured.y, 6))) == 11
    note = next(
        note for note in plot.notes if note.startswith("pinion.csv less computed")
    )
    assert (
        "mean +0.7 " in note
        and "root mean square 0.7 " in note
        and "largest +0.7" in note
    )


def test_it_is_drawn_and_answers_again_from_its_own_file(run, tmp_path):
    file = tmp_path / "pinion.csv"
    file.write_text(traces(run))
    figure = wl.figure(run, "wear-map", select=PINION, published=str(file))
    figure.savefig(tmp_path / "map.png", dpi=60)
    assert len([axes for axes in figure.axes if axes.get_title(loc="left")]) == 2


def test_a_map_takes_the_description_of_a_flank_and_refuses_a_zero(run, tmp_path):
    file = tmp_path / "pinion.csv"
    file.write_text(traces(run))
    plot = plot_of(run, file, published={"file": file, "flank": "pinion"})
    assert len(plot.panels) == 2
    with pytest.raises(FigureError, match="zero = 'max' is of a wear-profile"):
        plot_of(run, file, published={"file": file, "zero": "max"})
    with pytest.raises(FigureError, match="it is of flank 'gear', and the map of"):
        plot_of(run, file, published={"file": file, "flank": "gear"})


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        (lambda run: traces(run), {"y": "wear_rate"}, "published tells wear depths"),
        (
            lambda run: traces(run),
            {"select": {}},
            "name it in select.flank, of pinion, gear",
        ),
        (
            lambda run: traces(run, column="deviation"),
            {},
            "tells deviation over diameter",
        ),
        (
            lambda run: "diameter [mm],depth [um]\n90,1\n91,2\n",
            {},
            "needs columns face_position",
        ),
        (
            lambda run: "x,y\n1,2\n",
            {},
            "expected diameter or roll_angle or roll_length or path_position",
        ),
        (
            lambda run: traces(run).replace("diameter [mm]", "diameter [m]"),
            {},
            "the flank reaches from",
        ),
    ],
)
def test_what_is_no_flank_is_refused(run, tmp_path, text, options, said):
    file = tmp_path / "pinion.csv"
    file.write_text(text(run))
    with pytest.raises(FigureError, match=said):
        plot_of(run, file, **options)


def test_points_have_no_place_on_other_maps(run, tmp_path):
    file = tmp_path / "points.csv"
    file.write_text("x [mm],y [mm]\n1,2\n")
    with pytest.raises(FigureError, match="points have no place on maps"):
        plot_of(run, file, kind="contact-pattern")
