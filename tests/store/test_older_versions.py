"""Runs of the model's version 3, whose ids were hashes of the whole
canonical scene, stay readable.
"""

import hashlib
import json

import made_up
from scenes import external_pair

from wearlab.scene import MODEL_VERSION, Scene
from wearlab.store import Store

NEWER = "stiffness"
TABLE = {
    "gears": external_pair(50, 50),
    "operation": {"torque": "340 N*m", "speed": "800 rpm"},
}


def version_3(scene):
    """Return canonical scene and id as version 3 made them, from
    before one of today's options.
    """
    table = json.loads(scene.canonical())
    del table["mesh"][NEWER]
    text = json.dumps(table, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return text, hashlib.sha256(f"3\n{text}".encode()).hexdigest()[:20]


def test_a_run_of_version_3_is_found_shown_opened_and_read(tmp_path):
    scene = Scene.from_mapping(TABLE)
    text, old = version_3(scene)
    store = Store(tmp_path / "store")
    store.archive.create()
    data = made_up.run(800.0).assign_attrs(model_version="3", scene=text)
    made_up.put(store, old, data, text)
    store = Store(tmp_path / "store")
    assert MODEL_VERSION > 3 and old != scene.id
    assert store.archive.find(old[:8]).id == old
    assert list(store.query("operation.torque = 340 N*m")["id"]) == [old]
    assert store.run(old).attrs["model_version"] == "3"
    again = Scene.from_canonical(store.run(old).attrs["scene"])
    assert again == scene and again.id == scene.id
    assert store.verify() == []
    store.close()
    store.archive.catalogue.path.unlink()
    assert Store(store.path).reindex() == []
    assert store.archive.find(old[:8]).id == old
