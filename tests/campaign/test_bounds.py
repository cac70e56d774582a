"""Campaign files that would take minutes to read are refused in a moment."""

import time

import pytest

from wearlab.campaign import CampaignError, load

PAIR = """
title = "pair"
[gears]
kind = "external-pair"
module = "3 mm"
face_width = "20 mm"
pinion = { teeth = 25 }
gear = { teeth = 30 }
[operation]
torque = "5 N*m"
speed = "1100 rpm"
"""


def refused(file, said):
    begun = time.process_time()
    with pytest.raises(CampaignError, match=said):
        load(file)
    assert time.process_time() - begun < 10.0


def test_one_file_extended_two_thousand_times(tmp_path):
    (tmp_path / "base.toml").write_text(PAIR)
    file = tmp_path / "many.toml"
    file.write_text("extends = [" + '"base.toml", ' * 2000 + "]")
    refused(file, "extends: more than 60 files")


def test_files_that_extend_each_other_twice(tmp_path):
    """Thirty files reach the first one a billion times."""
    (tmp_path / "0.toml").write_text(PAIR)
    for number in range(1, 31):
        (tmp_path / f"{number}.toml").write_text(
            f'extends = ["{number - 1}.toml", "{number - 1}.toml"]\n'
        )
    refused(tmp_path / "30.toml", "extends: more than 60 files")


def test_a_sweep_whose_last_values_cannot_be(tmp_path):
    file = tmp_path / "teeth.toml"
    file.write_text(
        f'{PAIR}[[sweep]]\n"gears.pinion.teeth" = {{ integers = [5, 90000] }}\n'
    )
    refused(file, "teeth: 90000 must be at most 10000")
