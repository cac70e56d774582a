"""``import wearlab as wl``: a handful of names, loaded when they are used."""

import subprocess
import sys

import pytest

import wearlab


def test_every_public_name_is_there():
    for name in wearlab.__all__:
        assert callable(getattr(wearlab, name)), name
    assert set(wearlab.__all__) <= set(dir(wearlab))
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = wearlab.nonsense


@pytest.mark.parametrize("before", ["", "import wearlab.simulate; ", "from wearlab.simulate import label; "])
def test_simulate_is_a_room_and_a_function(before):
    """Importing the room must not hide the function of the same name."""
    code = (
        before + "import wearlab as wl; wl.simulate.simulate = lambda scene: scene + 1; print(wl.simulate(2))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "3\n"
