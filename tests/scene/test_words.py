"""Choices with nothing but a name are words in files, scenes and
identities, and variants inside.
"""

import pytest

from wearlab.campaign import load
from wearlab.life.loads.static import StaticLoad
from wearlab.plugins import forget
from wearlab.scene import Scene
from wearlab.scene.merge import merge
from wearlab.slots import Slot
from wearlab.wear.patches.one_way import OneWayPatch

CHOICES = {
    "wear.load": "static",
    "wear.pressure": "peak",
    "wear.projection": "over-cosine",
    "wear.contact_patch": "one-way",
    "errors.slow": "frozen",
}
PLUGIN = """
from typing import Literal
from wearlab.options import Number, option
from wearlab.wear.projections import ProjectionModel

class Doubled(ProjectionModel):
    model: Literal["times"] = option(
        "times", "so many times the depth", source="my thesis"
    )
    times: Number = option(2.0, "factor")

    def factor(self, path):
        return self.times + 0.0 * path.curvature
"""


@pytest.mark.parametrize("key", CHOICES)
def test_a_word_is_the_same_as_its_table(table, key):
    table["errors"] = {"seed": 1}
    table["wear"].pop("average_over_contact_width", None)
    word = Scene.from_mapping(table).replace(key, CHOICES[key])
    written = Scene.from_mapping(table).replace(key, {"model": CHOICES[key]})
    assert word.id == written.id and word.canonical() == written.canonical()
    assert f'"{key.split(".")[1]}":"{CHOICES[key]}"' in word.canonical()
    assert (
        Slot.all[key].by_name and Scene.from_canonical(word.canonical()).id == word.id
    )


def test_what_is_chosen_is_a_variant(table):
    scene = Scene.from_mapping(table).replace("wear.load", "static")
    scene = scene.replace("wear.contact_patch", "one-way")
    assert scene.wear.load == StaticLoad() and scene.wear.contact_patch == OneWayPatch()


def test_another_shape_of_initial_wear_keeps_its_depth():
    base = {"wear": {"initial": {"gear": {"depth": "5 um", "shape": "quadratic"}}}}
    changed = merge(base, {"wear": {"initial": {"gear": {"shape": "uniform"}}}})
    assert changed["wear"]["initial"]["gear"] == {"depth": "5 um", "shape": "uniform"}
    measured = merge(base, {"wear": {"initial": {"gear": {"file": "a.csv"}}}})
    assert measured["wear"]["initial"]["gear"] == {"file": "a.csv"}


def test_a_users_own_is_one_of_them(tmp_path, table):
    """One file adds a direction of wear: options checked, and written
    as a table with its source.
    """
    (tmp_path / "mine.py").write_text(PLUGIN)
    (tmp_path / "c.toml").write_text(
        'title = "t"\nplugins = ["mine.py"]\n[gears]\nkind = "external-pair"\nmodule '
        '= "3 mm"\n'
        'face_width = "20 mm"\npinion.teeth = 50\ngear.teeth = '
        '50\n[operation]\ntorque = "340 N*m"\n'
        'speed = "1100 rpm"\n[wear]\nprojection = { model = "times", times = 3 }\n'
        'coefficient = { model = "constant", value = "1e-18 m^2/N" }\n'
    )
    try:
        scene = load(tmp_path / "c.toml").cases[0].scene
        assert (
            scene.wear.projection.times == 3.0
            and '"model":"times"' in scene.canonical()
        )
        assert scene.id != scene.replace("wear.projection", "normal").id
    finally:
        forget()
