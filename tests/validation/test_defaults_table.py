"""The table of the defaults: what is drawn, kept, and written."""

import changed_table
import defaults_table
import numpy as np
import onset_table
import pytest
import slow_table
import stiffness_table


@pytest.mark.parametrize("internal", [False, True])
def test_drawn_pairs_carry_the_load_that_the_page_says(internal: bool) -> None:
    """Circumferential force over module and face width: 30 to 150 N/mm²."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        table = stiffness_table.drawn(rng, internal)
        gears = table["gears"]
        module = float(gears["module"].split()[0])
        width = float(gears["face_width"].split()[0])
        torque = float(table["operation"]["torque"].split()[0])
        force = 2e3 * torque / (module * gears["pinion"]["teeth"])
        assert 30.0 <= force / (module * width) <= 150.0


def pieces(count: list[str]) -> list[defaults_table.Piece]:
    """Return one piece of each part with made-up results, which tell
    when they are asked for.
    """

    def of(part: str, rows: list) -> defaults_table.Piece:
        def judge() -> list:
            count.append(part)
            return rows

        return defaults_table.Piece(part, "1: a mesh", judge)

    stiffness = [
        stiffness_table.Score(model, depth, torque, 0.001, 0.002, 1e-3)
        for model in stiffness_table.MODELS
        for depth in stiffness_table.DEPTHS
        for torque in stiffness_table.TORQUES
    ]
    return [
        of("slow", [slow_table.Slow(way, 1.001) for way in slow_table.WAYS]),
        of(
            "changed",
            [changed_table.Changed(way, 1.2, 2e-6, 3e7) for way in changed_table.WAYS],
        ),
        of("stiffness", stiffness),
        of(
            "onset",
            [
                onset_table.Onset(way, 0.01, -0.02, 0.03, 1e-3)
                for way in onset_table.WAYS
            ],
        ),
    ]


def test_it_goes_on_where_it_stopped_and_writes_the_page(tmp_path) -> None:
    asked: list[str] = []
    made = pieces(asked)
    assert defaults_table.judged(tmp_path, made, -1.0) == 4 and not asked
    assert defaults_table.judged(tmp_path, made[:1], 60.0) == 0
    assert defaults_table.judged(tmp_path, made[:3], 60.0) == 0
    assert defaults_table.judged(tmp_path, made, -1.0) == 1
    assert defaults_table.judged(tmp_path, made, 60.0) == 0
    assert asked == ["slow", "changed", "stiffness", "onset"]
    page = defaults_table.page(tmp_path, made)
    assert "Not judged yet" not in page
    assert (
        "| 1: a mesh | 0.1 % | 0.2 % |" in page
        and "| 1: a mesh | 1.0010 | 1.0010 |" in page
    )
    assert "| 1: a mesh | 1.200 | 1.200 | 2.00 | 2.00 | 3e+07 | 3e+07 |" in page
    assert "1.0 %; -2.0 %; 3.0 %; 1.00 ms" in page
