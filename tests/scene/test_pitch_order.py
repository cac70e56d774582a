"""Measured pitches are in the order of the teeth that their file numbers."""

import pytest
from scenes import external_pair

from wearlab.scene import Scene, SceneError

PITCHES = [0.5 * (7 * tooth % 11) for tooth in range(1, 20)] + [0.0]


def scene(folder, numbers, head="tooth"):
    rows = [f"{number},{p}" for number, p in zip(numbers, PITCHES, strict=True)]
    text = "\n".join([f"{head},F_p [um]", *rows]) + "\n"
    (folder / "pitch.csv").write_text(text)
    table = {
        "gears": external_pair(20, 40),
        "operation": {"torque": "100 N*m", "speed": "1000 rpm"},
        "mesh": {"damping_ratio": 0.05},
        "dynamics": {"model": "torsional"},
        "errors": {"slow": "hunting", "pinion": {"pitch": {"file": "pitch.csv"}}},
    }
    return Scene.from_mapping(table, folder)


@pytest.mark.parametrize("head", ["tooth", "Tooth no.", "Zahn-Nr.", "Zahn"])
def test_teeth_out_of_order_are_refused(tmp_path, head):
    """They were read in the order of the rows, in silence."""
    numbers = [*range(1, 21)]
    numbers[4], numbers[5] = numbers[5], numbers[4]
    message = "line 6, column .*: tooth 6 where 5 belongs: .*sorted"
    with pytest.raises(SceneError, match=message):
        scene(tmp_path, numbers, head)
    numbers.sort()
    assert scene(tmp_path, numbers, head).errors.pinion.pitch.ordinate[4] == 1e-6


def test_teeth_may_be_counted_from_nought(tmp_path):
    assert len(scene(tmp_path, range(20)).errors.pinion.pitch.ordinate) == 20
    with pytest.raises(SceneError, match="tooth 20 where 1 belongs"):
        scene(tmp_path, range(20, 0, -1))
