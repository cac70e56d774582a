"""What docs/where_to_add.md shows is all that it takes: each example is one file of a
copy of the package.
"""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import wearlab

PAGE = Path(__file__).parents[1] / "docs" / "where_to_add.md"
SHOWN = re.compile(
    r"`((?:wearlab|tests)/[\w/]+\.py)`:\n\n```python\n(.*?)```", re.DOTALL
)
RUN = """
import json
from pathlib import Path
import numpy as np
import wearlab as wl
from wearlab.figures.kinds import KINDS
from wearlab.schema import VARIABLES

def pair(law):
    return {
        "gears": {
            "kind": "external-pair", "module": "3 mm", "face_width": "20 mm",
            "pinion": {"teeth": 25}, "gear": {"teeth": 30},
        },
        "operation": {"torque": "100 N*m", "speed": "1100 rpm"},
        "mesh": {"stiffness": "potential-energy"},
        "wear": {
            "law": law, "coefficient": {"model": "constant", "value": "1e-16 m^2/N"},
            "load": "static", "contact_patch": "none", "until": {"depth": "1 um"},
        },
    }

ZERO, SOME = ({"model": "threshold", "threshold": f"{p} MPa"} for p in (0, 500))
LAWS = ("archard", ZERO, SOME)
old, none, half = (wl.simulate(wl.Scene.from_mapping(pair(law))) for law in LAWS)
rates = [one.wear_rate[0] for one in (old, none, half)]
fixed = pair("archard")
fixed["wear"]["coefficient"] = {"model": "fixed", "value": "1e-16 m^2/N"}
again = wl.simulate(wl.Scene.from_mapping(fixed))
Path("uneven.png").write_bytes(wl.figure(half, "wear-unevenness")._repr_png_())
print(json.dumps({
    "same": bool(np.allclose(rates[0], rates[1], rtol=1e-6)),
    "fixed": bool(np.array_equal(old.wear_rate, again.wear_rate)),
    "less": bool((rates[2] <= rates[1]).all() and (rates[2] < rates[1]).any()),
    "uneven": float(half.wear_unevenness[-1].max()),
    "units": half.wear_unevenness.attrs["units"],
    "kind": KINDS["wear-unevenness"].title, "known": "wear_unevenness" in VARIABLES,
}), flush=True)
import pytest
options = ["-q", "-p", "no:cacheprovider", "--import-mode=importlib"]
raise SystemExit(pytest.main([*options, "tests"]))
"""
TESTS = Path(__file__).parent


def shown():
    return {path: text for path, text in SHOWN.findall(PAGE.read_text())}


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    folder = tmp_path_factory.mktemp("added")
    shutil.copytree(
        Path(wearlab.__file__).parent,
        folder / "wearlab",
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    shutil.copytree(TESTS / "support", folder / "tests" / "support")
    for own in ("conftest.py", "figures/conftest.py"):
        (folder / "tests" / own).parent.mkdir(exist_ok=True)
        shutil.copy(TESTS / own, folder / "tests" / own)
    for path, text in shown().items():
        (folder / path).parent.mkdir(exist_ok=True)
        (folder / path).write_text(
            text
        )  # over what somebody has added who followed the page
    return folder


def test_a_law_a_result_and_a_figure_are_one_file_and_its_test_each(copy):
    assert len(shown()) == 7
    done = subprocess.run(
        [sys.executable, "-c", RUN],
        cwd=copy,
        env={**os.environ, "PYTHONPATH": str(copy)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    told = json.loads(
        next(line for line in done.stdout.splitlines() if line.startswith("{"))
    )
    assert told["same"] and told["fixed"] and told["less"] and told["known"]
    assert (
        told["units"] == "1"
        and told["uneven"] > 1.0
        and told["kind"] == "Unevenness of wear"
    )
    assert (copy / "uneven.png").stat().st_size > 10_000
