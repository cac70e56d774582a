"""Campaign files that would keep their reader busy, or that no number can hold, are
refused at once.
"""

import os

import pytest

from wearlab.campaign import CampaignError, load
from wearlab.files import read_regular

HUGE = "9" * 400
LONG = ".".join(["a"] * 100_000)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            f"[numerics]\nphase_points = {HUGE}",
            r"numerics\.phase_points: a whole number of 333 hex",
        ),
        (f"[errors]\nseed = -{HUGE}", r"errors\.seed: a whole number"),
        (
            f"[wear]\nuntil = {{ cycles = {HUGE} }}",
            r"wear\.until\.cycles: a whole number",
        ),
        (
            f'[[sweep]]\n"gears.pinion.teeth" = [{HUGE}]',
            r"sweep\[0\]\.gears\.pinion\.teeth\[0\]: a whole",
        ),
        (
            f'[[sweep]]\n"gears.pinion.teeth" = {{ linspace = [1, 5, {HUGE}] }}',
            "a whole number",
        ),
        (
            f"[[sweep]]\nsample = {{ n = {HUGE} }}",
            r"sweep\[0\]\.sample\.n: a whole number",
        ),
        ('"" = 3', "the file: an empty key"),
        ('[gears]\n"" = 3', "gears: an empty key"),
        ('[[figure]]\nkind = "tvms"\n"" = 3', r"figure\[0\]: an empty key"),
        ('[metadata]\n" " = "x"', "metadata: an empty key"),
        (f"{LONG} = 1", r"line 2: a key of more than 50 parts"),
        (f"[{LONG}]", r"line 2: a key of more than 50 parts"),
        ('"a" . ' * 60 + "b = 1", r"line 2: a key of more than 50 parts"),
        (f'[[sweep]]\n"{LONG}" = [1]', r"sweep\[0\]: a key of 199999 characters"),
        (f'[[case]]\nlabel = "x"\n"{"a." * 60}a" = 1', r"case\[0\]: a key of 61 parts"),
        (f'drop = ["{LONG}"]', "drop: a name of more than 1000 characters"),
        (f'extends = "{LONG}"', "extends: a name of more than 1000 characters"),
        ('extends = "/dev/zero"', "cannot read it: not a file"),
        ('extends = "/dev/stdin"', "cannot read it"),
        ('extends = "pipe"', "cannot read it: not a file"),
        ('extends = "."', "cannot read it"),
        (
            'extends = "/proc/self/maps"',
            "cannot read it: not a file of a size that can be told",
        ),
    ],
)
def test_refused_in_a_moment(write, tmp_path, text, said):
    os.mkfifo(tmp_path / "pipe")
    extends = "" if text.startswith("extends") else 'extends = "base.toml"'
    with pytest.raises(CampaignError, match=said) as caught:
        load(write(f"{extends}\n{text}\n"))
    assert len(str(caught.value)) < 1000


def test_texts_with_many_full_stops_are_no_keys(study):
    assert study(f'title = "{"a. " * 80}"').title.count(".") == 80


def test_a_large_file_is_not_read(tmp_path):
    with (tmp_path / "large").open("wb") as file:
        file.truncate(10**10)
    with pytest.raises(OSError, match="10000000000 bytes are more than the 1000"):
        read_regular(tmp_path / "large", 1000)
    (tmp_path / "small").write_bytes(b"content")
    assert read_regular(tmp_path / "small", 1000) == b"content"
