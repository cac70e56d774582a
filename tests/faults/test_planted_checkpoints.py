"""A checkpoint that somebody planted in a store is data at most: no code of its own or
of ours runs.
"""

import hashlib
import json
import pickle
import struct
from contextlib import closing

import fake_life
import numpy as np
import pytest
from fake_campaign import sweep

import wearlab
from wearlab.life.checkpoint import CheckpointError, decoded, encoded
from wearlab.life.step import Node
from wearlab.runner.worker import in_progress
from wearlab.sources import source_hash
from wearlab.store import Store


def short_text(text):
    return pickle.SHORT_BINUNICODE + struct.pack("<B", len(text)) + text.encode()


def pickled_command(module, name, command):
    """Return a pickle that calls a name, dotted names among them, with a command."""
    words = b"(" + b"".join(map(short_text, command)) + b"l"
    called = short_text(module) + short_text(name) + pickle.STACK_GLOBAL
    return (
        pickle.PROTO + b"\x04" + called + words + pickle.TUPLE1 + pickle.REDUCE + b"."
    )


def planted(module, name, command):
    """Return images that hold the command: by itself, and as one of
    the lives of a run.
    """
    command = pickled_command(module, name, command)
    lengths = json.dumps({"0" * 64: len(command)}).encode()
    return [command, pickle.dumps({"0" * 64: command}), lengths + b"\n" + command]


@pytest.mark.parametrize(
    ("module", "name"),
    [
        ("wearlab.simulation.label", "subprocess.Popen"),
        ("subprocess", "Popen"),
        ("wearlab.life.checkpoint", "importlib.import_module"),
    ],
)
def test_a_planted_pickle_calls_nothing(tmp_path, module, name):
    """Dotted names of pickle's protocol 4 lead from a module of ours
    to whatever it imports.
    """
    witness = tmp_path / "was here"
    (case,) = sweep(1).cases
    for image in planted(module, name, ["touch", str(witness)]):
        with closing(Store(tmp_path / "store")) as store:
            store.archive.create()
            store.archive.checkpoints.write(case.id, image, source_hash())
            with in_progress(case.id, image, lambda message: None):
                assert fake_life.simulate(case.scene).cycle.size > 10
            assert wearlab.run(
                sweep(1), store, simulate=fake_life.SIMULATE, progress=False
            ).ok
    assert not witness.exists()


@pytest.mark.parametrize(
    "stored",
    [
        ["record", "subprocess:Popen", {"args": "true"}],
        ["record", "wearlab.simulation.label:subprocess.Popen", {}],
        ["record", "wearlab.store.store:Store", {"path": "/tmp"}],
        ["record", "wearlab.life.checkpoint:importlib", {}],
        ["record", "wearlab.life.checkpoint:json", {}],
        ["record", "wearlab.life.step:NamedTuple", {}],
        ["record", "wearlab.life.step:growth", {}],
        ["record", "wearlab.life.step:Node", {"cycle": 1.0}],
        ["record", "wearlab.life.step:Node", {"cycle": 1.0, "depth": [7], "rate": 0.0}],
        ["array", "|O", [1], "C", 0],
        ["array", "<f8", [10**12], "C", 0],
        ["array", "<f8", [-1], "C", 0],
        ["array", "<f8", [1], "C", -8],
        ["shared", -1],
        ["reduce", "os.system", "true"],
        "text",
        None,
    ],
)
def test_what_no_checkpoint_holds_is_refused(stored):
    image = json.dumps({"values": [stored], "root": [0]}).encode() + b"\n" + bytes(8)
    with pytest.raises(CheckpointError):
        decoded(image)


def test_keys_that_take_ages_to_hash_are_refused():
    """Tuples within tuples, each twice, are read in no time.

    As a key they had taken 2^60 steps.
    """
    nested = [
        ["tuple", []],
        *(["tuple", [[k], [k]]] for k in range(60)),
        ["table", [[[60], 1]]],
    ]
    with pytest.raises(CheckpointError, match="is no key of a table"):
        decoded(json.dumps({"values": nested, "root": [61]}).encode() + b"\n")


@pytest.mark.parametrize(
    "image", [b"", b"{}", b"[" * 100_000, b'{"values": 3, "root": [0]}\n', b"\x80\x04."]
)
def test_what_is_no_checkpoint_is_refused(image):
    with pytest.raises(CheckpointError):
        decoded(image)


def test_a_checkpoint_of_another_shape_begins_anew(tmp_path):
    """Its hash is right and so is its key, but it does not hold a life."""
    (case,) = sweep(1).cases
    images = []
    undisturbed = fake_life.simulate(case.scene)
    with in_progress(case.id, None, lambda message: images.append(message["image"])):
        fake_life.simulate(case.scene)
    head, _, rest = images[3].partition(b"\n")
    ((key, length),) = json.loads(head).items()
    assert len(rest) == length
    for other in (
        {"integration": 1},
        {"integration": {}, "stepper": {}, "followed": [], "rate": 0},
        [1],
        Node(0.0, 1, 1),
    ):
        life = encoded(other)
        image = json.dumps({key: len(life)}).encode() + b"\n" + life
        with in_progress(case.id, image, lambda message: None):
            np.testing.assert_array_equal(
                fake_life.simulate(case.scene).wear_depth, undisturbed.wear_depth
            )


def test_checkpoints_of_earlier_versions_begin_anew(tmp_path):
    (case,) = sweep(1).cases
    with closing(Store(tmp_path / "store")) as store:
        store.archive.create()
        image = pickle.dumps(
            {hashlib.sha256(b"life").hexdigest(): pickle.dumps({"integration": {}})}
        )
        store.archive.checkpoints.write(case.id, image, source_hash())
        assert wearlab.run(
            sweep(1), store, simulate=fake_life.SIMULATE, progress=False
        ).ok
        assert not (store.path / "checkpoints").exists()
