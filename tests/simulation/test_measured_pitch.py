"""Measured pitches of all teeth move the mesh until the same teeth meet again."""

import math
from pathlib import Path

import numpy as np
import pytest
from scenes import external_pair

import wearlab as wl
from wearlab.figures.kinds.hunting import named_lines, spectrum
from wearlab.scene import Scene, SceneError
from wearlab.simulation import simulate

TEETH = 20
ONE_WAVE = [f"{8 * math.sin(2 * math.pi * n / TEETH):.6f} um" for n in range(1, 21)]
SCENE = {
    "gears": external_pair(TEETH, 30, module="2 mm", face_width="15 mm"),
    "operation": {"torque": "50 N*m", "speed": "1500 rpm"},
    "mesh": {"stiffness": "potential-energy"},
    "errors": {"slow": "hunting", "pinion": {"pitch": ONE_WAVE}},
}
MOVING = {
    "mesh": {"stiffness": "potential-energy", "damping_ratio": 0.07},
    "dynamics": {"model": "torsional"},
}


def scene(**sections):
    """Return the scene of measured pitches, with other sections."""
    return Scene.from_mapping({**SCENE, **sections})


def with_errors(**errors):
    """Return the scene of measured pitches, with other errors."""
    return scene(errors={**SCENE["errors"], **errors})


def lines_of(values):
    """Return the amplitudes of a signal of whole mesh periods by order times 60."""
    orders, amplitude = spectrum(values)
    return dict(zip(np.rint(60 * orders).astype(int).tolist(), amplitude, strict=True))


def test_one_wave_of_pitches_is_one_shaft_order():
    """8 µm of F_p are 8 cos 20° = 7.518 µm along the line of action."""
    data = simulate(scene())
    error = data["hunting_transmission_error"]
    assert error.sizes["hunting_period"] == 60
    lines = lines_of(error.values[0, 0])
    assert 1e6 * lines[3] == pytest.approx(7.518, abs=5e-4)
    others = [amplitude for line, amplitude in lines.items() if line % 60 and line != 3]
    assert max(others) < 1e-7 * lines[3]  # rounding of the list
    unmoved = simulate(scene(errors={"slow": "hunting"}))
    assert float(error.mean()) == pytest.approx(
        float(unmoved["static_transmission_error"].mean()), rel=1e-9
    )
    assert "wear stays the same for all teeth" in data["validity"].item()


def test_tooth_that_stands_back_comes_late_on_either_gear():
    """The driving gear has to turn on, the driven one has turned further."""
    step = ["0 um"] * 4 + ["5 um"] + ["0 um"] * 15
    at_pitch_point = {}
    for name, teeth in (("pinion", 20), ("gear", 30)):
        table = step + ["0 um"] * (teeth - 20)
        data = simulate(scene(errors={"slow": "hunting", name: {"pitch": table}}))
        error = data["hunting_transmission_error"].values[0, 0]
        slow = error - data["static_transmission_error"].values[0, 0]
        phase = data["phase"].values
        path = data["path_position"].values[0]
        pitch = math.pi * 2e-3 * math.cos(math.radians(20.0))
        place = int(np.argmin(np.abs(phase - (-path.min() / pitch) % 1.0)))
        at_pitch_point[name] = 1e6 * (slow[:, place] - slow[:, place].mean())
    expected = 5.0 * math.cos(math.radians(20.0))
    assert at_pitch_point["pinion"].argmax() % 20 == 4
    assert at_pitch_point["gear"].argmin() % 30 == 4
    for values, sign in ((at_pitch_point["pinion"], 1), (at_pitch_point["gear"], -1)):
        assert np.ptp(values) == pytest.approx(expected, rel=0.02), sign


def test_motion_has_the_shaft_order_and_sidebands():
    data = simulate(scene(**MOVING))
    dte = lines_of(data["dynamic_transmission_error"].values[0, 0])
    assert 1e6 * dte[3] == pytest.approx(7.518, rel=0.02)
    force = lines_of(data["dynamic_mesh_force"].values[0, 0])
    beside = force[57] + force[63]
    far = force[50] + force[70]
    assert beside > 100.0 * far
    plain = simulate(scene(**MOVING, errors={"slow": "hunting"}))
    assert plain["dynamic_mesh_force"].sizes["mesh_period"] == 1


def test_machine_file_is_read_by_side_and_quantity(tmp_path: Path):
    (tmp_path / "pitch.csv").write_text(
        "tooth;F_p [um]\n"
        + "\n".join(
            f"{n};{8 * math.sin(2 * math.pi * n / TEETH):.6f}" for n in range(1, 21)
        )
    )
    read = Scene.from_mapping(
        {
            **SCENE,
            "errors": {"slow": "hunting", "pinion": {"pitch": {"file": "pitch.csv"}}},
        },
        tmp_path,
    )
    single = np.diff([0.0, *(float(text.split()[0]) for text in ONE_WAVE)])
    listed = with_errors(
        pinion={
            "pitch": {
                "values": [f"{value:.6f} um" for value in single],
                "quantity": "f_p",
            }
        }
    )
    waves = [each.errors.pinion.pitch.waves()[0] for each in (scene(), read, listed)]
    assert waves[1] == pytest.approx(waves[0], rel=1e-5)
    assert waves[2] == pytest.approx(waves[0], rel=1e-4)


@pytest.mark.parametrize(
    ("errors", "message"),
    [
        ({"slow": "averaged"}, "give errors.slow = 'hunting', not 'averaged'"),
        ({"slow": "frozen"}, "give errors.slow = 'hunting', not 'frozen'"),
        (
            {"pinion": {"pitch": ONE_WAVE, "total_composite": "20 um"}},
            "leave out total_composite",
        ),
        ({"pinion": {"pitch": ONE_WAVE[:19]}}, "comes back to 0|19 deviations"),
        ({"gear": {"pitch": ONE_WAVE}}, "20 deviations, but gear has 30 teeth"),
        ({"pinion": {"pitch": ["0 um"] * 19 + ["9 um"]}}, "comes back to 0"),
        ({"pinion": {"pitch": []}}, "pitch"),
        ({"pinion": {"pitch": {"quantity": "F_p"}}}, "'file' is required"),
        ({"pinion": {"pitch": {"file": "missing.csv"}}}, "missing.csv"),
    ],
)
def test_refusals_name_the_place_and_the_remedy(errors, message):
    with pytest.raises(SceneError, match=message) as error:
        with_errors(**errors)
    assert "errors." in str(error.value)


def test_figure_names_shaft_orders_mesh_orders_and_sidebands():
    shafts = {"pinion": 1 / 20, "gear": 1 / 30}
    size = {0.05: 4.0, 1 / 30: 3.0, 1.0: 9.0, 1.05: 2.0, 1 - 1 / 30: 1.0, 2.0: 5.0}
    marks = named_lines(np.array(list(size)), np.array(list(size.values())), shafts)
    assert {mark.text: mark.x for mark in marks} == {
        "pinion": 0.05,
        "gear": 1 / 30,
        "mesh − gear": 1 - 1 / 30,
        "mesh": 1.0,
        "mesh + pinion": 1.05,
        "2 mesh": 2.0,
    }


def test_figure_is_drawn_of_a_run(tmp_path):
    campaign = wl.load(SCENE)
    wl.run(campaign, tmp_path / "store")
    grid = wl.open(tmp_path / "store").open(campaign)
    figure = wl.figure(grid, "shaft-orders")
    names = {text.get_text() for axes in figure.axes for text in axes.texts}
    assert {"pinion", "mesh"} <= names
